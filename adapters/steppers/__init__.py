"""Steppers of free motion: parts of scripts without kincheck, and the scripts made of them."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    steppers={
        name: f"scripts:{name.replace('-', '_')}"
        for name in (
            "mujoco",
            "pinocchio",
            "exudyn",
            "drake",
            "dart",
            "simbody",
            "pybullet",
            "mjx",
            "mujoco-warp",
            "newton",
            "genesis",
        )
    },
)
