"""What a file has is read, listed as left out, or stops the run by name: in every format, whatever
is planted anywhere.

For more random models, and plants at more places:

    KINCHECK_MODELS=10 pytest tests/extensions/trees/test_ledger.py
"""

import importlib.util
import os
import random
import re
from xml.etree import ElementTree

import pytest
from kincheck.core.case.models.files import load
from kincheck.core.errors import CaseError
from kincheck.core.extensions.trees.reader import read_tree

from ...support import osim_texts
from ...support.case_texts import write
from ...support.model_files import GRIPPER, driven
from ...support.random_models import FORMATS, random_robot

MODELS = int(os.environ.get("KINCHECK_MODELS", "1"))
PLACES = 8 * MODELS
NAME = "zq_unknown"
XML = {kind: write_as for kind, write_as in FORMATS.items() if kind != "USD"}
OSIM = osim_texts.model(
    ["<Body name='a'><FrameGeometry><scale_factors>1 1 1</scale_factors></FrameGeometry></Body>"],
    [
        osim_texts.joint(
            *("PinJoint", "A", "", "a"),
            osim_texts.coordinate(
                "A", inside="<prescribed_function><Constant/></prescribed_function>"
            ),
        )
    ],
    more="<ControllerSet><objects/><groups/></ControllerSet>",
)
FIXED = {
    "OpenSim": {"osim": osim_texts.FOUR_BAR},
    "OpenSim with settings": {"osim": OSIM},
    "gripper": {"xml": GRIPPER.read_text()},
}
HAS_USD = importlib.util.find_spec("pxr") is not None


def texts_of(kind, seed):
    """The files of a model, the model itself first."""
    return FIXED[kind] if kind in FIXED else FORMATS[kind](random_robot(seed))


def written(folder, texts):
    for ending, text in texts.items():
        write(folder, text, f"model.{ending}")
    return folder / f"model.{next(iter(texts))}"


def contents(text):
    """Number of elements, attributes and texts, by another parser."""
    root = ElementTree.fromstring(text)
    count = len(re.findall(r"\sxmlns(?::\w+)?=", text))
    for each in root.iter():
        own = [each.text, *(child.tail for child in each)]
        count += 1 + len(each.attrib) + bool("".join(filter(None, own)).strip())
    return count


OF_OSIM = pytest.mark.needs("osim")
KINDS = [
    pytest.param(kind, marks=OF_OSIM) if kind.startswith("OpenSim") else kind
    for kind in (*XML, *FIXED)
]


@pytest.mark.parametrize("kind", KINDS)
def test_account_adds_up(kind, tmp_path):
    if "YAML" in kind:
        pytest.importorskip("yaml")
    for seed in range(MODELS):
        texts = texts_of(kind, seed)
        tree = read_tree(written(tmp_path, texts))
        assert tree.account.read + tree.account.left == contents(next(iter(texts.values())))
        assert tree.account.read > tree.account.left or kind == "gripper"


def said(file):
    """What is said of a file: why it is refused, or what is left out."""
    try:
        tree = read_tree(file)
    except CaseError as error:
        return str(error)
    unread = (f"inertial of {link}" for link in tree.unweighed)  # a case lists these
    return "\n".join([*tree.left_out, *tree.notes, *unread])


def is_listed(said, tags):
    """Whether one of some elements is listed, with all in it."""
    wanted = "|".join(map(re.escape, tags))
    line = rf"(?:\w+: )?(?:{wanted})s?|(?:{wanted}) of \w+|joints of what stands still"
    lines = [*said.splitlines(), *re.findall(r"equalities that are not active", said)]
    return any(re.fullmatch(line, each) for each in lines)


PLANTS = {
    "element": lambda each: each.append(ElementTree.Element(NAME)),
    "foreign element": lambda each: each.append(ElementTree.Element(f"acme:{NAME}")),
    "attribute": lambda each: each.set(NAME, "1"),
    "foreign attribute": lambda each: each.set(f"acme:{NAME}", "1"),
    "text": lambda each: setattr(each, "text", f"{each.text or ''}{NAME}"),
}


def places(root, rng):
    """Some elements of a document, each with the tags around it."""
    above = {child: parent for parent in root.iter() for child in parent}
    every = [*root.iter()]
    for each in rng.sample(every, min(PLACES, len(every))):
        chain = [each]
        while chain[-1] in above:
            chain.append(above[chain[-1]])
        yield each, [x.tag for x in chain]


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("kind", KINDS)
def test_planted_name_is_named(kind, plant, tmp_path):
    if "YAML" in kind:
        pytest.importorskip("yaml")
    for seed in range(MODELS):
        texts = dict(texts_of(kind, seed))
        first, text = next(iter(texts.items()))
        text = text.replace("drake:", "drake-")  # a prefix that the other parser would resolve
        for k in range(min(PLACES, sum(1 for _ in ElementTree.fromstring(text).iter()))):
            root = ElementTree.fromstring(text)
            (each, tags), *_ = places(root, random.Random(1000 * seed + k))
            PLANTS[plant](each)
            planted = ElementTree.tostring(root, "unicode").replace("drake-", "drake:")
            told = said(written(tmp_path, {**texts, first: planted}))
            assert NAME in told or is_listed(told, tags), (tags, told)


