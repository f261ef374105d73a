"""Benchmarks: cost of a substep, limit of the processor, and the same sheet in other engines."""
