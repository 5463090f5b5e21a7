"""The scene of a report in a browser: it is turned, moved and played."""

from __future__ import annotations

from kincheck import cases
from kincheck.core.harness.scene import FRAMES, scene
from msgspec.structs import replace

from ..support.strut_results import results
from .test_report_browser import strut


def test_scene_turns_and_plays_in_browser(visit):
    told = visit(
        strut(),
        """
        const canvas = one("canvas"), slider = one("input[type=range]"), out = one("output"), looks = [];
        const ink = () => canvas.toDataURL();
        const note = (what) => looks.push([what, +slider.value, out.textContent, ink()]);
        note("design");
        press("ArrowLeft", canvas); note("turned");
        canvas.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 40, movementY: 10 })); note("dragged");
        press(".", canvas); note("step");
        slider.value = 0; slider.dispatchEvent(new Event("input")); note("first");
        one("[data-view='y z']").click(); note("front");
        press(" ", canvas); await until(() => +slider.value > 2); const playing = one("[data-act=play]").textContent;
        press(" ", canvas); note("played"); const still = +slider.value; await pause(5 * FRAME_MS);
        one("[data-layer=names]").click(); note("no names");
        return { looks, playing, stopped: still === +slider.value, last: +slider.max };
        """,  # noqa: E501
    )
    looks = {what: (frame, said) for what, frame, said, _ in told["looks"]}
    assert told["last"] == FRAMES - 1
    assert looks["design"][0] == looks["turned"][0] == 30
    assert looks["step"][0] == 31
    assert looks["first"][1].startswith("sample 0 · wheel travel −100 mm")  # the made-up grid's
    assert looks["played"][0] > 2
    assert (told["playing"], told["stopped"]) == ("pause", True)
    pictures = [picture for *_, picture in told["looks"]]
    assert len(set(pictures)) == len(pictures), [what for what, *_ in told["looks"]]


def test_scene_without_poses_in_browser(visit):
    shown = scene(cases.load("mcpherson_strut"), poses=False)
    told = visit(
        replace(results(), scenes={"strut": shown}),
        """
        const canvas = one("canvas"), seen = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        press(" ", canvas);
        const controls = all("[data-act=play], input[type=range]").length;
        return { said: one("output").textContent, controls, drawn: seen.some(Boolean), note: one(".scene .note").textContent };
        """,  # noqa: E501
    )
    assert (told["said"], told["controls"], told["drawn"]) == ("design position", 0, True)
    assert "no answer in this run: this is the design position" in told["note"]
