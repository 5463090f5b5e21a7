"""Robots of URDF and SDF: links and joints, with their loops, as elements of MJCF, which one reader
makes a case of.
"""
