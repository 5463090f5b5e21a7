"""Benchmarks: run time, accuracy, memory, and the paper's claims."""
