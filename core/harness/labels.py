"""Labels of numbers, units, engines and kinds of reference, for every report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import msgspec

from ..case.case import PER_TRAVEL, Truth
from ..errors import number_of, shortened
from ..trajectory import PER_TIME, QUANTITIES
from ..unit_text import unit_text, value_text
from .record import Facts, Outcome, Record, Results
from .table_units import in_table_units

TRUTHS = {
    Truth.CLOSED_FORM: "closed form",
    Truth.THIRD_PARTY_DATA: "third-party data",
    Truth.IN_HOUSE_ORACLE: "in-house oracle",
    Truth.CONSENSUS_ONLY: "consensus only",
}

NAMED = 8
"""Most cases or outputs named in a message; a table, the page or the JSON has all."""

UNMADE = "not run: the run ended before this pair"
"""Message of a planned pair without a record whose case can be read."""

_LABELS = {"half_track_change": "half-track change", "wheelbase_change": "wheel-base change"}


def engine_name(record: Record) -> str:
    """Return the label of the record's engine, as `product` names it."""
    return product(record.engine, record.mode)


def product(engine: str, mode: str) -> str:
    """Return the engine's name, with its mode unless the mode is projection: each mode is a
    separate product.
    """
    return engine if mode == "projection" else f"{engine} · {mode}"


def output_label(name: str) -> str:
    """Return an output's name as suspension engineers write it."""
    if name.endswith(PER_TRAVEL):
        return f"{output_label(name.removesuffix(PER_TRAVEL))} per travel"
    return _LABELS.get(name, name.replace("_", " "))


def signs(run: Mapping[str, Any]) -> list[str]:
    """Return one line for each sign convention, with its cases, from the circumstances of a run."""
    said: dict[str, list[str]] = {}
    for case, facts in run.get("cases", {}).items():
        if words := facts.get("signs"):
            said.setdefault(words, []).append(case)
    return [f"Signs of {', '.join(cases)}: {words}" for words, cases in said.items()]


