"""Diagnosis: what can be said of a case before and beside its results; why it cannot be solved, or
how well.
"""

from .diagnose import Diagnosis, diagnose

__all__ = ["Diagnosis", "diagnose"]
