"""Links between pages of the kernel and of extensions, in the repository and in the site."""

import os
from pathlib import Path

import pytest

from ..support.sources import ROOT, files
from .builder import module

COLLECTED = module("collected")
GENERATED = (ROOT / "docs/generated.py").read_text("utf-8")
PAGES = [
    Path("README.md"),
    Path("CONTRIBUTING.md"),
    *files("docs", "core", "adapters", ending="md"),
]


def leads_nowhere(path):
    """Return whether a file is neither there nor made, although its extension is there."""
    made = path.is_relative_to("docs/pages") and f'"{path.relative_to("docs/pages")}"' in GENERATED
    return not ((ROOT / path).exists() or made or COLLECTED.is_absent(path))


def test_links_lead_to_pages():
    wrong = [
        f"{page}: {found['path']}"
        for page in PAGES
        for found in COLLECTED.LINK.finditer((ROOT / page).read_text("utf-8"))
        if found["path"].endswith(".md")
        and leads_nowhere(Path(os.path.normpath(page.parent / found["path"])))
    ]
    assert wrong == []


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A repository with an extension that has a page; one named `gone` is deleted."""
    page = tmp_path / "core/extensions/trace/docs/how-to/trace.md"
    page.parent.mkdir(parents=True)
    page.write_text("# Trace\n")
    (tmp_path / "core/extensions/trace/__init__.py").touch()
    (tmp_path / "core/extensions/gone").mkdir()
    monkeypatch.setattr(COLLECTED, "ROOT", tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("written", "in_site"),
    [
        ("[a](../../../core/extensions/trace/docs/how-to/trace.md#x)", "[a](trace.md#x)"),
        ("[a](../../../core/extensions/gone/docs/how-to/gone.md#x)", "a"),
        ("[a](../../../core/extensions/trace/docs/gone.md)", "[a](../gone.md)"),  # MkDocs warns
        ("::: kincheck.core.extensions.gone.x.Y\nend", "end"),
        ("[a](#kincheck.core.extensions.gone.x.Y)", "a"),
        ("::: kincheck.core.extensions.trace.x.Y\n", None),
        ("[a](forces.md), [b](https://example.org/x.md)", None),
    ],
)
def test_link_of_kernel(repository, written, in_site):
    assert COLLECTED.in_site(written, COLLECTED.KERNEL, "how-to/a.md") == (in_site or written)


def test_link_from_extension_to_kernel(repository):
    folder = Path("core/extensions/trace/docs")
    written = "[a](../../../../../docs/pages/theory/forces.md#x) and ![b](b.svg)"
    assert COLLECTED.in_site(written, folder, "how-to/trace.md") == (
        "[a](../theory/forces.md#x) and ![b](b.svg)"
    )


def test_navigation_has_pages_of_extensions(repository):
    nav = [{"Home": "index.md"}, {"How to": [{"Forces": "how-to/forces.md"}]}, {"Theory": []}]
    COLLECTED.add_to(nav)
    assert nav[1:] == [
        {"How to": [{"Forces": "how-to/forces.md"}, "how-to/trace.md"]},
        {"Theory": []},
    ]