def misspelt(word):
    """The word with two letters exchanged, the last ones that differ."""
    k = max((k for k in range(1, len(word)) if word[k] != word[k - 1]), default=0)
    return word[: k - 1] + word[k] + word[k - 1] + word[k + 1 :] if k else word


@pytest.mark.parametrize("kind", KINDS)
def test_misspelt_name_is_named(kind, tmp_path):
    """Or the run stops at what is missing in its place."""
    if "YAML" in kind:
        pytest.importorskip("yaml")
    texts = dict(texts_of(kind, 0))
    first, text = next(iter(texts.items()))
    text = text.replace("drake:", "drake-")
    right = said(written(tmp_path, texts))
    for k in range(2 * PLACES):
        rng, root = random.Random(k), ElementTree.fromstring(text)
        (each, tags), *_ = places(root, rng)
        if each is root or (each.attrib and rng.random() < 0.6):
            old = rng.choice([*each.attrib] or [""])
            new = misspelt(old)
            each.attrib = {new if key == old else key: x for key, x in each.attrib.items()}
        else:
            old, new = each.tag, misspelt(each.tag)
            each.tag = new
        if old == new or each is root:
            continue
        planted = ElementTree.tostring(root, "unicode").replace("drake-", "drake:")
        told = said(written(tmp_path, {**texts, first: planted}))
        stops = "model." in told and told != right
        assert new in told or stops or is_listed(told, tags), (old, new, tags, told)


def contents_of_usd(text):
    """Number of prims and of what they and the stage say, by their text. The reader adds a prim's
    name, path, schemas, place and variants, and five facts of the stage; a place is its operations.
    """
    prims = len(re.findall(r"^def ", text, re.MULTILINE))
    inside = re.sub(r"^def [^{]*", "", text.partition(")")[2], flags=re.MULTILINE)
    said = [each[1] for each in re.finditer(r"(\S+)(?:\.timeSamples)? = ", inside)]
    return 1 + 5 + 6 * prims + sum(not each.startswith("xformOp") for each in said)


ODD = {"float2": "(1, 2)", "double[]": "[1, 2]", "matrix2d": "((1, 0), (0, 1))"}
"""Values of kinds that no reader asks for."""


@pytest.mark.skipif(not HAS_USD, reason="usd-core is not installed")
@pytest.mark.needs("usd")
def test_account_of_usd_adds_up(tmp_path):
    for seed in range(MODELS):
        text = next(iter(FORMATS["USD"](random_robot(seed)).values()))
        more = "".join(f"{kind} acme:{kind[0]} = {value}\n" for kind, value in ODD.items())
        for planted in ("", more, "float physics:mass = 2\n"):
            *_, head = re.finditer(r"def Xform \"a0\"[^{]*\{\n", text)
            said = text[: head.end()] + planted + text[head.end() :]
            account = read_tree(written(tmp_path, {"usda": said})).account
            assert account.read + account.left == contents_of_usd(said)
            assert account.read > account.left


@pytest.mark.skipif(not HAS_USD, reason="usd-core is not installed")
@pytest.mark.needs("usd")
def test_planted_usd_is_named(tmp_path):
    text = next(iter(FORMATS["USD"](random_robot(0)).values()))
    heads = [*re.finditer(r"def (\w+) \"\w+\" *(\([^)]*\))?\s*\{", text)]
    assert len(heads) > 4
    for found in heads:
        moves = "Joint" in found[1] or "RigidBody" in (found[2] or "")
        for line, always in (
            (f"float physics:{NAME} = 1", True),
            (f"float acme:{NAME} = 1", moves),
            (f"custom float {NAME} = 1", moves),
            (f"float2 physics:{NAME} = (1, 2)", True),
            (f'token[] acme:{NAME} = ["a"]', moves),
            (f'def Physics{NAME} "p" {{}}', True),
            (f'def {NAME} "p" {{}}', True),
        ):
            planted = f"{text[: found.end()]}\n{line}\n{text[found.end() :]}"
            told = said(written(tmp_path, {"usda": planted}))
            assert NAME in told or not always, (found[0], line)


def test_joint_takes_no_foreign_element(tmp_path):
    """It may mean where the joint is; a link has such elements for other programs."""
    text = """<sdf version="1.9" xmlns:acme="acme"><model name="m"><link name="arm">{0}</link>
    <joint name="pin" type="revolute"><parent>world</parent><child>arm</child>{1}
    <axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"""
    planted = "<acme:offset>0.5 0 0</acme:offset>"
    with pytest.raises(CaseError, match="<acme:offset>: unknown in <joint>"):
        load(write(tmp_path, text.format("", planted), "m.sdf"), driven("pin:0:1:3"))
    case = load(write(tmp_path, text.format(planted, ""), "m.sdf"), driven("pin:0:1:3"))
    assert "acme:offset (1)" in case.source
