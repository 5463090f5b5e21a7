"""Address of `print_table` before version 0.2; `kincheck.core.report.table` has it now."""

from importlib import import_module
from typing import Any

print_table: Any = import_module("kincheck.core.report.table").print_table
"""Print the results of a run as a table; see `kincheck.core.report.table`."""
