"""Recordings of a live cloth: repeated to the bit, or simulated again with other settings."""
