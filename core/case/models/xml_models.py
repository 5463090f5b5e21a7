"""Models in XML: MJCF, URDF or SDF, whatever the file is called."""

from __future__ import annotations

from pathlib import Path

from ..case import Case
from ..io.reader_options import Supplied
from .mjcf.elements import parse_xml
from .mjcf.read import Document, case_of, read_mjcf


def read_model(file: Path, text: str, supplied: Supplied) -> Case:
    """Return the case of a model.

    Raises:
        CaseError: not a model that can be read, or the options do not say how it moves.
    """
    root = parse_xml(file, text)
    match root.tag:
        case "robot":
            from .robots.urdf import read_urdf

            robot = read_urdf(file, root)
        case "sdf":
            from .robots.sdf import read_sdf

            robot = read_sdf(root)
        case _:
            return read_mjcf(file, root, supplied)
    from .robots.as_mjcf import as_mjcf

    name = root.attributes.get("name", file.stem)
    beside = f" with {', '.join(robot.beside)}" if robot.beside else ""
    described = f"{robot.format} {name!r} of {file.name}{beside}"
    zero, closed = "its zero pose", not robot.paired
    document = Document(described, as_mjcf(robot), root, robot.left_out, zero, closed)
    return case_of(file, document, supplied)
