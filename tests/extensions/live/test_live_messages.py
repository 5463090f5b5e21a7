"""Messages that no page sends: whatever they are, the server answers this page or closes its
socket, goes on for others, and writes no file.
"""

import json
import random
from contextlib import closing, suppress

import pytest
from kincheck import live as kincheck_live
from kincheck.core.extensions.live.protocol import LARGEST_MESSAGE
from websockets.exceptions import ConnectionClosed

from .conftest import TRAVEL, Page, page_of

COUNT = 130
NUMBERS = [0, -0.0, 1, -1, 3.5, 1e-300, 1e30, 1e100, -1e100, 1e101, 1e308, 10**30, 2**53, 2**54]
OTHERS = [None, True, "x", "", "\ud800", "\0", "é" * 99, [], {}, [[]], {"": 0}]
WORDS = [
    "solve",
    "read",
    "rank",
    "vary",
    "move",
    "reach",
    "check",
    "export",
    "save",
    "measured",
    "propose",
]


class Maker:
    """Makes messages out of right ones.

    Args:
        opening: of the file.
    """

    def __init__(self, opening, seed):
        self.rng = random.Random(seed)
        self.points = [each["position"] for each in opening["points"]]
        self.drivers = {each["name"]: each["design"] for each in opening["drivers"]}
        self.outputs = [each["name"] for each in opening["outputs"]]

    def right(self):
        """Return a right message of any type; engines are unknown, which takes no time."""
        points = [[*row] for row in self.points]
        output = self.rng.choice(self.outputs)
        return self.rng.choice(
            [
                {"type": "solve", "points": points, "whole": self.rng.random() < 0.5},
                {"type": "read", "point": "uca_front", "axis": "x", "text": "1"},
                {"type": "rank", "points": points, "output": output},
                {"type": "vary", "points": points, "output": output},
                {"type": "move", "drivers": {**self.drivers}, "measured": True},
                {"type": "reach", "driver": next(iter(self.drivers), "a")},
                {"type": "check", "engines": ["no engine"]},
                {"type": "export", "kind": "csv", "engines": ["no engine"]},
                {"type": "save", "points": points, "name": "../other.csv"},
                {"type": "measured", "milliseconds": [1.0]},
                {"type": "propose", "points": points, "bands": {output: [1, 0]}, "boxes": {"a": 1}},
            ]
        )

    def value(self, depth=0):
        """Return any value of JSON."""
        choice = self.rng.random()
        if choice < 0.7 or depth > 3:
            return self.rng.choice([*NUMBERS, *OTHERS])
        if choice < 0.85:
            return [self.value(depth + 1) for _ in range(self.rng.randrange(4))]
        names = [*self.drivers, "", "a", "\ud800"]
        return {self.rng.choice(names): self.value(depth + 1) for _ in range(3)}

    def changed(self, message):
        """Return a message with a change."""
        choice, key = self.rng.random(), self.rng.choice([*message, "id"])
        rows = [row for row in message.get("points") or [] if row]
        if choice < 0.4 and rows:
            self.rng.choice(rows)[self.rng.randrange(3)] = self.value(4)
        elif choice < 0.5 and "drivers" in message:
            message["drivers"][self.rng.choice([*self.drivers, "a"])] = self.rng.choice(NUMBERS)
        elif choice < 0.6:
            message["type"] = self.rng.choice([*WORDS, "SOLVE", "eval", ""])
        elif choice < 0.7:
            message.pop(key, None)
        else:
            message[key] = self.value()
        return message

    def text(self):
        """Return a message as sent: one or more changes, or no JSON at all."""
        message = self.changed(self.right())
        if self.rng.random() < 0.3:
            with suppress(TypeError, IndexError, AttributeError):  # points are rows no more
                message = self.changed(message)
        text = json.dumps(message)
        return self.rng.choice(
            [
                *[text] * 12,
                text[: self.rng.randrange(len(text))],
                text.encode(),
                self.rng.randbytes(40),
                "[" * self.rng.choice([9, 900, 60_000]),
                " " * (LARGEST_MESSAGE + self.rng.randrange(2)),
            ]
        )


@pytest.mark.by_day(6)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["table", "model"])
def test_fuzzed_messages_end_no_server(car, kind, seed, caplog):
    server = (
        kincheck_live(car, TRAVEL) if kind == "table" else kincheck_live("mcpherson_strut_loaded")
    )
    with closing(server), page_of(server) as first:
        watching = Page(first)  # a page that has nothing to do with it
        maker = Maker(watching.opening, seed)
        driver = next(iter(maker.drivers), None)
        asked = {"type": "reach", "driver": driver} if driver else {"type": "read", "point": "a"}
        asked |= {} if driver else {"axis": "x", "text": "1"}
        before, sent = sorted(car.parent.iterdir()), 0
        while sent < COUNT:
            with page_of(server) as socket, suppress(ConnectionClosed):
                while sent < COUNT:
                    sent += 1
                    socket.send(text := maker.text())
                    socket.send(json.dumps(asked | {"id": 10**6 + sent}))
                    while json.loads(socket.recv(timeout=60)).get("id") != 10**6 + sent:
                        assert not server.ended.is_set(), text
        assert not server.ended.is_set()
        assert not server.measured
        assert sorted(car.parent.iterdir()) == before
        if driver is None:
            assert watching.answers(7)
        else:
            watching.say(**asked)
            assert watching.told("reached")["driver"] == driver
    assert not [record for record in caplog.records if "a message failed" in record.message]


def test_measured_ends_only_if_asked(served, page):
    told = page.refusal(type="measured", milliseconds=[1.0])
    assert told == "measured: nobody asked for it"
    assert not served.ended.is_set()
    served.measuring = True
    page.say(type="measured", milliseconds=[1.0, 2.0])
    assert served.ended.wait(20)
    assert served.measured == [1.0, 2.0]
