"""The server of the live page: fixed files and one socket, on this machine only.

A request has to name this machine as its host (a rebound DNS name does not), and to come from this
server's own page (other sites and pages of other ports do not). Page and socket ask for the token
of the printed address. No path is joined, and nothing of a page is evaluated.
"""

from __future__ import annotations

import hmac
import http
import logging
import re
import secrets
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Condition, Event, Lock, Thread
from time import monotonic
from typing import Any, TypeAlias
from urllib.parse import parse_qs, urlsplit

import msgspec

from ...case.case import Case
from ...case.io.reference_file import sha256
from ...errors import KincheckError
from ...extras import library
from ...harness.record import Record, Results
from ...harness.scene import with_scenes
from ...report.curves import write_curves
from ...report.page_model import worst_of
from ...report.report import write_report
from ...report.sections import SCENE_SCRIPTS, script_of, style_sheet
from .model import LiveModel
from .naming import LiveNaming
from .protocol import (
    LARGEST_MESSAGE,
    MOST_MESSAGES,
    Asked,
    Changed,
    Check,
    Export,
    Exported,
    Invalid,
    Measured,
    Move,
    Names,
    Propose,
    Rank,
    Reach,
    Read,
    Refused,
    Rows,
    Save,
    Solve,
    Told,
    Vary,
    Verdict,
    encode,
    read,
)
from .table import LiveTable

