"""The server of the live page: who gets in, what it answers, and how it ends."""

import base64
import http.client
import json
import os
import re
import signal
import stat
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import monotonic, perf_counter

import numpy as np
import pytest
from kincheck import KincheckError, load, run, sweep
from kincheck import live as kincheck_live
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.extensions.live import table as live_table
from kincheck.core.extensions.live.model import LiveModel
from kincheck.core.extensions.live.protocol import (
    LARGEST_MESSAGE,
    MOST_MESSAGES,
    Move,
    Propose,
    Rank,
    Reach,
    Solve,
    Vary,
)
from kincheck.core.extensions.live.table import LiveTable
from kincheck.core.extensions.measured.reference_curve import CurveOptions, with_curve
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from ...support.examples import examples
from .conftest import CAR, TRAVEL, Page, page_of

TYPED, VARY, REQUESTS = examples(__file__, "typed", "vary", "requests")


def status(server, path, method="GET", **headers):
    """The status of a request, whose host is this machine unless given; and its headers."""
    talk = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    talk.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        talk.putheader(name.replace("_", "-"), value)
    talk.endheaders()
    answer = talk.getresponse()
    answer.read()
    return answer.status, answer.headers


def test_server_listens_on_loopback(served):
    assert served.listener.socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize(("path", "header", "expected"), REQUESTS)
def test_request_without_token_is_refused(served, path, header, expected):
    headers = dict([header.split()] if header else [])
    assert status(served, path.format(token=served.token), **headers)[0] == expected


def test_live_page_security_policy(served):
    _, headers = status(served, f"/?token={served.token}")
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe-inline'; connect" in policy.partition("style-src-attr")[2]
    assert headers["Referrer-Policy"] == "no-referrer"


def test_post_is_refused(served):
    assert status(served, f"/?token={served.token}", "POST")[0] == 403


@pytest.mark.parametrize("case", ["token", "origin", "host"])
def test_socket_without_token_is_refused(served, case):
    host = f"127.0.0.1:{served.port}"
    token = "x" if case == "token" else served.token
    origin = "http://evil.example" if case == "origin" else f"http://{host}"
    more = {"Host": "evil.example"} if case == "host" else {}
    address = f"ws://{host}/socket?token={token}"
    with (
        pytest.raises(InvalidStatus, match="403"),
        connect(address, origin=origin, additional_headers=more),
    ):
        pass


@pytest.mark.parametrize(
    "text",
    [
        "",
        pytest.param("[" * 9000, id="nested"),
        "{}",
        '{"type": "solve"}',
        '{"type": "solve", "points": [[1, 2, NaN]]}',
        '{"type": "solve", "points": [[1, 2, 1e999]]}',
        '{"type": "solve", "points": [[1, 2]]}',
        '{"type": "solve", "points": [], "more": 1}',
        '{"type": "rank", "points": [], "output": ""}',
        '{"type": "check", "engines": []}',
        '{"type": "eval", "text": "1"}',
        b"\xff\x00",
    ],
)
def test_bad_message_is_answered_invalid(page, text):
    page.socket.send(text)
    assert page.told("invalid")["message"].startswith("message: ")
    assert page.answers(4)


def test_flood_of_messages_closes_socket(page, open_page):
    for _ in range(2 * MOST_MESSAGES):
        with suppress(ConnectionClosed):
            page.socket.send("{}")
    with suppress(ConnectionClosed):
        while True:
            page.socket.recv(timeout=20)
    assert page.socket.close_code == 1008
    other = open_page()
    assert other.answers(1)


def test_slow_page_delays_no_page(page, open_page):
    """A page that reads nothing: its answers wait in its socket, and the newest comes last."""
    for k in range(300):
        page.solve(page.moved("uca_outer", 1, 0.01 * k), id=k)
    other = open_page()
    for k in range(3):
        assert other.answers(k)
    while page.told("answer")["id"] != 299:
        pass


