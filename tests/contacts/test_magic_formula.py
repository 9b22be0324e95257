"""Magic Formula 5.2, 6.1 and 6.2: figures of MFeval, the tape, partials at the edges, symmetries."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from eomgen.products.contacts.tangential_laws import tangential_law
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape
from tests.anchors import anchor
from tests.contacts.states import MORE, deflection_under, own_tyre, results_at

#: Load, kappa, alpha, gamma, forward speed, pressure of the figures.
STATES = np.array([(1500.0, -0.1, 0.05, 0.04, 16.0, 2.1e5), (3000.0, 0.6, 0.5, -0.06, 12.0, 2.2e5)])
ANCHORED = ("Fx", "Fy", "Mx", "My", "Mz", "Re", "Rl", "two_a", "t", "sigmax", "sigmay")
RESULTS = (
    *("force_x", "force_y", "moment_x", "moment_y", "moment_z", "effective_radius", "vertical_force", "loaded_radius"),
    *("contact_length", "relaxation_x", "relaxation_y"),
)
ROLLING = {
    "load": 4000.0, "deflection": 0.02, "slip_x": 0.02, "slip_y": 0.05, "camber": 0.03, "velocity_x": 16.0,
    "wheel_speed": 52.0, "force_held_x": 300.0, "force_held_y": -900.0,
}  # fmt: skip  # a table


def numbers_of(version: str) -> dict[str, float]:
    """Return coefficients of a version."""
    return {**own_tyre().numbers, **MORE[version]}


@pytest.mark.parametrize(
    ("name", "version", "mode"),
    [
        ("magic_formula_5_2", "5.2", "211"),
        ("magic_formula_6_1", "6.1", "211"),
        ("magic_formula_6_1_tangents", "6.1", "221"),
        ("magic_formula_6_2", "6.2", "211"),
    ],
)
def test_results_are_those_of_mfeval(name: str, version: str, mode: str) -> None:
    found = results_at(version, numbers_of(version), STATES, mode)
    anchor(name).check([found[quantity][state] for state in range(2) for quantity in ANCHORED])


def test_the_book_takes_the_sine_of_the_camber_in_the_friction_too() -> None:
    """MFeval's mode 221 does not: 2e-6 to 2e-5 in the longitudinal force."""
    found = results_at("6.1", numbers_of("6.1"), STATES, "221")
    law = tangential_law("magic_formula", "6.1", "tangents")
    load, kappa, alpha, gamma, speed, pressure = STATES.T
    given = {"load": load, "slip_x": kappa, "slip_y": np.tan(alpha), "camber": gamma, "velocity_x": speed}
    book = law.values(["force_x", "force_y", "friction_x"], {**numbers_of("6.1"), "INFLPRES": pressure}, **given)
    np.testing.assert_allclose(book["force_y"], found["Fy"], rtol=1e-12)
    friction = (1.0 - 5.0 * np.sin(gamma) ** 2) / (1.0 - 5.0 * gamma**2)
    np.testing.assert_allclose(book["friction_x"] / found["mux"], friction, rtol=1e-12)
    assert np.all(np.abs(book["force_x"] / found["Fx"] - 1.0) < 5e-5)


