"""Poses of a URDF with pairs of frames in YAML, by Newton's method on Pinocchio's frames."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

from .newton import least_squares

AXES = {"X": "1 0 0", "Y": "0 1 0", "Z": "0 0 1"}


def tree_of(file, types):
    """Return Pinocchio's reading of the tree, with the types of joints of the YAML file."""
    root = ET.parse(file).getroot()
    for joint in root.findall("joint"):
        kind = "SPHERICAL" if joint.get("type") in ("ball", "spherical") else ""
        kind = types.get(joint.get("name", ""), kind)
        if kind == "FIXED":
            joint.set("type", "fixed")
        elif kind:
            _split(root, joint, "XYZ" if kind == "SPHERICAL" else kind.removeprefix("UJOINT_"))
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    return pin.buildModelFromXML(ET.tostring(root, encoding="unicode"))


def _split(root, joint, axes):
    """Make hinges of a joint, one an axis: any three independent ones are a ball."""
    name, child = str(joint.get("name")), joint.find("child")
    assert child is not None
    last = child.get("link")
    for old in joint.findall("axis"):
        joint.remove(old)
    joint.set("type", "continuous")
    joint.set("name", name if len(axes) == 3 else f"{name}_{axes[0]}")
    ET.SubElement(joint, "axis", xyz=AXES[axes[0]])
    for k, letter in enumerate(axes[1:], 1):
        between = f"{name}.between{k}"
        ET.SubElement(root, "link", name=between)
        child.set("link", between)
        joint = ET.SubElement(root, "joint", name=f"{name}_{letter}", type="continuous")
        ET.SubElement(joint, "parent", link=between)
        child = ET.SubElement(joint, "child", link=str(last))
        ET.SubElement(joint, "axis", xyz=AXES[letter])


class PinocchioNewton:
    """A pose, moved by Newton's method.

    Attributes:
        residual: of all pairs of frames after the last move [m or rad].
    """

    def __init__(self, file, assembled, fixed):
        assert not fixed, "balls are hinges here, and are not held"
        beside = yaml.safe_load(file.with_suffix(".yaml").read_text())
        types = zip(beside.get("joint_name") or [], beside.get("joint_type") or [], strict=True)
        self.model, self.residual = tree_of(file, dict(types)), 0.0
        self.data = self.model.createData()
        self.pairs: Sequence[tuple[Sequence[str], str]] = [
            *zip(beside.get("closed_loop") or [], beside.get("type") or [], strict=True)
        ]
        self.joints = {name: k for k, name in enumerate(self.model.names)}
        self.state = pin.neutral(self.model)
        hinges = [each for each in assembled.tree.moves.values() if each.is_axial]
        known = {each.name: each.value for each in hinges if each.name in self.joints}
        for name, value in known.items():  # Newton's steps from zero might end elsewhere
            joint = self.model.joints[self.joints[name]]
            here = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
            self.state[joint.idx_q : joint.idx_q + joint.nq] = here
        self.move(known)

    def move(self, targets):
        """Close all pairs with joints at given coordinates [rad or m]."""
        unit = np.eye(self.model.nv)

        def rows():
            off, slopes = self._pairs()
            for name, value in targets.items():
                joint = self.model.joints[self.joints[name]]
                off = [*off, [self._apart(joint, value)]]
                slopes = [*slopes, unit[joint.idx_v : joint.idx_v + 1]]
            return np.concatenate([np.zeros(0), *off]), np.vstack([unit[:0], *slopes])

        def step(change):
            self.state = pin.integrate(self.model, self.state, change)

        least_squares(rows, step, 1e-7)
        self.residual = float(np.abs(np.concatenate([np.zeros(1), *self._pairs()[0]])).max())

    def body(self, name):
        """Return position and rotation matrix of a link; None of one that is no link there."""
        if not self.model.existFrame(name, pin.FrameType.BODY):
            return None
        pin.framesForwardKinematics(self.model, self.data, self.state)
        place = self.data.oMf[self.model.getFrameId(name, pin.FrameType.BODY)]
        return place.translation.copy(), place.rotation.copy()

    def _apart(self, joint, value):
        here = self.state[joint.idx_q : joint.idx_q + joint.nq]
        if joint.nq == 1:
            return float(here[0] - value)
        return float((np.arctan2(here[1], here[0]) - value + np.pi) % (2.0 * np.pi) - np.pi)

    def _pairs(self):
        pin.framesForwardKinematics(self.model, self.data, self.state)
        pin.computeJointJacobians(self.model, self.data, self.state)
        off, slopes = list[Any](), list[Any]()
        for names, kind in self.pairs:
            one, two = (self.model.getFrameId(name) for name in names)
            here, there = self.data.oMf[one], self.data.oMf[two]
            J = [
                pin.getFrameJacobian(self.model, self.data, each, pin.LOCAL_WORLD_ALIGNED)
                for each in (one, two)
            ]
            off.append(there.translation - here.translation)
            slopes.append(J[1][:3] - J[0][:3])
            if kind.lower() == "6d":
                off.append(pin.log3(there.rotation @ here.rotation.T))
                slopes.append(J[1][3:] - J[0][3:])
        return off, slopes
