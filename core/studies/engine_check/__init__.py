"""Conformance of an engine with the engine protocol: one row for each check."""
