"""The attributes of MJCF for the elements read here; from MuJoCo's own schema
(mj_printSchema, MuJoCo 4.0).
"""

from __future__ import annotations

from .elements import Element

ORIENTATION = ("quat", "axisangle", "xyaxes", "zaxis", "euler")
_FRAME = ("name", "childclass", "pos", *ORIENTATION)
_SOFT = ("solref", "solimp", "class", "active", "name")
_FORCES = (
    "springdamper",
    "springyield",
    "stiffness",
    "springref",
    "armature",
    "damping",
    "frictionloss",
)
_LIMITS = (
    "range",
    "limited",
    "actuatorfrcrange",
    "actuatorfrclimited",
    "actuatorgravcomp",
    "margin",
    "solreflimit",
    "solimplimit",
)
_JOINT = (
    "type",
    "group",
    "pos",
    "axis",
    "ref",
    "user",
    "solreffriction",
    "solimpfriction",
    *_FORCES,
    *_LIMITS,
)

_COMPILER = (
    *(
        "alignfree",
        "angle",
        "assetdir",
        "autolimits",
        "balanceinertia",
        "boundinertia",
        "boundmass",
        "conflict",
        "coordinate",
    ),
    *(
        "discardvisual",
        "eulerseq",
        "fitaabb",
        "fusestatic",
        "inertiafromgeom",
        "inertiagrouprange",
        "meshdir",
        "passthrough",
    ),
    *(
        "savecanonical",
        "savecompiled",
        "saveinertial",
        "settotalmass",
        "strippath",
        "texturedir",
        "usethread",
    ),
)

KNOWN = {
    "compiler": _COMPILER,
    "worldbody": (),
    "body": (*_FRAME, "mocap", "gravcomp", "user", "sleep", "fuse", "simple"),
    "frame": _FRAME,
    "replicate": ("count", "sep", "offset", "euler", "childclass"),
    "key": ("name", "time", "qpos", "qvel", "act", "mpos", "mquat", "ctrl"),
    "joint": ("name", "class", *_JOINT),
    "freejoint": ("name", "group", "align"),
    "site": (
        "name",
        "class",
        "type",
        "group",
        "pos",
        *ORIENTATION,
        "material",
        "mesh",
        "size",
        "fromto",
        "rgba",
        "user",
    ),
    "connect": (*_SOFT, "body1", "body2", "anchor", "site1", "site2"),
    "weld": (*_SOFT, "body1", "body2", "relpose", "anchor", "torquescale", "site1", "site2"),
    "equality joint": (*_SOFT, "joint1", "joint2", "polycoef"),
    "equality tendon": (*_SOFT, "tendon1", "tendon2", "polycoef"),
    "default equality": _SOFT,
    "inertial": ("pos", "mass", "diaginertia", "fullinertia", *ORIENTATION),
    "spatial site": ("site",),
    "spatial geom": ("geom", "sidesite"),
    "pulley": ("divisor",),
    "fixed joint": ("joint", "coef"),
}
_TENDON = ("name", "class", "stiffness", "damping", "springlength")
_OPEN = {
    "geom": (
        *("name", "class", "type", "size", "fromto", "pos", *ORIENTATION),
        *("mass", "density", "group", "shellinertia", "mesh"),
    ),
    "option": ("gravity",),
    "flag": ("gravity", "equality", "spring", "damper", "passive"),
    **dict.fromkeys(("spatial", "fixed", "default tendon"), _TENDON),
}
"""Attributes that are read of elements with many others, and more in other releases of MuJoCo."""
_ALL = KNOWN | _OPEN

_READ = ("compiler", "option", "default", "worldbody", "tendon", "equality")
_NOT_READ = (
    *("size", "statistic", "visual", "extension", "asset", "deformable"),
    *("contact", "actuator", "sensor", "custom", "keyframe"),
)
ROOT = (*_READ, *_NOT_READ)
"""What <mujoco> can hold: sections that are read, and those that are not."""

IN_BODY = (
    "body",
    "frame",
    "joint",
    "freejoint",
    "site",
    "inertial",
    "geom",
    "camera",
    "light",
    "plugin",
)
"""What a body can hold, besides elements that make bodies."""

MAKE_BODIES = {
    "composite": "it makes bodies",
    "flexcomp": "it makes bodies",
    "attach": "it takes bodies from another model",
}
"""Elements that stand for others and are not read; MuJoCo itself can write the model out."""

EXPANDED = ("include", "replicate")
"""Elements that stand for others and are read; see `expand`."""

WRITE_OUT = (
    'let MuJoCo write the model out and give that file: python -c "import mujoco;'
    " mujoco.mj_saveLastXML('flat.xml', mujoco.MjModel.from_xml_path('model.xml'))\""
)

DYNAMIC = {
    "range": "ranges",
    "armature": "armature",
    "frictionloss": "friction",
}
"""Attributes of joints that move nothing where motion is given; they are counted for the list of
what is left out.
"""


def require_known_attributes(root: Element) -> None:
    """Refuse attributes unknown to MJCF, for a mistyped one would silently be its default.

    Raises:
        CaseError: there is one.
    """
    for section in root.only(*_READ, "keyframe"):
        if section.tag != "compiler":  # read before
            _require_known(section, root.tag)


def _require_known(element: Element, around: str) -> None:
    inner = f"{around} {element.tag}"
    key = inner if inner in _ALL else element.tag
    if key in _ALL:
        element.require_known(_ALL[key], closed=key in KNOWN)
    if element.tag not in MAKE_BODIES:
        for child in element.children:
            _require_known(child, element.tag)
