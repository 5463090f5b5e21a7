"""Reports in a browser."""

import pytest
from kincheck.core.report.report import write_report

from ..support.browser import CHROMIUM, Browser


@pytest.fixture
def browser(tmp_path):
    """A browser whose window shows a whole page; anything on its console is a failure."""
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    browser = Browser(tmp_path / "profile", (1200, 4000))
    yield browser
    complaints = browser.complaints()
    browser.close()
    assert complaints == []


@pytest.fixture
def visit(browser, tmp_path):
    """Writes a report, opens it, and returns what a script returns there."""

    def opened(run, act, **further):
        write_report(run, file := tmp_path / "report.html", **further)
        browser.visit(file.as_uri())
        return browser.run(f"await settled(); {act}")

    return opened
