"""Steppers of free motion whose engines have environments of their own: parts of scripts."""
