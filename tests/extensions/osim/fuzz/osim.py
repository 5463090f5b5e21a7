"""Models of OpenSim; a coordinate named in the model is driven."""

from kincheck.core.extensions.osim.curves import FUNCTIONS
from kincheck.core.extensions.osim.osim import AXES, CHAINS, CONSTRAINTS

from ....fuzz.fuzzing import changing, reading
from ....fuzz.keeping import seeds_in_file
from ....fuzz.trees import changed_xml

LONGEST = 6000
IN_FILES = """socket_parent_frame socket_child_frame coordinates frames components SpatialTransform
reverse default_value range clamped locked prescribed prescribed_function isEnforced socket_body_1
socket_body_2 location_body_1 location_body_2 constant_distance socket_frame1 socket_frame2
scale_factor coupled_coordinates_function independent_coordinate_names dependent_coordinate_name
""".split()
WORDS = (
    *(*AXES, *CHAINS, *CONSTRAINTS, *FUNCTIONS, *IN_FILES),
    *("/ground", "/bodyset/a", "..", "on_parent", "SimmSpline", "CustomJoint", "40000", "30000"),
    *("SpringGeneralizedForce", "BushingForce", "Marker", "PhysicalOffsetFrame", "Constant"),
)
one = reading("m.osim", hold_rest=True)


def seeds() -> list[bytes]:
    """A four-bar, and all else in one."""
    return seeds_in_file("osim")


mutate = changing(changed_xml, words=WORDS)
