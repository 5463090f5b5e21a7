"""Components solved one after the other: the same motions as all at once, whatever the mechanism,
and programs are shared.
"""

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import Body, Point, solve
from kincheck.core.kinematics import Method, NativeSolver
from kincheck.core.kinematics.blocks.component_lanes import LANES, Cascade, ComponentLanes
from kincheck.core.kinematics.blocks.sweep import WORST
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import FROM, SIGMA, TIME, Request
from kincheck.core.kinematics.compiled.routes import Route, start_of
from kincheck.core.kinematics.continuation.sweep import follow
from kincheck.core.kinematics.continuation.walk import HALVINGS, part_of_step
from kincheck.core.mechanism.motions import Path, Ramp, Sine
from kincheck.core.program import MARGIN

from ..support.block_structures import solve_components
from ..support.mechanisms import four_bar, slider_crank
from .test_chain import LEAN, chain


def both(mechanism, path, points, *, compiled=True):
    bodies = tuple(body.name for body in mechanism.moving)
    request = Request(tuple(path.motions), points, bodies, compiled=compiled)
    found = solve_components(mechanism, path, points, bodies, compiled=compiled)
    return found, follow(Route(compile_model(mechanism, request), path), 1e-12)


def assert_alike(found, expected):
    assert found.solved.all(), found.message
    assert expected.solved.all()
    for name, motion in expected.bodies.items():
        # two orders of elimination: round-off of one times the condition, once more for each
        # derivative (library: below 100)
        for label, limit in (("r", 1e-14), ("p", 1e-14), ("v", 1e-13), ("a", 3e-12)):
            assert (
                np.abs(getattr(found.bodies[name], label) - getattr(motion, label)).max() <= limit
            )
    for name, motion in expected.points.items():
        assert np.abs(found.points[name].acceleration - motion.acceleration).max() <= 3e-12
    assert [found.details[name] for name in ("rank", "dof")] == [
        expected.details[name] for name in ("rank", "dof")
    ]


# the redundant, the open loop of several, several drivers, a sweep that does not start at the
# design
@pytest.mark.parametrize(
    "name", ["andrews_squeezer", "mcpherson_steered", "four_bar", "rssr", "delta_robot", "bricard"]
)
def test_components_give_what_one_program_gives(name):
    case = cases.load(name)
    assert_alike(*both(case.mechanism, case.sweep.path, case.points))


def test_numpy_runs_components_too():
    path = Path({"turn": Ramp(1.0)}, np.linspace(-1.0, 1.0, 9))
    assert_alike(*both(chain(3), path, ("end",), compiled=False))


@pytest.mark.parametrize(
    "times",
    [np.linspace(2.0, 3.0, 5), np.linspace(-0.2, 0.9, 70)[::-1], np.zeros(1)],
    ids=["far", "back", "one"],
)
def test_any_samples(times):
    for mechanism, driver in ((slider_crank(), "turn"), (four_bar(), "turn")):
        points = tuple(point.name for point in mechanism.points)
        assert_alike(*both(mechanism, Path({driver: Ramp(2.0)}, times), points))


@pytest.mark.parametrize("first", [-7.0, 1000.0])
def test_the_way_to_the_first_sample_is_one_and_the_time_there_another(first):
    """The drivers go there in a second of their own; the path's own time may be any."""
    mechanism, path = (
        chain(3),
        Path({"turn": Sine(1.2, 1e-2, np.pi / 2.0)}, np.linspace(first, first + 1.0, 5)),
    )
    assert not start_of(chain(3), path).stands
    assert_alike(*both(mechanism, path, ("end",)))


def test_a_singular_pose_on_the_way_to_the_first_sample_is_told_every_time():
    path = Path({"turn": Sine(2.4, 1e-2, np.pi / 2.0)}, np.linspace(2.0, 3.0, 5))
    solve = NativeSolver(method=Method.BY_COMPONENTS).prepare(chain(6), path, ("end",))
    told = [solve(1e-12).details["notes"] for _ in range(2)]
    assert told[0] == told[1]
    assert "crosses a singular pose near turn = 1.870" in told[0][0]


def test_what_is_fixed_stands_still_beside_many_components():
    m = chain(2)
    still = Body("frame", fixed=True, origin=(0.5, 0.0, 0.0))
    m = type(m)(
        m.name,
        [*m.bodies, still],
        m.joints,
        [*m.points, Point("mark", "frame", (1.0, 2.0, 3.0))],
        m.drivers,
    )
    path = Path({"turn": Ramp(1.0)}, np.array([0.0, 0.2]))
    found = solve_components(m, path, ("mark",), ("frame",))
    assert found.solved.all()
    mark, frame = found.points["mark"], found.bodies["frame"]
    given = mark.position, mark.velocity, mark.acceleration, frame.r, frame.p, frame.v, frame.a
    expected = (
        (1.0, 2.0, 3.0),
        [0.0] * 3,
        [0.0] * 3,
        (0.5, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0),
        [0.0] * 6,
        [0.0] * 6,
    )
    for values, wanted in zip(given, expected, strict=True):
        assert np.array_equal(values, [wanted] * 2)


