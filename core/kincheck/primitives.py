"""Primitives, the conditions that joints consist of: the names of `kincheck.core.primitives`."""

from kincheck.core.primitives import *  # noqa: F403  # pyright: ignore[reportWildcardImportFromLibrary]
from kincheck.core.primitives import __all__ as __all__