def test_killed_worker_gives_crashed_verdict(page):
    page.say(type="check", engines=["native", "mujoco"], points=page.points)
    children = Path(f"/proc/{os.getpid()}/task")
    killed = set[int]()
    end = monotonic() + 60
    while not killed and monotonic() < end:
        for task in children.glob("*/children"):
            for child in map(int, task.read_text().split()):
                if b"-P" in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0"):
                    os.kill(child, signal.SIGKILL)
                    killed.add(child)
    verdicts = [page.told("verdict") for _ in range(2)]
    assert "crashed" in {each["outcome"] for each in verdicts}
    assert [each["last"] for each in verdicts] == [False, True]
    assert page.answers(9)


def test_oversized_message_closes_socket(page):
    page.socket.send(" " * (LARGEST_MESSAGE + 1))
    with pytest.raises(ConnectionClosed):
        page.told("answer")


def test_answers_keep_message_number(page):
    """`Page` holds both ways against the schema."""
    numbers = {"points": page.points}
    asked = {
        "answer": {"type": "solve", **numbers},
        "ranking": {"type": "rank", **numbers, "output": "toe"},
        "refused": {"type": "solve", "points": page.moved("uca_outer", 2, -400)},
        "invalid": {"type": "vary", **numbers, "output": "toe"},
        "verdict": {"type": "check", **numbers, "engines": ["native"]},
        "saved": {"type": "save", **numbers, "name": "new.csv"},
        "exported": {"type": "export", "kind": "csv", "engines": ["native"]},
    }
    for number, (kind, message) in enumerate(asked.items(), 5):
        page.say(**message, id=number)
        assert page.told(kind)["id"] == number


def test_live_mechanism_follows_schema():
    """Opened from Python, as in a notebook."""
    server = kincheck_live("mcpherson_strut_loaded")
    with page_of(server) as socket:
        page = Page(socket)
        (driver,) = page.opening["drivers"]
        page.solve([])
        page.told("answer")
        page.say(type="reach", driver=driver["name"])
        assert page.told("reached")["low"] < driver["design"]
        for measured in (False, True):
            page.say(type="move", drivers={driver["name"]: 0.02}, measured=measured)
            pose = page.told("pose")
            assert ("tie_rod_force_y" in pose["outputs"]) == measured
            assert bool(pose["reactions"]) == measured
        assert "strok" in page.refusal(type="move", drivers={"strok": 0.0})
        assert (
            page.refusal(type="rank", points=[], output="toe") == "a model has no answer to 'rank'"
        )
    server.close()


def test_live_case_refuses_variation(tmp_path):
    with pytest.raises(KincheckError, match="--vary: rssr is no table of hardpoints; give one"):
        kincheck_live(load("rssr"), variation=tmp_path / "vary.toml")


def test_live_case_follows_page(car):
    server = kincheck_live(car, TRAVEL)
    with page_of(server) as socket:
        page = Page(socket)
        page.solve(page.moved("uca_outer", 2, -400))
        page.told("refused")
        assert server.case.mechanism == load(car, TRAVEL).mechanism
        page.solve(page.moved("uca_outer", 1, 2.0))
        page.told("answer")
    assert server.case.mechanism.point("uca_outer").position[1] == pytest.approx(0.542)
    assert server.address in server._repr_html_()
    assert server.address in repr(server)
    server.close()


@pytest.mark.parametrize(("text", "told"), TYPED)
def test_typed_text_message_equals_file(page, car, text, told):
    message = page.refusal(type="read", point="uca_outer", axis="y", text=text)
    assert told in message
    car.write_text(CAR.replace("-15,540,", f'-15,"{text}",'), "utf-8")
    with pytest.raises(KincheckError) as error:
        load(car)
    assert str(error.value) == message


def test_edit_answer_equals_run(page, car):
    """The numbers of a program whose inputs are hardpoints, against one made for the table."""
    points = page.moved("uca_outer", 1, 10.0)
    page.solve(points, id=1)
    found = page.told("answer")["outputs"]
    page.say(type="save", points=points, name="other.csv", id=2)
    assert page.told("saved")["name"] == "other.csv"
    (record,) = run(load(car.with_name("other.csv"), TRAVEL), "native").records
    assert {*record.outputs} == {*found}
    for name, expected in record.outputs.items():
        assert found[name] == pytest.approx(expected.position, rel=1e-9, abs=1e-12, nan_ok=True)


