"""Reference motions for stress tests: equations written independently of the solver, in long
double, with error bounds.
"""
