"""Tables of costs of the engine benchmark, against their JSON."""

import json

import msgspec
import numpy as np
import pytest
from kincheck.core.harness.record import to_json
from kincheck.core.report.sections import page
from kincheck.core.studies.bench.engines import Bench
from kincheck.core.studies.bench.processes import STAGES
from kincheck.core.studies.bench.report import report

from ..report.page import Page
from ..support.printed import assert_row


def spread(k):
    """A time over seven rounds: no two numbers alike."""
    return {"least": k, "median": 1.21 * k, "lower": 1.1 * k, "upper": 1.37 * k, "rounds": 7}


def size(loops, engine, us, **more):
    found = {"mechanism": "chain of loops", "loops": loops, "bodies": 2 * loops + 1, "mode": ""}
    found |= {"engine": engine, "loop": "compiled", "message": "too slow", "us_per_sample": us}
    return found | more


def scaling(n, us):
    found = {"mechanism": "ring", "size": n, "bodies": 2 * n - 1, "unknowns": 12 * n}
    found |= {"path": "sparse", "residual": 1.5e-15 * n, "error": 2.5e-16 * n}
    return found | {"us_per_value": spread(us)}


RUN = dict.fromkeys(("kincheck", "numpy", "python", "processor"), "1.0") | {"cores": 2}
RUN |= {"load_before": 0.12, "load_after": 0.34, "linear_algebra_threads": "1"}
PARTS = {name: spread(0.01 * (k + 1)) for k, name in enumerate(STAGES)}
BENCH = {
    "run": RUN,
    "rounds": 7,
    "vector_width": 8,
    "loops": [
        {"engine": engine, "loop": "python", "base": "native", "cases": 9, "us_per_sample": us}
        | {"ratio": ratio, "lower": 0.91 * ratio, "upper": 1.83 * ratio}
        for engine, us, ratio in (("native", 1.23, 1.0), ("mujoco", 456.7, 371.3))
    ],
    "batches": [
        {"case": "strut", "variants": n, "loop": "compiled", "solved": share, "retried": n // 4}
        | {"error": error, "us_per_sample": spread(3.2 / n), "flops_per_sample": 9e3}
        | {"gflops": 3.21, "of_peak": peak}
        for n, share, error, peak in ((1, 1.0, 1e-17, None), (64, 0.9876, None, 0.456))
    ],
    "studies": [
        {"case": "strut", "variants": 2048, "jobs": jobs, "us_per_sample": spread(0.2 / jobs)}
        | {"times": spread(0.8 * jobs), "peak_times": peak, "unsolved": jobs - 1}
        for jobs, peak in ((1, None), (2, spread(1.5)))
    ],
    "sizes": [
        size(1, "native", spread(1.0), outcome="pass", error=1e-16, residual=2e-16),
        size(10, "native", spread(30.0), outcome="fail", error=3e-9, residual=4e-15),
        size(100, "native", None),
    ],
    "scalings": [scaling(10, 5.0), scaling(20, 7.0), scaling(40, 40.0)],
    "processes": [
        {"what": what, "seconds": spread(t), "status": status, "stages": stages, "peak_mb": peak}
        for what, t, status, stages, peak in (
            ("import numpy", 0.1, 0, {}, None),
            ("first use, empty cache", 0.9, 1, PARTS, 123.4),
        )
    ],
}


@pytest.fixture(scope="module")
def shown():
    results = msgspec.convert(BENCH, Bench)
    return json.loads(to_json(results)), Page(page(report(results)))


def timed(us):
    """Median and quartiles."""
    return [None, None] if us is None else [us["median"], f"{us['lower']:.3g} … {us['upper']:.3g}"]


def assert_table(page, heading, expected):
    rows = page.rows(heading)
    assert len(rows) == len(expected)
    for row, values in zip(rows, expected, strict=True):
        assert_row(row, values)


def test_page_costs_equal_json(shown):
    found, page = shown
    expected = [
        [each["engine"], each["loop"], each["cases"], each["us_per_sample"], each["ratio"]]
        + [f"{each['lower']:.3g} … {each['upper']:.3g}"]
        for each in found["loops"]
    ]
    assert_table(page, "Whole loops", expected)
    expected = [
        [each["variants"], *timed(each["us_per_sample"]), each["gflops"]]
        + [None if each["of_peak"] is None else f"{100 * each['of_peak']:.1f} %"]
        + [f"{100 * each['solved']:.4g} %", each["retried"], each["error"]]
        for each in found["batches"]
    ]
    assert_table(page, "strut: cost against batch size", expected)
    expected = [
        [each["jobs"], *timed(each["us_per_sample"]), *timed(each["times"])]
        + [each["peak_times"] and each["peak_times"]["median"], each["unsolved"]]
        for each in found["studies"]
    ]
    assert_table(page, "strut: a tolerance study", expected)
    expected = [
        [each[key] for key in ("engine", "loop", "loops", "bodies", "outcome", "error", "residual")]
        + timed(each["us_per_sample"])
        for each in found["sizes"]
    ]
    assert_table(page, "Cost against size: chain", expected)
    keys = ("mechanism", "size", "bodies", "unknowns", "path", "error", "residual")
    expected = [
        [*(each[key] for key in keys), *timed(each["us_per_value"])] for each in found["scalings"]
    ]
    assert_table(page, "Cost against size: large", expected)
    expected = []
    for each in found["processes"]:
        stages = [each["stages"][name]["median"] if each["stages"] else None for name in STAGES]
        beyond = sum(stages[1:4]) if each["stages"] else None
        expected.append(
            [each["what"], *timed(each["seconds"]), *stages, beyond]
            + [each["status"], each["peak_mb"]]
        )
    assert_table(page, "First use", expected)


def test_cost_diagrams_equal_json(shown):
    found, page = shown
    words = " ".join(page.text.split())
    power = np.log(30.0) / np.log(10.0)
    assert f"from 1 to 10 loops the cost grows as their number to the power of {power:.2f}" in words
    assert "native, 100 loops: too slow" in words
    power = np.log(8.0) / np.log(4.0)
    assert (
        f"ring: from 10 to 40 the cost grows as the unknowns to the power of {power:.2f}" in words
    )
    figures = page.data["figures"]
    for key, rows, x in (("batch", "batches", "variants"), ("chain-of-loops", "sizes", "loops")):
        (curve,) = figures[key]["data"]
        some = [each for each in found[rows] if each["us_per_sample"]]
        assert curve["x"] == [each[x] for each in some]
        assert curve["y"] == [each["us_per_sample"]["median"] for each in some]
    for bar in figures["stages"]["data"]:
        assert bar["x"] == [found["processes"][1]["stages"][bar["name"]]["median"]]
        assert bar["y"] == ["empty cache"]