def test_ranking_equals_difference(page):
    """Against the difference of two tables that are read and solved anew."""
    page.say(type="rank", points=page.points, output="toe")
    effects = {(e["point"], e["axis"]): e["slopes"] for e in page.told("ranking")["effects"]}
    toe = []
    for by in (0.05, -0.05):
        page.solve(page.moved("tierod_inner", 2, by))
        toe.append(page.told("answer")["outputs"]["toe"])
    for slope, sample in zip(effects["tierod_inner", "z"], (0, 10, 20), strict=True):
        assert slope == pytest.approx((toe[0][sample] - toe[1][sample]) / 1e-4, rel=1e-5, abs=1e-9)


def test_refusal_names_point(page):
    page.solve(page.moved("uca_outer", 2, -400), id=7)
    found = page.told("refused")
    assert found["point"] == "uca_outer"
    assert "expected" in found["message"] or "not above" in found["message"]


def test_unreached_samples_are_null(page):
    page.solve(page.moved("tierod_outer", 1, -40.0), id=7)
    message = json.loads(page.socket.recv(timeout=60))
    if message["type"] == "answer" and not all(message["solved"]):
        assert message["message"]
        lost = [k for k, solved in enumerate(message["solved"]) if not solved]
        assert all(message["outputs"]["toe"][k] is None for k in lost)


def test_last_edit_is_answered(page):
    for k in range(100):
        page.solve(page.moved("uca_outer", 1, 0.1 * k), id=k)
    answers = [page.told("answer")["id"]]
    while answers[-1] != 99:
        answers.append(page.told("answer")["id"])
    assert len(answers) < 100


def test_two_pages_are_independent(open_page):
    one, other = open_page(), open_page()
    one.solve(one.moved("uca_outer", 1, 5.0), id=1)
    other.solve(other.points, id=1)
    first, second = one.told("answer")["outputs"], other.told("answer")["outputs"]
    assert first["camber"] != second["camber"]


def test_server_survives_closed_page(served, open_page):
    gone = open_page()
    gone.solve(gone.points)
    gone.socket.socket.close()
    page = open_page()
    assert page.answers(3)


def test_save_keeps_comments_and_file(page, car):
    page.say(type="save", points=page.moved("uca_front", 0, 2.5), name="car_2.csv")
    page.told("saved")
    assert car.read_text("utf-8") == CAR
    expected = CAR.replace("uca_front,90,", "uca_front,92.5,")
    assert car.with_name("car_2.csv").read_text("utf-8") == expected


@pytest.mark.parametrize(
    "name",
    ["car.csv", "../car_2.csv", "/tmp/x.csv", ".x.csv", "x.toml", "a\0.csv", "x", "a/b.csv"],
)
def test_save_refuses_unsafe_names(page, car, name):
    before = sorted(car.parent.rglob("*"))
    assert page.refusal(type="save", points=page.moved("uca_front", 0, 2.5), name=name).startswith(
        "save "
    )
    assert sorted(car.parent.rglob("*")) == before
    assert car.read_text("utf-8") == CAR


def test_save_follows_no_link(page, car):
    victim = car.with_name("victim")
    car.with_name("link.csv").symlink_to(victim)
    page.say(type="save", points=page.points, name="link.csv")
    page.told("invalid")
    assert not victim.exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_save_in_unwritable_folder(page, car):
    car.parent.chmod(stat.S_IRUSR | stat.S_IXUSR)
    assert "cannot be written" in page.refusal(type="save", points=page.points, name="other.csv")


def test_changed_file_is_read_again(page, car, open_page):
    car.write_text(CAR.replace("uca_front,90,", "uca_front,95,"), "utf-8")
    page.solve(page.points)
    assert "has changed" in page.told("changed")["message"]
    assert open_page().points[0] == [95.0, 260.0, 285.0]


def test_spoilt_file_refuses_page(car, served, page):
    car.write_text("name,x,y,z\n", "utf-8")
    host = f"127.0.0.1:{served.port}"
    with connect(f"ws://{host}/socket?token={served.token}", origin=f"http://{host}") as other:
        assert "expected hardpoints" in json.loads(other.recv(timeout=20))["message"]
    assert page.answers(5)


