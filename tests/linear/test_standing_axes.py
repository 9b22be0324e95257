"""Campbell diagrams of shafts that the spin joint carries, against closed forms of an observer's frequencies."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import eomgen
from tests.linear.test_campbell import BENDING, DIAMETRAL, K11, K12, K22, LENGTH, MASS, POLAR, frequencies

SPEEDS = np.linspace(0.0, 900.0, 7)


@cache
def springs(driven: bool = False, uneven: float = 1.0, plane: bool = False) -> eomgen.Model:
    """Return a disc at the end of a massless shaft along z that turns with the disc: springs on the spin joint.
    ``uneven`` is the ratio of the stiffnesses, and in a ``plane`` the shaft bends along x only."""
    builder = eomgen.SceneBuilder("overhung", gravity=[0, 0, 0]).parameter("rate", 0.0, unit="rad/s", tunable=True)
    kinds = [("x", "prismatic", [1, 0, 0]), ("y", "prismatic", [0, 1, 0])]
    kinds += [("tilt_x", "revolute", [1, 0, 0]), ("tilt_y", "revolute", [0, 1, 0])]
    kinds = [kind for kind in kinds if not plane or kind[0] in ("x", "tilt_y")]
    bodies = ["base", "hub", *(f"by_{name}" for name, _, _ in kinds[:-1]), "disc"]
    for body in bodies[1:-1]:
        builder.body(body, 0)
    builder.body("disc", MASS, inertia=[DIAMETRAL, DIAMETRAL, POLAR])
    builder.joint("spin", "revolute", "base", "hub", axis=[0, 0, 1], **({"drive": "rate * t"} if driven else {}))
    for (name, kind, axis), parent, child in zip(kinds, bodies[1:-1], bodies[2:], strict=True):
        builder.joint(name, kind, parent, child, axis=axis)
    builder.effort("x", "x", f"-{K11} * q.x - {K12} * q.tilt_y")
    builder.effort("tilt_y", "tilt_y", f"-{K22} * q.tilt_y - {K12} * q.x")
    if not plane:
        builder.effort("y", "y", f"{uneven} * (-{K11} * q.y + {K12} * q.tilt_x)")
        builder.effort("tilt_x", "tilt_x", f"{uneven} * (-{K22} * q.tilt_x + {K12} * q.y)")
    return eomgen.build(builder.build(), profile="instant")


def beam(axis: tuple[int, int, int], turning: bool = True) -> eomgen.Model:
    """Return a beam along x with a disc at its tip, that turns with the disc about an axis, or stands."""
    bending = {"modes": 2, "stiffness": BENDING}
    builder = eomgen.SceneBuilder("beam", gravity=[0, 0, 0]).body("hub", 0.5, inertia=[1e-3] * 3)
    builder.body("disc", MASS, inertia=[POLAR, DIAMETRAL, DIAMETRAL])
    builder.beam("shaft", LENGTH, mass_per_length=5.5, bending_y=bending, bending_z=bending)
    builder.joint("root", "fixed", "hub", "shaft")
    if turning:
        builder.joint("spin", "revolute", "base", "hub", axis=axis)
        builder.joint("seat", "fixed", "shaft", "disc", position=[LENGTH, 0, 0])
    else:
        builder.joint("wall", "fixed", "base", "hub")
        builder.joint("spin", "revolute", "shaft", "disc", axis=axis, position=[LENGTH, 0, 0])
    return eomgen.build(builder.build(), profile="instant")


def told(call: Callable[[], eomgen.Campbell]) -> tuple[eomgen.Campbell, list[str]]:
    """Return a diagram and the warnings that do not concern the search for rest."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        diagram = call()
    return diagram, [str(item.message) for item in caught if "equilibrium in doubt" not in str(item.message)]


