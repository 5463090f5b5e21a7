"""Models of links: MJCF, URDF and SDF."""

from ...doors import Extension

EXTENSION = Extension(
    "kincheck.core.case.models.trees",
    readers={name.lower(): f"reader:{name}" for name in ("MJCF", "URDF", "SDF")},
)
