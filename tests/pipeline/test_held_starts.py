"""Initial values that are held are kept or refused; runs say which others they lose that could have been held."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.compiled.consistent_states import consistent_samples
from eomgen.compiled.initial_state import starts_of, values_by_joint


def built(*, hold: bool | None = None, coupler: Any = None, rocker: Any = None, coordinates: str = "joint") -> Any:
    """Return a linkage of four bars with starts of its joints."""
    builder = eomgen.SceneBuilder("four_bar", coordinates=coordinates).parameter("width", 3.0, unit="m", tunable=True)
    crank = {"position": -1.2, "velocity": 5.236} | ({} if hold is None else {"hold": hold})
    for name, parent, place, start in (
        ("crank", "base", 0, crank), ("coupler", "crank", 1, coupler), ("rocker", "base", "width", rocker)
    ):  # fmt: skip  # a table
        mass, center = (1, 0.5) if name == "crank" else (2, 1)
        builder.body(name, mass, inertia=[0.1, 0.1, 0.1], center_of_mass=[center, 0, 0])
        given = {} if start is None else {"initial": start}
        builder.joint(name, "revolute", parent, name, axis=[0, 1, 0], position=[place, 0, 0], **given)
    ends = ({"body": name, "position": [at, 0, 0], "axis": [0, 1, 0]} for name, at in (("coupler", 2.5), ("rocker", 2)))
    return eomgen.build(builder.constraint("loop", "revolute", *ends).build(), profile="quick")


def follows(q: Any, v: Any, width: float = 3.0) -> float:
    """Return how far coupler and rocker are off the circles about the pins, in position and rate: the oracle."""
    crank, coupler, rocker = q[0], q[0] + q[1], q[2]

    def along(angle: float) -> complex:
        return complex(np.exp(-1j * angle))  # turning about y brings x to -z

    gap = along(crank) + 2.5 * along(coupler) - width - 2 * along(rocker)
    rates = v[0] * along(crank) + 2.5 * (v[0] + v[1]) * along(coupler) - 2 * v[2] * along(rocker)
    return max(abs(gap), abs(rates))


@pytest.mark.slow
def test_lost_values_that_could_be_held_are_in_the_message() -> None:
    model = built()  # one freedom: one position and one velocity are given
    run = model.simulate(0.01, 1e-3)
    assert abs(run.v[0][0] - 5.236) > 0.05 and follows(run.q[0], run.v[0]) < 1e-9
    assert "; corrected onto the constraints: " in run.message and "v.crank 5.236 -> " in run.message
    assert run.message.endswith("; try: hold = true to keep v.crank, q.crank") or run.message.endswith(
        "; try: hold = true to keep q.crank, v.crank"
    )
    held = built(hold=True).simulate(0.01, 1e-3)
    assert (held.q[0][0], held.v[0][0]) == pytest.approx((-1.2, 5.236), abs=1e-12)
    assert "hold" not in held.message


def test_guesses_of_a_loop_are_no_lost_values() -> None:
    """Two positions choose one of the two ways to close the loop: the run says nothing."""
    model = built(rocker={"position": -1.6}, coupler={"position": 1.5})
    message = model.simulate(0.01, 1e-3, initial={"crank": {"position": -1.2, "velocity": 0.0}}).message
    assert "hold" not in message


@pytest.mark.slow
def test_lost_velocities_of_bodies_in_absolute_coordinates_are_in_the_message() -> None:
    message = built(coordinates="absolute").simulate(0.01, 1e-3).message
    assert "; corrected onto the constraints: " in message and "hold = true to keep " in message


@pytest.mark.slow
def test_held_values_are_kept_where_others_are_written_as_well() -> None:
    model = built(hold=True, rocker={"position": -1.6})
    assert (model.initial_q[0], model.initial_v[0]) == pytest.approx((-1.2, 5.236), abs=1e-12)
    assert follows(model.initial_q, model.initial_v) < 1e-9


def test_values_that_cannot_be_held_are_refused() -> None:
    with pytest.raises(eomgen.ModelError, match="no hold of the initial state of crank, rocker"):
        built(hold=True, rocker={"position": -1.6, "hold": True})
    with pytest.raises(
        eomgen.DescriptionError, match=r"joints.rocker.initial.hold\): no position or velocity is given"
    ):
        built(rocker={"hold": True})
    with pytest.raises(eomgen.DescriptionError, match="no coordinates of joints that could be held"):
        built(hold=True, coordinates="absolute")


def test_starts_of_joints_are_given_by_their_coordinates_too() -> None:
    model: Any = SimpleNamespace(factors=[SimpleNamespace(name=name) for name in ("hinge", "slide", "blade")])
    given = {"v.hinge": 2.0, "q.hinge": 1.0, "v.slide": 4.0, "slide": 3.0, "q.other": 5.0, "a.hinge": 6.0, "z": 7.0}
    assert values_by_joint(model, given) == {
        "hinge": {"position": 1.0, "velocity": 2.0}, "slide": {"position": 3.0, "velocity": 4.0},
        "q.other": 5.0, "a.hinge": 6.0, "z": 7.0,
    }  # fmt: skip
    given = {"hinge": {"velocity": 1.0}, "q.hinge": 2.0, "q.blade[2]": 1.0, "blade[1]": 2.0}
    assert values_by_joint(model, given) == {
        "hinge": {"velocity": 1.0, "position": 2.0}, "blade[2]": {"position": 1.0}, "blade[1]": 2.0,
    }  # fmt: skip
    assert values_by_joint(model, None) == {}


def test_starts_of_runs_are_kept_and_held() -> None:
    model = built(rocker={"position": -1.6})
    run = model.simulate(0.01, 1e-3, initial={"crank": {"position": -1.0, "velocity": 3.0, "hold": True}})
    assert (run.q[0][0], run.v[0][0]) == pytest.approx((-1.0, 3.0), abs=1e-12)
    assert follows(run.q[0], run.v[0]) < 1e-9
    named = model.simulate(0.01, 1e-3, initial={"crank": {"hold": True}, "q.crank": -1.0, "v.crank": 3.0})
    assert np.array_equal(named.q, run.q) and np.array_equal(named.v, run.v)
    both = {"crank": {"position": -1.0, "hold": True}, "rocker": {"position": -1.65, "hold": True}}
    with pytest.raises(eomgen.ModelError, match="no hold of the initial state of crank, rocker"):
        model.simulate(0.01, 1e-3, initial=both)
    for wrong in ({"hold": True}, {"velocity": 1.0, "hold": 1}):
        with pytest.raises(eomgen.UsageError, match=r"could be held|hold is true or false"):
            model.simulate(0.01, 1e-3, initial={"crank": wrong})


def test_samples_start_as_single_runs_do() -> None:
    model, widths = built(hold=True), np.array([[2.9], [3.05], [9.0]])
    starts = starts_of(model, None)
    q, v = (np.repeat(np.array(model.library.layout[name])[np.newaxis], 3, axis=0) for name in ("asked_q", "asked_v"))
    found = consistent_samples(model, q, v, 0.0, widths, starts)
    assert found.met.tolist() == [True, True, False]
    for k in (0, 1):
        run = model.simulate(0.01, 1e-3, parameters=widths[k])
        assert (run.q[0][0], run.v[0][0]) == pytest.approx((-1.2, 5.236), abs=1e-12)
        assert follows(run.q[0], run.v[0], float(widths[k, 0])) < 1e-9
        np.testing.assert_allclose(found.q[k], run.q[0][: model.nq], atol=1e-9)
        np.testing.assert_allclose(found.v[k], run.v[0], atol=1e-8)
