"""Readers of URDF and SDF: links, joints and loops, translated to elements of MJCF, from which its
reader makes a case.
"""
