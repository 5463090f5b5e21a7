"""Results as JUnit XML, for continuous integration: one test case per case, engine and output."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from ..errors import labelled
from ..harness.compare import describe
from ..harness.engine import STANDARD
from ..harness.labels import (
    UNMADE,
    account,
    against,
    engine_name,
    motion_unit,
    notes,
    suspects,
)
from ..harness.record import REFERENCE, Deviations, Facts, Outcome, Record, Results
from ..history.findings import Kind, Regressions
from ..history.store import Pair
from ..unit_text import motion_word
from .regressions import TITLES

COUNTS = {"tests": "testcase", "failures": "failure", "errors": "error", "skipped": "skipped"}
FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even escaped; a simulator's message may contain them."""

SUSPECTED = {
    REFERENCE: "suspect the reference rather than the engine: see the suite's output",
    STANDARD: f"suspect {STANDARD} rather than the engine: see the suite's output",
}
"""What to suspect, by the subject of a suspicion."""


def to_junit(results: Results) -> bytes:
    """Return the results as JUnit XML.

    A missing engine or feature, or an output without a verdict, is a skipped test with its reason.
    A pair without a record is an error.

    The output of a test holds every error with its tolerance, and the reasons for those that are
    missing; that of a suite the signs, the notes on its case's geometry, and the facts of its
    records.
    """
    root = ElementTree.Element("testsuites", name="kincheck")
    for case in dict.fromkeys(
        [*(record.case for record in results.records), *(case for case, _, _ in results.missing)]
    ):
        suite = ElementTree.SubElement(root, "testsuite", name=case)
        for record in results.records:
            if record.case == case:
                subject = results.suspects[case].subject if results.explains(record) else ""
                suspicion = f"; {SUSPECTED[subject]}" if subject in SUSPECTED else ""
                warm = record.seconds.warm if record.seconds else None
                for output, deviations in record.errors.items():
                    test = _test(suite, record.pair, output, warm or 0.0)
                    facts = results.run.get("cases", {}).get(case, {})
                    verdict, message = _verdict(record, output, deviations, facts)
                    if verdict:
                        ElementTree.SubElement(test, verdict, message=message + suspicion)
                    _write(test, _numbers(record, output, deviations))
        for name, engine, mode in results.missing:
            if name == case:
                test = _test(suite, (case, engine, mode), "not run")
                ElementTree.SubElement(test, "error", message=results.unread.get(case, UNMADE))
        facts = results.run.get("cases", {}).get(case, {})
        lines = [f"signs: {facts['signs']}"] if facts.get("signs") else []
        lines += [labelled(note) for named, note in notes(results.run) if named == case]
        lines += [f"suspect: {why}" for named, why in suspects(results) if named == case]
        for record in results.records:
            if record.case == case:
                said = "; ".join(filter(None, (record.message, account(record))))
                lines.append(f"{engine_name(record)}: {record.outcome.shown}: {said}")
        _write(suite, lines)
        count_tests(suite)
    ElementTree.indent(root)
    for element in root.iter():
        for key, text in element.attrib.items():
            element.set(key, FORBIDDEN.sub("\ufffd", text))
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def count_tests(suite: ElementTree.Element) -> None:
    """Set a suite's numbers of tests, failures, errors and skipped tests."""
    for count, tag in COUNTS.items():
        suite.set(count, str(sum(1 for _ in suite.iter(tag))))


def _write(element: ElementTree.Element, lines: Sequence[str]) -> None:
    """Add the output of a test or a suite, if there is any."""
    if lines:
        text = FORBIDDEN.sub("\ufffd", "\n".join(lines))
        ElementTree.SubElement(element, "system-out").text = text


def _numbers(record: Record, output: str, deviations: Deviations) -> list[str]:
    """Return a line for each error of an output, and the reason for those that are missing."""
    unit = record.outputs[output].unit if output in record.outputs else ""
    lines = [
        f"{motion_word(quantity, unit)}: {each.max_abs:.3g} of {each.tolerance:.3g}"
        f" {motion_unit(unit, quantity)}, rms {each.rms:.3g}, largest at sample {each.worst_step},"
        f" against {against(each.against)}"
        for quantity, each in deviations.items()
    ]
    return lines + [f"not compared: {deviations.reason}"] * bool(deviations.reason)


def _test(
    suite: ElementTree.Element, pair: Pair, name: str, seconds: float = 0.0
) -> ElementTree.Element:
    place = {"classname": ".".join(pair), "name": name, "time": f"{seconds:.6f}"}
    return ElementTree.SubElement(suite, "testcase", place)


def _verdict(record: Record, output: str, deviations: Deviations, facts: Facts) -> tuple[str, str]:
    """Return the element of a test case (none if it passed) and its message."""
    if record.outcome in (Outcome.UNJUDGED, Outcome.UNAVAILABLE, Outcome.UNSUPPORTED):
        return "skipped", f"{record.outcome.shown}: {record.message}"
    if record.outcome is Outcome.FAIL:
        (driver, values), *_ = record.driver.items()
        unit = record.outputs[output].unit
        off = [
            describe(output, quantity, each, driver, values, unit, facts)
            for quantity, each in deviations.items()
            if not each.within
        ]
        if deviations.lost and not off:
            off = [f"{output}: {deviations.reason}"]
        if deviations.contradicted:
            off.append(record.message)
        # missing samples concern every output, and so does a residual
        of_all = record.solved != record.samples or all(
            each.sound for each in record.errors.values()
        )
        off += [record.message] if of_all and not off else []
        if off:
            return "failure", "; ".join(off)
    elif record.outcome.bad:
        return "error", f"{record.outcome.shown}: {record.message}"
    if not deviations.items():
        return "skipped", f"{Outcome.UNJUDGED.shown}: {deviations.reason}"
    return "", ""


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
        if finding.kind is Kind.FAILURE or finding.pair in unmade:  # the XML has these already
            continue
        place, name = ".".join(finding.pair), finding.output or str(finding.kind)
        if finding.case not in suites:  # a case of the earlier run only
            suites[finding.case] = ElementTree.SubElement(root, "testsuite", name=finding.case)
        if (place, name) not in tests:
            tests[place, name] = _test(suites[finding.case], finding.pair, name)
        test = tests[place, name]
        message = FORBIDDEN.sub(
            "\ufffd", f"{TITLES.get(finding.kind, finding.kind)}: {finding.message}"
        )
        verdict = test.find("failure")
        if verdict is None:
            verdict = ElementTree.SubElement(test, "failure")
        verdict.set("message", "; ".join(filter(None, (verdict.get("message"), message))))
    for suite in suites.values():
        count_tests(suite)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
