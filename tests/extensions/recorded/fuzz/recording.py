"""Recordings of a crank: tables, motions of OpenSim, results of Adams and MAT-files; a table states
the options --map in lines "# map NAME=COLUMN". What is read is judged. And descriptions of FMUs.
"""

import importlib.util
import io
import re
import zipfile
from functools import cache
from pathlib import Path

from kincheck.core.case.case import Case
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.reader_options import CurveOptions
from kincheck.core.extensions.recorded.engine import RecordedEngine
from kincheck.core.extensions.recorded.fmu import read_fmu
from kincheck.core.extensions.recorded.source import recorded_engines

from ....fuzz.fuzzing import changing, read_or_refused, written
from ....fuzz.keeping import seeds_in_file
from ....fuzz.trees import changed_lines, changed_xml

LONGEST = 6000
MAP = re.compile(r"^# map (.*)$", re.MULTILINE)
CRANK = b"""schema = "kincheck-case/1"
name = "crank"
source = "made up for fuzzing"
[bodies.crank]
mass = 2.0
inertia = [0.1, 0.1, 0.2, 0, 0, 0]
[joints.pin]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[points.tip]
body = "crank"
position = [0.1, 0, 0]
[drivers.turn]
type = "joint_angle"
joint = "pin"
[sweep]
driver = "turn"
start = 0
stop = 1
steps = 3
[outputs.x]
point = "tip"
component = "x"
relative = false
"""
FMU = b"<fmiModelDescription"
WORDS = """turn turn.velocity x tip_x time crank.x pin.FX event=first event=last frame first body
euler 321 fixed inverted quaternion wxyz omega alpha acceleration velocity endheader inDegrees=yes
[deg] [mm] (rad) rad/s [N] # map = + - , ; : NaN inf 1e400 -0 1,5 Results Analysis Data Step Entity
Component StepMap name id unitsValue entity objectId
fmiVersion guid ModelVariables ScalarVariable Real unit ModelExchange TypeDefinitions Derivatives
valueReference causality parameter declaredType""".split()


def one(data: bytes) -> None:
    """Read one input as the kind of file that it begins like."""
    start = data.lstrip()[:1]
    maps = [each.strip() for each in MAP.findall(data.decode("latin-1"))]
    if data.startswith(FMU):
        if importlib.util.find_spec("fmpy") is None:
            return
        read_or_refused(lambda: read_fmu(packed(data), crank(), ["turn=turn [rad]", "x=x [m]"]))
        return
    if data.startswith(b"PK"):
        name = "run.xlsx"
    elif start == b"<":
        name, maps = "run.res", []
    elif data.startswith((b"MATLAB", b"\0\0\0\0", b"\x14\0\0\0", b"3\0\0\0")):
        name, maps = "run.mat", ["turn=turn [rad]", "x=x [m]"]
    else:
        name = "run.mot" if b"endheader" in data else "run.csv"
    read_or_refused(lambda: _judged(name, data, maps))


def packed(description: bytes) -> Path:
    """An FMU of that description, with a binary for each machine."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        for machine in ("linux64", "x86_64-linux"):
            archive.writestr(f"binaries/{machine}/crank.so", b"")
    return written("crank.fmu", stream.getvalue())


def _judged(name: str, data: bytes, maps: list[str]) -> None:
    found, engines = recorded_engines([written(name, data)], crank(), CurveOptions(maps))
    for each in engines:
        assert isinstance(each, RecordedEngine)
        each.report(found)


@cache
def crank() -> Case:
    """The case that recordings are of."""
    return load_case(written("crank.toml", CRANK))


def seeds() -> list[bytes]:
    """A recording in each format, with angles, poses, rates and reactions; two FMUs."""
    return seeds_in_file("recording")


mutate = changing(changed_xml, changed_lines, words=(*WORDS,))
