"""The page that names unnamed points: roles proposed by geometry, saved as a file of names."""

import json
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.extensions.live.naming import NamingServer, naming_of

from ...support.case_texts import write
from ..hardpoints.test_guess import RACE, places, plain, rows

TEXT = "name;x;y;z\n" + rows("numbers", "P{};{};{};{}")
TRUE = {role: f"P{k}" for k, role in enumerate(RACE, 1)}


@pytest.fixture
def server(tmp_path):
    guess = naming_of(write(tmp_path, TEXT, "car.csv"), Supplied())
    made = NamingServer(guess)
    yield made
    made.close()


def ask(server, path, names=None, token=None, **headers):
    token = server.token if token is None else token
    address = f"{server.address.partition('?')[0]}{path}?token={token}"
    data = None if names is None else json.dumps(names).encode()
    try:
        with urlopen(Request(address, data, headers), timeout=10.0) as answer:
            return answer.status, answer.read().decode()
    except HTTPError as error:
        return error.code, error.read().decode()


def test_page_proposes_roles_and_saves(server, tmp_path):
    status, text = ask(server, "points")
    found = json.loads(text)
    assert status == 200
    assert {each["name"]: each["point"] for each in found["roles"] if each["point"]} == TRUE
    at = next(each["at"] for each in found["points"] if each["name"] == "P9")
    assert at == pytest.approx([1e-3 * x for x in RACE["wheel_center"]])
    assert ask(server, "names", TRUE) == (200, str(tmp_path / "car_names.toml"))
    assert server.saved.wait(5.0)
    said = Supplied("double_wishbone", "mm", "iso", names=tmp_path / "car_names.toml")
    assert places(load(tmp_path / "car.csv", said)) == places(plain(tmp_path, RACE))
    server.follow("http://127.0.0.1:1/")
    assert ask(server, "next") == (200, '"http://127.0.0.1:1/"')


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"tierod_inner": ""}, "Choose a point for tierod_inner"),
        ({"tierod_inner": "Q"}, "no role or point 'Q'"),
        ({"uca_front": "P2", "uca_rear": "P1"}, "in front of that"),
    ],
)
def test_answers_that_cannot_be(server, tmp_path, changed, message):
    status, text = ask(server, "names", TRUE | changed)
    assert status == 400
    assert message in text
    assert not (tmp_path / "car_names.toml").exists()


def test_requests_of_others_are_refused(server):
    assert ask(server, "points", token="x")[0] == 403
    assert ask(server, "names", TRUE, Origin="http://elsewhere.example")[0] == 403
    assert ask(server, "", Host="elsewhere.example")[0] == 403
    assert ask(server, "other")[0] == 404


def test_named_table_needs_no_page(tmp_path):
    file = write(tmp_path, "name;x;y;z\n" + rows("German"), "car.csv")
    assert naming_of(file, Supplied()) is None
