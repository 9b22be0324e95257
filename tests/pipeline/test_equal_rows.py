"""Programs of nets with many equal rows: continued from nets with few rows, and equal to Programs that are derived."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import eomgen
from benchmarks import chains
from benchmarks.large_scenes import NET, SPRING
from eomgen.base.data import fields, is_dataclass
from eomgen.codegen.continuation import IrregularSamples
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.codegen.targets.register import C
from eomgen.formula.nodes import Number, Symbol
from eomgen.integrators.newton import stages
from eomgen.mechanics.derive import derive
from eomgen.mechanics.initial_coordinates import free_start
from eomgen.pipeline import equal_parts, equal_rows
from eomgen.pipeline.pipeline import build_reproducible
from eomgen.pipeline.programs import write_program
from eomgen.pipeline.requests import ProgramRequest
from eomgen.pipeline.scenes import SCENES
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene
from eomgen.system.signals import Parameter
from eomgen.system.terms import Selection

WIDTH = 3
Change = Callable[[str], str]


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let short nets be continued."""
    monkeypatch.setattr(equal_parts, "_WORK", 0.01)
    monkeypatch.setattr(equal_rows, "_FEW", 60)
    monkeypatch.setattr(stages, "_ROWS", 20)


def net(rows: int, change: Change = lambda text: text) -> Scene:
    """Return a net of three knots in a row."""
    text = change(NET).replace("ROWS", f"{rows}").replace("WIDE", f"{WIDTH}")
    return load_toml(text.replace("SPRING", SPRING))


def short_scene(rows: equal_rows.EqualRows, removed: int) -> Scene:
    """Return the scene without so many rows of its only long run."""
    (long,) = (run for run in rows.runs if run.groups > 8)
    short = rows.fewer([removed * (run is long) for run in rows.runs])
    assert short is not None
    return short


def programs(scene: Scene) -> tuple[Program, Program]:
    """Return the Program of a scene as it is built, and as it is derived."""

    def program(front_end: Any) -> Program:
        return write_program(
            ProgramRequest(scene, front_end, Selection(), "generalized_alpha"), C, build_reproducible, for_runs=True
        )[0]

    return program(SCENES), program(dataclasses.replace(SCENES, program=lambda document, derived: None))


def assert_alike(one: Program, other: Program) -> None:
    """Compare two Programs, the matrix of the step by its assembly in loops."""
    one, other = (dataclasses.replace(item, method={**item.method, "solver": {}}) for item in (one, other))
    assert one == other


