"""Hardpoints: files of named points as suspension engineers have them, onto templates of
suspensions, to cases.
"""
