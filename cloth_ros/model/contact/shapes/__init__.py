"""Shapes of colliders."""
