"""Recordings of other programs as engines: their files, their meaning, and their verdict."""
