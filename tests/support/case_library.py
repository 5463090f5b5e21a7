"""Cases of the library, solved once."""

from kincheck import cases

CASES = {name: cases.load(name) for name in cases.names()}
