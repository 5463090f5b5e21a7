"""MuJoCo's own conversion of URDF into MJCF."""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

from ...core.errors import KincheckError


def convert(file: Path) -> str:
    """Return the MJCF saved by MuJoCo of a model of URDF or MJCF.

    Raises:
        KincheckError: MuJoCo does not load it.
    """
    mujoco: Any = import_module("mujoco")
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        raise KincheckError(f"{file}: MuJoCo does not load it: {error}") from None
    with tempfile.TemporaryDirectory() as folder:
        mujoco.mj_saveLastXML(str(out := Path(folder) / "saved.xml"), model)
        return out.read_text(encoding="utf-8")
