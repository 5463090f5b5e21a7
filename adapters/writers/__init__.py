"""Writers of mechanisms in the formats of simulators, one module per format."""

from ...core.doors import Extension

EXTENSION = Extension(
    __name__,
    needs=["exports", "trees"],
    writers={
        "mjcf": "mjcf:write",
        "exudyn": "exudyn:write",
        "urdf": "urdf:write",
        "sdf": "sdf:write",
        "osim": "osim:write",
    },
    formats={
        "mjcf": "MuJoCo",
        "exudyn": "a Python script",
        "urdf": "Pinocchio",
        "sdf": "Drake",
        "osim": "Simbody, by OpenSim",
    },
)
