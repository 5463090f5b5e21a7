"""A page to name unnamed points: in 3D, role by role, with roles proposed by geometry. The
answer is the house's file of names.
"""

from __future__ import annotations

import hmac
import json
import secrets
from collections.abc import Mapping
from dataclasses import replace
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from ...errors import CaseError, KincheckError
from ...report.sections import script_of, style_sheet
from ..hardpoints.guess import Guess, guess_of
from ..hardpoints.options import WheelOptions
from ..hardpoints.read import case_of_hardpoints
from ..hardpoints.reader import read_hardpoints
from ..hardpoints.roles import names_text
from ..hardpoints.table import axes_of, positions_of, unit_of
from .server import HEADERS, HOST, LOCAL

SCRIPTS = ("elements.js", "vectors.js", "canvas.js")
LARGEST = 100_000
"""Of an answer [bytes]."""


def naming_of(file: Path, supplied: WheelOptions) -> Guess | None:
    """Return the guess of a table whose names do not tell the roles of its points; None of another.

    Raises:
        CaseError: the file cannot be read.
    """
    guess = guess_of(read_hardpoints(file, supplied), supplied, case_of_hardpoints)
    return guess if guess and "names" in guess.stated else None


def points_of(guess: Guess) -> dict[str, Any]:
    """Return the data of the page: points in metres, x forward, y left, z up; roles with their
    proposed point; and pairs of roles with a link between.
    """
    table, taken, template = guess.table, guess.taken, guess.fit.template
    places = positions_of(table, unit_of(table, taken.units), axes_of(table, taken.axes))
    needed = [role.name for role in template.roles]
    links = [row[3:5] for row in template.joint_rows.values() if len(row) == 5]
    links += [(role, role.replace(end, "_outer")) for role in needed for end in ("_front", "_rear")]
    return {
        "file": table.file.name,
        "template": template.name,
        "why": guess.why,
        "doubts": guess.doubts,
        "points": [{"name": name, "at": at} for name, at in places.items()],
        "roles": [
            {
                "name": role.name,
                "meaning": role.meaning,
                "needed": role.name in needed,
                "point": guess.fit.roles.get(role.name, ""),
            }
            for role in (*template.roles, *template.optional)
        ],
        "links": [[a, b] for a, b in links if a != b],
    }


def save_names(guess: Guess, roles: Mapping[str, str]) -> Path:
    """Write the file of names, if the case of these roles can be made.

    Raises:
        KincheckError: a role or point is unknown, a needed role is missing, a point has two roles,
            the case cannot be made, or the file cannot be written.
    """
    template = guess.fit.template
    known = {role.name for role in (*template.roles, *template.optional)}
    filled = {role: name for role, name in roles.items() if name}
    if unknown := [*({*filled} - known), *({*filled.values()} - guess.table.points.keys())]:
        raise KincheckError(f"There is no role or point {unknown[0]!r}.")
    if missing := [role for role in template.roles if role.name not in filled]:
        raise KincheckError(f"Choose a point for {missing[0].name}: {missing[0].meaning}.")
    case_of_hardpoints(replace(guess.table, roles=filled), guess.taken)
    (file,) = guess.writes
    try:
        file.write_text(names_text(template, filled), encoding="utf-8")
    except OSError as error:
        raise KincheckError(
            f"{file} cannot be written ({error.strerror}). Start kincheck where it can."
        ) from None
    return file


class NamingServer:
    """A server of the page, on this machine alone.

    Attributes:
        address: with the token.
        saved: is set when the names are saved.
        following: the next address of the page, if there is one.
    """

    def __init__(self, guess: Guess, port: int = 0) -> None:
        self.guess, self.saved = guess, Event()
        self.file, self.following, self.go_on = Path(), "", Event()
        self.token = secrets.token_urlsafe(32)
        naming = self

        class Handler(_Handler):
            server_of = naming

        try:
            self.server = ThreadingHTTPServer((HOST, port), Handler)
        except (OSError, OverflowError) as error:
            raise KincheckError(
                f"--port {port} cannot be used ({error}). Leave it out for a free one."
            ) from None
        self.address = f"http://{HOST}:{self.server.server_port}/?token={self.token}"
        Thread(target=self.server.serve_forever, daemon=True).start()

    def follow(self, address: str) -> None:
        """Send the page on to an address."""
        self.following = address
        self.go_on.set()

    def close(self) -> None:
        """Stop listening."""
        self.go_on.set()
        self.server.shutdown()
        self.server.server_close()


class _Handler(BaseHTTPRequestHandler):
    """Answers requests of this server's own page."""

    server_of: NamingServer

    def do_GET(self) -> None:
        """Answer with a file of the page, its data, or the next address."""
        path = urlsplit(self.path).path
        own = Path(__file__).parent
        if not self._allowed(path in ("/", "/points", "/next")):
            return
        if path == "/next":
            self.server_of.go_on.wait(60.0)
        scripts = [*map(script_of, SCRIPTS), script_of("naming.js", own)]
        files = {
            "/points": (json.dumps(points_of(self.server_of.guess)), "application/json"),
            "/next": (json.dumps(self.server_of.following), "application/json"),
            "/": ((own / "naming.html").read_text("utf-8"), "text/html"),
            "/naming.js": ("\n".join(scripts), "text/javascript"),
            "/naming.css": (style_sheet(), "text/css"),
        }
        text, media = files.get(path, ("kincheck: no such page\n", "text/plain"))
        self._tell(text, media, HTTPStatus.OK if path in files else HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """Save the names."""
        if not self._allowed(secret=True):
            return
        size = int(self.headers.get("Content-Length") or 0)
        try:
            if not 0 < size <= LARGEST:
                raise KincheckError("The answer is too long.")
            roles = msgspec.json.decode(self.rfile.read(size), type=dict[str, str])
            self.server_of.file = save_names(self.server_of.guess, roles)
        except (msgspec.MsgspecError, UnicodeDecodeError, KincheckError, CaseError) as error:
            self._tell(str(error), "text/plain", HTTPStatus.BAD_REQUEST)
        else:
            self._tell(str(self.server_of.file), "text/plain")
            self.server_of.saved.set()

    def _allowed(self, secret: bool) -> bool:
        """Return whether a request comes from the page of the printed address; refuse others."""
        host, origin = self.headers.get("Host", ""), self.headers.get("Origin")
        given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
        own = LOCAL.fullmatch(host) and origin in (None, f"http://{host}")
        if own and (
            not secret or hmac.compare_digest(given.encode(), self.server_of.token.encode())
        ):
            return True
        said = "kincheck: open the address that kincheck serve printed, with its token\n"
        self._tell(said, "text/plain", HTTPStatus.FORBIDDEN)
        return False

    def _tell(self, text: str, media: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        body = text.encode()
        self.send_response(status)
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", f"{media}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing: the terminal shows the address alone."""
