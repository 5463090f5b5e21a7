"""Whatever a case file holds: a case or a CaseError."""

import json
import tomllib
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kincheck.core.case.io.case_file import load_case
from kincheck.core.errors import CaseError

from ..support.case_texts import BASE, BY_FILE, INLINE, write
from .test_broken_motions import DRIVEN

ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["ground", "revolute", "slider"]),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=8,
)

FUZZ = settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def read_or_refuse(file: Path) -> None:
    try:
        case = load_case(file)
    except CaseError as error:
        assert str(error).startswith(str(file))  # noqa: PT017
        str(error).encode()
    else:
        assert case.outputs
        assert np.isfinite(case.sweep.values).all()


@FUZZ
@given(
    data=st.binary(max_size=60)
    | st.text(max_size=60).map(lambda text: text.encode(errors="surrogatepass"))
)
def test_garbage(tmp_path: Path, data: bytes):
    for name in ("case.toml", "case.json", "case"):
        read_or_refuse(write(tmp_path, data, name))


@FUZZ
@given(
    cut=st.integers(0, len(BASE + INLINE)), length=st.integers(0, 12), instead=st.text(max_size=4)
)
def test_damaged_text(tmp_path: Path, cut: int, length: int, instead: str):
    text = BASE + INLINE
    read_or_refuse(
        write(
            tmp_path, (text[:cut] + instead + text[cut + length :]).encode(errors="surrogatepass")
        )
    )


def places(value: object, path: tuple[object, ...] = ()) -> list[tuple[object, ...]]:
    inside = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    return [path] * bool(path) + [
        place for key, each in inside for place in places(each, (*path, key))
    ]


PLACES = [
    (text, place) for text in (BASE + INLINE, DRIVEN) for place in places(tomllib.loads(text))
]


@FUZZ
@given(place=st.sampled_from(PLACES), value=ANYTHING)
def test_wrong_values_anywhere(
    tmp_path: Path, place: tuple[str, tuple[object, ...]], value: object
):
    text, place = place
    document = tomllib.loads(text)
    *way, last = place
    inside: object = document
    for key in way:
        inside = inside[key]  # type: ignore[index]
    inside[last] = value  # type: ignore[index]
    read_or_refuse(write(tmp_path, json.dumps(document), "case.json"))


@FUZZ
@given(rows=st.lists(st.lists(st.floats() | st.text(max_size=5), max_size=4), max_size=5))
def test_wrong_reference_files(tmp_path: Path, rows: list[list[object]]):
    lines = "\n".join(",".join(map(str, row)) for row in rows)
    write(
        tmp_path, ("push,tip_x,tip_x.velocity\n" + lines).encode(errors="surrogatepass"), "tip.csv"
    )
    try:
        load_case(write(tmp_path, BASE + BY_FILE))
    except CaseError as error:
        assert "tip.csv" in str(error)  # noqa: PT017
