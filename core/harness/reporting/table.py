"""Address of `print_table` that the README named before version 0.2; scripts that import it go on
working. `kincheck.core.report.table` has it now.
"""

from importlib import import_module
from typing import Any

print_table: Any = import_module("kincheck.core.report.table").print_table
"""Print the results of a run as a table; see `kincheck.core.report.table`."""
