"""The version, here and nowhere else: to read it from the installation's metadata takes a third as
long as importing numpy.
"""

VERSION = "0.1.0"
