"""The regression report as JUnit XML: one test case per case, engine and output, which fails for a
failure or a regression.
"""

from __future__ import annotations

from xml.etree import ElementTree

from ..harness.record import Results
from ..history.findings import Finding, Kind, Regressions
from .junit import FORBIDDEN, count_tests, to_junit


def to_regression_junit(results: Results, found: Regressions) -> bytes:
    """Return the XML of `to_junit`, with a failure for every regression of a passed pair.

    A finding on a pair as a whole (a lost phase, a time) is a separate test case, named by its
    kind.
    """
    root = ElementTree.fromstring(to_junit(results))
    tests = {(test.get("classname"), test.get("name")): test for test in root.iter("testcase")}
    suites = {suite.get("name"): suite for suite in root.iter("testsuite")}
    unmade = set(results.missing)
    for finding in found.regressions:
        pair = (finding.case, finding.engine, finding.mode)
        if finding.kind is Kind.FAILURE or pair in unmade:  # the XML has these already
            continue
        place = ".".join(pair)
        name = finding.output or str(finding.kind)
        if finding.case not in suites:  # a case of the earlier run only
            suites[finding.case] = ElementTree.SubElement(root, "testsuite", name=finding.case)
        if (place, name) not in tests:
            tests[place, name] = ElementTree.SubElement(
                suites[finding.case], "testcase", classname=place, name=name, time="0.000000"
            )
        _fail(tests[place, name], finding)
    for suite in suites.values():
        count_tests(suite)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _fail(test: ElementTree.Element, finding: Finding) -> None:
    message = FORBIDDEN.sub("\ufffd", f"{finding.kind}: {finding.message}")
    verdict = test.find("failure")
    if verdict is None:
        verdict = ElementTree.SubElement(test, "failure")
    verdict.set("message", "; ".join(filter(None, (verdict.get("message"), message))))
