"""TMeasy, brush and linear laws: own programs of the same equations, closed forms, the tape at the edges."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from eomgen.products.contacts.tangential_laws import read_formulas, tangential_law
from eomgen.scene.formula.tokens import FormulaError
from eomgen.symbolic.calculus.partials import gradient
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape

#: A van's tyre as Chrono has it (vehicle/VW_microbus, TMeasy), at 1900 N and 3800 N; radius and stiffness are assumed.
VAN = {
    "LOAD": 1900.0, "DFX1": 34910.7021, "DFX2": 73974.3082, "FXM1": 2145.5102, "FXM2": 4140.6407, "FXS1": 1522.8229,
    "FXS2": 2922.8487, "SXM1": 0.13913, "SXM2": 0.13913, "SXS1": 0.66667, "SXS2": 0.66667, "DFY1": 30366.8749,
    "DFY2": 48833.5824, "FYM1": 1901.7234, "FYM2": 3471.9636, "FYS1": 1583.8391, "FYS2": 2938.7727, "SYM1": 0.14852,
    "SYM2": 0.18504, "SYS1": 0.96524, "SYS2": 1.0714, "TRAIL1": 0.178, "TRAIL2": 0.19, "SY01": 0.16337,
    "SY02": 0.20355, "SYE1": 0.96524, "SYE2": 1.0714, "RADIUS": 0.376, "STIFFNESS_Z": 1e5,
}  # fmt: skip  # a table
BRUSH = {"STIFFNESS": 15.0, "FRICTION": 0.9}
LINEAR = {"STIFFNESS_X": 20.0, "STIFFNESS_Y": 15.0, "FRICTION": 1.1}


def tmeasy(load: float, slip_x: float, slip_y: float) -> tuple[float, float, float]:
    """Return forces and the aligning moment of the van's tyre by Rill's equations, case by case."""
    share = load / VAN["LOAD"]

    def force(name: str) -> float:
        first, second = VAN[f"{name}1"], VAN[f"{name}2"]
        return share * (2.0 * first - 0.5 * second - (first - 0.5 * second) * share)

    def line(name: str) -> float:
        return VAN[f"{name}1"] + (VAN[f"{name}2"] - VAN[f"{name}1"]) * (share - 1.0)

    lift = [force("FXM") / force("DFX"), force("FYM") / force("DFY")]
    most = [line("SXM"), line("SYM")]
    scale = [most[k] / sum(most) + lift[k] / sum(lift) for k in (0, 1)]
    part = (slip_x / scale[0], slip_y / scale[1])
    slip = math.hypot(*part)
    if slip == 0.0:
        return 0.0, 0.0, 0.0
    cosine, sine = part[0] / slip, part[1] / slip
    slope = math.hypot(force("DFX") * scale[0] * cosine, force("DFY") * scale[1] * sine)
    peak = math.hypot(force("FXM") * cosine, force("FYM") * sine)
    slide = math.hypot(force("FXS") * cosine, force("FYS") * sine)
    at_peak = math.hypot(most[0] / scale[0] * cosine, most[1] / scale[1] * sine)
    at_slide = math.hypot(line("SXS") / scale[0] * cosine, line("SYS") / scale[1] * sine)
    if slip <= at_peak:
        ratio = slip / at_peak
        size = at_peak * slope * ratio / (1.0 + ratio * (ratio + slope * at_peak / peak - 2.0))
    elif slip < at_slide:
        ratio = (slip - at_peak) / (at_slide - at_peak)
        size = peak - (peak - slide) * ratio**2 * (3.0 - 2.0 * ratio)
    else:
        size = slide
    zero, end, lateral = line("SY0"), line("SYE"), abs(slip_y)
    trail = 0.0
    if lateral < end:
        factors = (-(2.0 * zero**2 + (zero + end) ** 2), 2.0 * (zero + end) ** 2 / end, -(2.0 * zero + end) / end)
        quartic = factors[0] + factors[1] * lateral + factors[2] * lateral**2
        trail = line("TRAIL") * (1.0 + (lateral / (zero * end)) ** 2 * quartic)
    length = 2.0 * math.sqrt(VAN["RADIUS"] * load / VAN["STIFFNESS_Z"])
    return size * cosine, -size * sine, length * trail * size * sine


def test_tmeasy_is_an_own_program_of_the_same_equations() -> None:
    slips = (-1.2, -0.4, -0.12, -0.02, 0.0, 0.01, 0.09, 0.3, 0.8)
    states = np.array([*product((800.0, 1900.0, 3000.0, 4200.0), slips, slips)])
    known = dict(zip(("load", "slip_x", "slip_y"), states.T, strict=True))
    found = tangential_law("tmeasy").values(["force_x", "force_y", "moment_z"], VAN, **known)
    own = np.array([tmeasy(*state) for state in states])
    for column, name in enumerate(found):
        np.testing.assert_allclose(found[name], own[:, column], rtol=1e-10, atol=1e-10 * np.abs(own[:, column]).max())


def test_tmeasy_has_the_published_maxima_and_slopes() -> None:
    """Digits of Chrono's file: maxima, forces of sliding and slopes at 1900 N and at twice this load."""
    law = tangential_law("tmeasy")

    def force(name: str, load: float, slip: float) -> float:
        found = law.values([f"force_{name}"], VAN, **{"load": load, "slip_x": 0.0, "slip_y": 0.0, f"slip_{name}": slip})
        return abs(float(found[f"force_{name}"]))

    assert force("x", 1900.0, 0.13913) == pytest.approx(2145.5102, rel=1e-12)
    assert force("x", 3800.0, 0.7) == pytest.approx(2922.8487, rel=1e-12)
    assert force("y", 3800.0, 0.18504) == pytest.approx(3471.9636, rel=1e-12)
    assert force("y", 1900.0, 0.97) == pytest.approx(1583.8391, rel=1e-12)
    assert force("x", 3800.0, 1e-7) / 1e-7 == pytest.approx(73974.3082, rel=1e-4)
    assert force("y", 1900.0, 1e-7) / 1e-7 == pytest.approx(30366.8749, rel=1e-4)


