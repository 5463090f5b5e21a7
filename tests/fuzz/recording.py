"""Recordings of a crank: tables, motions of OpenSim, results of Adams and MAT-files; a table states
the options --map in lines "# map NAME=COLUMN". What is read is judged. And descriptions of FMUs.
"""

import importlib.util
import io
import re
import struct
import zipfile
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from kincheck.core.case.case import Case
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.reader_options import CurveOptions
from kincheck.core.cli.shared_options import recorded_engines
from kincheck.core.recorded.engine import RecordedEngine
from kincheck.core.recorded.fmu import read_fmu

from .fuzzing import changing, read_or_refused, written
from .hardpoints import workbook
from .trees import changed_lines, changed_xml

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
POSE = "crank=crank: x y z, quaternion xyzw qx qy qz qw, velocity vx vy vz, omega wx wy wz"
ADAMS = """<?xml version="1.0" encoding="UTF-8"?>
<Results><Bibliography><File URL="a.res"/></Bibliography>
<Analysis name="run" Solver="Adams">
<Units angle="rad" length="meter"/>
<StepMap name="map">
<Entity name="time"><Component name="TIME" unitsValue="sec" id="1"/></Entity>
<Entity name="crank_XFORM" entity="crank" entType="Part" objectId="2">
<Component name="X" unitsValue="meter" id="2"/><Component name="Y" unitsValue="meter" id="3"/>
<Component name="Z" unitsValue="meter" id="4"/><Component name="PSI" unitsValue="rad" id="5"/>
<Component name="THETA" unitsValue="rad" id="6"/><Component name="PHI" unitsValue="rad" id="7"/>
</Entity></StepMap>
<Data name="kinematic_001"><Step type="static">0 0 0 0 0.1 0 0</Step>
<Step>0.5 0 0 0 0.25 0 0</Step>
<Step>1 0 0 0 0.4 0 0</Step></Data>
</Analysis></Results>
"""
FMU = b"<fmiModelDescription"
SCALAR = """<ScalarVariable valueReference="%d" name="%s" causality="%s"><Real unit="m"/>
</ScalarVariable>"""
FLOAT = '<Float64 valueReference="%d" name="%s" causality="%s" unit="m"/>'
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
    """A recording in each format, with angles, poses, rates and reactions."""
    rows = [(0.0, 0.1), (10.0, 0.0984808), (25.0, 0.0906308), (60.0, 0.05)]
    plain = "\n".join(["turn [deg],x [m]", *(f"{a},{x}" for a, x in rows)])
    german = "sep=;\n# map turn=-Kurbel+5 [deg]\n" + "\n".join(
        ["Kurbel;x [m];pin.FX", *(f"{5 - a};{x};1".replace(".", ",") for a, x in rows)]
    )
    heads = "time,crank.x,crank.y,crank.z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz"
    turned = [
        f"{0.1 * k},0,0,0,0,0,{np.sin(a / 2):.9f},{np.cos(a / 2):.9f},0,0,0,0,0,1"
        for k, a in enumerate((0.0, 0.1, 0.2, 0.3))
    ]
    posed = "\n".join([f"# map {POSE}", "# map event=last", heads, *turned])
    named = posed.replace(f"# map {POSE}\n", "").replace(",q", ",crank.q")
    euler = "# map crank=x y z, euler zyx c b a [deg], first\nx,y,z,a,b,c\n0,0,0,0,0,0\n0,0,0,0,0,5"
    opensim = "motion\nnRows=4\ninDegrees=yes\nendheader\nturn\tx\n" + "\n".join(
        f"{a}\t{x}" for a, x in rows
    )
    scipy_io: Any = import_module("scipy.io")
    fmus = [
        f'<fmiModelDescription fmiVersion="{fmi}.0" {token}="1" generationTool="own">'
        '<CoSimulation modelIdentifier="crank"/><ModelVariables>'
        f"{''.join(variables)}</ModelVariables></fmiModelDescription>"
        for fmi, token, variables in (
            (2, "guid", [SCALAR % (1, "turn", "input"), SCALAR % (2, "x", "output")]),
            (3, "instantiationToken", [FLOAT % (1, "turn", "input"), FLOAT % (2, "x", "output")]),
        )
    ]
    stream = io.BytesIO()
    turn = np.radians([a for a, _ in rows])
    scipy_io.savemat(stream, {"turn": turn, "x": np.array([x for _, x in rows]), "n": 3.0})
    log = io.BytesIO()
    scipy_io.savemat(log, {"turn": np.float32(turn), "log": {"turn": turn}, "x": np.cos(turn)})
    return [
        *(text.encode() for text in (plain, german, posed, named, euler, opensim, ADAMS, *fmus)),
        *(each.getvalue() for each in (stream, log)),
        modelica(turn, np.cos(turn) / 10),
        *workbook([line.split(",") for line in plain.splitlines()]),
    ]


def modelica(turn: np.ndarray, x: np.ndarray) -> bytes:
    """A file of level 4, as Modelica tools write it."""

    def text(name: str, lines: list[str]) -> bytes:
        width = max(map(len, lines))
        cells = [[ord(c) for c in line.ljust(width)] for line in lines]
        return matrix(name, np.array(cells, np.uint8), 51)

    def matrix(name: str, values: np.ndarray, kind: int = 0) -> bytes:
        head = struct.pack("<5i", kind, *values.shape, 0, len(name) + 1)
        return head + name.encode() + b"\0" + values.astype(values.dtype, order="F").tobytes("F")

    info = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [2, 3, 0, -1], [1, 2, 0, 0]], np.int32)
    data = np.column_stack([np.linspace(0, 1, len(turn)), turn, x])
    return b"".join(
        [
            text("Aclass", ["Atrajectory", "1.1", "", "binNormal"]),
            text("name", ["time", "turn", "x", "g"]),
            text("description", ["[s]", "angle [rad]", "[m]", "constant"]),
            matrix("dataInfo", info, 20),
            matrix("data_1", np.array([[0.0, 9.81], [1.0, 9.81]])),
            matrix("data_2", data),
        ]
    )


mutate = changing(changed_xml, changed_lines, words=(*WORDS,))