def notes(run: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return cases and notes on their geometry, from the circumstances of a run."""
    return [
        (case, note)
        for case, facts in run.get("cases", {}).items()
        for note in facts.get("notes", ())
    ]


def suspects(results: Results) -> list[tuple[str, str]]:
    """Return the cases with a suspected reference or native engine, and the reason."""
    return [(case, each.message) for case, each in results.suspects.items()]


def unsound(record: Record) -> str:
    """Return the reason why the reference cannot validate although its kind could; empty if it
    can.
    """
    if not Truth(record.truth).validates or record.evidence is None or record.evidence.sound:
        return ""
    return "kincheck's own" if record.evidence.own else "uncited"


def account(record: Record) -> str:
    """Return the facts of a record beside its errors: what was solved and how well, the reasons for
    what is not known, times, its reference, and the sense of its outputs.
    """
    numbers = {
        "residual": record.residual_max,
        "rank": record.rank,
        "dof": record.dof,
        "iterations": record.iterations,
        "us/sample": record.us_per_step,
    }
    said = [f"{record.version or 'unknown version'}, {record.mode}, loop: {record.loop}"]
    said += [f"{record.solved} of {record.samples} samples"] * (record.samples is not None)
    said += [f"{name} {number(value)}" for name, value in numbers.items() if value is not None]
    said += [f"no {key}: {reason}" for key, reason in record.reasons.items()]
    if record.seconds is not None:
        times = msgspec.structs.asdict(record.seconds).items()
        said += [f"{name} {number(value)} s" for name, value in times if value is not None]
    if (own := record.evidence) is not None:
        units = (f"{name} [{unit}]" for name, unit in own.units.items())
        given = own.citation, own.signs, own.grid, *own.limits.values(), *units
        said += [
            f"reference {', '.join(filter(None, given)) or 'uncited'} ({own.of} {own.sha256[:12]})"
        ]
    said += [f"{name}: {each.sense}" for name, each in record.outputs.items() if each.sense]
    return "; ".join(said)


def unmade(results: Results) -> str:
    """Return the planned pairs without a record whose cases can be read; empty if there are
    none.
    """
    names = [
        f"{case} · {product(engine, mode)}"
        for case, engine, mode in results.missing
        if case not in results.unread
    ]
    return f"{UNMADE}: {shorten_names(names)}" if names else ""


def unread(run: Mapping[str, Any]) -> str:
    """Return the unreadable cases of a run, from its circumstances; empty if there are none."""
    names = run.get("unread", {})
    return f"{unread_count(len(names))}: {shorten_names([*names])}" if names else ""


def shorten_names(names: Sequence[str], between: str = ", ") -> str:
    """Return the names, or of many the first ones and the number of the others."""
    return shortened(names, NAMED, between)


def unread_count(count: int) -> str:
    """Return the phrase for a number of unreadable cases."""
    return f"{number_of(count, 'case')} could not be read"


def motion_unit(unit: str, motion: str) -> str:
    """Return the unit of a motion's derivative, e.g. m/s for a velocity in m."""
    return unit_text(unit + PER_TIME[QUANTITIES.index(motion)])


def displayed(unit: str, facts: Facts) -> tuple[str, float]:
    """Return the name of an SI unit as people read it, and the factor to it; see
    `in_table_units`.
    """
    text, size = in_table_units(unit, facts)
    return unit_text(text).replace("deg", "\N{DEGREE SIGN}"), 1.0 / size


def shown_text(value: float, unit: str, facts: Facts, form: str = "") -> str:
    """Return a number [SI] with its unit, as people read it; see `in_table_units`.

    Args:
        form: format of the number; by default that of `number`.
    """
    text, factor = displayed(unit, facts)
    return value_text(f"{factor * value:{form}}" if form else number(factor * value), text)


def shown_change(before: float, now: float, unit: str, facts: Facts) -> str:
    """Return two numbers [SI] with their unit, as people read them; see `in_table_units`."""
    _, factor = displayed(unit, facts)
    return f"{number(factor * before)} → {shown_text(now, unit, facts)}"


def number(value: float | None) -> str:
    """Return a number to three digits for a table; a dash if it was not computed."""
    if value is None:
        return "–"
    if value == 0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    mantissa, _, exponent = f"{value:.2e}".partition("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}" if exponent else mantissa


LINES, CHARACTERS = 5, 2000
"""Most lines and characters of an engine's message that a table or Markdown shows."""


def folded(message: str) -> str:
    """Return a message without its middle, if it is long; the JSON has it."""
    lines = message.splitlines()
    if len(lines) > LINES:
        left = f"[{len(lines) - LINES + 1} lines more, all in the JSON]"
        message = "\n".join([*lines[: LINES - 2], left, lines[-1]])
    if len(message) > CHARACTERS:
        left = f"[{len(message) - CHARACTERS} characters more, all in the JSON]"
        message = f"{message[: CHARACTERS // 2]} {left} {message[-CHARACTERS // 2 :]}"
    return message


def value_words(value: Any) -> Any:
    """Return a value of any type from a results file, in words."""
    if isinstance(value, Mapping):
        return (
            "; ".join(
                f"{key} {value_words(each)}"
                for key, each in cast("Mapping[str, Any]", value).items()
            )
            or "–"
        )
    if isinstance(value, list | tuple):
        return ", ".join(str(value_words(each)) for each in cast("Sequence[Any]", value)) or "–"
    if isinstance(value, float):
        return number(value)
    return "–" if value is None or value == "" else value


def against(name: str) -> str:
    """Return the label of a standard: a kind of reference in words, or an engine by its name."""
    kinds = {kind.value: words for kind, words in TRUTHS.items()}
    return kinds.get(name, name)


def validation(record: Record) -> str:
    """Return the label of the validation of a record; empty if there is none."""
    if not record.validated:
        return (
            f"{said}: not validated"
            if record.outcome is Outcome.PASS and (said := unsound(record))
            else ""
        )
    standards = {
        deviation.against for errors in record.errors.values() for _, deviation in errors.items()
    }
    whole = standards == {record.truth} and all(
        len(errors.items()) == len(QUANTITIES) for errors in record.errors.values()
    )
    return "validated" if whole else "validated, positions only"
