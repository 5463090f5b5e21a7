"""The examples of a page in Markdown: fenced blocks, and how each is run.

- `sh` is a script. `console` shows commands after "$ " and their output.
- `python` is executed; all blocks of a page share their names. A `text` block that follows directly
  is its output.
- A block of any language with a title is a file of that name.
- Other languages are not run. A comment before a block, `<!-- not run: REASON -->`, excuses it;
  `<!-- status: 1 -->` gives the exit status of its last command.
- `<!-- needs: NAME ... -->` at the end names extensions whose commands the blocks use.

A number in shown output stands for any number, a line "..." for any lines, and " ..." at the end of
a line for its rest.
"""

import re
from dataclasses import dataclass

LANGUAGES = {
    "sh", "console", "python", "c", "text", "toml", "csv", "xml", "yaml", "ini", "json",
    "math", "markdown", "crontab", "powershell",
}  # fmt: skip
BLOCK = re.compile(
    r"^(?:<!-- (?P<key>not run|status): (?P<value>.+?) -->\n)?"
    r"^(?P<indent> *)(?P<fence>```+) *(?P<language>\w*)(?: +title=\"(?P<title>[^\"]+)\")?[^\n]*\n"
    r"(?P<text>.*?)^(?P=indent)(?P=fence)$",
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"[-+−]?\d+(?:[.,]\d+)*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Block:
    """A fenced block; `shown` is the output that the page prints below it, or None."""

    line: int
    language: str
    title: str | None
    text: str
    status: int
    excuse: str | None
    shown: str | None = None


def blocks(page):
    """Yield the blocks of a page; a `text` block that follows `python` directly is its output."""
    held, end = None, 0
    for found in BLOCK.finditer(page):
        indent, text = found["indent"], found["text"]
        text = "".join(line.removeprefix(indent) for line in text.splitlines(keepends=True))
        is_output = (
            held is not None
            and held.language == "python"
            and found["language"] == "text"
            and not page[end : found.start()].strip()
        )
        if is_output:
            yield Block(**{**vars(held), "shown": text})
            held = None
            continue
        if held is not None:
            yield held
        keyed = {found["key"]: found["value"]}
        held, end = (
            Block(
                page.count("\n", 0, found.start()) + 1,
                found["language"],
                found["title"],
                text,
                int(keyed.get("status", 0)),
                keyed.get("not run"),
            ),
            found.end(),
        )
    if held is not None:
        yield held


def commands(text):
    """Yield each command of a console block with the output that the page shows."""
    command, shown = "", []
    for line in text.splitlines():
        if line.startswith("$ "):
            if command:
                yield command, "\n".join(shown)
            command, shown = line[2:], []
        else:
            shown.append(line)
    yield command, "\n".join(shown)


def differences(shown, printed):
    """Return the first shown line that the output lacks, or nothing."""
    wanted, found = ([_plain(line) for line in text.splitlines()] for text in (shown, printed))
    found, free, at = [line for line in found if line], False, 0
    for line in filter(None, wanted):
        if line == "...":
            free = True
            continue
        places = range(at, len(found)) if free else range(at, min(at + 1, len(found)))
        at = next((k + 1 for k in places if _fits(line, found[k])), -1)
        if at < 0:
            return line
        free = False
    return ""


def _fits(line, found):
    """Return whether a shown line is the found one; " ..." at its end stands for the rest."""
    return found == line or (line.endswith(" ...") and found.startswith(line[:-4]))


def _plain(line):
    return " ".join(NUMBER.sub("#", line).split())
