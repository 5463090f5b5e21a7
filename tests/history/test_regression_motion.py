"""A motion that is another than it was is reported: where there is no reference nothing else would
show it.
"""

import math

import msgspec
import pytest
from kincheck.core.harness.record import OutputSeries
from kincheck.core.history.findings import Kind

from ..support.nights import changed, keep, records, worse
from .test_regression import FIRST, reported

SERIES = OutputSeries(
    position=[0.0, 0.5, None], velocity=[1.0, 1.0, None], acceleration=None, unit="m"
)
DRIVER = {"turn": [0.0, 0.5, 1.0]}


def night(path, unjudged=True, driver=DRIVER, **values):
    """A run in which the first pair has that output, judged by nothing unless said otherwise."""
    outputs = {"y": msgspec.structs.replace(SERIES, **values)}
    errors = {"errors": {}} if unjudged else {}
    keep(path, changed(records(), driver=driver, outputs=outputs, **errors))


def found_after(path, **now):
    night(path, unjudged=now.get("unjudged", True))
    night(path, **now)
    found = reported(path, against="1")
    return (
        [(each.kind, each.case, each.engine) for each in found.findings],
        [each.message for each in found.findings],
        found,
    )


@pytest.mark.parametrize(
    "values", [{"position": [0.0, -0.5, None]}, {"velocity": [1.0, 1.001, None]}]
)
def test_other_values_at_the_same_samples(path, values):
    kinds, messages, found = found_after(path, **values)
    assert kinds == [(Kind.MOVED, *FIRST)]
    assert found.regressed
    assert (
        f"y {next(iter(values))} differs by up to {'1 m ' if 'position' in values else '1e-3 m/s '}"
        in messages[0]
    )


@pytest.mark.parametrize(("off", "kinds"), [(1e-6, [Kind.MOVED]), (0.0, [])])
def test_large_forces_do_not_hide_a_small_motion(path, off, kinds):
    """Of an output without a standard, the scale is that of the outputs of its unit."""
    for moved in (0.0, off):
        force = OutputSeries(position=[9e5, 1e6, 0.0], velocity=None, acceleration=None, unit="N")
        y = msgspec.structs.replace(SERIES, position=[0.0, 0.5 + moved, None])
        outputs = {"y": y, "load": force}
        keep(path, changed(records(), driver=DRIVER, outputs=outputs, errors={}))
    assert [each.kind for each in reported(path, against="1").findings] == kinds


def test_round_off_is_no_other_motion(path):
    kinds, messages, _ = found_after(
        path, position=[0.0, 0.5 + 1e-10, None], velocity=[1.0, None, 2.0]
    )
    assert kinds == [(Kind.GONE, *FIRST)]
    assert messages == [
        "y velocity has no value at 1 of 2 samples that had one, first at turn = 0.5: no reason is"
        " given"
    ]


@pytest.mark.parametrize(("off", "kinds"), [(1.9e-9, []), (2.1e-9, [(Kind.MOVED, *FIRST)])])
def test_values_within_tolerances_are_no_motion(path, off, kinds):
    assert found_after(path, unjudged=False, position=[0.0, 0.5 + off, None])[0] == kinds


def test_another_sweep_is_said(path):
    kinds, messages, _ = found_after(path, driver={"turn": [0.0, 0.25, 0.5]})
    assert kinds == [(Kind.MOVED, *FIRST)]
    assert messages == ["solved at other values of the drivers than before"]


def test_the_last_digit_of_a_driver_is_no_other_sweep(path):
    assert found_after(path, driver={"turn": [0.0, math.nextafter(0.5, 1.0), 1.0]})[0] == []


def test_another_driver_is_another_sweep(path):
    assert found_after(path, driver={"push": DRIVER["turn"]})[0] == [(Kind.MOVED, *FIRST)]


def test_fewer_samples_are_reported_lost(path):
    keep(path, records())
    keep(path, changed(records(), solved=2, samples=2))
    (finding,) = reported(path, against="1").findings
    assert finding.kind is Kind.LOST
    assert finding.message == "2 of 2 samples solved, 9 of 9 before"


def test_grown_error_is_reported_as_drift(path):
    keep(path, changed(records(), driver=DRIVER, outputs={"x": SERIES}))
    keep(path, changed(records(), driver=DRIVER, outputs={"x": SERIES}, **worse(20.0)))
    assert [each.kind for each in reported(path, against="1").findings] == [Kind.DRIFTED]
