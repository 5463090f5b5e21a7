"""Options of models: how they move, which their files do not say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

from ...case.io.readers import CaseOptions
from ...options import option, switch

MODELS = "models"
_option = partial(option, heading=MODELS)


@dataclass(frozen=True)
class DrivingOptions(CaseOptions):
    """Options of files that do not say how their mechanism is driven."""

    HEADINGS: ClassVar[Mapping[str, str]] = {
        MODELS: (
            "Models (MJCF, URDF, SDF, USD, OpenSim), which do not state drivers, and datasets of"
            " Adams (.adm)."
        ),
    }

    drive: tuple[str, ...] = _option(
        "a joint that moves, as qpos, in rad or m without a unit: knee:-30:30deg:61; several"
        " move together",
        metavar="JOINT:START:STOP[:SAMPLES]",
        several="repeated",
    )
    hold: tuple[str, ...] = _option(
        "joints or free bodies that do not move",
        metavar="NAME",
        several="together",
    )
    hold_rest: bool = switch(
        "hold as many joints as needed: free bodies, joints with an actuator, others",
        heading=MODELS,
    )
    without: tuple[str, ...] = _option(
        "elements of a model to leave out, by tag, name or TAG/NAME, or statements of a dataset"
        " of Adams, as BUSHING or BUSHING/3; a note beside every verdict says so",
        metavar="NAME",
        several="together",
    )


@dataclass(frozen=True)
class ModelOptions(DrivingOptions):
    """Options of models, which have a pose to start from too."""

    start: tuple[str, ...] = _option(
        "keyframe:NAME, or JOINT=VALUE, as qpos, in rad or m without a unit, instead of qpos0;"
        " the start is assembled to close, and a note says by how far joints moved",
        metavar="WHERE",
        several="together",
    )
