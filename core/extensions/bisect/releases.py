"""Releases of a package, by the user's own installer, and an environment for each.

An environment is a virtual one whose packages come before those of this Python, in which nothing
changes. If its libraries do not load beside ours, all its requirements are installed.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import venv
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

from ...doors import entry_points
from ...errors import KincheckError
from ...extras import THREADS, distribution_of
from ..environments.environments import ENVIRONMENTS

PATIENCE = 900.0
"""Longest installation of a release [s]; the largest wheel has 200 MB."""

HOME = "bisect"
USED, LOG = ".used", ".log"
WHEELS = "--only-binary", ":all:"  # a build from source may take an hour
QUIET = "--disable-pip-version-check", "--no-input"


class NotInstallableError(KincheckError):
    """A release cannot be installed; the message is the installer's."""


def package_of(engine: str) -> str:
    """Return the distribution of an engine: of kincheck's own extra, of its entry
    point, or the engine's own name.
    """
    from ...cli.class_loading import GROUP

    point = entry_points(GROUP).get(engine)
    if point is not None and point.dist is not None:
        return point.dist.name
    return distribution_of(engine) or engine


def version_key(text: str) -> Any:
    """Return a version in the order of Python's packages.

    Raises:
        KincheckError: it is not the version of a package.
    """
    for module in ("packaging.version", "pip._vendor.packaging.version"):
        if _is_there(module):
            found: Any = importlib.import_module(module)
            break
    else:
        raise KincheckError("bisect needs pip or packaging to order releases. Install pip.")
    try:
        return found.Version(text)
    except ValueError:
        raise KincheckError(
            f"{text!r} is not a version of a package. Give one such as 3.6.0 or 1.2rc1."
        ) from None


def _is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def between(releases: Sequence[str], first: str, last: str) -> list[str]:
    """Return the releases from one to another, both included, in their order.

    Raises:
        KincheckError: an end is not among them, or the first is not the earlier one.
    """
    ordered = sorted({version_key(each): each for each in releases}.items())
    low, high = version_key(first), version_key(last)
    if not low < high:
        raise KincheckError(f"--from {first} --to {last}: found no range. Give the earlier first.")
    known = dict(ordered)
    for option, text, key in (("--from", first, low), ("--to", last, high)):
        if key not in known:
            near = sorted(known, key=lambda each: each < key)
            around = ", ".join(known[each] for each in near[:2]) if key < near[0] else ""
            names = around or ", ".join([*known.values()][-8:])
            raise KincheckError(
                f"{option} {text}: the installer finds no such release for this Python. It finds"
                f" {names} and others."
            )
    return [name for key, name in ordered if low <= key <= high]


def releases_of(package: str) -> list[str]:
    """Return the releases known to the installer, pre-releases too, and those of wheels for another
    Python in its local folders, which cannot be installed.

    Raises:
        KincheckError: there is no such package, or the index does not answer.
    """
    command = [*_pip(), "index", "versions", "--pre", *WHEELS, *QUIET, package]
    status, said = run(command, PATIENCE)
    listed = re.search(r"^Available versions: (.*)$", said, re.M)
    plain = re.sub(r"[-_.]+", "-", package).lower()
    local = [
        found[1]
        for folder in os.environ.get("PIP_FIND_LINKS", "").split()
        for each in sorted(Path(folder).glob("*.whl"))
        if (found := re.match(r".+?-([^-]+)-", each.name))
        and re.sub(r"[-_.]+", "-", each.name.partition("-")[0]).lower() == plain
    ]
    if (status or not listed) and not local:
        raise KincheckError(
            f"The installer finds no releases of the package {package!r} ({_reason(said)}). Name"
            " the package of the engine by --package, or the releases by --releases."
        )
    return [*(listed[1].split(", ") if listed else ()), *local]