def recorded_programs(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Return a list to which the Programs are added that are continued."""
    made, program = [], equal_rows.EqualRows.program

    def recorded(rows: equal_rows.EqualRows, derived: Any) -> Any:
        made.append(program(rows, derived))
        return made[-1]

    monkeypatch.setattr(equal_rows.EqualRows, "program", recorded)
    return made


def files(program: Program) -> dict[str, str]:
    return generate_files(dataclasses.replace(program, later=()))


@pytest.mark.long
def test_the_program_of_a_net_is_the_one_that_is_derived() -> None:
    """Another knot in the middle, and springs whose stiffness grows from row to row."""

    def stiffer(text: str) -> str:
        return text.replace('second = "eye_{i}_{j}", SPRING', 'second = "eye_{i}_{j}", stiffness = "{1000 + 0.1 * i}"')

    scene = with_heavy(net(60, stiffer), 91)
    assert scene.springs[0].stiffness != scene.springs[-110].stiffness
    rows = equal_rows.equal_rows(scene)
    assert rows is not None
    assert (rows.first, rows.last) == (1, 60)
    made, derived = programs(scene)
    assert_alike(made, derived)
    assert files(made) == files(derived)


@pytest.mark.parametrize("count", [12, 15])
def test_a_net_with_fewer_rows_is_the_net_of_so_many(count: int) -> None:
    rows, short = equal_rows.equal_rows(net(40)), net(count)
    assert rows is not None
    made = short_scene(rows, 40 - count)
    for name in ("bodies", "joints", "points", "elements", "groups"):
        assert getattr(made, name) == getattr(short, name)


CHANGES: dict[str, Change] = {
    "numbers without a rule": lambda text: text.replace("mass = 0.1", 'mass = "{0.1 + 0.01 * i * i}"'),
    "a moving base": lambda text: text + '[base]\nposition = ["0.1*sin(t)", "0", "0"]\n',
    "joint coordinates": lambda text: text.replace('coordinates = "absolute"', 'coordinates = "joint"'),
}


def with_heavy(scene: Scene, *numbers: int) -> Scene:
    """Return a scene in which some bodies have another mass."""
    bodies = list(scene.bodies)
    for number in numbers:
        bodies[number] = dataclasses.replace(bodies[number], mass=bodies[0].inertia[0])
    return dataclasses.replace(scene, bodies=tuple(bodies))


@pytest.mark.parametrize(
    ("rows_of_net", "heavy", "runs", "plan"),
    [
        (48, (45,), [(1, 1), (1, 14), (1, 1), (1, 32)], (False, False, False, True)),
        (48, (143,), [(1, 1), (1, 46), (1, 1)], (False, True, False)),
        (60, range(1, 180, 6), [(1, 1), (2, 29), (1, 1)], (False, True, False)),
    ],
)
def test_runs_of_rows_between_others(
    rows_of_net: int, heavy: Any, runs: list[tuple[int, int]], plan: tuple[bool, ...]
) -> None:
    """A heavy knot in the middle and at the end, and in each second row."""
    rows = equal_rows.equal_rows(with_heavy(net(rows_of_net), *heavy))
    assert rows is not None
    assert [(run.period, run.groups) for run in rows.runs] == runs
    assert rows.plans[0][0].grows == plan


def test_rows_after_the_removed_ones_keep_their_entries() -> None:
    scene = net(48)
    rows = equal_rows.equal_rows(with_heavy(scene, 143))
    assert rows is not None
    assert short_scene(rows, 36).bodies[35].mass == scene.bodies[143].inertia[0]


def test_rows_that_distant_ones_name_are_kept() -> None:
    """A spring between distant rows, and a point without a row on another one."""
    scene = net(48)
    spring = next(item for item in scene.springs if item.name == "along_2_1")
    far = dataclasses.replace(spring, name="far", first="eye_1_1", second="eye_24_1")
    marked = dataclasses.replace(scene.points[0], name="marked", body="knot_40_1")
    changed = dataclasses.replace(scene, elements=(*scene.elements, far), points=(*scene.points, marked))
    rows = equal_rows._find_rows(changed)
    assert rows is not None
    assert rows.named_from_afar == [1, 24, 40]
    short = rows.fewer([(run.groups > 10) * 5 for run in rows.runs])
    assert short is not None
    assert next(item for item in short.springs if item.name == "far").second == "eye_19_1"
    assert next(item for item in short.points if item.name == "marked").body == "knot_30_1"


def chain_of_stiffness(stiffness: Callable[[int], Any], count: int = 400) -> Scene:
    """Return a chain of hinges in joint coordinates with a stiffness for each joint."""
    scene = hinges(count)
    joints = [dataclasses.replace(joint, stiffness=stiffness(k)) for k, joint in enumerate(scene.joints)]
    return dataclasses.replace(scene, joints=tuple(joints))


LOCKED = {300: Number(1e10)}
NOISE = np.diff(np.linspace(0.0, 300.0, 401))


@pytest.mark.parametrize(
    "stiffness",
    [
        lambda k: Number(100.0 + 5.0 * max(k - 200, 0)),
        lambda k: Number(100.0 + min(k, 200)),
        lambda k: Number(100.0 + k if k != 200 else 5000.0),
        lambda k: Number(NOISE[k] if k != 200 else 5.0),
        lambda k: LOCKED.get(k, Number(1.0 if k < 200 else 5.0)),
        lambda k: Number(100.0 + 1e-7 * max(k - 200, 0) ** 2),
    ],
    ids=["bend", "end of growth", "another one", "rounding", "locked joint", "slow bend"],
)
def test_numbers_that_grow_otherwise_are_not_continued(stiffness: Callable[[int], Any]) -> None:
    """A short scene would lose the numbers, or have these of other rows."""
    scene = chain_of_stiffness(stiffness)
    rows = equal_rows.equal_rows(scene)
    if rows is not None:  # constant in each run: all numbers are in the short scene
        step = rows.plans[0][0]
        short = rows.fewer([step.number * step.more * long for long in step.grows])
        assert short is not None
        assert {joint.stiffness for joint in short.joints} == {joint.stiffness for joint in scene.joints}


@dataclasses.dataclass(frozen=True)
class Made:
    """Stands for the Program that is continued."""

    scenes: list[Scene]
    number: int
    functions: tuple[()] = ()
    initial_q: Any = None
    initial_v: Any = None


def test_three_shorter_scenes_are_derived_with_samples_of_their_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(equal_parts, "continued_program", lambda made, number, rule: Made(made, number))
    scene, asked = net(40), []
    rows = equal_rows.equal_rows(scene)
    assert rows is not None
    ((least, more, number, _),) = rows.plans[0]

    def derived(short: Scene, sample: Any) -> Any:
        asked.append((len(short.bodies) // WIDTH, sample.parts, sample.missing))
        return short, "no stepper"

    made, refusal = rows.program(derived)  # type: ignore[misc, arg-type]
    edges = sum(run.groups for run in rows.runs if run.groups == 1)
    sizes = [least + more * k for k in range(3)]
    assert sorted(asked) == [(size + edges, size, 40 - edges - size) for size in sizes]
    assert [len(short.bodies) // WIDTH for short in made.scenes] == [size + edges for size in sizes]
    assert (made.number, refusal) == (number, "no stepper") and sizes[0] + more * number == 40 - edges
    np.testing.assert_array_equal(made.initial_q, free_start(scene)[0])  # type: ignore[index]
    refusals = iter(("", "", "no stepper"))
    assert rows.program(lambda short, sample: (short, next(refusals, ""))) is None  # type: ignore[arg-type, return-value]


def test_a_scene_whose_samples_are_irregular_is_derived_whole() -> None:
    def derived(scene: Scene, sample: Any) -> Any:
        raise IrregularSamples("a list")

    rows = equal_rows.equal_rows(net(40))
    assert rows is not None and rows.program(derived) is None


def test_numbers_that_grow_from_row_to_row_are_the_scene_s_own() -> None:
    """Lists of three shorter nets determine the list of the whole net, with the same bits."""

    def stiffer(text: str) -> str:
        return text.replace('second = "eye_{i}_{j}", SPRING', 'second = "eye_{i}_{j}", stiffness = "{1000 + 0.1 * i}"')

    scene = net(40, stiffer)
    rows = equal_rows.equal_rows(scene)
    assert rows is not None
    continued = rows.rule((), 7)
    whole = [1000.0 + 0.1 * k for k in range(1, 40)]
    own = sorted({spring.stiffness.value for spring in scene.springs} - {scene.springs[0].stiffness.value})
    assert set(whole[:30]) & set(own) and len(rows.growing) >= len(own)
    lists = [[value for value in own[: 6 + 2 * k] for _ in range(2)] for k in range(3)]
    assert continued(tuple(lists)) == [value for value in own[: 6 + 2 * 7] for _ in range(2)]  # type: ignore[arg-type]
    for other in (
        (lists[0], lists[1], [*lists[2][:-1], own[30]]),  # another end
        (lists[0], lists[1], [own[1], *lists[2][1:]]),  # another beginning
        ([own[1], *lists[0][1:]], lists[1], lists[2]),
        (lists[0][:3], lists[0][:5], lists[0][:7]),  # fewer rows than two steps
        ([1], [1, 2], [1, 2, 3]),
    ):
        assert continued(other) is None  # type: ignore[arg-type]


def test_parameters_with_names_of_rows_are_derived_whole() -> None:
    scene = chain_of_stiffness(lambda k: Symbol("parameter", f"rod{k}"))
    names = tuple(Parameter(f"rod{k}", 2.0 + k // 200) for k in range(400))
    assert equal_rows.equal_rows(dataclasses.replace(scene, parameters=names)) is None


def test_a_row_with_other_data_is_kept() -> None:
    """Stops of one joint, and the Lie group of one body."""
    chain, grouped = hinges(400), chains.scene("absolute", "hinge", 200)
    joints = list(chain.joints)
    joints[200] = hinges(201, **STOPS).joints[200]
    groups = {**grouped.groups, grouped.bodies[100].name: "R3xSO3"}
    stopped, grouped = dataclasses.replace(chain, joints=tuple(joints)), dataclasses.replace(grouped, groups=groups)
    for scene in (stopped, grouped):
        rows = equal_rows.equal_rows(scene)
        assert rows is not None
        short = rows.fewer([10 * (run.groups > 20) for run in rows.runs])
        assert short is not None
        assert len(short.bodies) == len(scene.bodies) - 20
        assert sum(bool(joint.stops) for joint in short.joints) == (scene is stopped)
        assert [*short.groups.values()].count("R3xSO3") == [*scene.groups.values()].count("R3xSO3")


@pytest.mark.parametrize("name", CHANGES)
def test_other_scenes_have_no_equal_rows(name: str) -> None:
    assert equal_rows.equal_rows(net(48, CHANGES[name])) is None


def test_the_start_of_free_bodies_is_the_start_of_the_equations() -> None:
    def moved(text: str) -> str:
        text = text.replace("mass = 0.1,", "mass = 0.1, center_of_mass = [0.1, 0.2, -0.3],")
        start = 'position = ["{i}", "{j}", 0], orientation = [0.5, 0.5, -0.5, 0.5], velocity = [1, 2, 3, 4, 5, 6]'
        return text.replace('position = ["{i}", "{j}", 0]', start)

    for change in (lambda text: text, moved):
        scene = net(4, change)
        start = free_start(scene)
        assert start is not None
        system = derive(scene, ["mass"])
        np.testing.assert_allclose(start[0], system.initial_q, rtol=0, atol=1e-15)
        np.testing.assert_allclose(start[1], system.initial_v, rtol=0, atol=1e-14)


def test_a_chain_with_fewer_links_is_the_chain_of_so_many() -> None:
    rows = equal_rows.equal_rows(chains.scene("absolute", "hinge", 120))
    assert rows is not None
    made, short = short_scene(rows, 100), chains.scene("absolute", "hinge", 20)
    for name in ("bodies", "joints", "elements", "groups"):
        assert getattr(made, name) == getattr(short, name)


def test_chains_that_are_short_or_have_other_axes_are_derived_whole() -> None:
    assert equal_rows.equal_rows(chains.scene("absolute", "hinge", 20)) is None
    assert equal_rows.equal_rows(chains.scene("absolute", "skew", 120)) is None
    assert equal_rows.equal_rows(chains.scene("absolute", "hinge", 120, ["mass"])) is None
    scene = chains.scene("absolute", "hinge", 120)
    stiff = tuple(dataclasses.replace(joint, stiffness=scene.bodies[0].mass) for joint in scene.joints)
    assert equal_rows.equal_rows(dataclasses.replace(scene, joints=stiff)) is None


def difference(one: Any, other: Any) -> float:
    """Return the largest relative difference of numbers in data that are equal otherwise."""
    assert type(one) is type(other)
    if isinstance(one, float):
        return abs(one - other) / max(abs(one), abs(other)) if one != other else 0.0
    if is_dataclass(one):
        return max(difference(getattr(one, item.name), getattr(other, item.name)) for item in fields(one))
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        return max((difference(one[key], other[key]) for key in one), default=0.0)
    if isinstance(one, list | tuple):
        assert len(one) == len(other)
        return max((difference(*pair) for pair in zip(one, other, strict=True)), default=0.0)
    assert one == other
    return 0.0


SPRINGS = {"stiffness": 2.0, "damping": 0.3}
STOPS: dict[str, Any] = {
    "limits": {"lower": -1.0, "upper": 1.0, "stiffness": 100.0},
    "friction": {"coulomb": 0.1, "velocity": 0.01},
}


def hinges(count: int, **joint: Any) -> Scene:
    """Return a chain of rods on hinges in joint coordinates; masses and lengths are no powers of 2."""
    builder = eomgen.SceneBuilder("hinges")
    for k in range(count):
        builder.body(f"rod{k}", 0.7, center_of_mass=[0.15, 0, 0], inertia=[1e-4, 0.006, 0.006])
        place, parent = [0.3 if k else 0.0, 0, 0], f"rod{k - 1}" if k else "base"
        builder.joint(f"hinge{k}", "revolute", parent, f"rod{k}", axis=[0, 1, 0], position=place, **joint)
    return builder.simulation(step=1e-3, duration=0.1).build()


@pytest.mark.long
@pytest.mark.parametrize(
    ("joint", "heavy"),
    [(STOPS, ()), (SPRINGS, (100,)), ({}, range(1, 200, 2))],
    ids=["stops", "springs and another rod in the middle", "two kinds in turn"],
)
def test_the_program_of_a_chain_in_joint_coordinates_is_the_one_that_is_derived(
    monkeypatch: pytest.MonkeyPatch, joint: dict[str, Any], heavy: Any
) -> None:
    """Numbers that are sums along the chain are equal to rounding."""
    continued = recorded_programs(monkeypatch)
    made, derived = programs(with_heavy(hinges(200, **joint), *heavy))
    assert continued == [(made, "")]
    made, derived = (dataclasses.replace(item, method={**item.method, "solver": {}}) for item in (made, derived))
    assert difference(made, derived) < 1e-13


def test_chains_in_joint_coordinates_with_other_laws_are_derived_whole() -> None:
    scene = hinges(90)
    assert equal_rows.equal_rows(scene) is not None
    driven = list(scene.joints)
    driven[20] = hinges(21, drive="0.1*t").joints[20]
    assert equal_rows.equal_rows(dataclasses.replace(scene, joints=tuple(driven))) is None
    assert equal_rows.equal_rows(chains.scene("joint", "skew", 90)) is None
    assert equal_rows.equal_rows(chains.scene("joint", "hinge", 90, ["mass"])) is None
    rows = equal_rows.equal_rows(scene)
    assert rows is not None
    short = short_scene(rows, 78)
    assert (short.bodies, short.joints) == (hinges(12).bodies, hinges(12).joints)
