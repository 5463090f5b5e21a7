"""Verified samples: exact numbers, ball arithmetic, Krawczyk's test."""
