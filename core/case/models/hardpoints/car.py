"""Data of the vehicle of hardpoints, from options: for anti-values and Ackermann."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...io.document import decimal, fault, shown, unknown_name
from ...io.reader_options import Supplied
from ...suspension import Axle


@dataclass(frozen=True)
class Car:
    """Data of the vehicle; None if unknown.

    Attributes:
        position: the axle of the hardpoints.
        wheelbase, cg_height: wheelbase, and height of the centre of gravity above the road [m].
        brake_share, drive_share: shares of the braking and driving force at this axle [-].
    """

    position: Axle | None = None
    wheelbase: float | None = None
    cg_height: float | None = None
    brake_share: float | None = None
    drive_share: float | None = None

    @property
    def anti_outputs(self) -> Iterator[str]:
        """Yield the types of the outputs defined by these data, for a wheel of known radius."""
        if self.position is None:
            return
        yield "wheelbase_change"
        if self.wheelbase is None or self.cg_height is None:
            return
        if self.brake_share is not None:
            yield "anti_dive" if self.position is Axle.FRONT else "anti_lift"
        if self.drive_share is not None and self.position is Axle.REAR:
            yield "anti_squat"


def read_car(file: Path, supplied: Supplied) -> Car:
    """Return the vehicle stated by options.

    Raises:
        CaseError: an option is not a length, a share, or an axle.
    """
    position = supplied.position
    if position is not None and position not in list(Axle):
        raise unknown_name(file, "--position", position, [*Axle], "an axle")
    return Car(
        None if position is None else Axle(position),
        read_length(file, "wheelbase", supplied.wheelbase),
        read_length(file, "cg-height", supplied.cg_height),
        _share(file, "brake-share", supplied.brake_share),
        _share(file, "drive-share", supplied.drive_share),
    )


def read_length(file: Path, option: str, text: str | None) -> float | None:
    """Return the length stated by an option [m].

    Raises:
        CaseError: the text is not a length, or the length is not positive.
    """
    if text is None:
        return None
    try:
        found = decimal(text)
    except ValueError:
        raise fault(
            file,
            f"--{option}",
            f"found {shown(text)}, expected metres; say --{option} 0.3",
        ) from None
    if not 0.0 < found < float("inf"):
        raise fault(file, f"--{option}", f"found {found:.6g} m, expected a length; correct it")
    return found


def _share(file: Path, option: str, text: str | None) -> float | None:
    if text is None:
        return None
    try:
        found = decimal(text)
    except ValueError:
        found = float("nan")
    if not 0.0 <= found <= 1.0:
        raise fault(
            file,
            f"--{option}",
            f"found {shown(text)}, expected the part of a force, 0 to 1; say --{option} 0.6",
        )
    return found
