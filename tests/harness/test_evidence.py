"""Validated is said with evidence only: a citation, the digest of what was judged against, and data
that are not kincheck's own.
"""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters, cases
from kincheck.core.case.case import Origin, Series, Truth
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.notes import notes
from kincheck.core.cli import main
from kincheck.core.harness.evidence import digest
from kincheck.core.harness.record import Outcome, from_json, to_json
from kincheck.core.harness.run import run

from ..support.case_texts import BASE, CSV, INLINE, complains, write
from ..support.fakes import Fake, crank, exact

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
def test_validation_needs_a_citation(tmp_path, capsys, truth, cited):
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


def test_the_digest_of_a_file_is_that_of_its_bytes(tmp_path):
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
    complains(write(tmp_path, text.replace("DIGEST", "0" * 64)), ["reference.digest", right])
    complains(
        write(tmp_path, text.replace("DIGEST", "12")), ["reference.digest", "64 hexadecimal digits"]
    )
    complains(
        write(tmp_path, BASE + INLINE + f'digest = "sha256:{right}"'), ["reference.digest", "rows"]
    )


@pytest.mark.parametrize("citation", ['""', '"  "', "3"])
def test_a_citation_says_something(tmp_path, citation):
    complains(
        write(tmp_path, BASE + INLINE + f"citation = {citation}"),
        ["reference.citation", "where the true values come from"],
    )


def test_the_digest_tells_values_apart():
    one, other = crank().reference, crank(rate=2.5).reference
    assert digest(one) == digest(dict(reversed(one.items())))
    assert digest(one) != digest(other)
    assert digest(one) != digest({"x": one["x"]})
    assert digest({"x": one["x"]}) != digest({"y": one["x"]})


def test_the_built_in_closed_forms_cite_their_modules():
    for name in cases.names():
        case = cases.load(name)
        assert case.origin is not None
        if case.truth is Truth.CLOSED_FORM:
            assert "kincheck.cases." in case.origin.citation
        assert not [note for note in notes(case) if "uncited" in note]
    (record,) = run([cases.load("rssr")], [adapters.engine("native")], tol=1e-12).records
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


@pytest.mark.parametrize("engines", [OWN, OWN[::-1]])
def test_own_result_as_reference_is_recognised(engines):
    results = run([third_party()], engines, tol=1e-12)
    assert [record.outcome for record in results.records] == [Outcome.PASS] * 2
    assert not any(record.validated for record in results.records)
    assert all(record.evidence.own for record in results.records)
    (note,) = results.run["cases"]["crank"]["notes"]
    assert "equals native's own result in every bit" in note
    assert from_json(to_json(results)) == results


def test_own_result_is_recognised_by_baseline():
    (record,) = run([third_party()], [Fake("other")], tol=1e-12, baseline=Fake("native")).records
    assert not record.validated
    (record,) = run([third_party()], [Fake("other")], tol=1e-12).records
    assert record.validated  # nobody can tell


def test_one_bit_makes_it_another_result():
    def bump(series):
        moved = series.position.copy()
        moved[3] = np.nextafter(moved[3], 9.0)
        return Series(moved, series.velocity, series.acceleration)

    assert all(record.validated for record in run([third_party(bump)], OWN, tol=1e-12).records)


def test_closed_forms_may_be_met_in_every_bit():
    assert all(record.validated for record in run([crank()], OWN, tol=1e-12).records)


@pytest.mark.parametrize("taken", [slice(0, 2), slice(4, 5)])
def test_few_samples_tell_nothing(taken):
    case = third_party()
    case = replace(case, sweep=replace(case.sweep, values=case.sweep.values[taken]))
    p, v, a = exact(case)
    case = replace(case, reference={"y": Series(p[:, 1].copy(), v[:, 1].copy(), a[:, 1].copy())})
    assert not any(record.evidence.own for record in run([case], OWN, tol=1e-12).records)


def test_a_driven_coordinate_tells_nothing(tmp_path):
    """The slide's tip is where its driver puts it: everybody's data are the same."""
    _, results = results_of(tmp_path, THIRD_PARTY + INLINE + CITED)
    assert results.records[0].validated
