"""Files made to harm: name, content, and a part of the message that refuses each."""

import json
import tomllib
import zipfile
from io import BytesIO

from kincheck.core.case.io import case_file

from ..fuzz.reference import PROVED
from .case_texts import BASE, BY_FILE, edited

LARGEST = case_file.LARGEST_FILE


def filled(repeated, around="{}", size=LARGEST // 10):
    """A text of a tenth of the largest size, at which what is quadratic takes minutes too."""
    return around.replace("{}", repeated * ((size - len(around)) // len(repeated)))


def archives(*ends):
    """A zip archive under other names."""
    with zipfile.ZipFile(packed := BytesIO(), "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("case.toml", "0" * 1_000_000)
    return {
        f"an archive as {end}": (f"a{end}", packed.getvalue(), "a zip archive, expected text")
        for end in ends
    }


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
    "open comments": ("a.json", filled("/* "), "not valid JSON"),
    "open strings": ("a.json", '"' + filled('\\"')[:-100], "not valid JSON"),
    "open strings in TOML": ("a.toml", filled('"', "a = {}"), "not valid TOML"),
    # encodings
    "Latin-1": ("a.toml", BASE.replace("made up", "d\u00e9but").encode("latin-1"), "is not UTF-8"),
    "UTF-16": ("a.toml", BASE.encode("utf-16"), "is not UTF-8"),
    "null bytes": ("a.toml", BASE.encode() + b"\0" * 1000, "not valid TOML"),
    "empty": ("a.toml", "", "found none, expected"),
    "empty JSON": ("a.json", "", "not valid JSON"),
    "a mark alone": ("a.toml", b"\xef\xbb\xbf", "found none, expected"),
    **archives(".toml", ".json", ""),
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
            "deep.json": "unknown field",
            "words.json": "expected a decimal number",
        }.items()
    },
    "reference with a null": (
        "a.toml",
        BASE + BY_FILE.replace("tip.csv", "tip\\u0000.csv"),
        "printable",
    ),
}


def proved(text):
    return json.dumps(PROVED).replace('"1.5"', f'"{text}"')
