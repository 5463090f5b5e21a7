"""Independent truth: motions and forces by equations that share nothing with the solver, in long
double, with error bounds.
"""
