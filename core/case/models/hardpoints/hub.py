"""The wheel of suspension-explorer's geometry files: its hub face, wheel offset and tire."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ....mechanism.mechanism import Vector
from .forms import is_number
from .table import Hardpoint
from .templates.base import normal


def wheel_points(
    points: Mapping[str, Hardpoint],
    values: Mapping[tuple[str, ...], object],
    *,
    millimetres: bool,
) -> dict[str, Hardpoint]:
    """Return wheel centre, axis and contact of suspension-explorer's hub face, wheel offset and
    tire.

    The centre is inboard of `axle_outboard` by the offset (github.com/suspension-explorer/
    suspension-explorer-core, derived points); the rim's diameter is in inches, its other lengths
    in mm.
    """
    at = {normal(name): point.position for name, point in points.items()}
    given = {tuple(map(normal, keys[-2:])): value for keys, value in values.items()}
    offset = given.get(("wheel", "offset"))
    if "wheel_center" in at or not {"axle_inboard", "axle_outboard"} <= at.keys():
        return {}
    if not is_number(offset):
        return {}
    inner, outer = at["axle_inboard"], at["axle_outboard"]
    length = math.dist(inner, outer)
    if length == 0.0:
        return {}
    axis = [(b - a) / length for a, b in zip(inner, outer, strict=True)]
    center = _moved(outer, axis, -float(str(offset)))
    where = f"axle_outboard, wheel offset {offset}"
    found = {
        "wheel_center": Hardpoint(center, where),
        "wheel_axis": Hardpoint(_moved(center, axis, length), where),
    }
    tire = [given.get(("tire", key)) for key in ("rim_diameter", "aspect_ratio", "section_width")]
    if millimetres and all(map(is_number, tire)):
        rim, ratio, width = (float(str(each)) for each in tire)
        down = [axis[2] * axis[0], axis[2] * axis[1], axis[2] * axis[2] - 1.0]
        size = math.hypot(*down)
        if size > 0.0:
            radius = 0.5 * rim * 25.4 + ratio * width
            found["wheel_contact"] = Hardpoint(
                _moved(center, [each / size for each in down], radius), f"{where}, tire"
            )
    return found


def _moved(place: Vector, along: Sequence[float], far: float) -> Vector:
    x, y, z = (a + far * b for a, b in zip(place, along, strict=True))
    return x, y, z
