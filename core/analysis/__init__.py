"""Analysis: equations of a mechanism, their rank, and the sweep."""
