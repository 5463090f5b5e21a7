"""Words of tables in several languages: meanings of names of points, keys and free texts, by the
lists of `words.toml`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import zip_longest
from pathlib import Path
from typing import Any

from ...case.io.document import decimal, fault, shown
from ...case.io.table import folded, numeral, read_unit
from ...case.units import LENGTHS
from ...errors import similar
from .table import STATIC_ANGLES, is_axes, length_name
from .templates import TEMPLATE_NAMES, compact, corner_of, normal, side_of

_WRITTEN: Mapping[str, Any] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
_FACTS: Mapping[str, str] = {
    normal(word): fact for fact, words in _WRITTEN["fact"].items() for word in words
}
_FACT = re.compile(r"#?\s*([^:=,：;]+?)\s*(?:[\[(]([^\])]*)[\])])?\s*[:=,：;]+\s*(.+)")
_MEASURE = re.compile(r"([-+−]?(?:\d+[.,]?\d*|[.,]\d+))[\s,;]*[\[(]?([^\d\s,;\])]*)[\])]?")
# Two words are one with a typing error.
_SLIP = 0.75
# Shorter words stand by themselves, unless they are Chinese.
SHORT = 3
# Texts whose meanings are kept: those of a table that is read at each edit.
TEXTS = 4096
_PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[^\W_]+")
_AXIS = re.compile(r"(?<![^\W_])([xyz])(?![^\W_])")


@lru_cache(TEXTS)
def said(text: str, kind: str) -> Sequence[str]:
    """Return the meanings in a text, in the order of its words.

    Args:
        kind: list of words, such as "name".
    """
    plain = folded(text, str).replace("ß", "ss")
    rest = f" {' '.join(_PARTS.findall(plain)).lower()} "
    found = list[tuple[int, str]]()
    for word, meanings in _by_length(kind):
        alone = word.isascii() and len(word) <= SHORT
        form = rf"(?<= ){re.escape(word)}(?= )" if alone else re.escape(word)
        if match := re.search(form, rest):
            found += [(match.start(), each) for each in meanings]
            rest = re.sub(form, lambda each: "*" * len(each[0]), rest)
    return tuple(meaning for _, meaning in sorted(found))


@cache
def _by_length(kind: str) -> Sequence[tuple[str, Sequence[str]]]:
    """Return the words of a list with their meanings, long ones first."""
    found = dict[str, list[str]]()
    for meaning, words in _WRITTEN[kind].items():
        for word in words:
            found.setdefault(word, []).append(meaning)
    return sorted(found.items(), key=lambda each: -len(each[0]))


def side_in(name: str) -> str:
    """Return the side in a point's name, at either end or in words; empty without one."""
    found = {*said(name, "name")} & {"left", "right"}
    return side_of(name)[1] or (found.pop() if len(found) == 1 else "")


def by_words(names: Collection[str], side: str) -> Callable[[str], list[str]]:
    """Return the function from a role to the names of its points, by their meaning.

    Args:
        side: of the wheel; names of the other one are left out.
    """
    other = "right" if side == "left" else "left"
    says = {name: {*said(name, "name")} for name in names}
    says = {name: words for name, words in says.items() if other not in words}
    for words in says.values():
        if "ball" in words and not words & {*_WRITTEN["parts"]["words"]}:
            words.add("arm")
    if not any({"arm", "upper"} <= words for words in says.values()):  # one arm, the lower one
        for words in says.values():
            words |= {"lower"} if "arm" in words else {*""}

    def found(role: str) -> list[str]:
        parts = _WRITTEN["role"].get(role, "").split()
        wanted = [{*each.split("|")} for each in parts if not each.startswith("-")]
        without = {each[1:] for each in parts if each.startswith("-")}
        return [
            name
            for name, words in says.items()
            if parts and all(words & each for each in wanted) and not words & without
        ]

    return found


def fact_of(text: str) -> tuple[str, str] | None:
    """Return the fact in a comment, a title or a row, `units: mm`, as its name and its value; None
    without.
    """
    found = _FACT.fullmatch(text.strip())
    return fact(found[1], f"{found[3].strip()} {found[2] or ''}".strip()) if found else None


