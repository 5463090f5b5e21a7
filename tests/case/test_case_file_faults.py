"""Broken and damaged case files: one message says what is wrong."""

import json
import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kincheck import CaseError
from kincheck.core.case.io.case_file import load_case

from ..support.case_texts import BASE, BY_FILE, INLINE, complains, edited, rows, write
from ..support.examples import examples

DRIVEN_BROKEN, BROKEN_JSON = examples(__file__, "driven_broken", "broken_json")

BROKEN = {
    row.id: row.values
    for row in rows("""
unknown key | axis = [1 | axes = [1 | joints.guide.axes ... unknown key ... did you mean 'axis'
misspelt joint type | type = "translational" | tyep = "translational"
    | joints.guide.tyep ... unknown key; did you mean 'type'?
misspelt output type | [outputs.tip_x]\\n
    | [outputs.tip_x]\\njoint = "guide"\\ntyep = "joint_force"\\n
    | outputs.tip_x.tyep ... unknown key ... did you mean 'type'?
unknown key far off | atol = 1e-9 | atol = 1e-9\\nqqq = 1
    | outputs.tip_x.qqq ... unknown key ... remove it
unknown output | [outputs.tip_x]\\n | [outputs.tip_x]\\ntype = "joint_forc"\\n
    | outputs.tip_x.type ... 'joint_forc', expected an output type; did you mean 'joint_force'?
wrong schema | kincheck-case/1 | kincheck-case/9
    | schema ... kincheck-case/9 ... expected "kincheck-case/1"
no schema | schema = "kincheck-case/1" |  | schema ... found none
no source | source = "made up for this test" |
    | source ... missing ... where the numbers come from
empty source | source = "made up for this test" | source = "" | source ... found ''
unknown truth | "closed_form" | "gospel" | truth ... 'gospel' ... third_party_data
unknown length unit | [bodies.slider] | [units]\\nlength = "inch"\\n[bodies.slider]
    | units.length ... 'inch' ... "m" or "mm"
unknown angle unit | [bodies.slider] | [units]\\nangle = "grad"\\n[bodies.slider]
    | units.angle ... 'grad' ... "rad" or "deg"
unknown joint | "translational" | "translation"
    | joints.guide.type ... 'translation' ... did you mean 'translational'
unheard-of joint | "translational" | "qqq"
    | joints.guide.type ... known: constant_velocity, cylindrical
no joint type | type = "translational" |
    | joints.guide.type ... missing, expected a joint type; add it
joint type of another kind | type = "translational" | type = [1] | joints.guide.type ... [1]
unknown driver | "joint_displacement" | "joint_shift"
    | drivers.push.type ... 'joint_shift' ... joint_displacement
missing body | ["ground", "slider"] | ["ground", "slidr"]
    | joints.guide.bodies ... 'slidr' ... did you mean 'slider'
one body | ["ground", "slider"] | ["slider"] | joints.guide.bodies ... ['slider'] ... two names
same body twice | ["ground", "slider"] | ["slider", "slider"] | joints.guide ... with itself
body of a point | body = "slider" | body = "sldr"
    | points.tip.body ... point 'tip' ... no body 'sldr'
zero axis | axis = [1.0, 0.0, 0.0] | axis = [0, 0.0, 0] | joints.guide ... axis is zero
missing axis | axis = [1.0, 0.0, 0.0] |
    | joints.guide.axis ... missing ... a direction [x, y, z] ... add the key
axis of two | axis = [1.0, 0.0, 0.0] | axis = [1, 0]
    | joints.guide.axis ... [1, 0] ... a direction [x, y, z]
axis of truth | axis = [1.0, 0.0, 0.0] | axis = [true, 0, 0] | joints.guide.axis ... True
NaN | axis = [1.0, 0.0, 0.0] | axis = [1, nan, 0] | joints.guide.axis[1] ... nan ... finite
overflowing | position = [1.5 | position = [1e200 | points.tip.position[0] ... 1e+200
underflowing axis | axis = [1.0, 0.0, 0.0] | axis = [1e-200, 0, 0]
    | joints.guide.axis[0] ... 1e-200
no driver | [drivers.push]\\ntype = "joint_displacement"\\njoint = "guide" | [drivers]
    | drivers ... no driver
driven twice | [drivers.push]
    | [drivers.pull]\\ntype = "joint_displacement"\\njoint = "guide"\\n[drivers.push]
    | drivers.push.joint ... 'guide' ... translation 'pull' drives already ... remove one
driver of nothing | driver = "push" | driver = "pull" | sweep.driver ... 'pull' ... push
driven joint | joint = "guide" | joint = "guid"
    | drivers.push.joint ... no joint 'guid' ... did you mean 'guide'
driven freedom | "joint_displacement" | "joint_angle"
    | drivers.push.joint ... driver 'push' ... no rotation
no steps | steps = 3 | steps = 0 | sweep.steps ... found 0 ... 1 to 1000000
half a step | steps = 3 | steps = 2.5 | sweep.steps ... 2.5 ... whole number
too many steps | steps = 3 | steps = 1_000_000_000_000 | sweep.steps ... 1 to 1000000
no motion | stop = 0.1 | stop = -0.1 | sweep.stop ... steps = 1
no stop | stop = 0.1\\n |  | sweep.stop ... missing
no sweep | [sweep]\\ndriver = "push"\\nstart = -0.1\\nstop = 0.1\\nsteps = 3\\nrate = 2.0\\n |
    | sweep ... missing
no point | [points.tip]\\nbody = "slider"\\nposition = [1.5, 2.0, 3.0] |
    | outputs.tip_x.point ... found 'tip', expected a point; there is none here: define it
output of nothing | point = "tip" | point = "top"
    | outputs.tip_x.point ... 'top' ... did you mean 'tip'
component | component = "x" | component = "u"
    | outputs.tip_x.component ... 'u' ... "x", "y" or "z"
neither | component = "x" |  | outputs.tip_x ... neither component nor direction
both | component = "x" | component = "x"\\ndirection = [1, 0, 0]
    | outputs.tip_x ... both component and direction
zero direction | component = "x" | direction = [0, 0, 0] | outputs.tip_x.direction ... found zero
no reason | why = "made up for this test" |  | outputs.tip_x.why ... missing ... reason
reason for nothing | atol = 1e-9 |  | outputs.tip_x.why ... without a tolerance
negative tolerance | atol = 1e-9 | atol = -1 | outputs.tip_x.atol ... -1 ... not negative
name of a derivative | [outputs.tip_x] | [outputs."tip.velocity"]
    | outputs.tip.velocity ... another name
euler parameters | origin = [1.0 | euler_parameters = [1, 1, 0, 0]\\norigin = [1.0
    | bodies.slider ... length 1.41
ground | [bodies.slider] | [bodies.ground]\\n[bodies.slider] | 'ground' exists by itself
body is a number | [bodies.slider]\\norigin = [1.0, 2.0, 3.0] | [bodies]\\nslider = 3
    | bodies.slider ... found 3 ... table
bodies are a list | [bodies.slider] | [[bodies]] | bodies ... expected a table
unprintable name | [bodies.slider] | [bodies."\\u001b[2J"]\\n[bodies.slider]
    | bodies ... printable
unprintable text | source = "made | source = "\\u001b[2J made | source ... printable
TOML syntax | rate = 2.0 | rate = = 2.0 | not valid TOML ... line
key twice | rate = 2.0 | rate = 2.0\\nrate = 2.0 | not valid TOML
no reference file | [outputs.tip_x] | \\n[reference]\\nfile = "tip.csv"\\n[outputs.tip_x]
    | case.toml: line 27: reference.file: found 'tip.csv', but there is no such file
file and rows | [outputs.tip_x]
    | \\n[reference]\\nfile = "tip.csv"\\nrows = [[1, 1]]\\n[outputs.tip_x]
    | reference ... one source
neither file nor rows | [outputs.tip_x] | [reference]\\n[outputs.tip_x]
    | reference ... neither file nor rows
ragged rows | [outputs.tip_x] | [reference]\\nrows = [[-0.1, 1], [0]]\\n[outputs.tip_x]
    | reference.rows[1] ... found 1 numbers
an empty row | [outputs.tip_x] | [reference]\\nrows = [[-0.1, 1], [], [0.1, 1]]\\n[outputs.tip_x]
    | reference.rows[1] ... found no numbers
an empty first row | [outputs.tip_x] | [reference]\\nrows = [[], [-0.1, 1]]\\n[outputs.tip_x]
    | reference.rows[0] ... found no numbers
rows off the grid | [outputs.tip_x]
    | [reference]\\nrows = [[-0.1, 1], [0.02, 1], [0.1, 1]]\\n[outputs.tip_x]
    | reference.rows[1] ... 0.02 m ... nearest is 0 m ... expected 4 rows
""")
} | {
    "both fixed": (
        "origin = [1.0, 2.0, 3.0]",
        "fixed = true",
        "joints.guide.bodies ... joint 'guide' ... are both fixed, and driver 'push' needs it to"
        " move; free one of them",
    ),
    "huge integer": ("steps = 3", f"steps = 0x1{'0' * 5000}", "sweep.steps ... huge integer"),
    "one step of two": (
        "steps = 3",
        "steps = 1",
        "sweep.steps ... found 1 with start -0.1 and stop 0.1 ... 2 or more ... stop = start for"
        " a single sample",
    ),
    "too deep": (
        "[bodies.slider]",
        f"[bodies.{'a.' * 3000}a]\n[bodies.slider]",
        "nested more than 16 deep",
    ),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_broken_case_file_is_refused(tmp_path, kind):
    *edit, fragments = BROKEN[kind]
    complains(write(tmp_path, edited(edit)), fragments)


@pytest.mark.parametrize("claim", ["", 'truth = "consensus_only"'])
def test_reference_needs_truth(tmp_path, claim):
    complains(
        write(tmp_path, edited(('truth = "closed_form"', claim)) + INLINE),
        "truth ... beside a [reference] ... closed_form",
    )


def test_unreadable_case_file_is_refused(tmp_path):
    complains(write(tmp_path, b"\xff" + BASE.encode()), "byte 0 is not UTF-8")
    complains(tmp_path / f"{'long' * 1000}.toml", "cannot be read ... check path")


@pytest.mark.parametrize(
    ("text", "fragments"),
    BROKEN_JSON,
)
def test_broken_json_case_is_refused(tmp_path, text, fragments):
    complains(write(tmp_path, text, "case.json"), f"case.json ... {fragments}")


# A crank and a slider, coupled and driven in several ways

DRIVEN = edited(
    (
        "[points.tip]",
        """[bodies.crank]
[bodies.pinion]
[joints.pivot]
type = "revolute"
bodies = ["ground", "crank"]
point = [0, 0, 0]
axis = [0, 0, 1]
[joints.axle]
type = "revolute"
bodies = ["ground", "pinion"]
point = [0, 1, 0]
axis = [0, 0, 1]
[joints.mesh]
type = "gear"
joints = ["axle", "pivot"]
ratio = -2.0
[drivers.turn]
type = "joint_angle"
joint = "pivot"
[drivers.turn.motion]
type = "table"
times = [-1, 0, 1]
values = [0.5, 0, 0.5]
[points.tip]""",
    )
)


TURN = DRIVEN[DRIVEN.index("[drivers.turn.motion]") : DRIVEN.index("[points.tip]")]
PUSH = '[drivers.push.motion]\ntype = "ramp"\nrate = 1\n'
MESH = DRIVEN[DRIVEN.index("[joints.mesh]") : DRIVEN.index("[drivers.turn]")]
TIME = ('driver = "push"', 'driver = "time"')
NO_RATE = ("rate = 2.0\n", "")


@pytest.mark.parametrize("kind", DRIVEN_BROKEN)
def test_broken_coupler_or_motion_is_refused(tmp_path, kind):
    *edits, said = DRIVEN_BROKEN[kind]
    pairs = zip(edits[::2], edits[1::2], strict=True)
    complains(write(tmp_path, edited(*pairs, base=DRIVEN)), said)


def test_driven_case_is_valid(tmp_path):
    assert load_case(write(tmp_path, DRIVEN)).mechanism.couplers
    assert load_case(write(tmp_path, edited(TIME, NO_RATE, base=DRIVEN))).sweep.driver == "time"


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["ground", "revolute", "slider"]),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=8,
)

