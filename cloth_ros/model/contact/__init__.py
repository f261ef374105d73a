"""Colliders: their paths, broad phase, and continuous collision with the sheet."""
