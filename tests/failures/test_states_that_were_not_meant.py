"""Linear models, equilibria and accelerations about which nothing was said: not the ones that were meant."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest

import eomgen
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm, scene_of

LOOP = """
[points.wall]
body = "base"
position = [0.5, 0, 0]
[bodies.lower]
mass = 1
center_of_mass = [0, 0, -0.25]
inertia = [0.02, 0.02, 0.001]
[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
axis = [0, 1, 0]
position = [0, 0, "-length"]
[points.end]
body = "lower"
position = [0, 0, -0.5]
[constraints.rod]
type = "distance"
first = "wall"
second = "end"
length = 0.6
"""
STANDS = "is an equilibrium, which a damped motion leaves for this one, {:.4g} rad away along shoulder; any_kind=True"


@functools.cache
def loop() -> eomgen.Model:
    return eomgen.build(scene_of(SCENE + LOOP), profile="quick")


def without_warnings(call: Callable[[], object]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        call()


@pytest.mark.slow_except("3.14", "3.1")
@pytest.mark.parametrize("angle", [math.pi, 3.14, 3.1])
def test_the_linear_model_of_a_pendulum_that_stands_is_not_that_of_one_that_hangs(angle: float) -> None:
    with pytest.warns(
        RuntimeWarning, match="linear about an equilibrium in doubt: at the start, or next to it"
    ) as told:
        hanging = arm().linearize(initial={"shoulder": angle}, u={"motor": 0.0})
    stands = STANDS.format(angle)
    assert stands in str(told[0].message) and told[0].filename == __file__
    assert math.cos(hanging.reference.q[0]) == pytest.approx(1.0)
    found = arm().equilibrium({"shoulder": angle}, u={"motor": 0.0})
    assert [note for note in found.notes if stands in note] and stands in found.message


def test_the_nearest_of_any_kind_and_a_pendulum_that_falls_are_meant() -> None:
    for angle in (0.5, 1.5, 2.5):
        assert not [note for note in arm().equilibrium({"shoulder": angle}).notes if "next to it" in note]
    standing = arm().equilibrium({"shoulder": math.pi}, any_kind=True)
    assert standing.q[0] == pytest.approx(math.pi) and not [note for note in standing.notes if "next to it" in note]


def test_a_state_that_accelerates_is_told() -> None:
    note = r"linear about a state that does not rest: shoulder accelerates with .* rad/s\^2, so modes hold at this"
    for rates in (None, [0.0]):
        with pytest.warns(RuntimeWarning, match=note) as told:
            arm().linearize([0.8], rates)
        assert told[0].filename == __file__


def test_states_of_motions_and_at_rest_are_meant() -> None:
    model = arm()
    acceleration = model.forward_dynamics([0.8], [0.0])
    without_warnings(lambda: model.linearize([0.8], a=acceleration))
    without_warnings(lambda: model.linearize([0.8], [1.5]))
    without_warnings(lambda: model.linearize([0.0], u=[0.0]))
    without_warnings(lambda: model.linearize(at="initial", initial={"shoulder": 0.8}))
    without_warnings(lambda: model.simulate(0.1, 1e-3).linearize(0.05))


@pytest.mark.slow
def test_accelerations_that_break_a_loop_are_told() -> None:
    model = loop()
    state = model.consistent(model.initial_q, model.initial_v)
    q, v = state.q, state.v
    note = r"these accelerations do not meet the constraints \(rod: .*\), and tau holds no forces of constraints"
    with pytest.warns(RuntimeWarning, match=note) as told:
        model.inverse_dynamics(q, v, [1.0, 1.0])
    assert told[0].filename == __file__
    allowed = model.forward_dynamics(q, v)
    without_warnings(lambda: model.inverse_dynamics(q, v, allowed))
    without_warnings(lambda: model.bias(q, v))
    without_warnings(lambda: arm().inverse_dynamics([0.3], [0.0], [1.0]))
    for _ in range(20):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model.inverse_dynamics(q, v, np.ones(2))
    without_warnings(lambda: model.inverse_dynamics(q, v, np.ones(2)))  # a loop that is under way is not held up
