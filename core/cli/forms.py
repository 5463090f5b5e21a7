"""Further forms of a command's page, such as a short paper: options added by extensions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import make_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..doors import offers
from ..options import asked, option_fields, options

if TYPE_CHECKING:
    from ..case.io.atomic_files import Content
    from ..harness.record import Results
    from ..report.sections import Report

    Shown: TypeAlias = Results | Report
    """Content of a page: the results of a run, or tables and diagrams."""


@options
class Form:
    """Options of an extension for further files. The functions get all options of the command, and
    are called if one of their own is given.
    """

    @staticmethod
    def files_of(options: Any) -> dict[str, Path]:
        """Return the requested files by their options, before the work starts.

        Raises:
            KincheckError: the folder of a file cannot be made.
        """
        return {}

    @staticmethod
    def contents(options: Any, shown: Shown, verdict: str) -> list[tuple[Path, Content]]:
        """Return the requested files.

        Args:
            verdict: a sentence of the command, before the verdict of the page.
        """
        return []


@cache
def forms() -> Sequence[type[Form]]:
    """Return the options of extensions."""
    return [each.load() for each in offers("forms").values()]


def with_forms() -> Any:
    """Return a class with all these options, behind the others of a command."""
    last = {"LAST": tuple(each.name for form in forms() for each, *_ in option_fields(form))}
    return make_dataclass("Formed", (), bases=tuple(forms()), namespace=last, frozen=True)


def files_of_forms(options: Any) -> dict[str, Path]:
    """Return the files requested by these options."""
    found = asked(forms(), options)
    return {name: file for form in found for name, file in form.files_of(options).items()}


def contents_of_forms(options: Any, shown: Shown, verdict: str = "") -> list[tuple[Path, Content]]:
    """Return the contents of these files; see `Form.contents`."""
    found = asked(forms(), options)
    return [each for form in found for each in form.contents(options, shown, verdict)]
