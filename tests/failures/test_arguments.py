"""Arguments that no model can take: one message with the name of the argument, never a bare exception of Python."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.scenes import PENDULUM_TOML


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> eomgen.Model:
    file = tmp_path_factory.mktemp("arguments") / "shaken.toml"
    file.write_text(PENDULUM_TOML.replace("[parameters]", "[parameters]\nload = 1.5"))
    return eomgen.build(file, profile="quick")


def test_parameters_that_do_not_broadcast_are_named(model: eomgen.Model) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        model.mass([0.1], parameters={"length": [1, 2, 3], "shake": [1, 2]})
    assert (
        str(caught.value)
        == "usage error: parameters: the shapes do not broadcast: length (3,), shake (2,); try: batches of equal shape"
    )


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"settings": [1.0]}, 'settings: a mapping is needed, not list; try: settings={"rtol": 1e-9}'),
        ({"settings": {"rtol": "x"}}, "settings.rtol: a number is needed, not str"),
        ({"rho_inf": 10**400}, "rho_inf: rho_inf is inf, not a finite number"),
        ({"settings": {"rtol": 0, "atol": 0}}, "rtol = 0, atol = 0"),
    ],
)
def test_what_cannot_run_is_refused_before_it_runs(model: eomgen.Model, options: dict[str, Any], text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        model.simulate(**{"t_end": 0.1, "step": 0.01, **options})


def test_a_step_beyond_all_measure_ends_with_a_message(model: eomgen.Model) -> None:
    solution = model.simulate(1e308, 1e300)
    assert not solution.success
    assert "a value became infinite or not a number" in solution.message


def test_a_state_that_is_broken_already_is_not_blamed_on_the_step(model: eomgen.Model) -> None:
    message = model.simulate(0.1, 0.01, parameters={"length": 1e300}).message
    assert "the first block that is not finite is M (the inertia matrix), component v.hinge at t = 0 s" in message
    assert message.endswith("try: other parameters, formulas or coordinates there: no smaller step helps")


def test_an_initial_state_is_a_mapping_and_no_array(model: eomgen.Model) -> None:
    text = 'initial: a mapping is needed, not ndarray; try: dict(q=..., v=...) or {"joint": position}'
    for begin in (lambda q: model.simulate(0.1, 0.01, initial=q), model.start):
        with pytest.raises(eomgen.UsageError, match=re.escape(text)):
            begin(np.zeros(2))


@pytest.mark.slow
def test_efforts_are_not_taken_for_times() -> None:
    builder = eomgen.SceneBuilder("pair").body("first", 1.0).body("second", 2.0)
    builder.joint("lower", "prismatic", "base", "first", axis=[1, 0, 0])
    builder.joint("upper", "prismatic", "first", "second", axis=[1, 0, 0])
    builder.input("lower_motor").effort("lower_motor", "lower", "lower_motor")
    model = eomgen.build(builder.build(), profile="quick")
    q, v, force = np.zeros(2), np.zeros(2), np.array([3.0, 4.0])
    with pytest.raises(eomgen.UsageError) as caught:
        model.forward_dynamics(q, v, force)
    assert str(caught.value) == (
        "usage error: t: 2 times for one state, and forward_dynamics does not depend on time; try: efforts by inputs:"
        " u=..."
    )
    # M = [[m1 + m2, m2], [m2, m2]]: two masses in a row, the force on the first
    np.testing.assert_allclose(model.forward_dynamics(q, v, 0.0, [3.0]), [3.0, -3.0], atol=1e-15)
    assert model.forward_dynamics(q, v, np.zeros(3)).shape == (3, 2)  # three times, two coordinates
