"""The options --summary and --figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ...cli.forms import Form
from ...errors import KincheckError
from ...options import destination, options

if TYPE_CHECKING:
    from ...case.io.atomic_files import Content
    from ...cli.forms import Shown

T = TypeVar("T")


@options
class Papers(Form):
    """A summary of two pages, and the figures of a page."""

    summary: Path | None = destination(
        "write a page that prints on two A4 pages: verdict, four figures, tolerances, what is not"
        " judged; and its PDF beside it if a Chromium is installed",
        Path,
        "FILE.html",
    )
    figures: Path | None = destination(
        "write every figure of the page there as SVG, and as PNG if a Chromium is installed",
        Path,
        "DIR",
    )

    @staticmethod
    def files_of(options: Any) -> dict[str, Path]:
        """Return the summary, and a file in the folder of the figures."""
        page: Path | None = options.summary
        folder: Path | None = options.figures
        if page is not None and page.suffix.lower() == ".pdf":
            raise KincheckError(
                f"--summary {page}: the page is HTML, and its PDF is made beside it. Give"
                f" --summary {page.with_suffix('.html')}."
            )
        found = {} if page is None else {"summary": page}
        if folder is not None:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise KincheckError(
                    f"--figures {folder}: the folder cannot be made ({error.strerror}). Give"
                    " another one."
                ) from None
            found["figures"] = folder / "figures.svg"
        return found

    @staticmethod
    def contents(options: Any, shown: Shown, verdict: str) -> list[tuple[Path, Content]]:
        """Return the page with its PDF, and the figures."""
        page: Path | None = options.summary
        folder: Path | None = options.figures
        from ..reports.svg import svg
        from . import browser
        from .paper import paper_of
        from .summary import summary

        found, paper = dict[Path, bytes](), paper_of(shown)
        if page is not None:
            text = summary(paper, verdict)
            found[page] = text.encode()
            if (made := _made(lambda: browser.pdf(text), f"no PDF of {page}")) is not None:
                found[page.with_suffix(".pdf")] = made
        if folder is not None:
            pictures = {name: svg(each.figure) for name, each in paper.diagrams.items()}
            found |= {folder / f"{name}.svg": each.encode() for name, each in pictures.items()}
            drawn = _made(lambda: browser.png(pictures), f"no PNG in {folder}") or {}
            found |= {folder / f"{name}.png": each for name, each in drawn.items()}
        return [*found.items()]


def _made(make: Callable[[], T], lacking: str) -> T | None:
    """Return what a browser makes, or None, and say in one line what is lacking."""
    from ...report.progress import complain

    try:
        return make()
    except OSError as error:
        complain([f"{lacking}: {error}."])
        return None
