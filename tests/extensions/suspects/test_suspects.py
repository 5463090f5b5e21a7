"""Samples that are suspect, in any engine and in the native one, and the evidence for them."""

import hashlib
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck import Outcome, Ramp, Trajectory, adapters, cases
from kincheck.adapters import engine
from kincheck.core.case.case import Origin, Series, Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.notes import notes
from kincheck.core.cli import main
from kincheck.core.extensions.hardpoints.suspension import camber_of_front_view
from kincheck.core.extensions.suspects.suspects import FACTORS, slips
from kincheck.core.harness.compare import Curve
from kincheck.core.harness.native_engine import NativeEngine
from kincheck.core.harness.record import from_json, to_json
from kincheck.core.harness.verdict import digest
from kincheck.core.report.junit import to_junit
from kincheck.core.report.report import headline, write_report
from kincheck.core.report.table import messages, to_markdown

from ...support.case_texts import BASE, CSV, INLINE, complains, write
from ...support.engine_faults import changed
from ...support.engine_forces import force_case
from ...support.fakes import Fake, crank, exact, off, record_of, run_case
from ...support.loaded_slider_crank import loaded

ENGINES = [Fake("native"), Fake("other"), Fake("third")]
S = np.linspace(-1.0, 1.3, 24)
WAVY = 0.3 * np.sin(1.7 * S + 0.4) + 0.1 * S**2


OTHER_SIGN = "with the other sign"


def with_reference(change):
    """The crank with its references changed: a function of the series of each output."""
    case = crank()
    return replace(
        case,
        reference={
            name: change(name, series, case.reference) for name, series in case.reference.items()
        },
    )


def every(series, change):
    return Series(
        *(change(each) for each in (series.position, series.velocity, series.acceleration))
    )


def suspected(change, engines=ENGINES):
    return found_by(engines, with_reference(change))


def scaled(factor):
    """A change of references by a factor."""
    return lambda name, x, _: every(x, lambda a: factor * a)


def added(by):
    """A change of the positions of references by a number or an array."""
    return lambda name, x, _: replace(x, position=x.position + by)


CHANGES = {
    "with the other sign": scaled(-1.0),
    "times 1/1000": scaled(1000.0),
    "times 1000": scaled(1.0 / 1000.0),
    "times pi/180": scaled(180.0 / math.pi),
    "times 25.4": scaled(1.0 / 25.4),
    "with the other sign and times 1000": scaled(-1.0 / 1000.0),
    "minus 0.7 m": added(0.7),
    "shifted by one sample": lambda name, x, _: every(
        x, lambda a: np.roll(a, 1)[[1, *range(1, len(a))]]
    ),
    "taken as that of output": lambda name, x, all_: all_["y" if name == "x" else "x"],
}


@pytest.mark.parametrize("words", CHANGES)
def test_reference_slip_is_named(words):
    results, found = suspected(CHANGES[words])
    assert found is not None
    assert found.engines == ["native", "other", "third"]
    named = [each for each in found.explanations if words in each.change]
    assert named
    assert all(each.difference <= each.tolerance for each in found.explanations)
    assert all(record.outcome is Outcome.FAIL for record in results.records)
    assert "all 3 engines agree within" in found.message
    assert f"at sample {found.sample} " in found.message
    assert "suspect the reference, the output's component or a sign" in found.message
    assert from_json(to_json(results)) == results


@pytest.mark.parametrize(
    ("driver", "unit", "written"),
    [("angle", "deg", "angle = 28.64788976 deg"), ("angle", "rad", "angle = 0.5 rad")]
    + [("time", "deg", "time = 0.5 s")],
)
def test_suspected_sample_has_unit_of_file(driver, unit, written):
    bump = np.where(np.arange(9) == 6, 0.01, 0.0)
    case = with_reference(added(bump))
    sweep = replace(case.sweep, driver=driver)
    if driver == "time":
        sweep = replace(sweep, rate=1.0, motions={"angle": Ramp(2.0)})
    suspects = run_case(replace(case, sweep=sweep, angle_unit=unit), *ENGINES).suspects
    assert f"at sample 6 ({written}) of output" in suspects["crank"].message


def test_run_names_suspected_reference_once(kincheck_main, capsys):
    case = with_reference(CHANGES[OTHER_SIGN])
    assert kincheck_main("run", "crank", engines=ENGINES, cases={"crank": case}) == 1
    out = capsys.readouterr().out
    assert (
        out.count("suspect: crank: all 3 engines agree") == out.count("suspect the reference") == 1
    )
    assert "fail: crank" not in out


