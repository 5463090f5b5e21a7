"""Floors of engines: the time of a simulator's compiled code alone."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    floors={
        "mujoco": "calls:mujoco",
        "exudyn": "calls:exudyn",
        "pinocchio": "calls:tree",
        "drake": "calls:tree",
        "dart": "calls:tree",
    },
)