@pytest.mark.parametrize(("version", "option"), [("5.2", ""), ("6.1", ""), ("6.1", "tangents"), ("6.2", "")])
def test_values_and_partials_on_the_tape_are_finite_at_the_edges(version: str, option: str) -> None:
    law, numbers = tangential_law("magic_formula", version, option), {**numbers_of(version), "LMUV": 0.1}
    tape = Tape()
    algebra, names = Algebra(tape), list(ROLLING)
    given = {name: Scalar(tape, tape.input("pair", place)) for place, name in enumerate(names)}
    coefficients = {name: algebra.scalar(number) for name, number in numbers.items()}
    found = law.record(algebra, RESULTS, {**coefficients, **given})
    symbols, values = [given[name].ref for name in names], [found[name].ref for name in RESULTS]
    first = [ref for value in values for ref in gradient(tape, value, symbols)]
    second = [ref for slope in first for ref in gradient(tape, slope, symbols)]
    edges = ("load", "slip_x", "slip_y", "camber", "velocity_x", "wheel_speed", "deflection")
    zeros = [(), edges, *((name,) for name in edges), *combinations(edges, 2)]
    states = [{**ROLLING, **dict.fromkeys(zero, 0.0)} for zero in zeros]
    states += [{**ROLLING, "slip_y": 1e3, "velocity_x": 0.0}, {**ROLLING, "slip_x": -2.0, "velocity_x": -3.0}]
    columns = {name: np.array([state[name] for state in states]) for name in names}
    table = evaluate(tape, [*values, *first, *second], {"pair": np.stack([*columns.values()], axis=-1)})
    numeric = law.values(RESULTS, numbers, **columns)
    for place, name in enumerate(RESULTS):
        np.testing.assert_allclose(table[:, place], numeric[name], rtol=1e-12, atol=1e-9, err_msg=name)
    assert np.all(np.isfinite(table))
    assert np.abs(table[:, len(values) :]).max() < 1e11, "smooth over widths that a run resolves"


def test_partials_are_slopes_of_the_values() -> None:
    law, numbers = tangential_law("magic_formula", "6.1"), numbers_of("6.1")
    tape = Tape()
    algebra = Algebra(tape)
    given = {name: Scalar(tape, tape.input(name, 0)) for name in ROLLING}
    known = {**{name: algebra.scalar(number) for name, number in numbers.items()}, **given}
    force = law.record(algebra, ["moment_z"], known)["moment_z"].ref
    slopes = gradient(tape, force, [given[name].ref for name in ROLLING])
    exact = evaluate(tape, slopes, {name: np.array([value]) for name, value in ROLLING.items()})
    for name, slope in zip(ROLLING, exact, strict=True):
        step = 1e-5 * max(1.0, ROLLING[name])
        ahead, back = ({**ROLLING, name: ROLLING[name] + sign * step} for sign in (1.0, -1.0))
        ends = [law.values(["moment_z"], numbers, **state)["moment_z"] for state in (ahead, back)]
        assert slope == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6, abs=1e-6), name


@pytest.mark.parametrize("version", ["6.1", "6.2"])
def test_the_vertical_force_at_the_deflection_of_a_load_is_the_load(version: str) -> None:
    law, numbers = tangential_law("magic_formula", version), numbers_of(version)
    given = {name: np.array([value]) for name, value in ROLLING.items() if name not in ("deflection", "camber")}
    given["camber"] = np.zeros(1)
    forces = law.values(["force_x", "force_y"], numbers, **given)
    given |= {"force_held_x": forces["force_x"], "force_held_y": forces["force_y"]}
    radius = law.values(["free_radius"], numbers, **given)["free_radius"]
    deflection = deflection_under(law, numbers, given)
    at_rest = tangential_law("magic_formula", "6.1").values(["static_deflection"], numbers, **given)
    if version == "6.1":
        pressed = deflection + radius - numbers["UNLOADED_RADIUS"]
        np.testing.assert_allclose(at_rest["static_deflection"], pressed, rtol=1e-12)
    force = law.values(["vertical_force"], numbers, **given, deflection=deflection)["vertical_force"]
    np.testing.assert_allclose(force, given["load"], rtol=1e-12)


def test_slip_stiffness_is_the_slope_at_zero_slip() -> None:
    """Without shifts, at zero slip: Kxk and Kya of the book."""
    shifts = ("PHX1", "PHX2", "PVX1", "PVX2", "PHY1", "PHY2", "PVY1", "PVY2", "RHX1", "RHY1", "RHY2", "RVY1", "RVY2")
    numbers = {**numbers_of("6.1"), **dict.fromkeys(shifts, 0.0)}
    law = tangential_law("magic_formula", "6.1")
    known: dict[str, Any] = {**ROLLING, "camber": 0.0}
    known |= {"slip_x": np.array([1e-6, 0.0]), "slip_y": np.array([0.0, 1e-6])}
    found = law.values(["force_x", "force_y", "stiffness_x", "stiffness_y"], numbers, **known)
    assert found["force_x"][0] / 1e-6 == pytest.approx(float(found["stiffness_x"]), rel=1e-6)
    assert found["force_y"][1] / 1e-6 == pytest.approx(float(found["stiffness_y"]), rel=1e-6)


