"""Former module of `print_table`, kept for scripts written before version 0.2; see
`kincheck.core.report.table`.
"""

from importlib import import_module
from typing import Any

print_table: Any = import_module("kincheck.core.report.table").print_table
"""Print the results of a run as a table; see `kincheck.core.report.table`."""