HERE = Path(__file__).parent
HOST = "127.0.0.1"
LOCAL = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?", re.IGNORECASE)
"""Names of this machine; any port, for tunnels such as ssh -L."""
MOST_PAGES = 16
SCRIPTS: Mapping[str, tuple[Sequence[str], Sequence[str]]] = {
    "naming": (("elements.js", "vectors.js", "canvas.js"), ("naming.js",)),
    "live": (
        SCENE_SCRIPTS,
        (
            "link.js",
            "table.js",
            "planes.js",
            "figures.js",
            "sliders.js",
            "tuning.js",
            "live.js",
        ),
    ),
}
"""Scripts of each page: those of reports, and its own."""
NOTEBOOKS = "http://127.0.0.1:* http://localhost:* vscode-webview:"
"""Pages that may show this one in a frame, if it is for a notebook: those of this machine."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; style-src-attr 'unsafe-inline';"
        " connect-src 'self'; img-src data: blob:; base-uri 'none'; form-action 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
POLICY = 1008
"""Code of a socket that is closed for its behaviour (RFC 6455, section 7.4.1)."""
GRACE = 2.0
"""Time for a page to load again [s]."""

Live: TypeAlias = LiveTable | LiveModel | LiveNaming
Judge: TypeAlias = Callable[[Case, Sequence[str], Callable[[Record], None]], Results]
"""Solves a case with engines of these names, and tells each record."""


class LiveServer:
    """A server of one file, listening.

    Args:
        open_file: reads the file; again when it has changed and a page is loaded.
        engines: names of the engines for checks.
        judge: solves by these engines.
        port: of this machine; 0 for a free one.
        once: whether to end when no page is open any more.
        measuring: whether to end when a page has measured its edits.
        framed: whether notebooks of this machine may show the page.

    Attributes:
        address: with the token.
        ended: is set when the server has no more to do.
        measured: times of edits that a page was asked to measure [ms].

    Raises:
        KincheckError: the file cannot be read, the port cannot be used, or a library is missing.
    """

    def __init__(
        self,
        file: Path,
        open_file: Callable[[], Live],
        engines: Sequence[str],
        judge: Judge,
        *,
        port: int = 0,
        once: bool = False,
        measuring: bool = False,
        framed: bool = False,
    ) -> None:
        serving: Any = library("kincheck serve", "websockets.sync.server", "live")
        self.file, self.open_file, self.built_in = file, open_file, not file.is_file()
        self.engines, self.judge = engines, judge
        self.once, self.measuring = once, measuring
        self.points: Rows | None = None
        frames = NOTEBOOKS if framed else "'none'"
        policy = f"{HEADERS['Content-Security-Policy']}; frame-ancestors {frames}"
        self.headers = {**HEADERS, "Content-Security-Policy": policy}
        self.lock, self.pages, self.ended = Lock(), 0, Event()
        self.measured = list[float]()
        self.live, self.digest = open_file(), self._sha256()
        self.token = secrets.token_urlsafe(32)
        silent = logging.Logger("kincheck.live")  # a refused handshake is no news for the terminal
        silent.addHandler(logging.NullHandler())
        try:
            self.listener = serving.serve(
                self._talk,
                HOST,
                port,
                process_request=self._answer,
                max_size=LARGEST_MESSAGE,
                compression=None,
                server_header=None,
                logger=silent,
            )
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise KincheckError(
                f"--port {port}: cannot be used ({why}); leave it out for a free one"
            ) from None
        self.port = self.listener.socket.getsockname()[1]
        self.address = f"http://{HOST}:{self.port}/?token={self.token}"
        Thread(target=self.listener.serve_forever, daemon=True).start()

    def __repr__(self) -> str:
        return f"<live page of {self.file.name}: {self.address}>"

    def _repr_html_(self) -> str:
        """Return the page in a frame, for a notebook on this machine."""
        return f'<iframe src="{self.address}" style="width:100%;height:900px;border:0"></iframe>'

    @property
    def case(self) -> Case:
        """The case with the numbers of the page that last had an answer; until then, the file."""
        live = self.live
        return (
            live.edited_case(self.points)
            if self.points and isinstance(live, LiveTable)
            else live.case
        )

    def close(self) -> None:
        """Stop listening. Open pages have a moment to close."""
        ending = Thread(target=self.listener.shutdown, daemon=True)
        ending.start()
        ending.join(GRACE)

    def changed(self) -> bool:
        """Return whether the file has other content than when it was read."""
        try:
            return self._sha256() != self.digest
        except OSError:
            return True

    def _sha256(self) -> str:
        """Return the digest of the file; empty for a built-in case."""
        return sha256(self.file) if not self.built_in else ""

    def opened(self) -> Live:
        """Return the file, read again if it has changed.

        Raises:
            KincheckError: it cannot be read any more.
        """
        with self.lock:
            if self.changed():
                self.live, self.digest = self.open_file(), self._sha256()
            return self.live

    def _answer(self, connection: Any, request: Any) -> Any:
        """Return the response to a request; None for the socket, which goes on."""
        if why := self._refusal(request):
            return self._response(http.HTTPStatus.FORBIDDEN, f"kincheck: {why}\n", "text/plain")
        path = _parts(request)[0]
        if path == "/socket":
            if self.pages < MOST_PAGES:
                return None
            busy = "kincheck: too many pages are open; close some\n"
            return self._response(http.HTTPStatus.SERVICE_UNAVAILABLE, busy, "text/plain")
        if path not in (parts := page_files(self.live.page)):
            return self._response(
                http.HTTPStatus.NOT_FOUND, "kincheck: no such page\n", "text/plain"
            )
        return self._response(http.HTTPStatus.OK, *parts[path])

    def _refusal(self, request: Any) -> str:
        """Return why a request is refused; empty if it is not."""
        if getattr(request, "method", "GET") != "GET":
            return "only GET is answered"
        hosts = request.headers.get_all("Host")
        if len(hosts) != 1 or not LOCAL.fullmatch(hosts[0]):
            return "the request is for another host"
        origins = request.headers.get_all("Origin")
        if any(each.lower() != f"http://{hosts[0].lower()}" for each in origins):
            return "the request comes from another page"
        path, token = _parts(request)
        if path == "/socket" and not origins:
            return "the request comes from no page"
        given, own = token.encode(), self.token.encode()
        if path in ("/", "/socket") and not hmac.compare_digest(given, own):
            return "open the address that kincheck serve printed, with its token"
        return ""

    def _response(self, status: http.HTTPStatus, text: str, media: str) -> Any:
        """Return a response with the headers of all."""
        headers: Any = library("kincheck serve", "websockets.datastructures", "live").Headers
        response: Any = library("kincheck serve", "websockets.http11", "live").Response
        body = text.encode()
        given = {
            **self.headers,
            "Content-Type": f"{media}; charset=utf-8",
            "Content-Length": str(len(body)),
            "Connection": "close",
        }
        return response(status.value, status.phrase, headers(given), body)

    def _talk(self, socket: Any) -> None:
        """Answer one page until it closes."""
        with self.lock:
            self.pages += 1
        try:
            Conversation(self, socket).run()
        finally:
            with self.lock:
                self.pages -= 1
            if self.once:
                Event().wait(GRACE)
                if not self.pages:
                    self.ended.set()


class Conversation:
    """The messages of one page. Of each kind only the newest waits; checks have their own thread,
    and edits do not wait for engines.
    """

    def __init__(self, server: LiveServer, socket: Any) -> None:
        self.server, self.socket = server, socket
        self.waiting, self.news = dict[type[Asked], Asked](), Condition()
        self.closed, self.told = False, False

    def run(self) -> None:
        """Read messages until the page closes."""
        closed: Any = library("kincheck serve", "websockets.exceptions", "live").ConnectionClosed
        try:
            self.live = self.server.opened()
        except KincheckError as error:
            with suppress(closed):
                self.tell(Invalid(message=str(error)))
            return
        threads = [
            Thread(target=self._work, args=(kinds, closed), daemon=True)
            for kinds in (
                (Solve, Move, Read, Save, Names, Rank, Vary, Reach),
                (Check, Export, Propose),
            )
        ]
        try:
            with suppress(closed):
                self.tell(self.live.opening(self.server.engines))
                for thread in threads:
                    thread.start()
                began, count = monotonic(), 0
                while count < MOST_MESSAGES:
                    self._receive(self.socket.recv())
                    count += 1
                    if monotonic() - began > 1.0:
                        began, count = monotonic(), 0
                self.tell(Invalid(message=f"found more than {MOST_MESSAGES} messages in a second"))
                self.socket.close(POLICY)
        finally:
            with self.news:
                self.closed = True
                self.news.notify_all()

    def tell(self, message: Told) -> None:
        """Send a message."""
        self.socket.send(encode(message))

    def _receive(self, text: str | bytes) -> None:
        try:
            message = read(text)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            self.tell(Invalid(message=f"message: {error}"))
            return
        if isinstance(message, Measured):
            if not self.server.measuring:
                self.tell(Invalid(id=message.id, message="measured: nobody asked for it"))
                return
            self.server.measured += message.milliseconds
            self.server.ended.set()
            return
        with self.news:
            self.waiting[type(message)] = message
            self.news.notify_all()

    def _work(self, kinds: Sequence[type[Asked]], closed: type[Exception]) -> None:
        """Answer messages of some kinds, the first kinds first."""
        while True:
            with self.news:
                self.news.wait_for(lambda: self.closed or {*kinds} & {*self.waiting})
                if self.closed:
                    return
                message = self.waiting.pop(next(each for each in kinds if each in self.waiting))
            try:
                self._reply(message)
            except closed:
                return
            except Exception as error:  # a defect; the page and the other requests live on
                logging.getLogger("kincheck").exception("kincheck serve: a message failed")
                with suppress(closed):
                    self.tell(Invalid(id=message.id, message=f"{type(error).__name__}: {error}"))

    def _reply(self, message: Asked) -> None:
        if self.server.changed() and not self.told:
            self.told = True
            self.tell(
                Changed(
                    message=f"{self.server.file.name} has changed on the disk; load the page again"
                    " to see it, or save your numbers first"
                )
            )
        try:
            if isinstance(message, Check | Export) and not isinstance(self.live, LiveNaming):
                self._judge(self.live, message)
                return
            answer: Callable[[Asked], Told] | None
            answer = getattr(self.live, type(message).__name__.lower(), None)
            if answer is None:
                kind = type(message).__name__.lower()
                raise KincheckError(f"a {self.live.kind} has no answer to {kind!r}")
            # edits go on while a proposal is looked for
            with nullcontext() if isinstance(message, Propose) else self.server.lock:
                found = answer(message)
                if isinstance(message, Solve):
                    self.server.points = message.points
                elif isinstance(message, Names):  # the page loads again
                    self.server.live = self.server.open_file()
        except KincheckError as error:
            found = self._refused(message, str(error))
        self.tell(msgspec.structs.replace(found, id=message.id))

    def _refused(self, message: Asked, text: str) -> Invalid | Refused:
        """Return a message about an error; of a design, with the row of the table in its text."""
        if not isinstance(message, Solve):
            return Invalid(message=text)
        names = self.live.names if isinstance(self.live, LiveTable) else []
        text = text.removeprefix(f"{self.live.file}: ")
        named = (each for each in names if re.search(rf"\b{re.escape(each)}\b", text))
        return Refused(message=text, point=next(named, ""))

    def _judge(self, live: LiveTable | LiveModel, message: Check | Export) -> None:
        """Tell the verdict of each engine as it ends, or hand out a file of the results."""
        names = [*dict.fromkeys(message.engines)]
        for name in names:
            if name not in self.server.engines:
                raise KincheckError(f"engines: there is no {name!r}")
        case = live.case
        if isinstance(live, LiveTable) and message.points is not None:
            with self.server.lock:
                case = live.referenced(live.edited_case(message.points))
        done = 0

        def tell(record: Record) -> None:
            nonlocal done
            done += 1
            if isinstance(message, Check):
                self.tell(_verdict(message.id, record, last=done == len(names)))

        results = self.server.judge(case, names, tell)
        if isinstance(message, Export):
            ending = "html" if message.kind == "report" else message.kind
            name = f"{live.file.stem}.{ending}"
            self.tell(Exported(id=message.id, name=name, content=file_of(results, case, name)))


def file_of(results: Results, case: Case, name: str) -> bytes:
    """Return the report or the curves of results."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        if path.suffix == ".html":
            write_report(with_scenes(results, [case]), path)
        else:
            write_curves(results, path, kind=path.suffix[1:], long=False)
        return path.read_bytes()


