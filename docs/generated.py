"""Reference pages made from the code: command line, keys and types of case files, joints and
engines.
"""

import argparse
import inspect
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import kincheck
from kincheck.core.case.io import schema
from kincheck.core.case.io.catalogue import output_tables, type_tables
from kincheck.core.cli.main import parser as parser_of
from kincheck.core.doors import offers

ROOT = Path(__file__).parent.parent
SHARED = {
    "hardpoints": "Hardpoint tables",
    "models": "Models",
    "isolation": "Isolation",
}
"""Groups of options that several commands have, by their title in the help."""


def PAGES() -> dict[str, str]:  # noqa: N802
    """Return the generated pages by address."""
    return {
        "reference/command-line.md": command_line(),
        "reference/case-file.md": case_file(),
        "reference/types.md": types(),
        "project/changes.md": (ROOT / "CHANGELOG.md").read_text("utf-8"),
    }


def command_line() -> str:
    """Return the page of all commands and options, from their parsers."""
    parser = parser_of([])
    (commands,) = (each for each in parser._actions if isinstance(each, argparse._SubParsersAction))
    helps = {each.dest: each.help or "" for each in commands._choices_actions}
    shared: dict[str, list[str]] = {}
    parts = [
        "# Command line",
        "The command is `kincheck`, or `python -m kincheck`. This page is made from the help of"
        " each command. [Exit statuses](judging.md#exit-status) are explained on a page of their"
        " own.",
        _table(
            ("Command", "Purpose"),
            [(f"[`{name}`](#{name})", f"{helps[name]}") for name in commands.choices],
        ),
    ]
    for name, each in commands.choices.items():
        parts += [f"## {name}", *_command(each, shared)]
    for title, lines in shared.items():
        parts += [f"## {SHARED[title]} {{ #{title} }}", *lines]
    return "\n\n".join(parts) + "\n"


def _command(parser: argparse.ArgumentParser, shared: dict[str, list[str]]) -> Iterator[str]:
    usage = parser.format_usage().removeprefix("usage: ").rstrip()
    yield f"```text\n{' '.join(usage.split())}\n```"
    if parser.description:
        yield " ".join(parser.description.split())
    for group in parser._action_groups:
        actions = [each for each in group._group_actions if each.dest != "help"]
        nested = [each for each in actions if isinstance(each, argparse._SubParsersAction)]
        rows = [_row(each) for each in actions if each not in nested]
        title = group.title or ""
        if title in SHARED and rows:
            lines = [group.description] if group.description else []
            shared.setdefault(title, [*lines, _table(("Option", "Meaning"), rows)])
            yield f"Also: [{SHARED[title].lower()}](#{title})."
        elif rows:
            yield _table(("Option", "Meaning"), rows)
        for each in nested:
            for name, sub in each.choices.items():
                yield f"### {parser.prog.split()[-1]} {name}"
                yield from _command(sub, shared)


def _row(action: argparse.Action) -> tuple[str, str]:
    name = ", ".join(action.option_strings)
    value = action.metavar or (action.choices and "{" + ",".join(map(str, action.choices)) + "}")
    value = value if action.nargs != 0 and value else "" if name else action.dest
    several = " ..." if action.nargs in ("*", "+") else ""
    help_text = (action.help or "") % {"default": action.default, "prog": "kincheck"}
    return f"`{' '.join(filter(None, [name, f'{value}{several}'.strip()]))}`", help_text


def case_file() -> str:
    """Return the page of the keys of case files, and of other files that extensions read."""
    parts = [
        "# Case files",
        "A case file describes a mechanism, its motion, its outputs and their reference. This page"
        " is made from the modules that read the files. `kincheck list --schema` prints the same"
        " text, and `kincheck schema case` a JSON Schema for editors.",
        "To complete and check keys while you write, save the schema once:\n\n"
        "```sh\nkincheck schema case > kincheck-case.json\n```\n\n"
        "and name it in the first line of a case file, for editors with the Even Better TOML"
        " extension or `taplo`: `#:schema ./kincheck-case.json`.",
    ]
    _, _, cases = (schema.__doc__ or "").partition("Reference. ")
    sections, _, loads = cases.partition(
        "Masses and loads of a case file: their keys, and their numbers in SI.\n\n"
    )
    for title, text in (
        ("All keys", sections),
        ("Masses, gravity and forces", loads),
        *(
            (f"{kind.capitalize()} files", each.load().partition("Reference. ")[2])
            for kind, each in offers("keys").items()
        ),
    ):
        prose, _, keys = text.partition("\n\n    ")
        parts += [f"## {title}", " ".join(prose.split()), f"```text\n{_dedented(keys)}\n```"]
    return "\n\n".join(parts) + "\n"


