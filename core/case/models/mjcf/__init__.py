"""MJCF: models of MuJoCo, closed by equalities, onto mechanisms; elements without meaning for
kinematics are listed, not read.
"""
