"""The report of a run names the search for the release behind a change."""

from kincheck.core.report.regressions import to_markdown
from msgspec.structs import replace

from ...support.history_runs import changed, keep, nights, records, reported, worse

COMMAND = "mujoco 4.0.0 → 4.1.0: kincheck bisect mujoco first --from 4.0.0 --to 4.1.0"


def newer(path, version):
    nights(path, 2)
    now = [
        replace(each, version=version) if each.engine == "mujoco" else each for each in records()
    ]
    keep(path, changed(now, **worse(20.0)))
    return to_markdown(reported(path))


def test_report_names_search_for_release(path):
    assert COMMAND in newer(path, "4.1.0")


def test_report_of_same_version_names_none(path):
    assert "kincheck bisect" not in newer(path, "4.0.0")
