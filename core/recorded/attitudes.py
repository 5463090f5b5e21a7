"""Attitudes as files give them: Euler angles of any sequence, or quaternions, of body to global or
the inverse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import mul

import numpy as np

from ..algebra import Quat, Vec3, X, Y, Z, quat
from ..trajectory import Array

SEQUENCES = tuple(
    "".join(each) for each in product("123", repeat=3) if each[0] != each[1] != each[2]
)
"""The twelve sequences of axes; 1 is x."""
ORDERS = ("wxyz", "xyzw")
_AXES: dict[str, Vec3] = {"1": X, "2": Y, "3": Z}


@dataclass(frozen=True)
class Reading:
    """The meaning of the numbers of an attitude.

    Attributes:
        order: of the axes of three angles, or of the parts of a quaternion.
        fixed: whether the angles are about fixed axes, and not about those of the body.
        inverted: whether they turn global axes into those of the body.
    """

    order: str
    fixed: bool = False
    inverted: bool = False

    @property
    def angles(self) -> bool:
        """Whether the numbers are angles."""
        return self.order in SEQUENCES

    def __str__(self) -> str:
        """Return its words in --map."""
        kind = "euler" if self.angles else "quaternion"
        words = [kind, self.order, *["fixed"] * self.fixed, *["inverted"] * self.inverted]
        return " ".join(words)

    def parameters(self, numbers: Sequence[Array]) -> Array:
        """Return Euler parameters of body -> global, shape (n, 4).

        Args:
            numbers: three angles [rad], or four parts of any length but zero, shape (n,) each.
        """
        if self.angles:
            turns = [
                Quat(np.cos(0.5 * angle), np.sin(0.5 * angle) * _AXES[axis])
                for axis, angle in zip(self.order, numbers, strict=True)
            ]
            q = reduce(mul, turns[::-1] if self.fixed else turns)
        else:
            w = self.order.index("w")
            q = quat((numbers[w], *(x for k, x in enumerate(numbers) if k != w)))
        q = q.conjugate() if self.inverted else q
        found = np.stack([q.e0, *q.e], axis=-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return found / np.linalg.norm(found, axis=1)[:, None]


def readings(count: int) -> list[Reading]:
    """Return all readings of three angles or of four parts of a quaternion."""
    flags = (False, True)
    if count == 4:
        return [Reading(order, inverted=inverted) for order in ORDERS for inverted in flags]
    return [Reading(*each) for each in product(SEQUENCES, flags, flags)]
