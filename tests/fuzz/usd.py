"""Stages of USD; the second line says how they are driven."""

import re

from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.case.models.trees.usd import GENERIC, IN_BODY, IN_JOINT, ROD, TYPES

from ..support.usd_texts import FOUR_BAR, body, joint, locked, prim, stage
from .fuzzing import changing, read_or_refused, written
from .trees import changed_text

LONGEST = 6000
DRIVEN = re.compile(rb"# drive ([^ \n]{1,40})")
WORDS = (
    *(*IN_BODY, *IN_JOINT, *TYPES, GENERIC, ROD, "true", "false", "inf", "-inf", "nan", "0.5"),
    *("PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsLimitAPI", "PhysxMimicJointAPI", "Cube"),
    *("NewtonMimicAPI", "PhysicsCollisionAPI", "rotX", "rotY", "rotZ", "transX", "angular", "low"),
    *("over", "class", "def", "rel", "float", "double3", "quatf", "token", "custom", "None"),
    *("</r/a>", "</r/A>", "</>", "@m.usda@", "timeSamples", "matrix4d", "xformOp:transform"),
)
MOST_OF_IT = stage(
    prim("PhysicsScene", "scene", lines=["float physics:gravityMagnitude = 3"]),
    body(
        "a",
        (0, 0, 0),
        "float physics:mass = 2",
        prim("Capsule", "shape", "Collision", ["double radius = 0.1", 'uniform token axis = "X"']),
        apis="RigidBody Mass",
        ops="double3 xformOp:scale = (2, 2, 2)",
    ),
    *(body("b", (0, 0, 1)), body("c", (1, 0, 0))),
    joint("", "j", "", "a", (0, 0, 0), None, *locked("transX transY transZ rotX rotY"), axis=None),
    joint(
        "Prismatic",
        "k",
        *("a", "b", None, None, "rel newton:mimicJoint = </r/j>", "float newton:mimicCoef1 = 2"),
        "double mjc:coef2 = 0.1",
        apis="NewtonMimicAPI MjcEqualityJointAPI PhysicsDriveAPI:linear",
    ),
    joint("Revolute", "l", "b", "c", (0, 0, 1), None, "float drive:linear:physics:damping = 1"),
    joint(
        "Distance",
        "rod",
        *("c", "", (1, 0, 0), (1, 0, 0), "float physics:minDistance = 1"),
        "float physics:maxDistance = 1",
        axis=None,
    ),
)


def one(data: bytes) -> None:
    """Read one input with its own options."""
    drive = DRIVEN.search(data)
    supplied = Supplied(drive=(drive[1].decode("latin-1"),) if drive else (), hold_rest=True)
    file = written("m.usdc" if data.startswith(b"PXR") else "m.usda", data)
    read_or_refused(lambda: load(file, supplied))


def seeds() -> list[bytes]:
    """A four-bar, and all else in one."""
    texts = stage(*FOUR_BAR), MOST_OF_IT
    said = "#usda 1.0\n# drive A:0:0.5:5", "#usda 1.0\n# drive j:0:0.1:3"
    return [
        text.replace("#usda 1.0", head).encode() for text, head in zip(texts, said, strict=True)
    ]


mutate = changing(changed_text, words=WORDS)