def test_components_iterate_no_more_than_is_asked_for():
    path = Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.2, 9))
    solver = NativeSolver(last_iteration=np.inf, method=Method.BY_COMPONENTS)
    found = solver.prepare(chain(3), path, ("end",))(np.inf)
    assert (found.iterations == 1).all()
    assert found.residual > 1e-10


def test_components_built_alike_share_a_program():
    cascade = Cascade(chain(40), Request(("turn",), ("end",)))
    assert len(cascade.parts) == 41
    # the crank, the one with the point, all others
    assert sorted(len(kind.members) for kind in cascade.kinds) == [1, 1, 39]
    assert cascade.largest == 12


def test_a_chain_of_two_hundred_loops_closes_to_round_off():
    loops = 200
    turn = np.linspace(-0.3, 0.3, 33)
    found = solve_components(chain(loops), Path({"turn": Ramp(1.0)}, turn), ("end",))
    assert found.solved.all(), found.message
    assert found.residual <= 1e-15
    # the end is two hundred metres away: its coordinates round at 1.4e-14 m
    expected = np.column_stack([loops + np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0 * turn])
    assert np.abs(found.points["end"].position - expected).max() <= 3e-14


@pytest.mark.parametrize("compiled", [False, True])
def test_to_go_on_from_the_last_time_is_to_carry_its_lane(compiled):
    path, request = (
        Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.3, 10)),
        Request(("turn",), ("end",), compiled=compiled),
    )
    cascade = Cascade(chain(3), request)
    for count in (LANES, 5):  # all that there are, or the last ones are as the last
        going, carrying = (ComponentLanes(cascade) for _ in range(2))
        for lanes in (going, carrying):
            lanes.accept(1e-12)
            lanes.depart(0.0, path)
            for first in (0.0, 0.1, 0.2):  # there and back again
                assert (lanes.attempt(first + np.linspace(0.005, 0.1, count), path) > 0.0).all()
                if lanes is going:
                    lanes.go_on()
                else:
                    lanes.carry(count - 1)
        ends = [lanes.anchor(0.3).pose for lanes in (going, carrying)]
        for a, b in zip(*ends, strict=True):
            np.testing.assert_array_equal(a, b)
        model = cascade.kinds[0].model
        time = [*model.plan.fixed].index(model.slots[FROM + TIME])
        assert ends[0][0][0, time] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("part", "compiled"), [(0, True), (1, False), (1, True), (2, True), (3, False), (3, True)]
)
def test_a_sample_is_as_good_as_its_worst_component(part, compiled):
    """The first, which is driven, any of those that are alike, and the last; what is not a number
    is the worst of all.
    """
    path, request = (
        Path({"turn": Ramp(1.0)}, np.linspace(0.0, 0.3, 10)),
        Request(("turn",), ("end",), compiled=compiled),
    )
    cascade = Cascade(chain(3), request)
    lanes, times = ComponentLanes(cascade), np.linspace(0.005, 0.1, LANES)
    lanes.accept(1e-12)
    lanes.depart(0.0, path)
    assert len(cascade.parts) == 4
    assert (lanes.attempt(times, path) > 0.0).all()
    np.testing.assert_array_equal(
        lanes.worst[WORST.index("closure")], lanes.each("closure").max(axis=0)
    )
    np.testing.assert_array_equal(lanes.worst[WORST.index(SIGMA)], lanes.each(SIGMA).min(axis=0))
    kind, member = cascade.place[part]
    anchor, model = lanes.anchor(0.0), kind.model
    column = [*model.plan.fixed].index(model.vectors[FROM + "q b0"][0])
    anchor.pose[cascade.kinds.index(kind)][member, column] = np.nan
    lanes.restore(anchor)
    assert not (lanes.attempt(times, path) > 0.0).any()
    for name in ("closure", MARGIN):
        assert np.isnan(lanes.worst[WORST.index(name)]).all()


def test_nothing_may_be_wanted():
    found = solve(chain(30), "turn", np.linspace(0.0, 0.3, 5), points=())
    assert found.details["components"] == 31
    assert found.solved.all()
    assert not found.points


@pytest.mark.parametrize("lanes", [8, 16])
@pytest.mark.parametrize("part", [1, 2, 7, 8, 9, 14, 15, 16, 17, 30, 31, 39])
def test_a_step_is_divided_as_often_whatever_the_lanes(part, lanes):
    """Lanes are fewer than the parts of a step: those take turns, and no part counts whose half is
    not reached.
    """
    tried = list[np.ndarray]()

    def attempt(times):
        assert len(times) == lanes
        tried.append(times)
        return np.where(times - 1.0 <= 2.0**-part, 1.0, -1.0)

    lane, time = part_of_step(1.0, 2.0, attempt, lanes)
    assert time == 1.0 + 2.0**-part == tried[-1][lane]
    # that of which no half is tried is no part
    last = lambda times: tried.append(times) or np.where(times - 1.0 <= 2.0**-HALVINGS, 1.0, -1.0)  # noqa: E731
    assert part_of_step(1.0, 2.0, last, lanes) is None
    assert tried[-1][-1] <= 1.0 + 2.0**-HALVINGS
