"""`python -m kincheck`, the command kincheck: this folder is the package kincheck itself; its parts lie in folders of their own."""

import sys
from importlib import import_module

if __name__ == "__main__":
    # by its name: relative to this file, as installed, it would be .core, which no checker finds in the sources
    sys.exit(import_module("kincheck.core.harness.cli").main())
