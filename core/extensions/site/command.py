"""kincheck site."""

from __future__ import annotations

import sys
from pathlib import Path

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...errors import KincheckError, refuse
from ...options import destination, options


@options
class BuildSite(Command):
    """Write index.html over the results in a folder and below: runs (--out), searches over
    releases, boards, and the documentation in its folder docs. Wrong rows are red and come first.

    Exit status: 0 nothing is wrong; 1 a row is wrong; 2 the tool could not do its work.
    """

    about = "make one static page of all results in a folder"
    out: Path = destination("folder with the results, for index.html", Path, "DIR", required=True)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write_all
        from ...report.sections import page
        from ..reports.reports import print_report
        from .documents import documents
        from .page import report

        refuse(self.unwritable("index.html"))
        found = documents(self.out)
        if not found:
            raise KincheckError(
                f"--out {self.out}: found no results of kincheck, expected some. Write them there"
                f" first, such as by kincheck run --out {self.out / 'run'}."
            )
        made = report(self.out, found)
        refuse(write_all([(self.out / "index.html", page(made).encode())]))
        print_report(made, sys.stdout)
        return Status.DEVIATES if any(each.wrong for each in made.sections) else Status.WITHIN
