"""MJCF models as files."""

import numpy as np
import pytest
from kincheck.core.algebra import X, Y, Z
from kincheck.core.case.models.files import load
from kincheck.core.extensions.trees.reader import read_tree

from .model_poses import EXACT, near

mujoco = pytest.importorskip("mujoco")
differences = pytest.importorskip("tests.oracles.public_robots").differences


# Without it MuJoCo refuses a moving body; masses move nothing here.
MASS = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def model(tmp_path, text, name="model.xml"):
    """The text as a file, with an inertia in every body."""
    file = tmp_path / name
    file.write_text(
        "".join(
            part + ">" + MASS * part.lstrip().startswith("<body")
            for part in text.split(">")
            if part.strip()
        )
    )
    return file


def closes_in_mujoco(file, supplied):
    """All samples are solved, and stand where Newton's method on MuJoCo's equalities puts them."""
    solved, reached, worst = differences(file, supplied)
    assert reached == solved == len(load(file, supplied).sweep.values)
    assert worst.max() < EXACT


def stands_as(place, there):
    """Whether a place is that of a body or site of MuJoCo."""
    axes = np.transpose([[*place.direction(axis)] for axis in (X, Y, Z)])
    return near([*place.at], there.xpos) and near(axes, there.xmat.reshape(3, 3))


def agree(file):
    """Compare what the tree holds at qpos0 with MuJoCo: places and turns of bodies and sites,
    points and axes of joints.
    """
    tree = read_tree(file)
    loaded = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(loaded)
    mujoco.mj_kinematics(loaded, data)
    for name, place in tree.places.items():
        assert stands_as(place, data.body(name)), name
    for name, (_, place) in tree.sites.items():
        assert stands_as(place, data.site(name)), name
    for name, joint in tree.joints.items():
        there = data.joint(name)
        assert near([*joint.point], there.xanchor), name
        if joint.kind != "ball":
            zero = loaded.qpos0[loaded.joint(name).qposadr[0]]
            assert near([*joint.axis, joint.reference], [*there.xaxis, zero]), name
    return tree