FUZZ = settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def read_or_refuse(file):
    try:
        case = load_case(file)
    except CaseError as error:
        assert str(error).startswith(str(file))  # noqa: PT017
        str(error).encode()
    else:
        assert case.outputs
        assert np.isfinite(case.sweep.values).all()


@FUZZ
@given(
    data=st.binary(max_size=60)
    | st.text(max_size=60).map(lambda text: text.encode(errors="surrogatepass"))
)
def test_random_bytes_are_refused(tmp_path, data):
    for name in ("case.toml", "case.json", "case"):
        read_or_refuse(write(tmp_path, data, name))


@FUZZ
@given(
    cut=st.integers(0, len(BASE + INLINE)), length=st.integers(0, 12), instead=st.text(max_size=4)
)
def test_damaged_case_text_is_refused(tmp_path, cut, length, instead):
    text = BASE + INLINE
    read_or_refuse(
        write(
            tmp_path, (text[:cut] + instead + text[cut + length :]).encode(errors="surrogatepass")
        )
    )


def places(value, path=()):
    inside = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    return [path] * bool(path) + [
        place for key, each in inside for place in places(each, (*path, key))
    ]


PLACES = [
    (text, place) for text in (BASE + INLINE, DRIVEN) for place in places(tomllib.loads(text))
]


@FUZZ
@given(place=st.sampled_from(PLACES), value=ANYTHING)
def test_random_value_anywhere_is_refused(tmp_path, place, value):
    text, place = place
    document = tomllib.loads(text)
    *way, last = place
    inside: object = document
    for key in way:
        inside = inside[key]  # type: ignore[index]
    inside[last] = value  # type: ignore[index]
    read_or_refuse(write(tmp_path, json.dumps(document), "case.json"))


@FUZZ
@given(rows=st.lists(st.lists(st.floats() | st.text(max_size=5), max_size=4), max_size=5))
def test_random_reference_cells_are_refused(tmp_path, rows):
    lines = "\n".join(",".join(map(str, row)) for row in rows)
    write(
        tmp_path, ("push,tip_x,tip_x.velocity\n" + lines).encode(errors="surrogatepass"), "tip.csv"
    )
    try:
        load_case(write(tmp_path, BASE + BY_FILE))
    except CaseError as error:
        assert "tip.csv" in str(error)  # noqa: PT017
