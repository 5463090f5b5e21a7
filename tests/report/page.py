"""Read a page of the report as the tests need it."""

from __future__ import annotations

import base64
import json
import zlib
from html.parser import HTMLParser

import pytest
from kincheck.core.report.report import write_report

HEADINGS = ("h2", "h3", "summary")


class Page(HTMLParser):
    """What the tests read off a page: its text outside scripts and styles, its scripts, its tags,
    and the rows of its tables, each by the heading above.
    """

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: dict[str, str] = {}
        self.names: list[str] = []
        self.text = ""
        self.tables: list[tuple[str, list[list[str]]]] = []
        self.heading = ""
        self.place = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.text += " "
        if tag == "script":
            self.names.append(dict(attrs).get("id") or f"script {len(self.names)}")
            self.scripts[self.names[-1]] = ""
        elif tag in HEADINGS:
            self.heading, self.place = "", "heading"
        elif tag == "table":
            self.tables.append((" ".join(self.heading.split()), []))
        elif tag == "tr":
            self.tables[-1][1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][1][-1].append("")
            self.place = "cell"

    def handle_endtag(self, tag):
        if tag in (*HEADINGS, "td", "th"):
            self.place = ""

    def handle_data(self, data):
        if self.cdata_elem == "script":
            self.scripts[self.names[-1]] += data
        elif self.cdata_elem is None:
            self.text += data
            if self.place == "heading":
                self.heading += data
            elif self.place == "cell":
                self.tables[-1][1][-1][-1] += data

    def rows(self, heading):
        """Return the rows of the tables below a heading, without their heads."""
        found = [rows[1:] for above, rows in self.tables if above.startswith(heading)]
        assert found, f"no table below {heading}"
        return [row for rows in found for row in rows]

    @property
    def words(self):
        return " ".join(self.text.split())

    @property
    def data(self):
        text = zlib.decompress(base64.b64decode(self.scripts["report-data"], validate=True))
        return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def report(run, folder):
    path = folder / "report.html"
    write_report(run, path)
    assert path.stat().st_size < 8_000_000
    return Page(path.read_text("utf-8"))


def traces(page, figure, name, mode):
    return [
        trace
        for trace in page.data["figures"][figure]["data"]
        if trace["meta"] == name and trace["mode"] == mode
    ]
