"""A runner of GitHub workflows on this machine: jobs in order, `run` steps in bash with their own
environment and conditions, artifacts as folders, and a fake `gh` that keeps comments in a file.
"""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import yaml

GH = '''#!{python}
"""The requests of workflows to GitHub's API; --jq by the program of that name."""
import json, pathlib, shutil, subprocess, sys

state = pathlib.Path({state!r})
comments = state / "comments.json"
known = json.loads(comments.read_text()) if comments.exists() else []
words = sys.argv[1:]
assert words.pop(0) == "api"
given, path = {{}}, ""
while words:
    word = words.pop(0)
    if word in ("--jq", "--method", "--field"):
        given[word] = words.pop(0)
    elif not word.startswith("--"):
        path = word
answer = None
if path.startswith("repos/o/r/actions/artifacts?name="):
    name = path.partition("name=")[2].partition("&")[0]
    own = {{"head_branch": "main", "head_repository_id": 1, "repository_id": 1}}
    forks = {{"head_branch": "main", "head_repository_id": 2, "repository_id": 1}}
    found = [{{"id": 7, "expired": False, "workflow_run": own}}] if (state / name).is_dir() else []
    found += [{{"id": 8, "expired": False, "workflow_run": forks}}]
    found += [{{"id": 9, "expired": True, "workflow_run": own}}]
    answer = {{"artifacts": found}}
elif path == "repos/o/r/actions/artifacts/7/zip":
    made = shutil.make_archive(str(state / "made"), "zip", state / "kincheck-history")
    sys.stdout.buffer.write(pathlib.Path(made).read_bytes())
elif given.get("--method") == "DELETE":
    number = int(path.removeprefix("repos/o/r/issues/comments/"))
    known = [each for each in known if each["id"] != number]
elif path == "repos/o/r/issues/12/comments" and "--field" in given:
    file = given["--field"].removeprefix("body=@")
    number = max([each["id"] for each in known], default=0) + 1
    text = pathlib.Path(file).read_text()
    known.append({{"id": number, "user": {{"login": "github-actions[bot]"}}, "body": text}})
elif path == "repos/o/r/issues/12/comments":
    answer = known
else:
    sys.exit(f"gh: {{path}}: no such request")
comments.write_text(json.dumps(known))
if answer is not None:
    words = ["jq", "-r", given["--jq"]]
    sys.exit(subprocess.run(words, input=json.dumps(answer), text=True).returncode)
'''


class Context(dict):
    """A context of expressions: what is not there is empty."""

    def __getattr__(self, name):
        found = self.get(name, "")
        return Context(found) if found == "" or isinstance(found, dict) else found

    def __str__(self):
        return "" if not self else repr(dict(self))


@dataclass
class Runner:
    """Runs the workflow of a repository.

    Attributes:
        state: folder of artifacts and comments, which stay from run to run.
        programs: scripts that come first on PATH, by name.
    """

    repository: Path
    state: Path
    environment: dict = field(default_factory=dict)
    programs: dict = field(default_factory=dict)

    def run(self, event="schedule", **inputs):
        """Run all jobs; the status of the first step that fails."""
        file = self.repository / ".github/workflows/kincheck.yml"
        workflow = yaml.safe_load(file.read_text("utf-8"))
        own = Context(full_name="o/r")
        github = Context(
            event_name=event, ref_name="main", repository="o/r", actor="ada", token="t"
        )
        if event == "pull_request":
            github |= {"base_ref": "main", "ref_name": "12/merge"}
            github["event"] = {"pull_request": {"number": 12, "head": {"repo": own}}}
        known = Context(github=github, inputs=Context(inputs), needs=Context())
        shutil.rmtree(self.repository / "kincheck-night", ignore_errors=True)
        status = 0
        for name, job in workflow["jobs"].items():
            if not evaluate(job.get("if", "always()"), known, self.repository):
                continue
            known |= {"steps": Context()}
            failed = self._job(job, known)
            status = status or failed
            outputs = {
                key: str(evaluate(inner(value), known, self.repository))
                for key, value in job.get("outputs", {}).items()
            }
            known["needs"] = Context({**known["needs"], name: Context(outputs=outputs)})
        return status

    def _job(self, job, known):
        status = 0
        for step in job["steps"]:
            condition = str(step.get("if", ""))
            if status and "always()" not in condition:
                continue
            if condition and not evaluate(condition, known, self.repository):
                continue
            if "uses" in step:
                self._use(step["uses"].partition("@")[0], step.get("with", {}))
            else:
                status = status or self._step(step, known)
        return status

    def _use(self, action, given):
        def copy(source, target):
            if source.is_dir():
                shutil.copytree(source, target, dirs_exist_ok=True)
            elif source.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(source, target)

        if action == "actions/upload-artifact":
            paths = [Path(each) for each in given["path"].split()]
            above = Path(os.path.commonpath(paths))
            above = above if len(paths) > 1 else above.parent
            shutil.rmtree(self.state / given["name"], ignore_errors=True)
            for path in paths:
                copy(self.repository / path, self.state / given["name"] / path.relative_to(above))
        elif action == "actions/download-artifact":
            copy(self.state / given["name"], self.repository / given["path"])

    def _step(self, step, known):
        self.state.mkdir(exist_ok=True)
        programs = self.state / "bin"
        programs.mkdir(exist_ok=True)
        texts = {"gh": GH.format(python=sys.executable, state=str(self.state)), **self.programs}
        for name, text in texts.items():
            (programs / name).write_text(text)
            (programs / name).chmod(0o755)
        outputs = self.state / "outputs"
        outputs.write_text("")
        environment = {
            **{name: x for name, x in os.environ.items() if not name.startswith("KINCHECK")},
            "PATH": f"{programs}:{os.environ['PATH']}",
            "GITHUB_REPOSITORY": "o/r",
            "GITHUB_EVENT_NAME": known.github.event_name,
            "GITHUB_OUTPUT": str(outputs),
            "GITHUB_STEP_SUMMARY": str(self.state / "summary"),
            **self.environment,
        }
        for name, value in step.get("env", {}).items():
            environment[name] = re.sub(
                r"\$\{\{(.*?)\}\}",
                lambda found: str(evaluate(found[1], known, self.repository)),
                str(value),
            )
        words = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
        done = subprocess.run(words, cwd=self.repository, env=environment)
        told = dict(line.split("=", 1) for line in outputs.read_text().splitlines())
        known["steps"] = Context(
            {**known["steps"], step.get("id", step["name"]): Context(outputs=told)}
        )
        return done.returncode


def inner(text):
    """The expression between the braces of a value."""
    return re.fullmatch(r"\$\{\{(.*)\}\}", text.strip())[1]


def evaluate(expression, known, folder):
    """The value of an expression of a workflow, of the few kinds that ours have."""
    text = expression.strip().replace("&&", " and ").replace("||", " or ")
    names = {
        **known,
        "always": lambda: True,
        "hashFiles": lambda file: "a" * (folder / file).exists(),
    }
    return eval(text, {"__builtins__": {}}, names)
