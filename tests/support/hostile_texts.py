"""Files made to harm: name, content, and a part of the message that refuses each."""

import json
import tomllib
import zipfile
from io import BytesIO

from kincheck.core.case.io import case_file
from kincheck.core.extensions.hardpoints.read import MOST_POINTS
from kincheck.core.extensions.trees.tree import MOST_LINKS, MOST_MOVING

from ..fuzz.reference import PROVED
from .case_texts import BASE, BY_FILE, edited

LARGEST = case_file.LARGEST_FILE
BOMB = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(9))
ZIP = BytesIO()
with zipfile.ZipFile(ZIP, "w", zipfile.ZIP_DEFLATED) as archive:
    archive.writestr("case.toml", "0" * 1_000_000)


def model(bodies: str, equalities: str = "") -> str:
    return f"<mujoco><worldbody>{bodies}</worldbody><equality>{equalities}</equality></mujoco>"


def filled(repeated: str, around: str = "{}", size: int = LARGEST // 10) -> str:
    """A text of a tenth of the largest size, at which what is quadratic takes minutes too."""
    return around.replace("{}", repeated * ((size - len(around)) // len(repeated)))


TEXTS: dict[str, tuple[str, str | bytes, str]] = {
    # numbers
    "beyond doubles": ("a.toml", edited(("start = -0.1", "start = 1e400")), "found inf"),
    "near their end": ("a.toml", edited(("start = -0.1", "start = 1e308")), "found 1e+308"),
    "denormal": ("a.toml", edited(("axis = [1.0,", "axis = [5e-324,")), "found 5e-324"),
    "ten thousand digits": (
        "a.toml",
        edited(("steps = 3", f"steps = {'9' * 10_000}")),
        "integer of thousands of digits",
    ),
    "as many in JSON": (
        "a.json",
        f'{{"schema": {"9" * 10_000}}}',
        "integer of thousands of digits",
    ),
    "millions in hexadecimal": (
        "a.toml",
        edited(("steps = 3", f"steps = 0x{'f' * 3_000_000}")),
        "a huge integer",
    ),
    "in a model": (
        "a.xml",
        model(f'<body pos="0 0 {"9" * 10_000}"><joint/></body>'),
        "expected 3 numbers",
    ),
    "in a table": ("a.csv", f"name,x,y,z\nwheel,1,2,{'9' * 10_000}\n", "expected a coordinate"),
    # nesting
    "deep lists in JSON": ("a.json", filled("[", size=LARGEST), "nested too deeply"),
    "deep tables in JSON": ("a.json", filled('{"a":'), "nested too deeply"),
    "deep lists": ("a.toml", filled("[", "a = {}"), "nested too deeply"),
    "deep tables": ("a.toml", filled("{a=", "a = {}"), "nested too deeply"),
    "a long key": (
        "a.toml",
        filled("a.", "{}a = 1"),
        "line 1: found a key nested more than 16 deep",
    ),
    "a long header": (
        "a.toml",
        filled('"a" . ', "# [a.a\n[{}a]"),
        "line 2: found a key nested more than 16 deep",
    ),
    "deep elements": ("a.xml", filled("<a>"), "nested more than 200 deep"),
    "deep bodies": ("a.xml", model(filled("<body>")), "nested more than 5000 deep"),
    # many
    "a million bodies": (
        "a.json",
        '{"bodies": {' + '"b": 1, ' * 1_000_000 + '"b": 1}}',
        "larger than 4000000 bytes",
    ),
    "bodies": (
        "a.json",
        json.dumps({**tomllib.loads(BASE), "bodies": {f"b{k}": {} for k in range(61_000)}}),
        "bodies: found 61000, expected 60000",
    ),
    "points in JSON": (
        "a.json",
        json.dumps({"schema": "kincheck-case/1", "points": {f"{k}": {} for k in range(50_000)}}),
        "name: missing",
    ),
    "bodies of a model": (
        "a.xml",
        model(filled("<body><joint/></body>")),
        f"more than the {MOST_MOVING} that are read",
    ),
    "fixed bodies of a model": (
        "a.xml",
        model(filled("<body/>")),
        f"more than the {MOST_LINKS} that are read",
    ),
    "many joints": (
        "a.xml",
        model("<body><joint/></body>" * 400),
        "degrees of freedom",
    ),
    "joints of a body": (
        "a.xml",
        model(f"<body>{filled('<joint/>')}</body>"),
        f"more than the {MOST_MOVING} that are read",
    ),
    "equalities": (
        "a.xml",
        model(
            '<body name="a"><joint type="ball"/></body>',
            filled('<connect body1="a" anchor="0 0 0"/>', size=LARGEST // 20),
        ),
        "degrees of freedom",
    ),
    "equalities of one name": (
        "a.xml",
        model(
            '<body name="a"><joint/></body>', '<connect name="c" body1="a" anchor="0 0 0"/>' * 5000
        ),
        "found 'c' again",
    ),
    "attributes": (
        "a.xml",
        "<mujoco " + " ".join(f'a{k}=""' for k in range(100_000)) + "/>",
        "has no body with a joint",
    ),
    "hardpoints": (
        "a.csv",
        "name,x,y,z\n" + "\n".join(f"p{k},1,2,3" for k in range(20_000)),
        f"{MOST_POINTS} at most",
    ),
    "hardpoints of Adams": (
        "a.sub",
        "[HARDPOINT]\n" + "\n".join(f"p{k} left 1 2 3" for k in range(20_000)),
        f"{MOST_POINTS} at most",
    ),
    "keys, one twice": (
        "a.json",
        json.dumps({f"{k}": 1 for k in range(100_000)})[:-1] + ', "7": 1}',
        "'7' is given twice",
    ),
    # texts
    "a long name": (
        "a.toml",
        BASE + f"[bodies.{'b' * 1_000_000}]",
        "1 to 200 printable characters",
    ),
    "a long reference": (
        "a.toml",
        edited(('["ground"', f'["{"ground" * 100_000}"')),
        "found a text of 600000 characters",
    ),
    "similar long names": (
        "a.xml",
        model(
            f'<body name="{"abcdefgh" * 100_000}"><joint/></body>',
            f'<connect body1="{"abcdefgi" * 100_000}" anchor="0 0 0"/>',
        ),
        "expected a body",
    ),
    "a long field": ("a.csv", f"name,x,y,z\n{'a' * 1_000_000},1,2,3\n", "line 2: not valid CSV"),
    "open comments": ("a.json", filled("/* "), "not valid JSON"),
    "open strings": ("a.json", '"' + filled('\\"')[:-100], "not valid JSON"),
    "open strings in TOML": ("a.toml", filled('"', "a = {}"), "not valid TOML"),
    "blanks": ("a.sub", filled(" ", "[UNITS]\nLENGTH = {}a'b'c"), "no row in a block"),
    # encodings
    "Latin-1": ("a.toml", BASE.replace("made up", "d\u00e9but").encode("latin-1"), "is not UTF-8"),
    "UTF-16": ("a.toml", BASE.encode("utf-16"), "is not UTF-8"),
    "null bytes": ("a.toml", BASE.encode() + b"\0" * 1000, "not valid TOML"),
    "empty": ("a.toml", "", "found none, expected"),
    "empty JSON": ("a.json", "", "not valid JSON"),
    "empty model": ("a.xml", "", "no element found"),
    "empty table": ("a.csv", "", "is empty"),
    "a mark alone": ("a.toml", b"\xef\xbb\xbf", "found none, expected"),
    **{
        f"an archive as {end}": (f"a{end}", ZIP.getvalue(), "a zip archive, expected text")
        for end in (".toml", ".json", ".csv", ".sub", ".xml", "")
    },
    # XML
    "document type": ("a.xml", "<!DOCTYPE mujoco>" + model(""), "<!DOCTYPE>"),
    "entities": (
        "a.xml",
        f'<!DOCTYPE m [<!ENTITY a0 "ha">{BOMB}]><mujoco>&a9;</mujoco>',
        "<!DOCTYPE>",
    ),
    "entity of a file": (
        "a.xml",
        '<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco>&a;</mujoco>',
        "<!DOCTYPE>",
    ),
    "unknown entity": ("a.xml", "<mujoco>&a;</mujoco>", "undefined entity"),
    "unknown encoding": (
        "a.xml",
        '<?xml version="1.0" encoding="foo"?>' + model(""),
        "no body with a joint",
    ),
    "wide encoding": (
        "a.xml",
        '<?xml version="1.0" encoding="utf-7"?>' + model(""),
        "no body with a joint",
    ),
    "include": ("a.xml", '<mujoco><include file="/etc/passwd"/></mujoco>', "no other is opened"),
    "a name that a terminal obeys": (
        "\x1b[2J\n.xml",
        model("<body><joint/></body>"),
        "control characters",
    ),
    # reference files: anything but a file in the folder of the case, or below
    **{
        f"reference {name!r}": ("a.toml", BASE + BY_FILE.replace("tip.csv", name), said)
        for name, said in {
            "../outside/tip.csv": "in the folder of the case file or below",
            "below/../../outside/tip.csv": "in the folder of the case file or below",
            "{outside}/tip.csv": "in the folder of the case file or below",
            "link.csv": "in the folder of the case file or below",
            "linked/tip.csv": "in the folder of the case file or below",
            "/dev/zero": "in the folder of the case file or below",
            "/dev/stdin": "in the folder of the case file or below",
            "/proc/self/environ": "in the folder of the case file or below",
            "loop.csv": "in the folder of the case file or below",
            "pipe.csv": "not a regular file",
            ".": "not a regular file",
            "below": "not a regular file",
            "a.toml": "line 10: not valid CSV",
            "a" * 300: "cannot be read",
            "a" * 9999: "cannot be read",
            "~/tip.csv": "no such file",
            "file:///etc/passwd": "no such file",
            "large.csv": "larger than 64000000 bytes",
            "lines.csv": "found 2000001 lines",
            "wide.csv": "found column names only",
            "deep.json": "maximum recursion depth",
            "words.json": "expected a decimal number",
        }.items()
    },
    "reference with a null": (
        "a.toml",
        BASE + BY_FILE.replace("tip.csv", "tip\\u0000.csv"),
        "printable",
    ),
}


def proved(text: str) -> str:
    return json.dumps(PROVED).replace('"1.5"', f'"{text}"')
