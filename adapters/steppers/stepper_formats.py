"""The model of steppers as MJCF and URDF: the files that engines read themselves.

The frame of every body is the global one at design; that of a URDF link is moved to its joint. An
MJCF file also has the rates at the start, in its keyframe. URDF has no closed loops: run.py adds
them.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from typing import Any

Plain = Mapping[str, Any]


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(each)) for each in values)


def mjcf(model: Plain) -> str:
    """Return the model as MJCF: loops are connects and, at rods, tendon equalities; springs are
    tendons. Loads are left to run.py.
    """
    root = ET.Element("mujoco", model=model["name"])
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", gravity=_numbers(model["gravity"]))
    elements = {"ground": ET.SubElement(root, "worldbody")}
    if any("ground" in tie["bodies"] for tie in model["ties"]):
        # Genesis has no connect with the world
        ET.SubElement(elements["ground"], "body", name="anchor")
    for body in model["bodies"]:
        element = ET.SubElement(elements[body["parent"]], "body", name=body["name"])
        elements[body["name"]] = element
        (a, d, e), (_, b, f), (_, _, c) = body["inertia"]
        about = {"pos": _numbers(body["center"]), "mass": _numbers([body["mass"]])}
        ET.SubElement(element, "inertial", {**about, "fullinertia": _numbers([a, b, c, d, e, f])})
        for move in body["moves"]:
            place = {
                name: _numbers(move[key]) for name, key in (("pos", "point"), ("axis", "axis"))
            }
            ET.SubElement(element, "joint", {"type": move["kind"], **place})
    tendons, equalities = ET.SubElement(root, "tendon"), ET.SubElement(root, "equality")

    def tendon(name: str, each: Plain, **more: str) -> None:
        spatial = ET.SubElement(tendons, "spatial", {"name": name, **more})
        for k, (body, point) in enumerate(zip(each["bodies"], each["points"], strict=True)):
            site = f"{name}.{k}"
            ET.SubElement(elements[body], "site", name=site, pos=_numbers(point))
            ET.SubElement(spatial, "site", site=site)

    for k, tie in enumerate(model["ties"]):
        if tie["length"]:
            tendon(f"tie {k}", tie)
            ET.SubElement(equalities, "tendon", tendon1=f"tie {k}")
            continue
        one, two = ("anchor" if name == "ground" else name for name in tie["bodies"])
        anchor = _numbers(tie["points"][0])
        ET.SubElement(equalities, "connect", body1=one, body2=two, anchor=anchor)
    for k, each in enumerate(model["springs"]):
        names = {"stiffness": "stiffness", "damping": "damping", "springlength": "free_length"}
        tendon(f"spring {k}", each, **{key: repr(each[name]) for key, name in names.items()})
    rates = _numbers(rate for body in model["bodies"] for rate in body["rates"])
    ET.SubElement(ET.SubElement(root, "keyframe"), "key", name="start", qvel=rates)
    return _text(root)


def urdf(model: Plain) -> str:
    """Return the tree of the model as URDF; links of a chain between bodies have no mass."""
    root, kinds = ET.Element("robot", name=model["name"]), {"hinge": "continuous"}
    kinds |= {"slide": "prismatic", "ball": "spherical", "fixed": "fixed"}
    ET.SubElement(root, "link", name="ground")
    at = {"ground": [0.0, 0.0, 0.0]}
    for body in model["bodies"]:
        parent = body["parent"]
        weld: Plain = {"kind": "fixed", "axis": [0.0, 0.0, 1.0], "point": at[parent]}
        moves = body["moves"] or [weld]
        for k, move in enumerate(moves, 1):
            last = k == len(moves)
            name = body["name"] if last else f"{body['name']} {k}"
            link = ET.SubElement(root, "link", name=name)
            at[name] = move["point"]
            if last:
                inertial = ET.SubElement(link, "inertial")
                ET.SubElement(inertial, "origin", xyz=_offset(at[name], body["center"]))
                ET.SubElement(inertial, "mass", value=repr(body["mass"]))
                six = {
                    f"i{'xyz'[i]}{'xyz'[j]}": repr(body["inertia"][i][j])
                    for i in range(3)
                    for j in range(i, 3)
                }
                ET.SubElement(inertial, "inertia", six)
            joint = ET.SubElement(root, "joint", name=f"{name} joint", type=kinds[move["kind"]])
            ET.SubElement(joint, "origin", xyz=_offset(at[parent], at[name]))
            ET.SubElement(joint, "parent", link=parent)
            ET.SubElement(joint, "child", link=name)
            ET.SubElement(joint, "axis", xyz=_numbers(move["axis"]))
            if move["kind"] == "slide":
                limits = {"lower": "-1e9", "upper": "1e9", "effort": "1e9", "velocity": "1e9"}
                ET.SubElement(joint, "limit", limits)
            parent = name
    return _text(root)


def _offset(start: Iterable[float], end: Iterable[float]) -> str:
    return _numbers(b - a for a, b in zip(start, end, strict=True))


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, "unicode") + "\n"


WRITERS: Mapping[str, tuple[str, Callable[[Plain], str]]] = {
    "mjcf": ("model.xml", mjcf),
    "urdf": ("model.urdf", urdf),
}
"""File and function of each format."""
