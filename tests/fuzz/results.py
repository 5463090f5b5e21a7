"""Results in JSON: read, and made into every kind of report."""

import io
from pathlib import Path
from unittest import mock
from xml.etree import ElementTree

from kincheck.core.harness.record import to_json
from kincheck.core.harness.results_file import read_results
from kincheck.core.report.junit import to_junit
from kincheck.core.report.page_model import Material
from kincheck.core.report.report import render
from kincheck.core.report.table import print_matrix, print_table, to_markdown

from .fuzzing import changing, read_or_refused, written
from .keeping import seeds_in_file
from .trees import changed_json

LONGEST = 16000
WORDS = """closed_form consensus_only native one pass fail error timeout crashed ground
half_track_change time wheel point_coordinate joint_angle rad m 1 rad/m dof_account
program signs""".split()


def one(data: bytes) -> None:
    """Read one input and report it; what is a script or a style of ours, and the same in all
    reports, is left out.
    """
    file = written("results.json", data)

    def read() -> None:
        found = read_results(file)
        to_json(found)
        ElementTree.fromstring(to_junit(found))
        to_markdown(found).encode()
        for show in (print_table, print_matrix):
            show(found, text := io.StringIO())
            assert "\x1b" not in text.getvalue()
        with mock.patch.object(Path, "read_text", return_value=""):
            render(Material(found, {}, {})).encode()

    read_or_refused(read)


def seeds() -> list[bytes]:
    """Results of two engines, of few samples, with a scene."""
    return seeds_in_file("results")


mutate = changing(changed_json, words=(*WORDS,))
