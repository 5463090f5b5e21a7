"""Datasets of Adams Solver; the command line's --drive, --hold, --without and --recorded stand in
the title.
"""

from pathlib import Path

from kincheck.core.case.models.files import load
from kincheck.core.extensions.adams.dataset import ARGUMENTS, KNOWN

from ....fuzz.fuzzing import changing, read_or_refused, said, written
from ....fuzz.trees import changed_text

LONGEST = 6000
DATA = Path(__file__).parents[3] / "data"
SIGNS = """TIME SIN COS SQRT STEP POLY SHF DM VR AZ WZ PI RTOD USER IF ( ) , ! & ; \\ = ** 90D 1E3
MILLIMETER INCH SECOND POUND_MASS NEWTON MKS NONE R:T hold rest recorded without END"""
WORDS = (*KNOWN, *(name for each in ARGUMENTS.values() for name in each.split()), *SIGNS.split())
LINKAGE = b"""title drive time:0:1:3
UNITS/ FORCE = NEWTON, MASS = KILOGRAM, LENGTH = MILLIMETER, TIME = SECOND
PART/1, GROUND
MARKER/11, PART = 1
MARKER/14, PART = 1, REULER = 90D, 90D, 0D
PART/2, QG = 40, 30, 0, MASS = 0.3, CM = 20, IP = 6000, 5000, 7000, 1, 2, 3, IM = 21
MARKER/20, PA = 2
MARKER/21, PART = 2, QP = -40, -30, 0
MARKER/22, PART = 2, QP = 40, 30, 0, ZP = 40, 30, 1, XP = 41, 30, 0
PART/3, QG = 140, 30, 0, ZG = 140, 30, 1, XG = 141, 30, 0
MARKER/32, PART = 3, QP = -60, 30, 0
MARKER/33, PART = 3, QP = 60, -30.001, 0
PART/4, QG = 200, 0, 0
MARKER/40, PART = 4
MARKER/44, PART = 4, REULER = 90D, 90D, 0D
JOINT/1, REVOLUTE, I = 21, J = 11
JOINT/2, SPHERICAL, I = 32, J = 22
JOINT/3, CYLINDRICAL, I = 33, J = 40
JOINT/4, TRANSLATIONAL, I = 44, J = 14
MOTION/1, ROTATION, JOINT = 1
, FUNCTION = STEP(TIME, 0, 0D, 1,
, 60D) + 0.1*SIN(2*TIME)**2
SPRINGDAMPER/1, TRANSLATIONAL, I = 40, J = 11, K = 0.5, C = 0.01, LENGTH = 150
SFORCE/2, ROTATIONAL, I = 21, J = 11, FUNCTION = -3*(AZ(21,11)-10D)-0.1*WZ(21,11,11)
ACCGRAV/JGRAV = -9806.65 ! falls
GRAPHICS/1, CYLINDER, CM = 20 ; RESULTS/XRF
END
"""
COUPLED = b"""title drive JOINT_1:0:0.5:5
UNITS/SYSTEM = MKS
PART/1, GROUND
MARKER/1, PART = 1
MARKER/2, PART = 1, QP = 3, 0, 0
MARKER/3, PART = 1, QP = 1, 0, 0, REULER = 0, 90D, 0
MARKER/4, PART = 1, QP = 0, 1, 0, REULER = 90D, 90D, 0D
PART/5
MARKER/51, PART = 5
PART/6, QG = 3, 0, 0
MARKER/61, PART = 6
PART/7, QG = 0, 1, 0
MARKER/71, PART = 7, REULER = 90D, 90D, 0D
JOINT/1, REV, I = 51, J = 1
JOINT/2, CYL, I = 61, J = 2
JOINT/3, TRANS, I = 71, J = 4
JOINT/4, RACKPIN, I = 51, J = 71, PD = 2
GEAR/1, JOINTS = 1, 2, CV = 3
JPRIM/1, INPLANE, I = 61, J = 2
END
"""
LOOSE = b"""title recorded without BUSHING
UNITS/LENGTH = INCH, MASS = POUND_MASS, FORCE = POUND_FORCE, TIME = SECOND
PART/1, GROUND
MARKER/1, PART = 1
PART/2, MASS = 1, CM = 2
MARKER/2, PART = 2, QP = 1, 1, 0
MARKER/3, PART = 2, QP = 0, 0, 0, REULER = 0, 0, 20D
JOINT/1, SCREW, I = 3, J = 1, PITCH = 2
GCON/1, I = 2, FUNCTION = DM(2, 1) - SQRT(2)
BUSHING/1, I = 2, J = 1
END
"""
COUPLER = COUPLED.replace(
    b"GEAR/1, JOINTS = 1, 2, CV = 3", b"COUPLER/1, JOINTS = 1, 2, TYPE = R:R, SCALES = 1, -2"
).replace(b"drive JOINT_1:0:0.5:5", b"hold rest drive JOINT_3:0:0.1:4")


def one(data: bytes) -> None:
    """Read one input with the options in its title."""
    title = data.split(b"\n", 1)[0]
    without = ("BUSHING",) if b"without" in title else ()
    more = {"hold_rest": b"rest" in title, "without": without, "recorded": b"recorded" in title}
    read_or_refused(lambda: load(written("deck.adm", data), said(title, hold=(), **more)))


def seeds() -> list[bytes]:
    """A linkage with springs, couplers, a screw with a distance, and a public deck."""
    public = (DATA / "adams" / "test_RotSpring_Case01.adm").read_bytes()
    return [LINKAGE, COUPLED, COUPLER, LOOSE, public.replace(b"ADAMS", b"recorded", 1)]


mutate = changing(changed_text, words=WORDS)