@pytest.mark.slow_cases("rate")
@pytest.mark.parametrize("speed", ["spin", "rate"])
def test_a_massless_shaft_that_turns_has_the_frequencies_and_critical_speeds_of_an_observer(speed: str) -> None:
    """Forward w = W: (k11 - m w^2) (k22 + (I_p - I_d) w^2) = k12^2; backward with -I_p."""
    model = springs(driven=speed == "rate")
    diagram, said = told(lambda: model.campbell(speed, SPEEDS, orders=(1,)))
    assert not said
    for value, found, whirl in zip(SPEEDS, diagram.angular_frequencies, diagram.whirl, strict=True):
        expected = frequencies(value)
        np.testing.assert_allclose(np.sort(found), np.sort(np.abs(expected)), rtol=1e-7)
        if value:
            np.testing.assert_allclose(np.sort(found * whirl), expected, rtol=1e-7)
    bending, critical = np.polynomial.Polynomial([K11, -MASS]), []
    for sense, word in ((1, "forward"), (-1, "backward")):
        squares = (bending * np.polynomial.Polynomial([K22, sense * POLAR - DIAMETRAL]) - K12**2).roots()
        critical += [(float(np.sqrt(w.real)), word) for w in squares if 0.0 < w.real < SPEEDS[-1] ** 2]
    assert [item.whirl for item in diagram.crossings] == [word for _, word in sorted(critical)]
    np.testing.assert_allclose(diagram.critical_speeds, [value for value, _ in sorted(critical)], rtol=1e-9)


@pytest.mark.slow_cases("1.0")
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_beam_has_one_diagram_whether_it_turns_with_its_disc_or_stands(sense: float) -> None:
    """The polar inertia of the beam is that of the hub, which does not bend."""
    values = np.sort(sense * np.linspace(50.0, 600.0, 5))
    turns, stands = (beam((1, 0, 0), turning) for turning in (True, False))
    turned, said = told(lambda: turns.campbell("spin", values, orders=(1, 2)))
    stood = stands.campbell("spin", values, orders=(1, 2), whirl=[("shaft[0]", "shaft[2]")])
    assert not said and turned.crossings
    np.testing.assert_allclose(turned.angular_frequencies, stood.angular_frequencies, rtol=1e-7)
    np.testing.assert_array_equal(turned.whirl, stood.whirl)
    np.testing.assert_allclose(turned.critical_speeds, stood.critical_speeds, rtol=1e-8)
    named, _ = told(lambda: turns.campbell("spin", values, whirl=[("shaft[0]", "shaft[2]")]))
    np.testing.assert_array_equal(named.whirl, turned.whirl)


@pytest.mark.slow
def test_damping_that_turns_makes_the_forward_mode_unstable_above_its_critical_speed() -> None:
    """m x'' + c (x' - i W x) + k x = 0 in the plane of an observer."""
    builder = eomgen.SceneBuilder("jeffcott", gravity=[0, 0, 0]).body("hub", 0).body("slide", 0)
    builder.body("disc", 3.0, inertia=[0.02, 0.02, 0.03])
    along = {"stiffness": 3e4, "damping": 20.0}
    builder.joint("spin", "revolute", "base", "hub", axis=[0, 0, 1])
    builder.joint("x", "prismatic", "hub", "slide", axis=[1, 0, 0], **along)
    builder.joint("y", "prismatic", "slide", "disc", axis=[0, 1, 0], **along)
    model = eomgen.build(builder.build(), profile="instant")
    diagram, said = told(lambda: model.campbell("spin", [20.0, 80.0, 120.0, 200.0]))
    assert not said
    for value, found, whirl in zip(diagram.values, diagram.eigenvalues, diagram.whirl, strict=True):
        roots = np.roots([3.0, 20.0, 3e4 - 20.0j * value])
        np.testing.assert_allclose(np.sort(found.imag * whirl), np.sort(roots.imag), rtol=1e-8)
        np.testing.assert_allclose(np.sort(found.real), np.sort(roots.real), rtol=1e-6)


@pytest.mark.slow
def test_a_turning_shaft_that_is_not_the_same_all_round_is_told_of() -> None:
    model = springs(uneven=1.3)
    diagram, said = told(lambda: model.campbell("spin", np.linspace(10.0, 60.0, 3)))
    (text,) = said
    assert text.startswith("campbell: disc: deflections are in axes that turn with spin, and the rotor is not the same")
    assert "orders are of loads that stand still, such as weight, and unbalance has order 0" in text
    alone = model.linearize(at=model.steady_motion({"spin": 60.0})).modes()  # in axes that turn
    np.testing.assert_allclose(
        np.sort(diagram.eigenvalues[-1].imag), np.sort(alone.eigenvalues.imag[alone.oscillating])
    )