def test_suspicion_without_slip_is_unexplained():
    bump = np.where(np.arange(9) == 4, 0.01, 0.0)
    _, found = suspected(lambda name, x, _: added(bump)(name, x, _) if name == "y" else x)
    assert found.explanations == []
    assert found.unexplained == ["y (position)"]
    assert (found.output, found.sample) == ("y", 4)
    assert found.difference == pytest.approx(0.01)
    assert "explains it" in found.message


def test_disagreeing_engines_suspect_nobody():
    wrong = Fake("wrong", off("position", lambda p: p + 1e-6))
    results, found = suspected(CHANGES[OTHER_SIGN], [Fake("native"), wrong])
    assert found is None
    assert len(messages(results)) == 2


def test_one_wrong_engine_suspects_nobody():
    wrong = [Fake("native"), Fake("wrong", off("position", lambda p: -p))]
    for case, engines in ((crank(), wrong), (crank(), ENGINES), (crank(reference=False), ENGINES)):
        assert run_case(case, *engines).suspects == {}


def test_lone_engine_suspects_explained_slips():
    """It is told only what a slip explains wholly."""
    _, found = suspected(CHANGES["times 1000"], [Fake("native")])
    assert "native is the only engine that solved it" in found.message
    assert (
        suspected(
            lambda name, x, _: every(x, lambda a: a + 1e-3 * np.arange(9.0) ** 2), [Fake("native")]
        )[1]
        is None
    )


def held(values, atol=1e-9):
    return Curve(np.asarray(values, dtype=float), atol, unit="m")


def words(values, reference, others=None):
    return [*slips(held(values), held(reference, 0.0), others or {})]


