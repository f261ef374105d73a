"""Recorded particles as a mesh over time, in files that other programs open."""
