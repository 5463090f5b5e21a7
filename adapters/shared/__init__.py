"""Parts that several engines share: chains of joints, loop closures, frame constraints, the
projection walk.
"""
