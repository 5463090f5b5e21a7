"""Diagnosis of a case: why it cannot be solved, or how well conditioned it is."""

from .diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
