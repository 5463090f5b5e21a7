"""A server of the live page in this process, and the table that it serves."""

from __future__ import annotations

import json
from contextlib import ExitStack

import pytest
from jsonschema import Draft202012Validator
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.cli.main import registry
from kincheck.core.extensions.live.command import judge_by
from kincheck.core.extensions.live.protocol import live_schema
from kincheck.core.extensions.live.server import LiveServer
from kincheck.core.extensions.live.table import LiveTable
from websockets.sync.client import connect

CAR = """\
# template: double_wishbone
# units: mm
# axes: forward,left,up
name,x,y,z,meaning
uca_front,90,260,285,a comment that stays
uca_rear,-110,265,280,
uca_outer,-15,540,312,
lca_front,120,210,125,
lca_rear,-130,215,120,
lca_outer,5,575,118,
tierod_inner,70,220,150,
tierod_outer,75,560,148,
wheel_center,0,612,228,
wheel_contact,0,612,0,
"""
TRAVEL = Supplied(travel="0.03:21")


@pytest.fixture
def car(tmp_path):
    path = tmp_path / "car.csv"
    path.write_text(CAR, "utf-8")
    return path


@pytest.fixture
def served(car):
    known = registry()
    server = LiveServer(car, lambda: LiveTable(car, TRAVEL), known.engines, judge_by(known))
    yield server
    server.close()


SCHEMA = live_schema()
ASKED, TOLD = (Draft202012Validator({"$ref": f"#/{way}", **SCHEMA}) for way in ("asked", "told"))


class Page:
    """A client that speaks the protocol, and checks both ways by its schema."""

    def __init__(self, socket):
        self.socket = socket
        self.opening = self.told("opening")
        self.points = [each["position"] for each in self.opening["points"]]

    def say(self, **message):
        ASKED.validate(message)
        self.socket.send(json.dumps(message))

    def solve(self, points, **more):
        """Ask for the answer to a design."""
        self.say(type="solve", points=points, **more)

    def answers(self, number):
        """Whether a question still has its answer."""
        self.solve(self.points, id=number)
        return self.told("answer")["id"] == number

    def told(self, kind):
        """Return the next message of a kind."""
        while True:
            message = json.loads(self.socket.recv(timeout=120))
            TOLD.validate(message)
            if message["type"] == kind:
                return message

    def refusal(self, **message):
        """Return why a message is no question of this page."""
        self.say(**message)
        return self.told("invalid")["message"]

    def moved(self, name, axis, by):
        """Return the points with one number moved."""
        rows = [[*row] for row in self.points]
        names = [each["name"] for each in self.opening["points"]]
        rows[names.index(name)][axis] += by
        return rows


def page_of(server):
    """Connect to a server as its page does."""
    host = f"127.0.0.1:{server.port}"
    address = f"ws://{host}/socket?token={server.token}"
    return connect(address, origin=f"http://{host}", max_size=None)


@pytest.fixture
def open_page(served):
    with ExitStack() as pages:
        yield lambda: Page(pages.enter_context(page_of(served)))


@pytest.fixture
def page(open_page):
    return open_page()
