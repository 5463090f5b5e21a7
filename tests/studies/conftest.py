"""Small checks of joint types."""

import pytest
from kincheck.core.studies.checks import check_joint
from kincheck.core.studies.checks import manifold as branches


@pytest.fixture
def few(patch):
    """One specimen, few starts of Newton's iteration, and few aims of the walks from their ends."""
    patch.setattr(check_joint, "SPECIMENS", 1)
    patch.setattr(check_joint, "STARTS", 10)
    patch.setattr(branches, "AIMS", 4)


@pytest.fixture
def loops_only(few, patch):
    """The same without the search for branches, half of the work."""
    patch.setattr(check_joint, "branches", lambda one, starts: [])
