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

_TENDON = (
    *("actuatorfrclimited", "actuatorfrcrange", "armature", "damping", "frictionloss", "group"),
    *("limited", "margin", "range", "solimpfriction", "solimplimit", "solreffriction"),
    *("solreflimit", "springlength", "springyield", "stiffness", "user", "class", "name"),
)
_SPATIAL = (*_TENDON, "material", "rgba", "width")
_GEOM = (
    *("adhesion", "castshadow", "class", "conaffinity", "condim", "contype", "density"),
    *("fitscale", "fluidcoef", "fluidshape", "friction", "fromto", "gap", "group", "hfield"),
    *("margin", "mass", "material", "mesh", "name", "pos", "priority", "rgba", "shellinertia"),
    *("size", "solimp", "solmix", "solref", "surfacevel", "type", "user", *ORIENTATION),
)
_OPTION = (
    *("actuatorgroupdisable", "ccd_iterations", "ccd_tolerance", "cone", "density", "gravity"),
    *("impratio", "integrator", "iterations", "jacobian", "ls_iterations", "ls_tolerance"),
    *("magnetic", "noslip_iterations", "noslip_tolerance", "o_friction", "o_margin"),
    *("o_solimp", "o_solref", "sdf_initpoints", "sdf_iterations", "sleep_tolerance", "solver"),
    *("timestep", "tolerance", "viscosity", "wind"),
)
_FLAG = (
    *("actuation", "autoreset", "clampctrl", "constraint", "contact", "damper", "diagexact"),
    *("energy", "equality", "eulerdamp", "filterparent", "frictionloss", "fwdinv", "gravity"),
    *("invdiscrete", "ipc", "island", "limit", "midphase", "multiccd", "nativeccd", "override"),
    *("refsafe", "sensor", "sleep", "speculative", "spring", "warmstart", "passive"),
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
    "default tendon": _SPATIAL,
    "inertial": ("pos", "mass", "diaginertia", "fullinertia", *ORIENTATION),
    "geom": _GEOM,
    "option": _OPTION,
    "flag": _FLAG,
    "spatial": _SPATIAL,
    "spatial site": ("site",),
    "spatial geom": ("geom", "sidesite"),
    "pulley": ("divisor",),
    "fixed": _TENDON,
    "fixed joint": ("joint", "coef"),
}
# Other releases of MuJoCo have further ones, of no matter for motion or masses.
_OPEN = ("geom", "option", "flag", "spatial", "fixed", "default tendon")

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
    key = inner if inner in KNOWN else element.tag
    if key in KNOWN:
        element.require_known(KNOWN[key], closed=key not in _OPEN)
    if element.tag not in MAKE_BODIES:
        for child in element.children:
            _require_known(child, element.tag)
