"""Pages of extensions, each in the folder docs of its own.

The path of a page below that folder is its address in the site, as for the kernel's in docs/pages.
Links name files, as they lie in the repository; in the site they have addresses.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
KERNEL = Path("docs/pages")
PLACES = Path("core/extensions"), Path("adapters")
"""Folders of extensions."""
LINK = re.compile(r"\[(?P<text>[^\[\]]*)\]\((?P<path>[^)\s:#]+)(?P<anchor>#[^)\s]*)?\)")
NAMED = re.compile(
    r"^::: (?P<name>kincheck\.core\.extensions[\w.]+)\n"
    r"|\[(?P<text>[^\[\]]*)\]\(#(?P<link>kincheck\.core\.extensions[\w.]+)\)",
    re.MULTILINE,
)
"""The description of a name of an extension, and a link to it."""


def folders() -> list[Path]:
    """Return the folders with pages of the extensions that are there, from the root."""
    return sorted(
        found.relative_to(ROOT) for place in PLACES for found in (ROOT / place).glob("*/docs")
    )


def files() -> Iterator[tuple[Path, str]]:
    """Yield folder and address of each page of an extension, and of each figure."""
    for folder in folders():
        for path in sorted((ROOT / folder).rglob("*.*")):
            yield folder, path.relative_to(ROOT / folder).as_posix()


def add_to(nav: list[dict[str, str | list[dict[str, str] | str]]]) -> None:
    """Add each extension's page to the section that has the kernel's pages of its folder."""
    added = sorted(address for _, address in files() if address.endswith(".md"))
    for section in nav:
        for pages in section.values():
            if isinstance(pages, list):
                own = {Path(address).parent for page in pages for address in dict(page).values()}
                pages += [address for address in added if Path(address).parent in own]


def in_site(markdown: str, folder: Path, address: str) -> str:
    """Return a page with the links that it has in the site.

    A link to a page or to a name of an extension that is not there becomes its text, and the
    name is not described.

    Args:
        folder: folder of the page's addresses, from the root.
        address: address of the page.
    """
    at = Path(address).parent

    def link(found: re.Match[str]) -> str:
        path = Path(os.path.normpath(folder / at / found["path"]))
        for home in (KERNEL, *folders()):
            if path.is_relative_to(home):
                target = Path(os.path.relpath(path.relative_to(home), at)).as_posix()
                return f"[{found['text']}]({target}{found['anchor'] or ''})"
        return found["text"] if is_absent(path) else found[0]

    def named(found: re.Match[str]) -> str:
        path = Path(*(found["name"] or found["link"]).split(".")[1:])
        return (found["text"] or "") if is_absent(path) else found[0]

    return LINK.sub(link, NAMED.sub(named, markdown))


def is_absent(path: Path) -> bool:
    """Return whether a file, from the root, is of an extension that is not there."""
    return any(
        path.is_relative_to(place)
        and not (ROOT / place / path.relative_to(place).parts[0] / "__init__.py").exists()
        for place in PLACES
    )
