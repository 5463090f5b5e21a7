"""DART: projection mode with the kinematics and Jacobians of its Skeleton, and simulate mode."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["simulate"],
    engines={"dart": "dart:Dart"},
    simulations={"dart": "dart:Steps"},
)
