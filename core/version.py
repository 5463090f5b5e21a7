"""The version, defined here only: reading installation metadata takes a third of numpy's import
time.
"""

VERSION = "0.3.0"
