"""A case of one crank, as the text of a file: recorded programs and units move it too."""

MECHANISM = """
schema = "kincheck-case/1"
name = "crank"
source = "a crank of half a metre"
[bodies.crank]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[points.tip]
body = "crank"
position = [0.5, 0, 0]
[drivers.turn]
type = "joint_angle"
joint = "pivot"
"""
