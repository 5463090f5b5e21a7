"""The strut's case file with keys changed."""

from .suspension_files import STRUT


def changed(table, **keys):
    """The strut's data with keys of a top-level table changed, or left out where None."""
    return STRUT | {
        table: {key: value for key, value in (STRUT[table] | keys).items() if value is not None}
    }


TOE = {"outputs": {"toe": {"type": "toe"}}}
