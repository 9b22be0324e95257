"""Messages on geometry without directions: upright axes of tyres, flat discs, angles of velocities at rest."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

import eomgen
from eomgen.errors import ModelError, NumericalError


def tyre(axis: list[float]) -> dict[str, Any]:
    """Return a car of one body, with a round tyre below it and one with this axis."""
    slip = {"stiffness": [10, 8], "friction": 1.0, "velocity": 0.1}
    wheel = {"radius": 0.3, "stiffness": 1e5, "road": "0"}
    return {
        "format": 1,
        "name": "car",
        "gravity": [0, 0, -9.81],
        "bodies": {"car": {"mass": 10.0, "inertia": [0.1, 0.2, 0.1]}},
        "joints": {"car": {"type": "free", "parent": "base", "child": "car", "initial": {"position": [0, 0, 0.29]}}},
        "points": {"f": {"body": "car", "position": [1, 0, 0]}, "r": {"body": "car", "position": [-1, 0, 0]}},
        "tyres": {
            "front": {"center": "f", **wheel, "slip": {"axis": axis, **slip}},
            "rear": {"center": "r", **wheel, "slip": {"axis": [0, 1, 0], **slip}},
        },
    }


@pytest.mark.slow
def test_a_tyre_whose_axis_is_upright_is_named() -> None:
    message = eomgen.build(tyre([0, 0, 1]), profile="quick").simulate(0.01, 1e-3).message
    assert "Q (the generalized force)" in message
    assert "where slip.axis of the tyre front is upright; try: the axis of the wheel's spin" in message


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_disc_that_lies_flat_is_told_so(side: float) -> None:
    scene = {
        "format": 1,
        "name": "disc",
        "bodies": {"disc": {"mass": 3.0, "inertia": [0.02, 0.04, 0.02]}},
        "joints": {"disc": {"type": "free", "parent": "base", "child": "disc"}},
        "constraints": {
            "ground": {
                "type": "rolling",
                "first": {"body": "base", "axis": [0, 0, 1]},
                "second": {"body": "disc", "axis": [0, 0, side]},
                "radius": 0.2,
            }
        },
    }
    with pytest.raises(ModelError) as caught:
        eomgen.derive(scene)
    assert "ground: contact, ground: no slip along x" in str(caught.value)
    assert str(caught.value).endswith("; try: a state in which no disc lies flat on the plane on which it rolls")


def test_equations_beyond_the_range_of_squares_have_a_message_alone() -> None:
    """Warnings of overflows in squares of rows would come before the message; they are errors of the tests."""
    scene = {
        "format": 1,
        "name": "sliders",
        "bodies": {"a": {"mass": 1.0}, "b": {"mass": 1.0}},
        "joints": {
            "a": {"type": "prismatic", "parent": "base", "child": "a", "axis": [1, 0, 0], "initial": {"position": 0.1}},
            "b": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0]},
        },
        "constraints": {"c": {"type": "formula", "equation": "1e300 * (q.a - q.b)", "unit": "m"}},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ModelError, match=r"after 50 corrections still off: c: formula by 1e\+299"):
            eomgen.derive(scene)


@pytest.mark.slow
def test_an_equilibrium_names_formulas_without_derivative() -> None:
    scene = {
        "format": 1,
        "name": "vane",
        "bodies": {"b": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1], "center_of_mass": [0, 0, -0.5]}},
        "joints": {"j": {"type": "spherical", "parent": "base", "child": "b"}},
        "points": {"here": {"body": "b", "position": [0, 0, -1]}},
        "forces": {
            "vane": {
                "body": "b",
                "point": [0, 0, -1],
                "force": ["0.1 * sqrt(velocity.here[1])", 0, 0],
            }
        },
    }
    with pytest.raises(NumericalError) as caught:
        eomgen.build(scene, profile="quick").equilibrium()
    assert str(caught.value) == (
        "numerical error: equilibrium: the stiffness is not a finite number at the initial state: a formula has no"
        " derivative there, of the forces perhaps sqrt(velocity.here[1]); try: another initial"
        " state, or a formula of finite slope there, x / sqrt(x + width) for sqrt(x)"
    )
