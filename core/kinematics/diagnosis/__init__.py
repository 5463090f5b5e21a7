"""Diagnosis of a mechanism for people: redundant rows, conditioning of the motion, and free
motions, in words.
"""
