"""Bodies that hang on one joint, recorded by ADAMS, and their joints (source in the data file)."""

import json
from pathlib import Path

import numpy as np
from kincheck import (
    Cylindrical,
    Distance,
    Revolute,
    RevoluteSpherical,
    Spherical,
    Translational,
    Universal,
)

from ..oracles import naive

CASES = json.loads(
    (Path(__file__).parents[1] / "data" / "adams_single_joints.json").read_text("utf-8")
)["cases"]
NAMES = ("joint", "ground", "body")


def axes(case):
    """The axes x, y, z of the joint frame, global."""
    p = np.array(case["frame"])
    return tuple(map(tuple, naive.Body(np.zeros(3), p / np.linalg.norm(p)).A.T))


def right(case):
    """The joint of a case: revolute, prismatic and cylindrical along z; universal with x on the
    ground and y on the body.
    """
    if case["joint"] == "distance":
        return Distance(*NAMES, (case["ground_point"], case["body_point"]), case["length"])
    if case["joint"] == "revolute_spherical":
        return RevoluteSpherical(*NAMES, (case["ground_point"], case["body_point"]), case["axis"])
    if case["joint"] == "spherical":
        return Spherical(*NAMES, case["point"])
    x, y, z = axes(case)
    if case["joint"] == "universal":
        return Universal(*NAMES, case["point"], (x, y))
    kinds = {"revolute": Revolute, "translational": Translational, "cylindrical": Cylindrical}
    return kinds[case["joint"]](*NAMES, case["point"], z)
