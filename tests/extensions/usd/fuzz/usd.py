"""Stages of USD; the second line says how they are driven."""

from kincheck.core.extensions.usd.usd import GENERIC, IN_BODY, IN_JOINT, ROD, TYPES

from ....fuzz.fuzzing import changing, reading
from ....fuzz.keeping import seeds_in_file
from ....fuzz.trees import changed_text

LONGEST = 6000
WORDS = (
    *(*IN_BODY, *IN_JOINT, *TYPES, GENERIC, ROD, "true", "false", "inf", "-inf", "nan", "0.5"),
    *("PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsLimitAPI", "PhysxMimicJointAPI", "Cube"),
    *("MjcEqualityJointAPI", "mjc:target", "mjc:coef2"),
    *("NewtonMimicAPI", "PhysicsCollisionAPI", "rotX", "rotY", "rotZ", "transX", "angular", "low"),
    *("over", "class", "def", "rel", "float", "double3", "quatf", "token", "custom", "None"),
    *("</r/a>", "</r/A>", "</>", "@m.usda@", "timeSamples", "matrix4d", "xformOp:transform"),
)


def one(data: bytes) -> None:
    """Read one input with its own options."""
    reading("m.usdc" if data.startswith(b"PXR") else "m.usda", hold_rest=True)(data)


def seeds() -> list[bytes]:
    """A four-bar, and all else in one."""
    return seeds_in_file("usd")


mutate = changing(changed_text, words=WORDS)
