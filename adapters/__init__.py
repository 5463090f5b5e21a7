"""Adapters: one package or file per engine and format, which translates the neutral mechanism. An
adapter is imported at its first use.
"""

from collections.abc import Mapping
from typing import Any

from ..core.doors import Extension, Offer, offers

_OWN = Extension(__name__)
ENGINES: Mapping[str, Offer] = {
    "native": Offer(_OWN, "native:Native"),
    "mujoco": Offer(_OWN, "mujoco.mujoco:MuJoCo"),
    "pinocchio": Offer(_OWN, "pinocchio.pinocchio:Pinocchio"),
    "exudyn": Offer(_OWN, "exudyn.exudyn:Exudyn"),
    **offers("engines"),
}
"""Engines in projection mode, by their names on the command line; those of extensions last."""

SIMULATIONS: Mapping[str, tuple[Offer, Mapping[str, Any]]] = {
    "mujoco": (_STEPPING := Offer(_OWN, "mujoco.steps:Stepping"), {"kind": "stiff", "effort": 4}),
    "mujoco-default": (_STEPPING, {"kind": "default", "effort": 1}),
    "mujoco-projecting": (_STEPPING, {"kind": "projecting", "effort": 5}),
    "pinocchio": (Offer(_OWN, "pinocchio.pinocchio:Dynamics"), {}),
    "exudyn": (
        _SOLVER := Offer(_OWN, "exudyn.solvers:Solver"),
        {"kind": "trapezoidal", "steps": 4},
    ),
    "exudyn-alpha": (_SOLVER, {"kind": "generalized alpha", "steps": 4}),
    "exudyn-static": (
        Offer(_OWN, "exudyn.statics:StaticSolver"),
        {"kind": "static", "modified": False},
    ),
    "exudyn-static-modified": (_SOLVER, {"kind": "static"}),
    **{name: (each, {}) for name, each in offers("simulations").items()},
}
"""Engines in simulate mode, by their names on the command line, with fields of their classes. A
simulator's bare name is its recommended solver.

A record belongs to a case, an engine and a mode, so one name in two modes denotes two products. A
further variant of a simulator gets another name, not another mode, because each mode is a ranking.
"""


def engine(name: str, mode: str = "projection") -> Any:
    """Return the engine of a name and mode; its simulator is not imported yet."""
    if mode == "projection":
        return ENGINES[name].load()()
    offer, fields = SIMULATIONS[name]
    return offer.load()(name=name, **fields) if fields else offer.load()()