def _dedented(keys: str) -> str:
    return "\n".join(line.removeprefix("    ") for line in keys.rstrip().splitlines())


HEADS = {
    "joints: type": ("Joints", ("Type", "Keys", "Rows", "Free", "Meaning")),
    "joints that": ("Couplers", ("Type", "Keys", "Rows", "Couples", "Meaning")),
    "drivers": ("Drivers", ("Type", "Keys", "Meaning")),
    "motions": ("Motions of drivers", ("Type", "Keys", "Meaning")),
    "force": ("Force elements", ("Type", "Keys", "Meaning")),
    "outputs: ": ("Outputs", ("Type", "Keys", "Meaning")),
    "outputs of a wheel": ("Outputs of a wheel", ("Type", "Unit", "Keys", "Sign", "Needs")),
}
"""Title and columns by the start of the heading in `kincheck list`."""


def types() -> str:
    """Return the page of the types that a case file can name, from their classes."""
    parts = [
        "# Types in case files",
        "Keys in brackets may be left out. Points and directions are `[x, y, z]`, global, at the"
        " design position; a key in the plural has one on each body. Body i is the first of"
        ' `bodies = ["first", "second"]`, body j the second. `kincheck list --joints` and'
        " `kincheck list --outputs` print the same tables.",
    ]
    for heading, rows in (type_tables() | output_tables()).items():
        title, head = next(value for key, value in HEADS.items() if heading.startswith(key))
        parts += [f"## {title}", _table(head, [(f"`{row[0]}`", *row[1:]) for row in rows])]
    parts.append(
        "Every output of a wheel has its derivative by wheel travel, `NAME.per_travel`, per metre"
        " of upward motion of the wheel centre. The table `[suspension]` describes the wheel."
    )
    return "\n\n".join(parts) + "\n"


@cache
def function(name: str) -> str:
    """Return the section of a function that is made of a command: its arguments and what they mean;
    empty for another one, which its source describes.
    """
    found = getattr(kincheck, name)
    if "__signature__" not in vars(found):
        return ""
    signature = inspect.signature(found)
    arguments, star = list[str](), False
    for each in signature.parameters.values():
        if each.kind is each.KEYWORD_ONLY and not star:
            star = True
            arguments.append("*")
        plain = str(each.replace(annotation=str(each.annotation).strip("'")))
        arguments.append(re.sub("'([^']*)'", r"\1", plain, count=1).replace("<factory>", "..."))
    code = "".join(f"    {each},\n" for each in arguments)
    answer = str(signature.return_annotation).strip("'")
    about, *sections = re.split(r"\n\n(Raises|Args):\n", inspect.getdoc(found) or "")
    parts = [
        f"### {name} {{ #kincheck.by_name.{name} }}",
        f"```python\n{name}(\n{code}) -> {answer}\n```",
        about,
    ]
    for title, text in zip(sections[::2], sections[1::2], strict=True):
        items = re.findall(r"^    ([\w, ]+): (.*?)(?=^    \w|\Z)", text, re.MULTILINE | re.DOTALL)
        rows = [(f"`{each}`", meaning) for each, meaning in items]
        parts.append(_table(("Argument" if title == "Args" else "Raises", ""), rows))
    return "\n\n".join(parts)


def joints() -> str:
    """Return the table of joint types and installed engines, from a run."""
    with tempfile.TemporaryDirectory() as folder:
        engines = _installed()
        file = Path(folder) / "joints.md"
        command = [sys.executable, "-m", "kincheck", "run", "--joints", "--engine", *engines]
        subprocess.run(
            [*command, "--markdown", str(file)], check=True, capture_output=True, cwd=folder
        )
        table = [line for line in file.read_text("utf-8").splitlines() if line.startswith("|")]
    return "\n".join(table)


def _installed() -> list[str]:
    from kincheck import adapters

    return [name for name in adapters.ENGINES if adapters.engine(name).version()]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = [head, ["---"] * len(head), *rows]
    return "\n".join(
        f"| {' | '.join(' '.join(str(cell).split()).replace('|', chr(92) + '|') for cell in row)} |"
        for row in cells
    )
