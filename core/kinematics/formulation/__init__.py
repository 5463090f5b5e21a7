"""What is solved: a mechanism's constraints as equations over any scalar, in Cartesian or in joint
coordinates.
"""
