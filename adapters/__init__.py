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

_ORDER = {name: k for k, name in enumerate(ENGINES)}
SIMULATIONS: Mapping[str, Offer] = dict(
    sorted(
        offers("simulations").items(),
        key=lambda each: _ORDER.get(each[0].partition("-")[0], len(_ORDER)),
    )
)
"""Engines in simulate mode, by their names on the command line, in the order of their simulators. A
simulator's bare name is its recommended solver; a variant's begins with it and a hyphen.

A record belongs to a case, an engine and a mode, so one name in two modes denotes two products. A
further variant of a simulator gets another name, not another mode, because each mode is a ranking.
"""


def engine(name: str, mode: str = "projection") -> Any:
    """Return the engine of a name and mode; its simulator is not imported yet."""
    return (ENGINES if mode == "projection" else SIMULATIONS)[name].load()()
