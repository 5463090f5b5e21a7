"""The recipes for JAX and PyTorch of the documentation, where these libraries are installed."""

import kincheck
import numpy as np
import pytest

from ...docs.page import blocks
from ...support.sources import ROOT

pytestmark = pytest.mark.needs("hardpoints")  # it brings the case

PLACES = ["joints.tie_rod.points.0 z", "joints.tie_rod.points.1 y"]
PAGE = ROOT / "core/extensions/sweep/docs/how-to/curves.md"


@pytest.fixture(scope="module")
def case():
    return kincheck.load("mcpherson_suspension")


def operator(library, case):
    """The operator of a recipe."""
    (text,) = [
        each.text for each in blocks(PAGE.read_text()) if each.title == f"curves_in_{library}.py"
    ]
    names = {}
    exec(compile(text, library, "exec"), names)
    return names["operator"](case, PLACES, "toe")


def expected(case, x):
    """Gradient of the sum of squares by differences; what they leave is of second order."""

    def size(x):
        return (kincheck.curves(case, PLACES, x, ["toe"]).values["toe"] ** 2).sum()

    steps = 1e-5 * np.eye(x.size).reshape(-1, *x.shape)
    return np.array([(size(x + h) - size(x - h)) / 2e-5 for h in steps]).reshape(x.shape)


X = np.array([[0.0, 0.0], [1e-3, -2e-3], [-5e-4, 1e-3]])


def test_recipe_of_jax(case):
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    curves = operator("jax", case)

    def size(x):
        return (curves(x) ** 2).sum()

    x = jax.numpy.asarray(X)
    found = jax.jit(jax.jacfwd(size))(x)
    np.testing.assert_allclose(found, expected(case, X), rtol=1e-6)
    np.testing.assert_allclose(jax.jit(jax.grad(size))(x), found, rtol=1e-12)
    each = jax.vmap(lambda one: curves(one[None])[0])(x)
    np.testing.assert_array_equal(each, curves(x))


def test_recipe_of_torch(case):
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    curves = operator("torch", case)
    x = torch.tensor(X, requires_grad=True)
    (curves(x) ** 2).sum().backward()
    np.testing.assert_allclose(x.grad.numpy(), expected(case, X), rtol=1e-6)