@dataclass
class Environments:
    """The environments of a package's releases.

    Attributes:
        folder: of all packages.
        most: largest size of the folder [bytes]; the longest unused environments go first.
        whole: whether all requirements of a release are installed beside it, also those present in
            this Python: its compiled libraries then come from one place.
    """

    package: str
    most: float
    folder: Path = field(default_factory=lambda: _folder())
    whole: bool = False

    def path_of(self, release: str) -> Path:
        """Return the folder of a release's environment."""
        here = sha256(sys.prefix.encode()).hexdigest()[:6]
        tag = f"{sys.implementation.cache_tag}-{here}"
        return self.folder / re.sub(r"[^\w.+-]", "_", f"{self.package}-{release}-{tag}")

    def python(self, release: str, *, again: bool = False) -> str:
        """Return the Python of a release, which is installed if it is not there, or again.

        Raises:
            NotInstallableError: the installer cannot install it.
            KincheckError: the disk is full, or the folder cannot be written.
        """
        path = self.path_of(release)
        if again or not (path / USED).is_file():
            self._build(release, path)
        (path / USED).touch()
        return str(_python(path))

    def _build(self, release: str, path: Path) -> None:
        try:
            with TemporaryDirectory(dir=self.folder, prefix=".building-") as part:
                made = Path(part) / "env"
                venv.create(made, with_pip=not _is_there("pip"), symlinks=os.name != "nt")
                python = _python(made)
                wanted = f"{self.package}=={release}"
                _install(str(python), "--no-deps", "--ignore-installed", wanted)
                packages = _see_this_python(python)
                if any(_needs(each) for each in packages.glob("*.dist-info/METADATA")):
                    _install(str(python), wanted, *["--ignore-installed"] * self.whole)
                shutil.rmtree(path, ignore_errors=True)
                made.rename(path)
                (path / USED).touch()
        except OSError as error:
            raise KincheckError(
                f"{self.folder}: an environment cannot be written ({error.strerror or error})."
                f" Set {ENVIRONMENTS} to another folder."
            ) from None
        self._make_room(path)

    def _make_room(self, kept: Path) -> None:
        """Remove the longest unused environments until the others fit."""
        every = [each.parent for each in self.folder.glob(f"*/{USED}")]
        every.sort(key=lambda each: (each / USED).stat().st_mtime)
        sizes = {each: _size(each) for each in every}
        for each in every:
            if sum(sizes.values()) > self.most and each != kept:
                del sizes[each]
                shutil.rmtree(each, ignore_errors=True)


def _folder() -> Path:
    from ...program.disk_cache import folder

    given, cache = os.environ.get(ENVIRONMENTS), folder()
    if not given and cache is None:
        raise KincheckError(f"There is no folder for environments. Set {ENVIRONMENTS} to one.")
    home = (Path(given) if given else cast("Path", cache) / "environments").absolute() / HOME
    try:
        home.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise KincheckError(
            f"{ENVIRONMENTS}: the folder {home} cannot be made ({error.strerror}). Give another."
        ) from None
    return home


def _python(path: Path) -> Path:
    return path / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _needs(metadata: Path) -> bool:
    """Return whether a package requires others, without extras."""
    lines = re.findall(r"^Requires-Dist:.*$", metadata.read_text("utf-8", "replace"), re.M)
    return any("extra ==" not in each for each in lines)


def _see_this_python(python: Path) -> Path:
    """Let an environment see the packages of this Python behind its own; return their folder."""
    import site

    status, own = run([str(python), "-c", "import site; print(site.getsitepackages()[0])"], 60.0)
    if status:
        raise NotInstallableError(f"its Python does not start ({own.strip()})")
    folders = [
        *site.getsitepackages(),
        *([site.getusersitepackages()] * bool(site.ENABLE_USER_SITE)),
    ]
    lines = [f"import site; site.addsitedir({each!r})\n" for each in folders]
    # read last, behind the files of the release
    packages = Path(own.strip().splitlines()[-1])
    (packages / "zzz_kincheck.pth").write_text("".join(lines), "utf-8")
    return packages


def _install(python: str, *wanted: str) -> None:
    status, said = run([*_pip(python), "install", *WHEELS, *QUIET, *wanted], PATIENCE)
    if status:
        raise NotInstallableError(_reason(said))


def _pip(python: str = sys.executable) -> list[str]:
    if _is_there("pip"):
        return [sys.executable, "-m", "pip", "--python", python]
    return [python, "-m", "pip"]


def _reason(said: str) -> str:
    errors = re.findall(r"^ERROR: (.*)$", said, re.M) or said.strip().splitlines()[-1:]
    return (errors or ["no message"])[-1].strip()[:300]


def _size(folder: Path) -> int:
    return sum(each.lstat().st_size for each in folder.rglob("*"))


def run(command: Sequence[str], patience: float) -> tuple[int, str]:
    """Run a program and return its status and output; it ends with us, with all its processes.

    Args:
        patience: longest time [s]; then the status is -SIGKILL.
    """
    environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
    with subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as program:
        try:
            out, _ = program.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            out = f"it takes more than {patience:g} s".encode()
        finally:
            _end(program)
    return program.returncode, out.decode(errors="replace")


def _end(program: subprocess.Popen[bytes]) -> None:
    if os.name == "posix":
        try:
            os.killpg(program.pid, signal.SIGKILL)
        except ProcessLookupError:
            return
    program.kill()
