"""Samples that are proved: exact numbers, ball arithmetic, Krawczyk's test."""
