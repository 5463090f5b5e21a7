"""Tensors of inertia from files, as each simulator's own reader has them, against a closed form:
principal moments turned by a known rotation, R diag(moments) R^T. The engines take masses and
inertias from kincheck, so that runs of them say nothing of a simulator's reader.
"""

import importlib

import numpy as np
import pytest
from kincheck.core import Body, Mechanism, Point, Revolute
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import written
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.extensions.trees.tree import sum_of_masses

from ...support.engine_motion import motion_case
from ...support.mechanisms import ORIGIN

ROUNDINGS = 1e-13
"""Of the largest entry: a product of three matrices, an eigenvalue problem and its product back
take a dozen roundings each; the error that MuJoCo had up to 3.13.0 is 1e-8. Drake keeps tensors
about the body's origin, so that those of small bodies have the roundings of m c^2."""
MASS, CENTER = 2.0, (0.3, -0.2, 0.7)
SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def rotation(rng):
    """Return a random rotation: of a unit quaternion, without any library."""
    a, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - a * z), 2 * (x * z + a * y)],
            [2 * (x * y + a * z), 1 - 2 * (x * x + z * z), 2 * (y * z - a * x)],
            [2 * (x * z - a * y), 2 * (y * z + a * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def tensors():
    """Yield names, rotations and principal moments [kg m^2] that a body can have."""
    rng = np.random.default_rng(7)
    for k in range(20):
        x, y, z = rng.uniform(0.1, 1.0, 3)
        yield f"random {k}", rotation(rng), np.array([y + z, x + z, x + y])
    for gap in (0.0, 1e-12, 1e-9, 1e-6, 1e-3):  # near symmetry the axes are nearly arbitrary
        yield f"two moments {gap:g} apart", rotation(rng), np.array([0.3, 0.3 + gap, 0.4])
        yield f"three moments {gap:g} apart", rotation(rng), np.array([0.3, 0.3 + gap, 0.3 - gap])
    for angle in (1e-9, 1e-6, 1e-4, 1e-2):  # nearly diagonal
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0]])
        yield f"turned by {angle:g}", np.vstack([turn, [0, 0, 1]]), np.array([0.2, 0.3, 0.4])
    for size in (1e-6, 1e4):
        yield f"size {size:g}", rotation(rng), size * np.array([0.2, 0.3, 0.4])
    yield "rod", rotation(rng), np.array([0.3, 0.3, 1e-4])


TENSORS = [(name, R @ np.diag(moments) @ R.T) for name, R, moments in tensors()]


def text_of(format, tensor):
    """Return a file with a body of this tensor, written here."""
    six = [repr(float(tensor[at])) for at in SIX]
    center = " ".join(map(repr, CENTER))
    if format == "mjcf":
        inertial = f'<inertial pos="{center}" mass="{MASS}" fullinertia="{" ".join(six)}"/>'
        joint = '<joint name="hinge" axis="0 0 1"/>'
        body = f'<worldbody><body name="body">{joint}{inertial}</body></worldbody>'
        return f'<mujoco model="m"><compiler balanceinertia="false"/>{body}</mujoco>'
    entries = [f"i{'xyz'[i]}{'xyz'[j]}" for i, j in SIX]
    if format == "urdf":
        inertia = " ".join(f'{name}="{n}"' for name, n in zip(entries, six, strict=True))
        inertial = f'<origin xyz="{center}"/><mass value="{MASS}"/><inertia {inertia}/>'
        link = f'<link name="body"><inertial>{inertial}</inertial></link>'
        ends = '<parent link="world"/><child link="body"/><axis xyz="0 0 1"/>'
        joint = f'<joint name="hinge" type="continuous">{ends}</joint>'
        return f'<robot name="r"><link name="world"/>{link}{joint}</robot>'
    inertia = "".join(f"<{name}>{n}</{name}>" for name, n in zip(entries, six, strict=True))
    inertial = f"<pose>{center} 0 0 0</pose><mass>{MASS}</mass><inertia>{inertia}</inertia>"
    link = f'<link name="body"><inertial>{inertial}</inertial></link>'
    ends = "<parent>world</parent><child>body</child><axis><xyz>0 0 1</xyz></axis>"
    joint = f'<joint name="hinge" type="revolute">{ends}</joint>'
    return f'<sdf version="1.6"><model name="m">{link}{joint}</model></sdf>'


