"""kincheck nightly: init writes a workflow into the repository of a simulator, and comment says
what is worse since a commit.
"""

from __future__ import annotations

import json
import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any, ClassVar

import msgspec

from ...cli.class_loading import WHERE
from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...errors import KincheckError, refuse
from ...options import argument, destination, option, options, switch
from ...version import VERSION

WORKFLOW = Path(".github/workflows/kincheck.yml")
LOCK = Path(".github/kincheck.lock")

ACTIONS: Mapping[str, str] = {
    "checkout": "3d3c42e5aac5ba805825da76410c181273ba90b1 # v7.0.1",
    "setup-python": "ece7cb06caefa5fff74198d8649806c4678c61a1 # v6.3.0",
    "upload-artifact": "bbbca2ddaa5d8feaa63e36b76fdaad77386f024f # v7.0.0",
    "download-artifact": "3e5f45b2cfb9172054b4087a40e8e0b5a5461e7c # v8.0.1",
}
"""Commits of the actions of GitHub, as kincheck's own workflows pin them."""

MARK = "<!-- kincheck -->"
"""First line of a comment, by which the next one finds and replaces it."""


@options
class Init(Command):
    """Write a workflow for GitHub into this repository, which installs its package every night and
    for each pull request, runs cases in its engine, and says what became worse: with a history, a
    comment on the pull request, a badge, and the lock of kincheck's own dependencies.

    On a terminal it asks for what it cannot find.
    """

    about = "write a nightly workflow for a simulator into its repository"
    install: str | None = option(
        "commands that install the package of this repository, a line each; default:"
        " python -m pip install . if it is one in Python",
        metavar="COMMANDS",
    )
    engine: tuple[str, ...] = option(
        "engines to run: MODULE:CLASS, or names that the package offers by the entry point"
        " kincheck.engines; default: all that its pyproject.toml names",
        metavar="NAME",
        several="together",
    )
    case: tuple[str, ...] = option(
        "case files of this repository, or names; default: all built-in cases",
        metavar="CASE",
        several="together",
    )
    history: str = option(
        "where the history goes from night to night: an artifact of the last night, or a branch;"
        " default %(default)s",
        default="artifact",
        choices=("artifact", "branch"),
    )
    extras: str = option(
        "extras of kincheck, separated by commas; default %(default)s",
        metavar="EXTRA,EXTRA",
        default="fast",
    )
    kincheck: str | None = option(
        "requirement that installs kincheck itself, such as kincheck==1.0 or git+https://...;"
        " default: the installed version, or its commit",
        metavar="REQUIREMENT",
    )
    no_badge: bool = switch("do not put the badge below the title of README.md")
    force: bool = switch(f"replace {WORKFLOW}")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import Content, write_all
        from . import repository

        folder = repository.root()
        if (folder / WORKFLOW).exists() and not self.force:
            raise KincheckError(
                f"nightly init: {WORKFLOW} is there already. Say --force to replace it; its second"
                " line has the command that wrote it."
            )
        install = self.install or _ask(
            "How is your package installed", repository.install_command(folder), "--install"
        )
        offered = repository.engines(folder)
        names = [*self.engine] or _ask(
            "Name of your engine, or MODULE:CLASS", " ".join(offered), "--engine"
        ).split()
        _check_engines(names, offered, registry)
        lock = _lock(self.extras)
        text = _workflow(self, install, names, self.kincheck or _own())
        files: dict[Path, Content] = {
            WORKFLOW: text.encode(),
            LOCK: lock.encode(),
        }
        badge = _badge(repository.address())
        readme = folder / "README.md"
        if not self.no_badge and badge and readme.is_file():
            page = readme.read_text("utf-8")
            if badge not in page:
                files[Path(readme.name)] = _with_badge(page, badge).encode()
        (folder / WORKFLOW).parent.mkdir(parents=True, exist_ok=True)
        refuse(write_all((folder / name, content) for name, content in files.items()))
        print("\n".join(f"{name}: written" for name in files))
        if Path(readme.name) not in files:
            print(f"badge: {badge or _badge('OWNER/REPOSITORY')}")
        print("Commit them, and start the first night: gh workflow run kincheck.yml")
        return Status.WITHIN


def _ask(question: str, known: str | None, flag: str) -> str:
    """Return the answer of the user, or what is known if there is no terminal."""
    answer = known
    if sys.stdin.isatty() and sys.stdout.isatty():
        with suppress(EOFError):
            answer = input(f"{question}{f' [{known}]' if known else ''}? ").strip() or known
    if not answer:
        raise KincheckError(f"nightly init: nothing here answers: {question}? Give {flag}.")
    return answer


def _check_engines(names: Sequence[str], offered: Sequence[str], registry: Registry) -> None:
    """Refuse what is no name of an engine; name those that only an installation can know."""
    for name in names:
        if WHERE.fullmatch(name) or name in (*offered, *registry.every_engine):
            continue
        if not re.fullmatch(r"[A-Za-z_][\w.-]*", name):
            raise KincheckError(
                f"nightly init: --engine: found {name!r}, expected a name or MODULE:CLASS."
            )
        print(
            f"{name}: no pyproject.toml here offers this engine. The installed package must, by"
            f' [project.entry-points."kincheck.engines"] {name} = "MODULE:CLASS"'
        )