@pytest.mark.parametrize("version", MORE)
def test_scaling_factors_have_their_places_in_the_book(version: str) -> None:
    """At slips of which each factor scales one quantity: 4.E7 and 4.E13 to 4.E30, 4.E69, 4.E76, A48."""
    law, numbers = tangential_law("magic_formula", version), numbers_of(version)
    names = ("friction_x", "friction_y", "stiffness_x", "stiffness_y", "moment_x", "moment_y", "arm", "c_x", "c_y")

    def ratio(**factors: float) -> dict[str, float]:
        both = [law.values(names, {**numbers, **more}, **ROLLING) for more in (factors, {})]
        return {name: float(both[0][name] / both[1][name]) for name in names}

    speed = math.hypot(0.02, 0.05) * 16.0
    slower = 1.0 / (1.0 + 0.3 * speed / numbers["LONGVL"])
    fading = ratio(LMUV=0.3)
    assert [fading["friction_x"], fading["friction_y"]] == pytest.approx([slower, slower], rel=1e-9)
    for factor, scaled in {
        "LMUX": "friction_x", "LMUY": "friction_y", "LKX": "stiffness_x", "LKY": "stiffness_y", "LMY": "moment_y",
        "LMX": "moment_x", "LS": "arm", "LCX": "c_x", "LCY": "c_y",
    }.items():  # fmt: skip  # a table
        assert ratio(**{factor: 0.9 * numbers.get(factor, 1.0)})[scaled] == pytest.approx(0.9, rel=1e-9), factor


def test_a_coefficient_replaces_the_default_of_its_name() -> None:
    law = tangential_law("magic_formula", "6.1")
    numbers = numbers_of("6.1")
    fewer = {name: number for name, number in numbers.items() if name != "PKY4"}
    both = [law.values(["stiffness_y"], {**fewer, **more}, **ROLLING)["stiffness_y"] for more in ({}, {"PKY4": 2.0})]
    assert both[0] == both[1] != law.values(["stiffness_y"], numbers, **ROLLING)["stiffness_y"]


def test_version_5_2_without_relaxation_lengths_has_the_length_zero() -> None:
    """Files that were fitted to steady slips alone; the lateral length is the sine of the book."""
    law, numbers = tangential_law("magic_formula", "5.2"), numbers_of("5.2")
    given = {**ROLLING, "load": np.array([0.0, 1e-3, 4000.0])}
    steady = {**numbers, **dict.fromkeys(("PTX1", "PTX2", "PTX3", "PTY1", "PTY2"), 0.0)}
    found = law.values(["relaxation_x", "relaxation_y"], steady, **given)
    assert [length.tolist() for length in found.values()] == [[0.0] * 3] * 2
    ratio = given["load"] / numbers["FNOMIN"] / numbers.get("LFZO", 1.0)
    sines = np.sin(2.0 * np.arctan(ratio / numbers["PTY2"]))
    lengths = law.values(["relaxation_y"], numbers, **given)["relaxation_y"]
    np.testing.assert_allclose(lengths / lengths[-1], sines / sines[-1], rtol=1e-9, atol=1e-15)


def test_factors_of_curvature_are_limited() -> None:
    law, numbers = tangential_law("magic_formula", "6.1"), {**numbers_of("6.1"), "PEX2": 0.0, "PEX3": 0.0, "PEX4": 0.0}
    limits = ({"PEX1": 1.0}, {"PEX1": 3.0}, {"PEX1": 3.0, "CURVATURE_MOST": 1e3})
    found = [float(law.values(["force_x"], {**numbers, **more}, **ROLLING)["force_x"]) for more in limits]
    assert found[1] == pytest.approx(found[0], rel=1e-6)
    assert found[2] < 0.97 * found[0]
