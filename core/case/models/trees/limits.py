"""Limits of joints as files state them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...io.document import decimal, shown
from .element import Element
from .tree import Move, Tree

INFINITE = 1e15
"""Simulators write numbers beyond this for no limit; SDF has 1e16."""


@dataclass(frozen=True)
class Limit:
    """Bounds of a joint with one coordinate; infinite without one.

    Attributes:
        lower, upper: of its coordinate [rad or m].
        effort: of its motor, by size [N m or N].
        velocity: by size [rad/s or m/s].
    """

    lower: float = -math.inf
    upper: float = math.inf
    effort: float = math.inf
    velocity: float = math.inf

    @property
    def is_bounded(self) -> bool:
        """Whether its coordinate has two bounds."""
        return math.isfinite(self.upper - self.lower)


NO_LIMIT = Limit()


def limit_of(tree: Tree, move: Move) -> Limit:
    """Return the limits of a move.

    Raises:
        CaseError: a limit is no number.
    """
    element = move.element
    if not move.is_axial:
        return NO_LIMIT
    if tree.dialect == "mujoco":
        return _of_mjcf(tree, move)
    if tree.dialect != "sdf" and (found := element.child("limit")) is not None:
        said = found.attributes
        zero = element.attributes.get("type") != "continuous"
        bounds = [
            _number(found, said.get(each, "0" if zero else "")) for each in ("lower", "upper")
        ]
        lower, upper = bounds if zero else (None, None)
        effort, velocity = (_number(found, said.get(each)) for each in ("effort", "velocity"))
        return _limit(lower, upper, effort, velocity)
    axis = element.child("axis2" if move.name.endswith(".2") else "axis")
    found = axis and axis.child("limit")
    if not found:
        return NO_LIMIT
    said = {each.tag: each.text for each in found.children}
    effort, velocity = (_number(found, said.get(each)) for each in ("effort", "velocity"))
    lower, upper = (_number(found, said.get(each)) for each in ("lower", "upper"))
    return _limit(lower, upper, *(x if x is None or x >= 0.0 else None for x in (effort, velocity)))


def motor_ranges(tree: Tree) -> tuple[str, ...]:
    """Return the ranges of all joints with a motor, as --drive takes them; none without limits."""
    limits = {
        name: limit_of(tree, move) for name, move in tree.joints.items() if name in tree.actuated
    }
    if not all(each.is_bounded and each.lower < each.upper for each in limits.values()):
        return ()
    return tuple(f"{name}:{each.lower!r}:{each.upper!r}" for name, each in limits.items())


def _limit(lower: float | None, upper: float | None, *sizes: float | None) -> Limit:
    effort, velocity = (math.inf if x is None else x for x in sizes)
    return Limit(
        -math.inf if lower is None else lower,
        math.inf if upper is None else upper,
        effort,
        velocity,
    )


def _of_mjcf(tree: Tree, move: Move) -> Limit:
    element, bounds = move.element, list[float]()
    for attribute, flag in (("range", "limited"), ("actuatorfrcrange", "actuatorfrclimited")):
        said = element.choice(flag, ("true", "false", "auto"), "auto")
        on = said == "true" or (said == "auto" and tree.limited)
        texts = element.attributes[attribute].split() if attribute in element.attributes else []
        numbers = [_number(element, each) for each in texts] if on else []
        bounds += [math.inf if x is None else x for x in numbers] or [-math.inf, math.inf]
    if len(bounds) != 4:
        raise element.fault("range: expected two numbers; correct the attribute")
    lower, upper, *effort = bounds
    if move.kind == "hinge" and tree.degrees:
        lower, upper = math.radians(lower), math.radians(upper)
    return Limit(lower, upper, max(map(abs, effort)))


def _number(element: Element, text: str | None) -> float | None:
    """Return the number of a text; None without one, or if it is too large for a limit."""
    if not text:
        return None
    try:
        number = decimal(text)
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise element.fault(f"found {shown(text)}, expected a number; correct the limit")
    return number if abs(number) < INFINITE else None