def _lock(extras: str) -> str:
    """Return the lock of kincheck with some extras."""
    from .lock import locked

    wanted = [each.strip() for each in extras.split(",") if each.strip()]
    known = metadata.metadata("kincheck").get_all("Provides-Extra") or []
    if unknown := [each for each in wanted if each not in known]:
        raise KincheckError(f"--extras: found {', '.join(unknown)}, expected {', '.join(known)}.")
    text, lacking = locked(wanted)
    if lacking:
        raise KincheckError(
            f"--extras {extras}: the lock lacks {', '.join(lacking)}. Leave out the extra, and"
            " install what it needs by --install."
        )
    return f"# kincheck's own dependencies, by kincheck {VERSION} nightly init\n{text}"


def _own() -> str:
    """Return the requirement of the installed kincheck: a commit, an archive, or the version."""
    text = metadata.distribution("kincheck").read_text("direct_url.json")
    found: dict[str, Any] = json.loads(text or "{}")
    url = str(found.get("url", ""))
    if commit := found.get("vcs_info", {}).get("commit_id"):
        return f"kincheck @ {found['vcs_info']['vcs']}+{url}@{commit}"
    return f"kincheck @ {url}" if url.startswith("http") else f"kincheck=={VERSION}"


def _workflow(given: Init, install: str, engines: Sequence[str], kincheck: str) -> str:
    """Return the text of the workflow."""
    from jinja2 import Environment, StrictUndefined

    template = Environment(
        undefined=StrictUndefined,
        variable_start_string="[[",
        variable_end_string="]]",
        block_start_string="[%",
        block_end_string="%]",
        trim_blocks=True,
        keep_trailing_newline=True,
    ).from_string(Path(__file__).with_name("workflow.yml").read_text("utf-8"))
    again = ["--install", install, "--engine", *engines]
    again += ["--case", *given.case] if given.case else []
    again += ["--history", given.history, "--extras", given.extras, "--kincheck", kincheck]
    again += ["--no-badge"] * given.no_badge
    return template.render(
        summary=f"{', '.join(engines)} against cases of kincheck, every night and for each pull"
        " request",
        command=f"kincheck nightly init {shlex.join(again)}".replace("\n", " && "),
        actions={name: f"actions/{name}@{commit}" for name, commit in ACTIONS.items()},
        lock=LOCK,
        mark=MARK,
        history=given.history,
        install=install.strip().splitlines(),
        kincheck=shlex.quote(kincheck),
        run=f"kincheck run {shlex.join([*given.case, '--engine', *engines])}",
    )


def _badge(address: str | None) -> str | None:
    page = f"https://github.com/{address}/actions/workflows/{WORKFLOW.name}"
    return address and f"[![kincheck]({page}/badge.svg?event=schedule)]({page})"


def _with_badge(text: str, badge: str) -> str:
    """Return a page with a badge below its title."""
    title = re.search(r"^# .*\n|^.+\n=+\n", text, flags=re.M)
    end = title.end() if title else 0
    return f"{text[:end]}\n{badge}\n{text[end:]}" if title else f"{badge}\n\n{text}"


@options
class Comment(Command):
    """Write what is worse since the run of a report as a comment on a pull request; nothing if
    nothing is worse since then.

    Exit status: 0 nothing is worse since this run, 1 something is, 2 the tool could not do its
    work.
    """

    about = "say what is worse since a commit"
    report: Path = argument("the regressions.json of kincheck report --out", "FILE", read=Path)
    out: Path | None = destination("write it there; default: standard output", Path)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write
        from ...history.findings import Regressions

        refuse(self.unwritable())
        try:
            found = msgspec.json.decode(self.report.read_bytes(), type=Regressions)
        except (OSError, msgspec.MsgspecError) as error:
            raise KincheckError(
                f"{self.report}: found {error}, expected the regressions.json of kincheck report"
                " --out."
            ) from None
        text = comment(found)
        if self.out is None:
            print(text, end="")
        else:
            write("--out", self.out, text.encode())
        failing = found.against is None and found.failing
        return Status.DEVIATES if text or failing else Status.WITHIN


def comment(found: Any) -> str:
    """Return what is worse since the run of a report, in Markdown; empty if nothing is.

    Without a run to compare with, nothing is known to be worse.
    """
    from ...report.regressions import pairs, to_markdown

    new = [each for each in found.regressions if each.since in (None, found.run.number)]
    if not new or found.against is None:
        return ""
    only = msgspec.structs.replace(found, findings=new, steps=[], loose=[], accepted=[])
    kinds = dict.fromkeys(each.kind for each in new)
    counts = ", ".join(f"{len(pairs(only, kind))} {kind}" for kind in kinds)
    commit = f" ({found.run.commit[:10]})" if found.run.commit else ""
    details = to_markdown(only).partition("\n")[2]
    return f"{MARK}\n**Worse since this commit{commit}: {counts}**\n{details}"


@options
class Nightly(Command):
    """Set up a nightly workflow in the repository of a simulator, and comment on its pull
    requests.
    """

    about = "set up a nightly workflow in the repository of a simulator"
    below: ClassVar[Mapping[str, type[Command]]] = {"init": Init, "comment": Comment}

    def run(self, registry: Registry) -> int:
        """Refuse: a command below is needed."""
        raise KincheckError("nightly: no command is given. Say kincheck nightly init.")
