"""Benchmarks: the paper's claims, measured."""