def test_check_gives_verdict_per_engine(page):
    page.say(type="check", engines=["native"], points=page.points, id=2)
    found = page.told("verdict")
    assert (found["engine"], found["outcome"], found["last"]) == ("native", "not judged", True)
    assert "os:system" in page.refusal(type="check", engines=["os:system"], points=page.points)


def test_slider_pose_closes_loops(tmp_path):
    live = LiveModel(tmp_path / "rssr", load("rssr"))
    (driver,) = live.drivers.values()
    begin = perf_counter()
    found = live.move(Move(drivers={driver.name: driver.design + 0.3}, measured=True))
    assert 0.0 < sum(found.milliseconds.values()) < 1e3 * (perf_counter() - begin)
    assert found.share == 1.0
    assert found.distance is not None
    assert found.distance > 0.0
    assert found.drivers[driver.name] == pytest.approx(driver.design + 0.3, abs=1e-12)


def test_open_loop_is_reported(tmp_path):
    case = load("rssr")
    joints = [
        replace(each, length=each.length + 9.0) if each.name == "rod" else each
        for each in case.mechanism.joints
    ]
    wrong = replace(case, mechanism=replace(case.mechanism, joints=tuple(joints)))
    found = LiveModel(tmp_path / "rssr", wrong).solve(Solve(points=[]))
    assert not any(found.solved)
    assert re.search(r"rows are off: rod: .* by \d", found.message)
    assert found.drawing["bodies"]  # the design position


def test_slider_stops_at_last_pose(tmp_path):
    live = LiveModel(tmp_path / "strut", load("mcpherson_strut"))
    (driver,) = live.drivers.values()
    found = live.move(Move(drivers={driver.name: 5.0}))
    reached = live.reach(Reach(driver=driver.name))
    assert 0.0 < found.share < 1.0
    assert found.message
    assert reached.high < driver.high
    assert reached.messages[1]


