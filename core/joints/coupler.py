"""What couples two joints: a relation between their coordinates. A new one is one file, as a new
joint is.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Self

from ..errors import MechanismError, Phrase
from ..input_checks import held, plain, require_finite
from .base import Kind, register

NUMBERS = (float, int, "float", "int")
"""What fields that are numbers are annotated with."""


@dataclass(frozen=True)
class Coupler(ABC):
    """A relation between one coordinate each of axial joints, most often of two, which are zero at
    design.

    Attributes:
        count: number of its joints; None for two or more.
        joints: names of the joints.
        freedoms: which coordinate of each: "rotation" or "translation".

    Raises:
        MechanismError: one joint twice, or a weight that is zero or not finite.
    """

    type: ClassVar[str]
    count: ClassVar[int | None] = 2
    freedoms: ClassVar[tuple[str, ...]]
    registry: ClassVar[dict[str, type[Coupler]]] = {}

    name: str
    joints: tuple[str, ...]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "type" in cls.__dict__:
            register(Coupler.registry, cls)

    def __post_init__(self) -> None:
        what = "two names" if self.count else "two names or more"
        joints = held(f"{self}: joints", self.joints, self.count, what)
        object.__setattr__(self, "joints", tuple(joints))
        if len(joints) < 2:
            raise MechanismError(f"{self}: joints: found {len(joints)}, expected {what}")
        if again := next((each for each in joints if joints.count(each) > 1), None):
            raise MechanismError(f"{self}: couples {again!r} with itself; give different joints")
        for each in fields(self):
            if each.type in NUMBERS:
                object.__setattr__(self, each.name, plain(getattr(self, each.name)))
                require_finite(
                    f"{self}: {each.name}",
                    (getattr(self, each.name),),
                    "a finite number other than zero",
                )
        self.check()

    def check(self) -> None:
        """Refuse weights that lock or lose a joint.

        Raises:
            MechanismError: a weight is zero or not finite.
        """
        if not all(weight and math.isfinite(weight) for weight in self.weights):
            given = {
                each.name: getattr(self, each.name)
                for each in fields(self)
                if each.name not in ("name", "joints")
            }
            raise MechanismError(
                f"{self}: {', '.join(f'{name} = {value}' for name, value in given.items())} would"
                " lock or lose a joint; give a finite number other than zero"
            )

    def __str__(self) -> str:
        return f"joint {self.name!r} ({self.type})"

    @property
    def notes(self) -> Sequence[str | Phrase]:
        """Remarks on its numbers for a reader of results: intended, or a mistake."""
        return ()

    def scaled(self, factor: float) -> Self:
        """The same coupler with all lengths multiplied by the factor."""
        lengths = [each.name for each in fields(self) if each.metadata.get("kind") is Kind.LENGTH]
        return replace(self, **{name: factor * getattr(self, name) for name in lengths})

    @property
    def terms(self) -> tuple[tuple[str, str, float], ...]:
        """Joint, freedom and weight of the coordinates."""
        return tuple(zip(self.joints, self.freedoms, self.weights, strict=True))

    @property
    def curve(self) -> tuple[float, ...]:
        """Coefficients of a polynomial in the second coordinate, the constant first, that is added
        to the weighted sum; empty for a linear relation.
        """
        return ()

    @property
    @abstractmethod
    def weights(self) -> tuple[float, ...]:
        """Weights of the coordinates [m, rad]; the sum, with that of `curve`, stays zero."""
