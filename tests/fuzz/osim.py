"""Models of OpenSim; a coordinate named in the model is driven."""

from kincheck.core.extensions.trees.osim import (
    AXES,
    CHAINS,
    CONSTRAINTS,
    FUNCTIONS,
    IN_CONSTRAINT,
    IN_COORDINATE,
    IN_JOINT,
)

from .fuzzing import changing, reading
from .keeping import seeds_in_file
from .trees import changed_xml

LONGEST = 6000
WORDS = (
    *(*AXES, *CHAINS, *CONSTRAINTS, *FUNCTIONS, *IN_CONSTRAINT, *IN_COORDINATE, *IN_JOINT),
    *("/ground", "/bodyset/a", "..", "on_parent", "SimmSpline", "CustomJoint", "40000", "30000"),
    *("SpringGeneralizedForce", "BushingForce", "Marker", "PhysicalOffsetFrame", "Constant"),
)
one = reading("m.osim", hold_rest=True)


def seeds() -> list[bytes]:
    """A four-bar, and all else in one."""
    return seeds_in_file("osim")


mutate = changing(changed_xml, words=WORDS)
