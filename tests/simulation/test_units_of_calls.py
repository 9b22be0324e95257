"""Texts with units where a call takes numbers: the same run as with numbers in SI, and messages that name the unit."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.models.scenes import flyer, pendulum


def test_a_run_given_in_units_is_that_in_numbers() -> None:
    model = pendulum()
    texts = model.simulate(
        "50 ms",
        "1 ms",
        initial={"hinge": {"position": "30 deg", "velocity": "10 rpm"}},
        inputs={"torque": "100 N mm"},
        parameters={"length": "400 mm"},
    )
    numbers = model.simulate(
        0.05,
        1e-3,
        initial={"hinge": {"position": np.radians(30.0), "velocity": 10.0 * 2.0 * np.pi / 60.0}},
        inputs={"torque": 0.1},
        parameters={"length": 0.4},
    )
    assert np.allclose(texts.q, numbers.q, rtol=1e-12) and np.array_equal(texts.t, numbers.t)
    several = flyer().simulate(1e-3, 1e-3, initial={"ball": {"velocity": ["60 rpm", 0.0, 1.0]}})
    assert np.allclose(several.v[0][6:9], [2.0 * np.pi, 0.0, 1.0], rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"t_end": "5 m"}, r"t_end: '5 m' is a length, a time in s is expected; try: \"5 s\""),
        ({"step": "soon"}, "step: 'soon' is neither a number nor a number with a unit"),
        ({"initial": {"hinge": "3 m"}}, "initial position of hinge: '3 m' is a length, an angle in rad is expected"),
        ({"inputs": {"torque": "3 kg"}}, "input torque: '3 kg' is a mass, a torque in N m is expected"),
    ],
)
def test_another_dimension_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(eomgen.UsageError, match=message):
        pendulum().simulate(**{"t_end": 0.01, **given})
