"""MJCF: models of MuJoCo, closed by equalities, onto mechanisms; what has no meaning for kinematics
is listed, not read.
"""
