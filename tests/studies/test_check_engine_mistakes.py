"""Engines with one fault each, and check-engine, which must find it."""

import kincheck
import pytest
from kincheck.core.case.joint_probe import probe
from kincheck.core.harness.execution import solve_in_process
from kincheck.core.joints import Screw, Universal
from kincheck.core.studies.checks import check_engine as checking
from kincheck.core.studies.checks import engine_cases as force_cases
from kincheck.core.studies.checks.findings import Verdict

from ..support.engine_faults import HARMLESS, OF_FORCES, OF_MOTION, Wrapped


@pytest.fixture(autouse=True)
def here_alone(monkeypatch):
    """Solved in this process, by two joint types at most."""
    monkeypatch.setattr(checking, "in_workers", lambda *_: solve_in_process)
    monkeypatch.setattr(checking, "probes", lambda: [probe(each) for each in (Screw, Universal)])
    monkeypatch.setattr(force_cases, "probes", lambda: [probe(Universal)])
    monkeypatch.setattr("kincheck.core.cli.checks.TOPOLOGIES", {"one loop": "rssr"})


@pytest.fixture
def without_loads(monkeypatch):
    monkeypatch.setattr(checking, "force_cases", list)


@pytest.fixture
def with_loads(monkeypatch):
    monkeypatch.setattr(checking, "probes", list)
    monkeypatch.setattr("kincheck.core.cli.checks.TOPOLOGIES", {})


def failing(fault):
    report = kincheck.check_engine(Wrapped(fault))
    return [each.check for each in report.findings if each.verdict is Verdict.FAIL]


@pytest.mark.parametrize("fault", OF_MOTION)
def test_check_engine_finds_fault_of_motion(fault, without_loads):
    assert failing(fault)


@pytest.mark.parametrize("fault", OF_FORCES)
def test_check_engine_finds_fault_of_forces(fault, with_loads):
    found = failing(fault)
    assert any(check.startswith("forces: ") for check in found)
    assert not any(check.startswith(("rates: ", "refusal: ")) for check in found)


@pytest.mark.parametrize("change", HARMLESS)
def test_check_engine_passes_harmless_changes(change):
    assert failing(change) == []


def test_check_engine_passes_without_fault():
    assert failing("") == failing("no fault, with bodies") == []
