"""Compilation of kernels, and the threads that share their loops."""
