"""Families of difficult situations."""

from . import arms, degenerate, forces, loops, planar, spatial
from .base import Family, Specimen

__all__ = ["FAMILIES", "Family", "Specimen"]

_FAMILIES = (
    arms.arms, planar.corners, degenerate.degenerate, loops.loops, loops.folds, forces.forces,
    spatial.hardpoints, planar.units, planar.offset, planar.ratios, planar.drift, planar.rates,
    planar.tolerances, planar.reach, planar.redundant, spatial.singular, loops.starts, planar.twins,
)  # fmt: skip
FAMILIES = {family.name: family for family in _FAMILIES}
"""All families by name."""
