"""Datasets of Adams Solver (.adm), read into cases."""
