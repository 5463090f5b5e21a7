"""Small checks of joint types."""

import pytest
from kincheck.core.studies.checks import check_joint
from kincheck.core.studies.checks import manifold as branches


@pytest.fixture
def few(monkeypatch):
    """One specimen, few starts of Newton's iteration, and few aims of the walks from their ends."""
    monkeypatch.setattr(check_joint, "SPECIMENS", 1)
    monkeypatch.setattr(check_joint, "STARTS", 10)
    monkeypatch.setattr(branches, "AIMS", 4)


@pytest.fixture
def loops_only(few, monkeypatch):
    """The same without the search for branches, half of the work."""
    monkeypatch.setattr(check_joint, "branches", lambda one, starts: [])
