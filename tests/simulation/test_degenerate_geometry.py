"""Messages on geometry without directions: upright axes of tyres, flat discs, angles of velocities at rest."""

from __future__ import annotations

import warnings

import pytest

import eomgen
from eomgen.errors import ModelError, NumericalError
from tests.simulation.rails import built, on_rail


@pytest.mark.slow
def test_a_tyre_whose_axis_is_upright_is_named() -> None:
    builder = eomgen.SceneBuilder("car").body("car", 10.0, inertia=[0.1, 0.2, 0.1])
    builder.joint("car", "free", "base", "car", initial={"position": [0, 0, 0.29]})
    for name, place, axis in (("front", 1, [0, 0, 1]), ("rear", -1, [0, 1, 0])):
        slip = {"axis": axis, "stiffness": [10, 8], "friction": 1.0, "velocity": 0.1}
        builder.point(name, "car", [place, 0, 0])
        builder.tyre(name, center=name, radius=0.3, stiffness=1e5, road="0", slip=slip)
    message = built(builder).simulate(0.01, 1e-3).message
    assert "Q (the generalized force)" in message
    assert "where slip.axis of the tyre front is upright; try: the axis of the wheel's spin" in message


def test_equations_beyond_the_range_of_squares_have_a_message_alone() -> None:
    """Warnings of overflows in squares of rows would come before the message; they are errors of the tests."""
    builder = on_rail("", "a", position=0.1).body("c", 1.0).joint("b", "prismatic", "base", "c", axis=[1, 0, 0])
    builder.constraint("c", "formula", equation="1e300 * (q.a - q.b)", unit="m")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ModelError, match=r"after 50 corrections still off: c: formula by 1e\+299"):
            eomgen.derive(builder.build())


@pytest.mark.slow
def test_an_equilibrium_names_formulas_without_derivative() -> None:
    builder = eomgen.SceneBuilder("vane").body("b", 1.0, inertia=[0.1, 0.1, 0.1], center_of_mass=[0, 0, -0.5])
    builder.joint("j", "spherical", "base", "b").point("here", "b", [0, 0, -1])
    builder.force("vane", "b", point=[0, 0, -1], force=["0.1 * sqrt(velocity.here[1])", 0, 0])
    with pytest.raises(NumericalError) as caught:
        eomgen.build(builder.build(), profile="instant").equilibrium()
    assert str(caught.value) == (
        "numerical error: equilibrium: the stiffness is not a finite number at the initial state: a formula has no"
        " derivative there, of the forces perhaps sqrt(velocity.here[1]); try: another initial"
        " state, or a formula of finite slope there, x / sqrt(x + width) for sqrt(x)"
    )
