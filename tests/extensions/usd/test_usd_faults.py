"""USD: what is refused, by name: joints, units, files from elsewhere and damaged ones."""

import importlib.util
import re
import sys
from functools import partial

import pytest
from kincheck.core.errors import CaseError, KincheckError
from kincheck.core.extensions.trees.reader import read_tree

from ...support.case_texts import refused
from ...support.examples import examples
from ...support.usd_texts import ARM, body, hinge, joint, prim, stage, write_stage

(ELSEWHERE,) = examples(__file__, "elsewhere")

pytestmark = pytest.mark.skipif(importlib.util.find_spec("pxr") is None, reason="no usd-core")


@pytest.fixture
def write(tmp_path):
    return partial(write_stage, tmp_path)


link = partial(hinge, "k", "a", "b")
tie = partial(joint, "", "k", "a", "b")
FAULTS = {
    "limit without schema": (
        prim(
            *("PhysicsJoint", "k", "rel physics:body0 = </r/a>", "rel physics:body1 = </r/b>"),
            "float limit:rotX:physics:low = 5",
        ),
        "limit:rotX: found without the schema PhysicsLimitAPI:rotX",
    ),
    "lock beside zero": (
        tie("float limit:rotX:physics:low = 5", "float limit:rotX:physics:high = 5"),
        "lock the joint out of its frames",
    ),
    "distance limit": (tie("float limit:distance:physics:high = 5"), "limits a distance"),
    "rope": (
        joint("Distance", "k", "a", "b", "float physics:maxDistance = 5"),
        "found a range",
    ),
    "reversed limits": (
        link("float physics:lowerLimit = 5", "float physics:upperLimit = -5"),
        "is above",
    ),
    "gear": (prim("PhysxPhysicsGearJoint", "k"), "PhysxPhysicsGearJoint, which may couple"),
    "rack": (prim("PhysxPhysicsRackAndPinionJoint", "k"), "may couple joints"),
    "unknown joint": (prim("PhysicsHelicalJoint", "k"), "may join bodies"),
    "attachment": (
        prim("PhysxPhysicsAttachment", "k", "rel actor0 = </r/a>\nrel actor1 = </r/b>"),
        "may join bodies a, b",
    ),
    "couples joints": (
        prim("Scope", "k", "rel one = </r/j>", "rel two = </r/i>") + "\n" + hinge("i", "", "b"),
        "</r/k>: of type Scope may couple joints i, j by one, two and is not read",
    ),
    "third body": (
        link("rel cable:body2 = </r/a>"),
        "of type PhysicsRevoluteJoint may join bodies a by cable:body2",
    ),
    "leader without schema": (
        link("rel newton:mimicJoint = </r/j>"),
        "may couple joints j by newton:mimicJoint",
    ),
    "tendon": (
        link(apis="PhysxTendonAxisRootAPI:t"),
        "PhysxTendonAxisRootAPI:t, which may couple",
    ),
    "no such body": (hinge("k", "a", "bb"), "found '/r/bb', expected a prim"),
    "itself": (hinge("k", "a", "a"), "joins 'a' with itself"),
    "world": (hinge("k", "", ""), "joins 'the world' with itself"),
    "mistyped": (
        link("bool physics:exludeFromArticulation = 1"),
        "did you mean 'excludeFromArticulation'",
    ),
    "axis": (link(axis="W"), "expected one of X, Y, Z"),
    "zero turn": (link("quatf physics:localRot0 = (0, 0, 0, 0)"), "localRot0: is zero"),
    "not finite": (link(p=("inf", 0, 0)), "localPos0: found"),
    "mirrored": (body("c", ops="double3 xformOp:scale = (1, -1, 1)"), "is mirrored by its scale"),
    "flat": (body("c", ops="double3 xformOp:scale = (1, 0, 1)"), "is scaled to nothing"),
    "sheared": (
        body("c", ops="double3 xformOp:scale = (1, 2, 1)\ndouble xformOp:rotateZ = 30"),
        "is sheared",
    ),
    "mimic without schema": (
        link("rel physxMimicJoint:rotY:referenceJoint = </r/j>"),
        "without the schema PhysxMimicJointAPI:rotY",
    ),
    "unknown leader": (
        link("rel newton:mimicJoint = </r/i>", apis="NewtonMimicAPI"),
        "newton:mimicJoint: found '/r/i', expected a joint",
    ),
    "leader without coordinate": (
        joint("Spherical", "s", "", "b")
        + "\n"
        + link("rel newton:mimicJoint = </r/s>", apis="NewtonMimicAPI"),
        "couples 's', expected joints with one coordinate",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_usd_fault_is_one_message(write, fault):
    prims, said = FAULTS[fault]
    refused(lambda: read_tree(write(*ARM, prims)), said)


@pytest.mark.parametrize(("asset", "problem"), ELSEWHERE)
def test_reference_from_elsewhere_is_refused(write, tmp_path, asset, problem):
    folder = tmp_path / "in" / "here"
    folder.mkdir(parents=True)
    (tmp_path / "far.usda").write_text(stage())
    (folder / "broken.usda").write_text('#usda 1.0\ndef Xform "a" {\n')
    file = folder / "m.usda"
    file.write_text(stage(*ARM, prim("Xform", "x", metadata=f"prepend references = @{asset}@</r>")))
    with pytest.raises(CaseError, match=re.escape(problem)):
        read_tree(file)


@pytest.mark.parametrize("count", [1_000, 1_001])
def test_stage_of_many_layers_is_read(tmp_path, count):
    """Layers beside one another: empty ones, and the stage."""
    for k in range(count - 1):
        (tmp_path / f"{k}.usda").write_text("#usda 1.0\n")
    layers = ", ".join(f"@{k}.usda@" for k in range(count - 1))
    units = f'metersPerUnit = 1\n    upAxis = "Z"\n    subLayers = [{layers}]'
    (file := tmp_path / "m.usda").write_text(stage(*ARM, units=units))
    if count == 1_000:
        assert [*read_tree(file).joints] == ["j"]
    else:
        refused(lambda: read_tree(file), "m.usda: found more than 1000 layers, expected no more")


INVALID = b'#usda 1.0\ndef "\xff\xff"'
OTHER = [b"", b"hello", b"PXR-USDC", b"PK\x03\x04", bytes(99), INVALID]


@pytest.mark.parametrize("data", OTHER, ids=range(len(OTHER)))
@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz", ".usd"])
def test_data_without_stage_is_refused(tmp_path, suffix, data):
    file = tmp_path / f"m{suffix}"
    file.write_bytes(data)
    with pytest.raises(CaseError, match=r"not valid USD|has no|no body"):
        read_tree(file)


def test_missing_library_names_package(write, monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(KincheckError, match=r"reading m.usda needs pxr.*pip install .*usd-core"):
        read_tree(write(*ARM))


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ("metresPerUnit = 1", "did you mean 'metersPerUnit'"),
        ('metersPerUnit = "cm"', "Failed to parse value"),
        ("metersPerUnit = 0", "expected positive numbers"),
    ],
)
def test_nonsense_stage_units_are_refused(write, units, message):
    with pytest.raises(CaseError, match=message):
        read_tree(write(*ARM, units=units))
