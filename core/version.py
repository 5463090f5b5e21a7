"""The version, here and nowhere else: to read it from the installation's metadata takes as long as importing half of numpy."""

VERSION = "0.1.0"
