"""Messages on files of TOML, JSON and YAML give the line of the key."""

import json
import random
import re

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kincheck import CaseError
from kincheck.core.case.io.case_file import load_case
from kincheck.core.case.io.document import Section, fault, parse_json
from kincheck.core.case.io.lines import join, keys_of, line_of

from ..support.case_texts import edited, line_with, write
from ..support.sources import ROOT

NAMES = st.text("ab-_\" '#=]{}:,é\\", min_size=1, max_size=4).filter(lambda x: x == x.strip())
TREES = st.recursive(
    st.just(0),
    lambda inner: (
        st.lists(inner, min_size=1, max_size=3)
        | st.dictionaries(NAMES, inner, min_size=1, max_size=4)
    ),
    max_leaves=12,
)


def numbered(tree, path="", numbers=None):
    """The tree with a number of its own at each leaf, and the number at each path."""
    numbers = {} if numbers is None else numbers
    if isinstance(tree, dict):
        return {k: numbered(v, join(path, k), numbers)[0] for k, v in tree.items()}, numbers
    if isinstance(tree, list):
        return [numbered(v, f"{path}[{k}]", numbers)[0] for k, v in enumerate(tree)], numbers
    numbers[path] = 1000 + len(numbers)
    return numbers[path], numbers


def toml(tree, rng, heading=""):
    """Tables below headings or in braces, lists in one line or in many, with comments between."""
    lines, below = [], []
    for name, value in tree.items():
        key = json.dumps(name, ensure_ascii=False)
        if isinstance(value, dict) and rng.random() < 0.7:
            path = f"{heading}.{key}" if heading else key
            below += [f"[{path}] # [no]", *toml(value, rng, path)]
        elif isinstance(value, list) and all(isinstance(x, dict) for x in value) and not heading:
            for each in value:
                below += [f"[[{key}]]", *toml(each, rng, key)]
        else:
            lines += ["# a = 1", f"{key} = {in_line(value, rng)}"]
    return [*lines, *below]


def in_line(value, rng):
    if isinstance(value, dict):
        pairs = (
            f"{json.dumps(k, ensure_ascii=False)} = {in_line(v, rng)}" for k, v in value.items()
        )
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, list):
        between = rng.choice([", ", ",\n", ", # ] \n"])
        return f"[{between.join(in_line(each, rng) for each in value)}]"
    return str(value)


@settings(deadline=None, max_examples=50)
@given(st.dictionaries(NAMES, TREES, min_size=1, max_size=4), st.integers(0, 9))
def test_each_key_has_its_line(tree, seed):
    tree, numbers = numbered(tree)
    rng = random.Random(seed)
    for text, root in ((json.dumps(tree, indent=1), ""), ("\n".join(toml(tree, rng)), None)):
        for path, number in numbers.items():
            assert line_of(path, keys_of(text, root)) == line_with(text, number), (path, text)


@pytest.mark.needs("yaml")
@settings(deadline=None, max_examples=25)
@given(st.dictionaries(NAMES, TREES, min_size=1, max_size=4), st.booleans())
def test_yaml_key_has_its_line(tmp_path_factory, tree, flow):
    yaml = pytest.importorskip("yaml")
    tree, numbers = numbered(tree)
    file = tmp_path_factory.mktemp("a") / "a.yaml"
    text = yaml.safe_dump(tree, default_flow_style=flow, allow_unicode=True)
    file.write_text(text, "utf-8")
    for path, number in numbers.items():
        assert str(fault(file, path, "x")) == f"{file}: line {line_with(text, number)}: {path}: x"


def test_lost_key_gets_table_line(tmp_path):
    file = write(tmp_path, '[a]\nb = 1\n[joints.pin]\ntype = "x"\n', "a.toml")
    assert str(fault(file, "joints.pin.bodies", "lost")) == (
        f"{file}: line 3: joints.pin.bodies: lost"
    )
    assert str(fault(file, "joints", "lost")) == f"{file}: line 3: joints: lost"
    assert str(fault(file, "outputs", "lost")) == f"{file}: outputs: lost"
    assert str(fault(tmp_path / "gone.toml", "a", "lost")).endswith("gone.toml: a: lost")


@pytest.mark.parametrize(
    "name", [path.stem for path in sorted((ROOT / "cases").glob("*.toml"))[::7]]
)
def test_planted_key_is_named(tmp_path, name):
    text = (ROOT / "cases" / f"{name}.toml").read_text()
    heads = [*re.finditer(r"^\[[\w.\"]+\].*\n", text, re.MULTILINE)]
    for head in random.Random(name).sample(heads, min(3, len(heads))):
        planted = f"{text[: head.end()]}zq_unknown = {{}}\n{text[head.end() :]}"
        line = text.count("\n", 0, head.end()) + 1
        with pytest.raises(
            CaseError, match=rf"case\.toml: line {line}: [\w.]*zq_unknown: "
        ) as found:
            load_case(write(tmp_path, planted))
        assert "case.toml" in str(found.value)


def test_key_twice_is_named_with_line(tmp_path):
    file = write(tmp_path, edited(("rate = 2.0", "rate = 2.0\nrate = 2.0")))
    line = file.read_text().splitlines().index("rate = 2.0") + 2
    with pytest.raises(CaseError, match=f"line {line}, column"):
        load_case(file)


@settings(deadline=None, max_examples=25)
@given(st.dictionaries(NAMES, TREES, min_size=1, max_size=4), st.integers(0, 9))
def test_json_key_twice_has_line(tree, seed):
    rows = json.dumps(tree, indent=1).splitlines()
    keys = [k for k, row in enumerate(rows) if re.match(r' *+"(?!.*\[\d+\]).*": 0,?$', row)]
    assume(keys)
    k = random.Random(seed).choice(keys)
    text = "\n".join([*rows[:k], f"{rows[k].rstrip(',')},", *rows[k:]])
    with pytest.raises(CaseError, match=rf"JSON: line {k + 2}: the key .+ is given twice"):
        parse_json(ROOT / "a.json", text)


def test_section_is_named_with_line(tmp_path):
    file = write(tmp_path, "[a]\n[a.b]\nc = 1\n", "a.toml")
    section = Section(file, "", {"a": {"b": {"c": 1}}}).at("a").at("b")
    with pytest.raises(CaseError, match=r"a\.toml: line 3: a\.b\.c: unknown key"):
        section.require_keys(["d"])