def by_mujoco(path):
    mujoco = importlib.import_module("mujoco")
    m = mujoco.MjModel.from_xml_path(str(path))
    axes, body = np.empty(9), m.body("body").id
    mujoco.mju_quat2Mat(axes, m.body_iquat[body] / np.linalg.norm(m.body_iquat[body]))
    axes = axes.reshape(3, 3)
    return axes @ np.diag(m.body_inertia[body]) @ axes.T


def by_pinocchio(path):
    pinocchio = importlib.import_module("pinocchio")
    readers = {
        ".xml": pinocchio.buildModelFromMJCF,
        ".urdf": pinocchio.buildModelFromUrdf,
    }
    return readers[path.suffix](str(path)).inertias[1].inertia


def by_drake(path):
    plant = importlib.import_module("pydrake.multibody.plant").MultibodyPlant(0.0)
    importlib.import_module("pydrake.multibody.parsing").Parser(plant).AddModels(str(path))
    found = plant.GetBodyByName("body").default_spatial_inertia()
    about_center = found.Shift(found.get_com())
    return about_center.CalcRotationalInertia().CopyToFullMatrix3()


def by_dart(path):
    utils = importlib.import_module("dartpy").utils
    urdf = path.suffix == ".urdf"
    read = utils.DartLoader().parseSkeleton if urdf else utils.SdfParser.readSkeleton
    skeleton = read(str(path))
    return skeleton.getBodyNode("body").getInertia().getMoment()


def by_kincheck(path):
    tree = read_tree(path)
    (joint,) = tree.moves.values()
    return sum_of_masses(tree.masses[joint.inner]).in_frame(tree.moving[joint.inner]).inertia


def by_simbody(path):
    opensim = importlib.import_module("opensim")
    model = opensim.Model(str(path))  # what it owns ends with it
    found = model.getBodySet().get("body").getInertia()
    moments, products = found.getMoments(), found.getProducts()
    (x, y, z), (xy, xz, yz) = ([each.get(k) for k in range(3)] for each in (moments, products))
    return np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])


READERS = {
    "mujoco": (by_mujoco, "mujoco", ("mjcf", "urdf")),
    "pinocchio": (
        by_pinocchio,
        "pinocchio",
        ("mjcf", "urdf"),
    ),  # its packages are built without SDF
    "drake": (by_drake, "pydrake", ("mjcf", "urdf", "sdf")),
    "dart": (by_dart, "dartpy", ("urdf", "sdf")),  # of MJCF it reads no tensor: docs/upstream
    "simbody": (by_simbody, "opensim", ("osim",)),
    "kincheck": (by_kincheck, "kincheck", ("mjcf", "urdf", "sdf", "osim")),
}
ENDINGS = {"mjcf": ".xml", "urdf": ".urdf", "sdf": ".sdf", "osim": ".osim"}


def exported(format, tensor):
    xx, yy, zz, xy, xz, yz = (float(tensor[at]) for at in SIX)
    body = Body("body", mass=MASS, center_of_mass=CENTER, inertia=(xx, yy, zz, xy, yz, xz))
    hinge = Revolute("hinge", "ground", "body", ORIGIN, (0.0, 0.0, 1.0))
    mechanism = Mechanism("m", [body], [hinge], [Point("P", "body", CENTER)], [])
    return written(motion_case(mechanism, [0.0, 1.0]), writer_of(format))[ENDINGS[format]]


WRITERS = {"by hand": text_of, "export": exported}
APART = {("simbody", "osim", "by hand"), ("kincheck", "osim", "by hand"), ("dart", "sdf", "export")}
"""OpenSim's documents are long, and DART reads SDF up to 1.6: exports are of 1.11."""


@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    ("reader", "format", "write"),
    [
        pytest.param(reader, format, write, id=f"{reader} {format} {name}")
        for reader, (_, _, formats) in READERS.items()
        for format in formats
        for name, write in WRITERS.items()
        if (reader, format, name) not in APART
    ],
)
def test_reader_keeps_inertia_of_file(reader, format, write, tmp_path):
    read, package, _ = READERS[reader]
    pytest.importorskip(package)
    path = tmp_path / f"model{ENDINGS[format]}"
    errors = {}
    for name, tensor in TENSORS:
        path.write_text(write(format, tensor))
        size = np.abs(tensor).max() + (MASS * np.dot(CENTER, CENTER) if reader == "drake" else 0.0)
        errors[name] = np.abs(read(path) - tensor).max() / size
    assert {name: error for name, error in errors.items() if not error < ROUNDINGS} == {}
