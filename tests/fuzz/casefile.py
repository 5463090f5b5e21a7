"""Case files, TOML and JSON: read, and driven as `kincheck run` asks."""

import kincheck.cases
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.document import fault
from kincheck.core.case.io.mechanism_sections import DRIVERS
from kincheck.core.case.io.sections import sections
from kincheck.core.case.measures import Measure
from kincheck.core.errors import KincheckError
from kincheck.core.joints import Coupler, Joint
from kincheck.core.kinematics import require_driven
from kincheck.core.mechanism.motions import Motion

from ..support.case_texts import BASE, INLINE
from .fuzzing import changing, read_or_refused, written
from .trees import changed_json, changed_toml

LONGEST = 6000
# The rank is found by a dense factorisation; of small mechanisms it takes milliseconds.
MOST_BODIES = 12
KEYS = """schema name source truth units length angle bodies origin euler_parameters fixed joints type point axis points axes radius
ratio lead body position drivers direction relative joint motion rate amplitude frequency phase times values sweep driver start stop
steps outputs component atol rtol why suspension convention side forward up wheel_center center_plane kingpin wheel_radius axle
wheelbase cg_height brakes drive per_travel reference file columns rows ground time closed_form x y z mm deg left iso8855 sae_j670
front outboard inboard"""  # noqa: E501
TYPES = [
    *Joint.registry,
    *Coupler.registry,
    *DRIVERS,
    *Motion.types(),
    *Measure.registry,
    *(name for section in sections() for name in section.types),
]
WORDS = (*KEYS.split(), *TYPES)


def one(data: bytes) -> None:
    """Read one input; raises what a user would see as a traceback."""
    file = written("case.json" if data.lstrip().startswith(b"{") else "case.toml", data)

    def read() -> None:
        case = load_case(file)
        if len(case.mechanism.bodies) <= MOST_BODIES:
            try:
                require_driven(case.mechanism)
            except KincheckError as error:  # as the command line has it
                raise fault(file, "", f"{error}") from error

    read_or_refused(read)


def seeds() -> list[bytes]:
    """The built-in cases without the files beside them, and one with a reference inside."""
    texts = [
        file.read_text().partition("[reference]")[0]
        for file in map(kincheck.cases.file, kincheck.cases.names())
    ]
    return [text.encode() for text in (BASE + INLINE, *texts)]


mutate = changing(changed_json, changed_toml, words=WORDS)