def require_no_slip(file: Path, where: str, comment: str) -> None:
    """Refuse a comment that states a fact by a misspelt name, "wheel_raduis: 300 mm", or a known
    one by no measure: the fact would be missing without a word.
    """
    found = _FACT.fullmatch(comment.strip())
    if found is None or fact_of(comment):
        return
    key, value = normal(found[1]), found[3].strip()
    close = similar(key, (each for each in _FACTS if abs(len(each) - len(key)) <= 1), _SLIP)
    name = _FACTS.get(close, "")
    measured = name in (*STATIC_ANGLES, "wheel_radius") and re.match(r"[-+−]?[.,]?\d", value)
    plain = (name == "unit" and value in LENGTHS) or (name == "axes" and is_axes(value))
    if measured or plain or (name == "template" and compact(value) in TEMPLATE_NAMES):
        expected = f"{close!r}" if close != key else "a number with its unit"
        raise fault(
            file,
            where,
            f"found {shown(comment.strip())}, expected {expected}. Correct it, or write it without"
            " a colon",
        )


def fact(key: str, value: str) -> tuple[str, str] | None:
    """Return the fact of a key and its value in English words: angles in degrees, as "0.2", lengths
    with their unit if they have one; None for the key of none.
    """
    name = _FACTS.get(normal(key))
    if name == "side":
        corner = corner_of(value, "side") or corner_of(value)
        return name, (corner or ("", ""))[1] or value
    if name == "axes":
        words = [said(part, "direction")[:1] for part in re.split("[,;/、，]", value)]
        each = ",".join(word for found in words for word in found)
        return name, value if is_axes(value) else axes_said(value) or each or value
    if name == "template":
        return name, value if compact(value) in TEMPLATE_NAMES else template_said(value) or value
    if name in (*STATIC_ANGLES, "wheel_radius"):
        measured = _MEASURE.fullmatch(value)
        if measured is None:
            return None
        number = decimal(numeral(measured[1], "," if "," in measured[1] else "."))
        unit = length_name(measured[2])
        if name == "wheel_radius":
            return (name, f"{number!r}{unit}") if unit in ("", *LENGTHS) else None
        degree = read_unit("deg")
        angle = read_unit(unit) if unit else degree
        if angle is None or degree is None or angle[1] != degree[1]:
            return None
        return name, repr(number * angle[0].size / degree[0].size)
    return (name, value) if name else None


def unit_said(text: str) -> str:
    """Return the unit of length in a free text such as "alle Maße in mm"; empty without one."""
    units = "|".join(sorted(LENGTHS, key=len, reverse=True))
    found = re.search(rf"(?:\b(?:in|en)\s+|[\[(]\s*)({units})\b(?!\s*/)", text.lower())
    return found[1] if found else ""


def axes_said(text: str) -> str:
    """Return the axes in a free text: "x nach hinten, y nach rechts, z nach oben" is
    "rearward,right,up"; empty unless each axis has one direction.
    """
    plain = folded(text).replace("_", " ")
    found = dict(_directions(plain))
    return ",".join(found[axis] for axis in "xyz") if found.keys() == {*"xyz"} else ""


def _directions(plain: str) -> Iterator[tuple[str, str]]:
    places = [*_AXIS.finditer(plain)]
    for place, after in zip_longest(places, places[1:]):
        part = plain[place.end() : after.start() if after else len(plain)]
        words = [*dict.fromkeys(said(part, "direction"))]
        if len(words) == 1:
            yield place[1], words[0]


def template_said(text: str) -> str:
    """Return the template in a free text; empty without one, or with several."""
    found = {*said(text, "template")}
    return found.pop() if len(found) == 1 else ""


def first_said(read: Callable[[str], str], texts: Iterable[str]) -> str:
    """Return the first answer of a function on texts; empty without one."""
    return next((found for each in texts if (found := read(each))), "")
