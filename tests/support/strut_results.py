"""Results made up for the report: two outputs of a strut, two engines that ran and one that is not
installed.
"""

from __future__ import annotations

import math

import msgspec
from kincheck import Outcome, Record, Results
from kincheck.core.harness.record import Deviation, Deviations, Evidence, OutputSeries, Seconds

from ..support.examples import examples

ACCOUNT, STROKE = examples(__file__, "account", "stroke")

CRANK = {"name": "crank", "type": "joint_angle", "joint": "pivot"}


def series(driver, error=0.0):
    position = [1e-3 * math.sin(20 * d) + error * (k % 3) for k, d in enumerate(driver)]
    velocity = [0.02 * math.cos(20 * d) - error * (k % 3) for k, d in enumerate(driver)]
    return OutputSeries(
        position=position,
        velocity=velocity,
        acceleration=None,
        unit="m",
        reason="there is no acceleration",
    )


def distances(a, b):
    return [abs(x - y) for x, y in zip(a, b, strict=True)]


def judged(found, truth, tolerance, against):
    def one(motion, tolerance):
        errors = distances(getattr(found, motion), getattr(truth, motion))
        worst = max(errors)
        return Deviation(
            max_abs=worst,
            rms=math.sqrt(sum(e * e for e in errors) / len(errors)),
            worst_step=errors.index(worst),
            tolerance=tolerance,
            against=against,
            within=worst <= tolerance,
        )

    return Deviations(
        position=one("position", tolerance),
        velocity=one("velocity", 10 * tolerance),
        acceleration=None,
        reason="acceleration: none",
    )


def record(case, truth, engine, error, grid, **changes):
    found, true = series(grid, error), series(grid)
    errors = {
        name: judged(found, true, 1e-9, truth) for name in ("half_track_change", "wheelbase_change")
    }
    outcome = Outcome.PASS if error < 1e-10 else Outcome.FAIL
    made = Record(
        case=case,
        truth=truth,
        engine=engine,
        mode="projection",
        loop="python",
        version="1.2.3",
        outcome=outcome,
        message="" if outcome is Outcome.PASS else "half_track_change: too far off",
        settings={"iterations": 20},
        driver={"stroke": grid},
        outputs={"half_track_change": found, "wheelbase_change": found},
        errors=errors,
        residual_max=3.21e-14,
        rank=17,
        dof=1,
        iterations=321,
        solved=len(grid),
        samples=len(grid),
        seconds=Seconds(build=0.125, first=0.25, warm=0.0625),
        us_per_step=12.5,
        evidence=None
        if truth == "consensus_only"
        else Evidence(citation="A. Uthor: Struts", sha256=64 * "a", of="strut.csv"),
    )
    return msgspec.structs.replace(made, **changes)


GRID = [0.01 * k - 0.1 for k in range(21)]


def results(truth="in_house_oracle", case="strut", driver=STROKE):
    native = {"dof_account": ACCOUNT, "program": {"newton": {"operations": 7231, "flops": 6702}}}
    absent = {
        "outputs": {},
        "errors": {},
        "driver": {},
        "solved": None,
        "samples": None,
        "us_per_step": None,
        "version": None,
    }
    return Results(
        run={
            "kincheck": "0.1.0",
            "tol": 1e-12,
            "engines": {"one": "1.2.3"},
            "cases": {case: {"source": "a book", "driver": driver}},
        },
        records=[
            record(case, truth, "native", 1e-17, GRID, details=native),
            record(case, truth, "one", 3e-9, GRID),
            record(
                case,
                truth,
                "two",
                0,
                GRID,
                outcome=Outcome.UNAVAILABLE,
                message="two is not installed",
                **absent,
            ),
        ],
        references={case: {"half_track_change": series(GRID), "wheelbase_change": series(GRID)}},
    )