def _verdict(number: int, record: Record, *, last: bool) -> Verdict:
    """Return the summary of a record."""
    most = worst_of(record)
    return Verdict(
        id=number,
        engine=record.engine,
        outcome=record.outcome.shown,
        worst=None if most is None else most.ratio,
        output="" if most is None else most.output,
        message=record.message,
        last=last,
    )


def _parts(request: Any) -> tuple[str, str]:
    """Return the path of a request, and its token; empty without one."""
    asked: str = request.path
    parts = urlsplit(asked)
    return parts.path, parse_qs(parts.query).get("token", [""])[0]


@cache
def page_files(page: str = "live") -> dict[str, tuple[str, str]]:
    """Return the files of a page by path: content and media type."""
    style = style_sheet() + (HERE / "live.css").read_text("utf-8")
    return {
        "/": ((HERE / f"{page}.html").read_text("utf-8"), "text/html"),
        "/live.js": (page_script("socket.js", page), "text/javascript"),
        "/live.css": (style, "text/css"),
    }


def page_script(answerer: str, page: str = "live") -> str:
    """Return the script of a page, with that of the one who answers it."""
    shared, own = SCRIPTS[page]
    own = [script_of(name, HERE) for name in (answerer, *own)]
    return "\n".join([*map(script_of, shared), *own])
