"""Parts shared by engines: chains of joints, loop closures, frame constraints, the
projection walk.
"""
