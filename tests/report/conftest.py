"""Reports in a browser."""

import pytest
from kincheck.core.report.report import write_report


@pytest.fixture
def browser(browser):
    """With a window that shows a whole page."""
    browser.resize(1200, 4000)
    return browser


@pytest.fixture
def visit(browser, tmp_path):
    """Writes a report, opens it, and returns what a script returns there."""

    def opened(run, act, **further):
        write_report(run, file := tmp_path / "report.html", **further)
        browser.visit(file.as_uri())
        return browser.run(f"await settled(); {act}")

    return opened