def test_brush_slides_with_friction_and_starts_with_its_stiffness() -> None:
    law, load = tangential_law("brush"), 3000.0
    small = law.values(["force_x", "force_y"], BRUSH, load=load, slip_x=0.0, slip_y=1e-4)
    assert float(small["force_y"]) == pytest.approx(-load * 15.0 * 1e-4, rel=2e-3)
    large = law.values(["force_x", "force_y"], BRUSH, load=load, slip_x=-0.6, slip_y=0.8)
    assert [float(force) for force in large.values()] == pytest.approx([-0.6 * 2700.0, -0.8 * 2700.0], rel=1e-12)
    # within adhesion, in the book's form: friction times load times 3 z - 3 z^2 + z^3
    z = 15.0 * 0.1 / (3.0 * 0.9)
    half = law.values(["force_y"], BRUSH, load=load, slip_x=0.0, slip_y=0.1)["force_y"]
    assert float(half) == pytest.approx(-0.9 * load * (3.0 * z - 3.0 * z**2 + z**3), rel=1e-12)


def test_linear_law_is_the_slip_of_tyres() -> None:
    law = tangential_law("linear")
    found = law.values(["force_x", "force_y"], LINEAR, load=3000.0, slip_x=-0.05, slip_y=0.02)
    size = 3000.0 / math.sqrt(1.0 + (1.0 + 0.3**2) / 1.1**2)
    assert (float(found["force_x"]), float(found["force_y"])) == pytest.approx((-size, -0.3 * size), rel=1e-14)


@pytest.mark.parametrize(("name", "coefficients"), [("tmeasy", VAN), ("brush", BRUSH), ("linear", LINEAR)])
def test_values_and_partials_on_the_tape_are_finite_at_the_edges(name: str, coefficients: dict[str, float]) -> None:
    law = tangential_law(name)
    results = [result for result in ("force_x", "force_y", "moment_z") if result in law.formulas]
    tape = Tape()
    algebra = Algebra(tape)
    given = {word: Scalar(tape, tape.input("pair", place)) for place, word in enumerate(("load", "slip_x", "slip_y"))}
    known = {**{word: algebra.scalar(number) for word, number in coefficients.items()}, **given}
    found = law.record(algebra, results, known)
    symbols, values = [scalar.ref for scalar in given.values()], [found[result].ref for result in results]
    first = [ref for value in values for ref in gradient(tape, value, symbols)]
    second = [ref for slope in first for ref in gradient(tape, slope, symbols)]
    states = np.array([*product((0.0, 2000.0), (-1.0, 0.0, 0.1, 3.0), (0.0, 0.1, 1e6))])
    table = evaluate(tape, [*values, *first, *second], {"pair": states})
    numeric = law.values(results, coefficients, **dict(zip(given, states.T, strict=True)))
    for place, result in enumerate(results):
        np.testing.assert_allclose(table[:, place], numeric[result], rtol=1e-12, atol=1e-9)
    assert np.all(np.isfinite(table))


def test_a_law_names_unknown_names() -> None:
    with pytest.raises(FormulaError, match="unknown name 'slipx'"):
        read_formulas({"force_x": "STIFFNESS*slipx"}, ["slip_x"], ["STIFFNESS"])
