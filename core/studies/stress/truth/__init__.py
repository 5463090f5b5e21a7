"""Reference motions for stress tests: equations independent of the solver, in long double,
with error bounds.
"""
