"""Steppers of free motion: parts of scripts without kincheck, and the scripts made of them."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    steppers={
        "mujoco": "scripts:mujoco",
        "pinocchio": "scripts:pinocchio",
        "exudyn": "scripts:exudyn",
        "drake": "scripts:drake",
        "dart": "scripts:dart",
        "simbody": "scripts:simbody",
        "pybullet": "scripts:pybullet",
        "mjx": "scripts:mjx",
        "mujoco-warp": "scripts:mujoco_warp",
        "newton": "scripts:newton",
        "genesis": "scripts:genesis",
    },
)
