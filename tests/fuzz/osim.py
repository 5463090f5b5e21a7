"""Models of OpenSim; a coordinate named in the model is driven."""

import re

from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.trees.osim import (
    AXES,
    CHAINS,
    CONSTRAINTS,
    FUNCTIONS,
    IN_CONSTRAINT,
    IN_COORDINATE,
    IN_JOINT,
)

from ..support.osim_texts import (
    FOUR_BAR,
    axis,
    coordinate,
    frame,
    joint,
    line,
    model,
    tagged,
    texts,
)
from .fuzzing import changing, read_or_refused, written
from .trees import changed_xml

LONGEST = 6000
DRIVEN = re.compile(rb'<Model name="m" drive="([^"]{1,40})"')
WORDS = (
    *(*AXES, *CHAINS, *CONSTRAINTS, *FUNCTIONS, *IN_CONSTRAINT, *IN_COORDINATE, *IN_JOINT),
    *("/ground", "/bodyset/a", "..", "on_parent", "SimmSpline", "CustomJoint", "40000", "30000"),
    *("SpringGeneralizedForce", "BushingForce", "Marker", "PhysicalOffsetFrame", "Constant"),
)
SPLINE = tagged("SimmSpline", texts(x=(-1, -0.2, 0.1, 0.5, 2), y=(0.3, 0.1, 0.2, 0.4, 0.1)))
BENT = joint(
    "CustomJoint",
    "knee",
    "",
    "a",
    coordinate("A", 0.1, texts(clamped="true", range=(-1, 1)))
    + coordinate("lift")
    + coordinate("free"),
    inside=tagged(
        "SpatialTransform",
        axis("rotation1", (0, 0, 1), line(-1, 0.2), "A")
        + axis("translation1", (1, 0, 0), line(0.5, 0.1), "A")
        + axis("translation2", (0, 1, 0), line(1, 0), "lift")
        + axis("translation3", (0, 0, 1), SPLINE, "free"),
    ),
)
TIED = (
    tagged(
        "CoordinateCouplerConstraint",
        tagged("coupled_coordinates_function", line(2, 0.1))
        + texts(independent_coordinate_names="A", dependent_coordinate_name="lift"),
        "couple",
    )
    + tagged(
        "ConstantDistanceConstraint",
        texts(socket_body_1="/bodyset/b", socket_body_2="/ground", constant_distance=(1.0,))
        + texts(location_body_1=(1, 0, 0), location_body_2=(1, 1, 0)),
        "rod",
    )
    + tagged(
        "WeldConstraint",
        texts(socket_frame1="end", socket_frame2="/bodyset/b")
        + tagged("frames", frame("end", "c", (0, 0, 1))),
        "weld",
    )
)
ALL = model(
    "abc",
    [
        BENT,
        joint("PinJoint", "B", "", "b", coordinate("B")),
        joint("FreeJoint", "F", "", "c", p=[(0, 0, -1)]),
    ],
    TIED,
    tagged("SpringGeneralizedForce", texts(coordinate="A", stiffness=(5.0,)), "s"),
)


def one(data: bytes) -> None:
    """Read one input with its own option."""
    drive = DRIVEN.search(data)
    supplied = Supplied(drive=(drive[1].decode("latin-1"),) if drive else (), hold_rest=True)
    read_or_refused(lambda: load(written("m.osim", data), supplied))


def seeds() -> list[bytes]:
    """A four-bar, and all else in one."""
    return [
        text.replace('name="m"', 'name="m" drive="A:0.1:0.3:3"', 1).encode()
        for text in (FOUR_BAR, ALL)
    ]


mutate = changing(changed_xml, words=WORDS)
