"""Constraint rows that were left out have to follow from the others at every run; rows without a derivative are
named."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal

import pytest

import eomgen
from eomgen import ModelError, UsageError
from tests.simulation.rails import built

TURNED = [{"axis": [1, 2, 3], "angle": 0.7}]
OFF = "rows that were left out, because they follow from others at the default parameters, are off at X = 0.3: "
NEW = "rows that were left out, because they follow from others at the default parameters, do not at X = 0.2: "


def four_bar(
    turned: bool, coordinates: Literal["joint", "absolute"], X: float = 0.0, Y: float = 1.5, *, on_line: bool = False
) -> eomgen.Scene:
    """Return a four-bar whose right bearing is shifted by X along the hinges, at a distance Y from the left one."""
    builder = eomgen.SceneBuilder("four_bar", gravity=[0, 0, 0], coordinates=coordinates).body("root", 0.0)
    builder.parameter("X", X, tunable=True).parameter("Y", Y, tunable=True)
    builder.joint("root", "fixed", "base", "root", rotation=TURNED if turned else [])
    for name, parent, place, start in (
        ("a", "root", [0, 0, 0], 1.2),
        ("b", "a", [1, 0, 0], -1.0),
        ("c", "root", ["Y", 0, "X"], 1.2),
    ):
        at = {"axis": [0, 0, 1], "position": place, "initial": {"position": start}}
        builder.body(name, 1.0, inertia=[0.1] * 3).joint(name, "revolute", parent, name, **at)
    first = {"body": "b", "position": [1.0 if on_line else 1.5, 0, 0], "axis": [0, 0, 1]}
    second = {"body": "c", "position": [1, 0, 0], **({} if on_line else {"axis": [0, 0, 1]})}
    return builder.constraint("close", "point_on_line" if on_line else "revolute", first, second).build()


@cache
def model(turned: bool, coordinates: Literal["joint", "absolute"]) -> eomgen.Model:
    return eomgen.build(four_bar(turned, coordinates), profile="quick")


FORMS: list[Any] = [(False, "joint"), (True, "joint"), (False, "absolute")]
CALLS: list[Callable[[eomgen.Model, dict[str, float]], Any]] = [
    lambda m, p: m.simulate(1e-3, 1e-3, parameters=p),
    lambda m, p: m.consistent(m.initial_q, m.initial_v, parameters=p),
    lambda m, p: m.equilibrium(parameters=p),
    lambda m, p: m.linearize(m.initial_q, parameters=p),
]


@pytest.mark.slow_except("form0")
@pytest.mark.parametrize("form", FORMS)
def test_a_shift_along_the_hinges_is_refused_by_scene_and_run(form: Any) -> None:
    with pytest.raises(ModelError, match="cannot be met together"):
        eomgen.derive(four_bar(*form, X=0.3), ["mass"])
    for call in CALLS if form[1] == "joint" else CALLS[:-1]:  # whose initial state is that of other bodies then
        with pytest.raises(ModelError) as caught:
            call(model(*form), {"X": 0.3})
        said = str(caught.value)
        assert said.startswith(f"model error: constraints: {OFF}"), said
        assert "; try: parameters with which the constraints can be met together, or a scene with these values" in said


@pytest.mark.slow_except("form0-1e-06")
@pytest.mark.parametrize("off", [1e-9, 1e-6])
@pytest.mark.parametrize("form", FORMS)
def test_a_shift_that_is_no_contradiction_is_said_by_scene_and_run(form: Any, off: float) -> None:
    """Machines are given to six digits or more, and what is not met for that is said with its size."""
    built = eomgen.derive(four_bar(*form, X=off), ["mass"])
    row = "close: origins meet along z"
    assert f"{row} follows from the constraints before it and is left out, though it is off by {off:.3g}" in built.notes
    said = f"{row}, left out because it follows from others, is off by -{off:.3g} at X = {off:.6g}"
    one, p = model(*form), {"X": off}
    run = one.simulate(1e-3, 1e-3, parameters=p)
    assert run.success and run.metadata["corrections"][-1] == said
    assert one.consistent(one.initial_q, one.initial_v, parameters=p).deviations == (said,)
    assert said in one.equilibrium(parameters=p).notes
    assert not any("left out" in line for line in one.simulate(1e-3, 1e-3).metadata["corrections"])


def hinged() -> eomgen.SceneBuilder:
    """Return a body on a hinge, with a tunable place X."""
    builder = eomgen.SceneBuilder("hinged").parameter("X", 0.0, tunable=True).body("b", 1.0, inertia=[0.1] * 3)
    return builder.joint("h", "revolute", "base", "b", axis=[0, 0, 1])


def test_a_constraint_of_which_nothing_is_left() -> None:
    """A hinge given twice: all rows of the second follow from the first, unless it lies elsewhere."""
    first = {"axis": [0, 0, 1], "position": [0, 0, "X"], "body": "base"}
    hinge = built(hinged().constraint("again", "revolute", first, {"body": "b", "axis": [0, 0, 1]}))
    assert hinge.multipliers == () and hinge.simulate(1e-2).success
    with pytest.raises(ModelError, match=r"are off at X = 0\.2: again: origins meet along z by -?0\.2; try"):
        hinge.simulate(1e-2, parameters={"X": 0.2})


def test_a_row_that_says_something_at_other_parameters_alone() -> None:
    """A point on a hinge is where it is; beside the hinge it holds the angle, at which it is met."""
    place = {"position": ["X", 0, 0]}
    hinge = built(hinged().constraint("pin", "spherical", {**place, "body": "base"}, {**place, "body": "b"}))
    assert hinge.multipliers == () and hinge.simulate(1e-2).success
    with pytest.raises(ModelError) as caught:
        hinge.simulate(1e-2, parameters={"X": 0.2})
    assert str(caught.value).startswith(f"model error: constraints: {NEW}pin: origins meet along y; try: ")


def rope(length: float | str, height: float) -> eomgen.Scene:
    """Return a free body that a rope holds to the base, its point that far below."""
    builder = eomgen.SceneBuilder("rope").parameter("X", 0.5, tunable=True).body("b", 1.0, inertia=[0.1] * 3)
    builder.joint("h", "free", "base", "b", initial={"position": [0, 0, -height]})
    return builder.constraint("rope", "distance", {"body": "base"}, {"body": "b"}, length=length).build()


UNDEFINED = (
    "these rows have no finite derivative where constraints are to be met: rope: distance; "
    "try: a state in which the points of a distance differ, and lengths above 0"
)


@pytest.mark.slow
def test_points_of_a_distance_that_coincide_are_named(capfd: pytest.CaptureFixture[str]) -> None:
    """Neither NumPy nor LAPACK speaks: at the build, at a run from such a state, and at a length of 0."""
    with pytest.raises(ModelError) as caught:
        eomgen.derive(rope("X", 0.0), ["mass"])
    assert str(caught.value).endswith(UNDEFINED)
    hanging = eomgen.build(rope("X", 0.5), profile="quick")
    with pytest.raises(ModelError) as caught:
        hanging.simulate(0.1, initial={"h": [1, 0, 0, 0, 0, 0, 0]})
    assert str(caught.value).endswith(UNDEFINED)
    with pytest.raises(
        UsageError, match=r"\(constraints\.rope\.length\): 0 m is not positive at X = 0; try: a length in m"
    ):
        hanging.simulate(0.1, parameters={"X": 0.0})
    assert capfd.readouterr().err == ""