OTHER = np.cos(3.0 * S)
SLIPS = {f"times {name}": WAVY / factor for name, factor in FACTORS.items()}
SLIPS |= {f"{OTHER_SIGN} and {words}": -series for words, series in SLIPS.items()}
SLIPS |= {
    # pairs, where nothing alone fits
    f"{OTHER_SIGN} and plus 0.4 m": 0.4 - WAVY,
    f"{OTHER_SIGN} and with its samples in reversed order": -WAVY[::-1],
    "times 1/1000 and minus 0.2 m": 1000.0 * (WAVY + 0.2),
    f"{OTHER_SIGN} taken as that of output z": -OTHER,
    "shifted by one sample, each taken from the one before": np.r_[WAVY[1:], 7.0],
    "shifted by one sample, each taken from the next": np.r_[7.0, WAVY[:-1]],
    "times 1/1000 and shifted by one sample, each taken from the next": (
        np.r_[0.0, WAVY[:-1]] * 1000.0
    ),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slip_is_found_alone(slip):
    assert words(WAVY, SLIPS[slip], {"z": held(OTHER)}) == [slip]


def test_slip_by_definition_and_sign():
    toe = 0.3 * S
    seen = np.arctan(np.tan(WAVY) / np.cos(toe))
    definitions = [("taken as another", lambda x: camber_of_front_view(x, toe))]

    def named(reference):
        return [*slips(held(WAVY), held(reference, 0.0), {}, definitions=definitions)]

    assert named(seen) == ["taken as another"]
    assert "with the other sign and taken as another" in named(-seen)
    assert "times pi/180 and taken as another" in named(np.degrees(seen))
    assert named(np.arctan(np.tan(WAVY) / np.cos(2.0 * toe))) == []


@pytest.mark.parametrize(
    ("values", "reference"),
    [
        (np.zeros(24), np.full(24, 1e-3)),
        (np.full(24, 1e-12), np.full(24, -0.4)),
        (np.full(24, 0.3), np.full(24, 0.1)),
        (WAVY[:2], -WAVY[:2]),
        (WAVY[:2], WAVY[:2] + 0.5),
        (np.where(np.arange(24) < 2, WAVY, np.nan), -WAVY),
        (WAVY, -WAVY + 1e-8 * S),
        (WAVY, WAVY * 1.01),
    ],
    ids=[
        "zeros",
        "as good as zeros",
        "constant",
        "two",
        "two, off",
        "two known",
        "nearly",
        "another factor",
    ],
)
def test_slip_needs_exact_fit(values, reference):
    assert words(values, reference) == []


def test_slip_ignores_missing_samples():
    values = np.where(np.arange(24) == 5, np.nan, WAVY)
    assert words(values, -np.where(np.arange(24) == 7, np.nan, WAVY)) == ["with the other sign"]


# Where most engines agree with each other and not with native, it is native that is suspected


ATOL = 1e-9
WRONG = Fake("native", off("velocity", lambda v: -v))
OTHERS = [Fake(name) for name in ("one", "two", "three")]


def shifted(name, part):
    """An engine with its positions off by a part of the tolerance."""
    return Fake(name, off("position", lambda p: p + part * ATOL))


def found_by(engines, case=None):
    results = run_case(case or crank(reference=False), *engines)
    return results, results.suspects.get("crank")


def test_native_against_engines_is_suspected():
    results, found = found_by([WRONG, *OTHERS])
    assert found is not None
    assert (found.subject, found.engines) == ("native", ["one", "two", "three"])
    assert {*found.outputs} == {"x", "y"}
    assert found.outputs["x"] == ["velocity"]
    assert "3 of 3 other engines agree with each other within 0 m/s (one, two, three)" in (
        found.message
    )
    assert "native differs by" in found.message
    assert "suspect native" in found.message
    assert "x (velocity): native with the other sign" in found.message
    outcomes = [record.outcome for record in results.records]
    assert outcomes == [Outcome.UNJUDGED, *[Outcome.FAIL] * 3]
    assert from_json(to_json(results)) == results


@pytest.mark.parametrize(
    ("subject", "who", "said"),
    [
        ("reference", "all 3 engines agree", "suspect the reference of crank"),
        ("native", "3 of 3 other engines agree with each other", "; suspect native in crank"),
    ],
)
def test_suspicion_appears_once_per_format(subject, who, said, tmp_path):
    by_reference = subject == "reference"
    results, _ = suspected(CHANGES[OTHER_SIGN]) if by_reference else found_by([WRONG, *OTHERS])
    left = [] if by_reference else [Outcome.UNJUDGED]  # native itself
    assert [outcome for _, outcome, _ in messages(results)] == left
    assert to_markdown(results).count(f"Suspect: crank: {who}") == 1
    assert "Fail: crank" not in to_markdown(results)
    assert headline(results).endswith(said)
    write_report(results, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert page.count(f"{who} within") == 1
    assert "Worst: engine" not in page
    junit = to_junit(results).decode()
    assert junit.count(f"suspect: {who}") == 1
    rather = "the reference" if by_reference else subject
    assert junit.count(f"suspect {rather} rather than the engine") == 6


def test_suspected_native_outside_run():
    """It is the standard without a record."""
    results = run_case(crank(reference=False), *OTHERS, baseline=WRONG)
    assert results.suspects["crank"].subject == "native"
    assert "with the other sign" in results.suspects["crank"].message


@pytest.mark.parametrize(
    "engines",
    [
        [WRONG, OTHERS[0]],
        [WRONG, OTHERS[0], Fake("wrong too", off("velocity", lambda v: 2.0 * v))],
        [WRONG, *OTHERS[:2], Fake("as native", off("velocity", lambda v: -v))],
        [Fake("native"), Fake("mujoco", WRONG.answer), Fake("mujoco-default", WRONG.answer)],
        [Fake("native"), Fake("one", WRONG.answer), *OTHERS[1:]],
    ],
    ids=["one other", "three answers", "two against two", "variants", "one astray"],
)
def test_suspicion_needs_majority(engines):
    results, found = found_by(engines)
    assert found is None
    assert any(outcome is Outcome.FAIL for _, outcome, _ in messages(results))


def test_majority_suspects_native():
    odd = Fake("odd", off("velocity", lambda v: 3.0 * v))
    results, found = found_by([WRONG, *OTHERS, odd])
    assert found.engines == ["one", "two", "three"]
    assert "3 of 4 other engines agree" in found.message
    assert {name for name, outcome, _ in messages(results) if outcome is Outcome.FAIL} == {"odd"}


def test_modes_of_one_simulator_count_once():
    twice = [Fake("one"), Fake("one", mode="simulate")]
    assert found_by([WRONG, *twice])[1] is None
    assert found_by([WRONG, *twice, OTHERS[1]])[1].engines == ["one", "two"]


def test_agreement_within_sum_of_tolerances():
    """Engines at three and at less than five tolerances from native agree; at six they do not."""
    native = Fake("native")
    assert found_by([native, shifted("one", 3.0), shifted("two", 4.9)])[1] is not None
    assert found_by([native, shifted("one", 3.0), shifted("two", 6.0)])[1] is None
    assert found_by([native, shifted("one", 0.9), shifted("two", 0.8)])[1] is None


def test_suspicion_keeps_engine_faults():
    """Its residual, or another output, is no fault of native."""

    def unconverged(case):
        found = OTHERS[0].answer(case)
        return Trajectory(found.points, found.solved, found.iterations, 1e-3)

    def also_accelerations(case):
        return off("acceleration", lambda a: 1.1 * a)(case)

    for answer in (unconverged, also_accelerations):
        results, found = found_by([WRONG, *OTHERS, Fake("odd", answer)])
        assert found.engines == ["one", "two", "three", "odd"]
        assert [name for name, outcome, _ in messages(results) if outcome is Outcome.FAIL] == [
            "odd"
        ]


def test_reference_clears_native():
    """All pass by the reference, except native."""
    results, found = found_by([WRONG, *OTHERS], crank())
    assert found is None
    assert [record.outcome for record in results.records][1:] == [Outcome.PASS] * 3


def test_native_is_suspected_beside_position_reference():
    case = crank()
    case = replace(case, reference={k: Series(each.position) for k, each in case.reference.items()})
    results, found = found_by([WRONG, *OTHERS], case)
    assert found.subject == "native"
    assert results.records[0].outcome is Outcome.PASS


class OtherMoments(NativeEngine):
    """The native engine with a moment of a thousandth of the force added to every reaction."""

    def solve(self, model, case, tol):
        found = super().solve(model, case, tol)
        joints = {
            name: replace(each, moment=each.moment + 1e-3 * np.roll(each.force, 1, axis=1))
            for name, each in found.forces.joints.items()
        }
        return changed(found, forces=replace(found.forces, joints=joints))


def test_simulators_suspect_native_moments():
    case = force_case(loaded(), [0.0, 0.25, 0.5])
    case = replace(case, outputs=tuple(replace(each, atol=1e-7) for each in case.outputs))
    simulators = [engine(name) for name in ("mujoco", "pinocchio", "exudyn")]
    results = run_case(case, OtherMoments(), *simulators)
    found = results.suspects[case.name]
    assert found.engines == ["mujoco", "pinocchio", "exudyn"]
    assert all(" joint_moment " in name for name in found.outputs)
    assert found.difference > 1e-3


# Validated is said with evidence only: a citation, the digest of what was judged against, and data


CITED = '\ncitation = "A. Uthor: On slides, table 3"'
THIRD_PARTY = BASE.replace('"closed_form"', '"third_party_data"')


def results_of(tmp_path, text, *engines):
    file = write(tmp_path, text)
    names = engines or ("native",)
    # in this process: a worker takes longer to begin than to solve
    argv = ["run", str(file), "--jobs", "0", "--engine", *names]
    status = main.main([*argv, "--json", str(tmp_path / "r.json")])
    return status, from_json((tmp_path / "r.json").read_bytes())


@pytest.mark.parametrize("truth", ["closed_form", "third_party_data"])
@pytest.mark.parametrize("cited", [True, False])
def test_validation_needs_citation(tmp_path, capsys, truth, cited):
    text = BASE.replace('"closed_form"', f'"{truth}"') + INLINE + (CITED if cited else "")
    status, results = results_of(tmp_path, text, "mujoco")
    (record,) = results.records
    assert (status, record.outcome, record.validated) == (0, Outcome.PASS, cited)
    out = capsys.readouterr().out
    assert ("(validated)" in out) is cited
    assert ("(uncited)" in out) is ("judged against an uncited reference" in out) is not cited
    assert ('add citation = "author, title, page or address" to [reference]' in out) is not cited
    assert record.evidence.citation == ("A. Uthor: On slides, table 3" if cited else "")
    assert record.evidence.of == "values"
    assert record.evidence.sha256 == digest(load_case(tmp_path / "case.toml").reference)


def test_reference_file_digest_is_of_bytes(tmp_path):
    (tmp_path / "x.csv").write_bytes(b"\xef\xbb\xbf" + CSV.encode())
    _, results = results_of(tmp_path, BASE + f'[reference]\nfile = "x.csv"{CITED}')
    evidence = results.records[0].evidence
    assert (evidence.of, evidence.sha256) == (
        "x.csv",
        hashlib.sha256((tmp_path / "x.csv").read_bytes()).hexdigest(),
    )
    assert (
        json.loads((tmp_path / "r.json").read_bytes())["records"][0]["evidence"]["sha256"]
        == evidence.sha256
    )


def test_pinned_reference_digest_must_match(tmp_path):
    (tmp_path / "x.csv").write_text(CSV)
    right = hashlib.sha256(CSV.encode()).hexdigest()
    text = BASE + '[reference]\nfile = "x.csv"\ndigest = "sha256:DIGEST"'
    assert load_case(write(tmp_path, text.replace("DIGEST", right))).origin.sha256 == right
    complains(write(tmp_path, text.replace("DIGEST", "0" * 64)), f"reference.digest ... {right}")
    complains(
        write(tmp_path, text.replace("DIGEST", "12")), "reference.digest ... 64 hexadecimal digits"
    )
    complains(
        write(tmp_path, BASE + INLINE + f'digest = "sha256:{right}"'), "reference.digest ... rows"
    )


@pytest.mark.parametrize("citation", ['""', '"  "', "3"])
def test_empty_citation_is_refused(tmp_path, citation):
    complains(
        write(tmp_path, BASE + INLINE + f"citation = {citation}"),
        "reference.citation ... where the true values come from",
    )


def test_reference_digest_depends_on_values():
    one, other = crank().reference, crank(rate=2.5).reference
    assert digest(one) == digest(dict(reversed(one.items())))
    assert digest(one) != digest(other)
    assert digest(one) != digest({"x": one["x"]})
    assert digest({"x": one["x"]}) != digest({"y": one["x"]})


def test_built_in_closed_forms_cite_modules():
    for name in cases.names():
        case = cases.load(name)
        assert case.origin is not None
        if case.truth is Truth.CLOSED_FORM:
            assert "kincheck.cases." in case.origin.citation
        assert not [note for note in notes(case) if "uncited" in note]
    record = record_of(adapters.engine("native"), cases.load("rssr"))
    assert record.validated


OWN = [Fake("native"), Fake("other")]


def third_party(change=lambda series: series, **changes):
    case = crank(truth=Truth.THIRD_PARTY_DATA)
    origin = Origin("somebody")
    return replace(
        case,
        reference={name: change(each) for name, each in case.reference.items()},
        origin=origin,
        **changes,
    )


@pytest.mark.parametrize("engines", [OWN, OWN[::-1]], ids=["native first", "native last"])
def test_own_result_as_reference_is_recognised(engines):
    results = run_case(third_party(), *engines)
    assert [record.outcome for record in results.records] == [Outcome.PASS] * 2
    assert not any(record.validated for record in results.records)
    assert all(record.evidence.own for record in results.records)
    (note,) = results.run["cases"]["crank"]["notes"]
    assert "equals native's own result in every bit" in note
    assert from_json(to_json(results)) == results


def test_own_result_is_recognised_by_baseline():
    record = record_of(Fake("other"), third_party(), baseline=Fake("native"))
    assert not record.validated
    record = record_of(Fake("other"), third_party())
    assert record.validated  # nobody can tell


def test_reference_one_bit_off_validates():
    def bump(series):
        moved = series.position.copy()
        moved[3] = np.nextafter(moved[3], 9.0)
        return Series(moved, series.velocity, series.acceleration)

    assert all(record.validated for record in run_case(third_party(bump), *OWN).records)


def test_closed_form_met_exactly_validates():
    assert all(record.validated for record in run_case(crank(), *OWN).records)


@pytest.mark.parametrize("taken", [slice(0, 2), slice(4, 5)], ids=["two", "one"])
def test_few_equal_samples_prove_nothing(taken):
    case = third_party()
    case = replace(case, sweep=replace(case.sweep, values=case.sweep.values[taken]))
    p, v, a = exact(case)
    case = replace(case, reference={"y": Series(p[:, 1].copy(), v[:, 1].copy(), a[:, 1].copy())})
    assert not any(record.evidence.own for record in run_case(case, *OWN).records)


def test_equal_driven_coordinate_proves_nothing(tmp_path):
    """The slide's tip is where its driver puts it: everybody's data are the same."""
    _, results = results_of(tmp_path, THIRD_PARTY + INLINE + CITED)
    assert results.records[0].validated


def test_slip_scales_accuracy():
    values = np.linspace(1.0, 2.0, 9)
    held = Curve(values, 1e-9)
    reference = Curve(values / 1000.0 + 4e-7, half=np.full(9, 5e-7))
    ((change, off),) = slips(held, reference, {}, offsets=False).items()
    assert (change, off.tolerance) == ("times 1000", pytest.approx(5e-4, rel=1e-5))
    assert slips(held, replace(reference, half=None), {}, offsets=False) == {}
