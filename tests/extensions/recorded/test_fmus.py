"""FMUs as engines: a crank in C, as FMI 2 and 3, as a model and as a co-simulation."""

import importlib
import importlib.util
import shutil
import subprocess
import sys
import zipfile

import pytest

from ...support.crank import MECHANISM
from ...support.examples import examples

VARIABLES, SOURCE = examples(__file__, "variables", "source")

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [
    pytest.mark.skipif(COMPILER is None, reason="no C compiler"),
    pytest.mark.skipif(sys.platform != "linux", reason="builds a binary for Linux"),
    pytest.mark.skipif(importlib.util.find_spec("fmpy") is None, reason="no FMPy"),
]
CASE = f"""{MECHANISM}[drivers.turn.motion]
type = "sine"
amplitude = 0.7
frequency = 1.0
[sweep]
driver = "time"
start = 0.0
stop = 1.0
steps = 41
[outputs.tip_x]
point = "tip"
component = "x"
relative = false
[outputs.swing]
type = "joint_angle"
joint = "pivot"
"""


def functions(fmi):
    """Return the names of all functions of FMI."""
    module = importlib.import_module(f"fmpy.fmi{fmi}")
    kinds = [getattr(module, f"FMU{fmi}{kind}") for kind in ("Slave", "Model")]
    return {name for kind in kinds for name in dir(kind) if name.startswith(f"fmi{fmi}")}


@pytest.fixture(scope="session")
def binary(tmp_path_factory):
    """The crank as a library."""
    folder = tmp_path_factory.mktemp("crank")
    every = functions(2) | functions(3)
    lacking = sorted(name for name in every if f"{name}(" not in SOURCE)
    stubs = "".join(f"int {name}() {{ return 3; }}\n" for name in lacking)
    (folder / "crank.c").write_text(SOURCE + stubs)
    command = [COMPILER, "-shared", "-fPIC", "-w", "-o", "crank.so", "crank.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    return (folder / "crank.so").read_bytes()


def description(fmi, kinds, states):
    """Return the model description of the crank."""
    variables = ""
    for k, (name, causality, unit) in enumerate(VARIABLES):
        own = f'name="{name}" valueReference="{k}" causality="{causality}"'
        real = f'unit="{unit}"' if unit else ""
        three = f"<Float64 {own} {real}/>"
        variables += three if fmi == 3 else f"<ScalarVariable {own}><Real {real}/></ScalarVariable>"
    derivative = {2: "<Derivatives><Unknown/></Derivatives>", 3: "<ContinuousStateDerivative/>"}
    token = "guid" if fmi == 2 else "instantiationToken"
    elements = "".join(f'<{kind} modelIdentifier="crank"/>' for kind in kinds)
    return (
        f'<fmiModelDescription fmiVersion="{fmi}.0" {token}="1" generationTool="own">{elements}'
        f"<ModelVariables>{variables}</ModelVariables>"
        f"<ModelStructure>{derivative[fmi] * states}</ModelStructure></fmiModelDescription>"
    )


@pytest.fixture
def judged(last_record, tmp_path, binary):
    """Returns status and record of the crank's FMU."""

    def run(fmi, kinds, maps, *, states=False, folder=None, jobs="1"):
        case, file = tmp_path / "crank.toml", tmp_path / "crank.fmu"
        case.write_text(CASE)
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("modelDescription.xml", description(fmi, kinds, states))
            place = folder or {2: "linux64", 3: "x86_64-linux"}[fmi]
            archive.writestr(f"binaries/{place}/crank.so", binary)
        options = [word for text in maps for word in ("--map", text)]
        return last_record(case, "--fmu", file, *options, jobs=jobs)

    return run


MODEL, STEPS = "ModelExchange", "CoSimulation"


@pytest.mark.by_day(2)
@pytest.mark.parametrize("kind", [MODEL, STEPS])
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu_outputs_belong_to_their_sample(judged, fmi, kind):
    status, record = judged(fmi, [kind], ["angle=turn", "x=tip_x"])
    errors = record["errors"]["tip_x"]["position"]
    assert (status, record["mode"], record["engine"]) == (0, "simulate", "crank")
    assert errors["max_abs"] < 1e-15
    assert errors["tolerance"] < 1e-8
    assert "inputs without a driver keep their start values: rate" in record["message"]


def test_fmu_input_offset_has_a_unit(judged):
    maps = ["angle=turn+90 [deg]", "x=tip_x"]
    _, record = judged(2, [MODEL], maps)
    assert record["errors"]["tip_x"]["position"]["max_abs"] == pytest.approx(0.70453, abs=1e-5)


def test_fmu_without_inputs_passes(judged):
    status, record = judged(2, [STEPS], ["free_x=tip_x"])
    assert status == 0
    assert "no driver is an input" in record["message"]


def test_co_simulation_step_is_halved(judged):
    maps = ["rate=turn.velocity", "sum=swing [rad]"]
    status, record = judged(2, [MODEL, STEPS], maps, states=True)
    errors = record["errors"]["swing"]["position"]
    assert status == 0
    assert errors["rms"] > 0.01
    assert "half the step changes swing by" in record["message"]


def test_wrong_co_simulation_output_fails(judged):
    maps = ["rate=turn.velocity", "sum=swing+0.5 [rad]"]
    assert judged(2, [STEPS], maps, states=True)[0] == 1


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"folder": "win64"}, "crank.fmu: has binaries for win64, this is linux64"),
        ({"kinds": [MODEL], "states": True}, "Export it for co-simulation"),
        ({"maps": ["angle=turn"]}, "found no output of the case among x, sum, free_x"),
        ({"maps": ["sum=swing"]}, 'Say --map "sum=swing [UNIT]"'),
        ({"maps": ["free_x=swing"]}, "unit 'mm' of column 'free_x'"),
        ({"maps": ["sum=turn [rad]", "x=tip_x"]}, "found sum for turn, expected an input"),
        ({"jobs": "0"}, "--fmu runs foreign machine code in workers alone. Leave out --jobs 0"),
    ],
    ids=str,
)
def test_unusable_fmu_is_refused(judged, capsys, options, text):
    given = {"fmi": 2, "kinds": [STEPS], "maps": ["angle=turn", "x=tip_x"], **options}
    assert judged(**given)[0] == 2
    assert text in capsys.readouterr().err


def test_fmu_without_description_is_refused(last_record, tmp_path, capsys):
    case, file = tmp_path / "crank.toml", tmp_path / "a.fmu"
    case.write_text(CASE)
    file.write_bytes(b"PK")
    assert last_record(case, "--fmu", file, jobs=None)[0] == 2
    assert "expected an FMU. Export it anew" in capsys.readouterr().err


def test_fmu_zip_bomb_is_refused(last_record, tmp_path, capsys):
    case, file = tmp_path / "case.toml", tmp_path / "large.fmu"
    case.write_text(CASE)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription/>")
        for k in range(3):
            archive.writestr(f"resources/{k}", bytes(100_000_000))
    assert file.stat().st_size < 400_000
    assert last_record(case, "--fmu", file)[0] == 2
    told = "unpacks to 300000022 bytes, expected 256000000 at most: export it without resources"
    assert told in capsys.readouterr().err