def kincheck(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "kincheck", "serve", *map(str, words), "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_serve_interrupted_has_status_130(car):
    process = kincheck(car)
    assert process.stdout is not None
    address = process.stdout.readline()
    assert address.startswith("http://127.0.0.1:")
    process.send_signal(signal.SIGINT)
    out, errors = process.communicate(timeout=30)
    assert (process.returncode, out, errors) == (130, "", "kincheck: interrupted\n")


def test_serve_once_ends_with_page(car):
    process = kincheck(car, "--once")
    assert process.stdout is not None
    host, _, token = process.stdout.readline().strip().partition("/?token=")
    with connect(f"{host.replace('http', 'ws')}/socket?token={token}", origin=host):
        pass
    process.communicate(timeout=60)
    assert process.returncode == 0


@pytest.mark.parametrize("words", ["absent.csv", "four_bar --port 1"])
def test_unservable_model_has_status_2(words, car):
    if os.geteuid() == 0:
        words = words.replace("--port 1", "--port 70000")
    process = kincheck(*words.split())
    out, errors = process.communicate(timeout=60)
    assert (process.returncode, out) == (2, "")
    assert "Traceback" not in errors


@pytest.mark.by_day(2)
@pytest.mark.parametrize("axle", ["heave", "roll", "steer"])
def test_axle_answer_equals_run(car, axle):
    """Derivatives by travel with the steering held too."""
    supplied = Supplied(travel="0.01:5", axle=axle)
    live = LiveTable(car, supplied)
    (record,) = run(load(car, supplied), "native").records
    outputs = live.solve(Solve(points=live.positions)).outputs
    assert {*outputs} == {*record.outputs}
    for name, expected in record.outputs.items():
        wanted = [np.nan if each is None else each for each in expected.position]
        assert outputs[name] == pytest.approx(wanted, rel=1e-9, abs=1e-11, nan_ok=True), name
    soon = live.solve(Solve(points=live.positions, whole=False)).outputs
    assert {*soon} == {*outputs}


@pytest.mark.by_day(2)
@pytest.mark.parametrize(
    ("axle", "travel", "whole"),
    [("roll", "0.06:161", True), ("steer", "0.04:161", True), ("steer", "0.06:161", False)],
)
def test_axle_edit_divides_no_step(car, monkeypatch, axle, travel, whole):
    """Each divided step is found by itself, some hundred times as long as the others; the rack of
    the last case locks up, which may wait until a gesture rests.
    """
    live = LiveTable(car, Supplied(travel=travel, axle=axle))
    marches = []
    march = "kincheck.core.extensions.designs.design_batch.follow_samples"
    monkeypatch.setattr(march, lambda *_: marches.append(1))
    answer = live.solve(Solve(points=live.positions, whole=whole))
    ranking = live.rank(Rank(points=live.positions, output="left_toe"))
    assert np.isfinite(ranking.effects[0].slopes).all()
    assert marches == []
    assert all(answer.solved) == whole


RIG = "# signs: iso8855\ntravel [mm],Toe Angle [deg]\n-30,0.22\n0,0.01\n30,-0.18\n"


def test_live_reference_has_tolerance(car, tmp_path):
    (tmp_path / "rig.csv").write_text(RIG, "utf-8")
    options = CurveOptions(accuracy=["toe=0.02 deg"])
    live = LiveTable(car, TRAVEL, lambda case: with_curve(case, tmp_path / "rig.csv", options)[0])
    found = live.opening([]).reference["toe"]
    assert found.tolerance == pytest.approx(np.radians(0.02 + 0.005))  # and half a digit
    known = [each for each in found.values if np.isfinite(each)]
    assert np.degrees(known) == pytest.approx([0.22, 0.01, -0.18])
    judged = live.referenced(live.edited_case(live.positions))
    (record,) = run(judged, "native").records
    assert record.errors["toe"].position.tolerance == pytest.approx(found.tolerance)


def test_live_spread_equals_sweep(car, tmp_path):
    (tmp_path / "vary.toml").write_text(VARY, "utf-8")
    live = LiveTable(car, TRAVEL, vary=tmp_path / "vary.toml")
    opening = live.opening([])
    assert opening.varied
    assert opening.limits == {"toe": (-np.inf, pytest.approx(np.radians(0.3)))}
    found = live.vary(Vary(points=live.positions, output="toe"))
    assert found.samples == [0, 10, 20]
    assert found.bins[1] is None  # toe at design is a number of the table
    case = load(car, TRAVEL)
    envelope = sweep(case, tmp_path / "vary.toml", samples=found.variants).outputs["toe"]
    for sample in (0, 20):
        bins = found.bins[found.samples.index(sample)]
        assert bins is not None
        assert sum(bins.counts) == found.variants
        assert bins.edges[0] == pytest.approx(envelope.min[sample], rel=1e-9)
        assert bins.edges[-1] == pytest.approx(envelope.max[sample], rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "start"), [("csv", b"stroke"), ("xlsx", b"PK"), ("report", b"<!")]
)
def test_live_export_files(page, kind, start):
    points = page.moved("uca_outer", 1, 2.0)
    page.say(type="export", kind=kind, engines=["native"], points=points)
    found = page.told("exported")
    assert found["name"] == f"car.{'html' if kind == 'report' else kind}"
    assert base64.b64decode(found["content"]).startswith(start)


@pytest.mark.parametrize("axle", [None, "heave"])
def test_live_edits_compile_nothing(car, tmp_path, monkeypatch, patch, axle):
    """The first answer has compiled all that an edit runs: none waits for the compiler."""
    pytest.importorskip("llvmlite")
    jit = pytest.importorskip("kincheck.core.extensions.llvm.jit")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    live = LiveTable(car, replace(TRAVEL, axle=axle))
    compiled = []
    patch.setattr(jit, "load", lambda *content: compiled.append(content))
    points = [list(each) for each in live.positions]
    for k in range(60):
        points[5][2] += 0.01 * k
        assert all(live.solve(Solve(points=points)).solved)
    assert compiled == []


def test_live_page_without_proposals(car, monkeypatch):
    monkeypatch.setattr(live_table, "offers", lambda kind: {})
    live = LiveTable(car, TRAVEL)
    assert not live.opening(()).tunable
    asked = Propose(points=live.positions, bands={"toe": (-1e-3, 1e-3)}, boxes={"uca_outer z": 1.0})
    with pytest.raises(KincheckError, match="is not installed"):
        live.propose(asked)
