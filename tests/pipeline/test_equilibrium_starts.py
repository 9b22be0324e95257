"""Programs whose initial state is an equilibrium: their numbers and words, by a model that answers as it is told."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.errors import ModelError
from eomgen.lie.product import Factor
from eomgen.pipeline.generated_defaults import with_equilibrium_start
from eomgen.system.system import Quantity

FACTORS = (Factor("R", "slide", 0, 1, 0, 1), Factor("SO3", "ball", 1, 4, 1, 3))
TURN = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]  # a quarter about z


@dataclasses.dataclass(frozen=True)
class Made:
    """The fields of a Program that change."""

    prefix: str = "arm"
    parameters: tuple[Quantity, ...] = (Quantity("mass", 2.0),)
    inputs: tuple[Quantity, ...] = ()
    start: str = ""
    initial_q: tuple[float, ...] = ()
    initial_v: tuple[float, ...] = ()
    initial_z: tuple[float, ...] = ()


def model(rest: dict[str, Any], multipliers: tuple[str, ...] = ()) -> Any:
    found = {
        "q": np.array([0.4, *TURN]),
        "v": np.zeros(4),
        "z": np.array([1.5]),
        "acceleration": 3e-9,
        "message": "found",
        **rest,
    }
    asked: list[Any] = []
    return SimpleNamespace(
        factors=FACTORS,
        initial_q=np.array([0.1, 1.0, 0.0, 0.0, 0.0]),
        initial_v=np.array([7.0, 1.0, 2.0, 3.0]),
        multipliers=multipliers,
        equilibrium=lambda parameters: asked.append(parameters) or SimpleNamespace(**found),
        consistent=lambda q, v, parameters: SimpleNamespace(q=q + 0.5, v=2.0 * v),
        asked=asked,
    )


def made_by(machine: Any, parameters: Any = None) -> Any:
    made: Any = Made()
    return with_equilibrium_start(made, lambda terms: machine, parameters)


def test_velocities_keep_their_directions_in_the_world() -> None:
    machine = model({})
    program = made_by(machine, {"mass": 3.0})
    np.testing.assert_allclose(program.initial_q, [0.4, *TURN])
    np.testing.assert_allclose(program.initial_v, [7.0, 2.0, -1.0, 3.0], atol=1e-15)  # of the turned axes
    assert machine.asked == [{"mass": 3.0}] and program.initial_z == (1.5,)
    assert "It starts at static equilibrium" in program.start and "are below 1e-8;" in program.start
    assert "velocities are those of the joints." in program.start and "drives" not in program.start


def test_drives_and_constraints_have_the_last_word() -> None:
    program = made_by(model({"v": np.array([0.0, 0.0, 5.0, 0.0]), "acceleration": 0.0}, ("rod",)))
    np.testing.assert_allclose(program.initial_q, 0.5 + np.array([0.4, *TURN]))
    np.testing.assert_allclose(program.initial_v, 2.0 * np.array([7.0, 2.0, 5.0, 3.0]), atol=1e-14)
    assert "are zero;" in program.start and "the joints and of the drives" in program.start


def test_notes_of_the_search_are_told() -> None:
    program = made_by(model({"message": "found; it is unstable; it is far"}))
    assert " Note: it is unstable. Note: it is far." in program.start and "found." not in program.start
    assert "at the default parameters (mass = 2)" in program.start
    assert program.start.endswith("Other values have their equilibrium elsewhere, and the C does not look for it.")


def test_without_an_equilibrium_the_joints_say_the_start() -> None:
    def refuse(parameters: Any) -> None:
        raise ModelError("no rest [E0001]", "another start")

    machine = model({})
    machine.equilibrium = refuse
    with pytest.warns(
        RuntimeWarning, match="arm: The scene asks for a start at static equilibrium, which was not found"
    ):
        program = made_by(machine)
    assert program.initial_q == () and program.start.endswith("The reason: no rest.")
