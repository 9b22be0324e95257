"""Campbell diagrams against characteristic polynomials of rotors with gyroscopic moments."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import eomgen
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.products.linear.campbell_plot import CampbellView, plot_campbell
from eomgen.products.linear.campbell_search import _FollowedModes, _Oscillations, _tracks_modes, campbell
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.plots import LabelBox, free_box
from tests.linear.by_hand import linear_model

MASS, DIAMETRAL, POLAR = 12.0, 0.18, 0.31
BENDING, LENGTH = 2.1e4, 0.6
K11, K12, K22 = 12 * BENDING / LENGTH**3, -6 * BENDING / LENGTH**2, 4 * BENDING / LENGTH


@pytest.fixture(scope="module")
def overhung() -> eomgen.Model:
    """Return a disc at the end of a massless cantilever shaft along z."""
    builder = eomgen.SceneBuilder("overhung", gravity=[0, 0, 0]).parameter("damping", 0.0, tunable=True)
    for name in ("along_x", "along_y", "about_x", "about_y"):
        builder.body(name, 0)
    builder.body("disc", MASS, inertia=[DIAMETRAL, DIAMETRAL, POLAR])
    chain = ["base", "along_x", "along_y", "about_x", "about_y", "disc"]
    kinds = [("x", "prismatic", [1, 0, 0]), ("y", "prismatic", [0, 1, 0])]
    kinds += [("tilt_x", "revolute", [1, 0, 0]), ("tilt_y", "revolute", [0, 1, 0]), ("spin", "revolute", [0, 0, 1])]
    for k, (name, kind, axis) in enumerate(kinds):
        builder.joint(name, kind, chain[k], chain[k + 1], axis=axis)
    builder.effort("x", "x", f"-{K11} * q.x - {K12} * q.tilt_y - damping * v.x")
    builder.effort("y", "y", f"-{K11} * q.y + {K12} * q.tilt_x - damping * v.y")
    builder.effort("tilt_x", "tilt_x", f"-{K22} * q.tilt_x + {K12} * q.y")
    builder.effort("tilt_y", "tilt_y", f"-{K22} * q.tilt_y - {K12} * q.x")
    return eomgen.build(builder.build(), profile="instant")


def frequencies(speed: float) -> np.ndarray:
    """Return the roots of (k11 - m w^2) (k22 - I_d w^2 + I_p W w) = k12^2; positive ones whirl forward."""
    bending = np.polynomial.Polynomial([K11, 0.0, -MASS])
    tilting = np.polynomial.Polynomial([K22, POLAR * speed, -DIAMETRAL])
    return np.sort((bending * tilting - K12**2).roots().real)


def overhung_by_hand(speed: float, before: Linearization | None = None) -> Linearization:
    """Return the same disc by its matrices: the axis of the spin is (tilt_y, -tilt_x, 1)."""
    K = np.diag([K11, K11, K22, K22])
    K[0, 3] = K[3, 0] = K12
    K[1, 2] = K[2, 1] = -K12
    C = np.zeros((4, 4))
    C[2, 3], C[3, 2] = POLAR * speed, -POLAR * speed
    return linear_model(np.diag([MASS, MASS, DIAMETRAL, DIAMETRAL]), C, K, ("x", "y", "tilt_x", "tilt_y"))


PLANES = [("x", "y"), ("tilt_x", "tilt_y")]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_an_overhung_disc_has_the_frequencies_of_its_polynomial(sense: float) -> None:
    """The sense of whirl is that of the spin, which may be negative."""
    speeds = np.sort(sense * np.linspace(0.0, 1500.0, 9))
    told: list[tuple[int, int]] = []
    diagram = campbell("spin", "rad/s", speeds, overhung_by_hand, (1, 2), PLANES, lambda *done: told.append(done))
    assert diagram.eigenvalues.shape == (9, 4) and set(diagram.stability) == {"marginal"}
    for row, speed in enumerate(speeds):
        expected = frequencies(abs(speed))
        found = diagram.angular_frequencies[row]
        np.testing.assert_allclose(np.sort(found), np.sort(np.abs(expected)), rtol=1e-7)
        if speed:
            np.testing.assert_allclose(np.sort(found * diagram.whirl[row]), expected, rtol=1e-7)
    # a column stays one mode: its frequency rises or falls all along, forward ones rise
    last = -1 if sense > 0.0 else 0
    for column, whirl in zip(diagram.angular_frequencies.T, diagram.whirl[last], strict=True):
        assert np.all(np.diff(column) * whirl * sense > 0.0)
    assert np.all(np.delete(diagram.whirl, 0 if sense > 0.0 else -1, axis=0) == diagram.whirl[last])
    assert told == sorted(told) and told[8] == (9, 18) and told[-1] == (18, 18)
    swapped = campbell("spin", "rad/s", speeds[1:3], overhung_by_hand, (), [pair[::-1] for pair in PLANES])
    np.testing.assert_array_equal(swapped.whirl, -diagram.whirl[1:3])


@pytest.mark.parametrize("after", [1, 2, 7])
def test_ctrl_c_keeps_the_values_and_crossings_so_far(after: int) -> None:
    """Half of the progress is for the values, half for the crossings."""
    speeds, told = np.linspace(0.0, 1500.0, 5), list[tuple[int, int]]()
    whole = campbell("spin", "rad/s", speeds, overhung_by_hand, (1,), PLANES)

    def report(done: int, total: int) -> None:
        told.append((done, total))
        if len(told) == after:
            raise KeyboardInterrupt

    if after == 1:
        with pytest.raises(KeyboardInterrupt):
            campbell("spin", "rad/s", speeds, overhung_by_hand, (1,), PLANES, report)
        return
    part = campbell("spin", "rad/s", speeds, overhung_by_hand, (1,), PLANES, report)
    assert part.interrupted and not whole.interrupted and len(whole.crossings) == 3
    np.testing.assert_array_equal(part.values, speeds[:after])
    np.testing.assert_array_equal(part.eigenvalues, whole.eigenvalues[:after])
    assert len(part.crossings) == max(0, after - len(speeds)) and set(part.crossings) <= set(whole.crossings)
    assert told == sorted(told) and {total for _, total in told} == {10}


def test_critical_speeds_are_roots_of_their_own_polynomial() -> None:
    """Forward w = n W: (k11 - m w^2) (k22 + (I_p / n - I_d) w^2) = k12^2; backward with -I_p."""
    diagram = campbell("spin", "rad/s", np.linspace(1.0, 2500.0, 9), overhung_by_hand, (1, 2), PLANES)
    expected = []
    for order in (1, 2):
        for sense, word in ((1, "forward"), (-1, "backward")):
            bending = np.polynomial.Polynomial([K11, -MASS])
            tilting = np.polynomial.Polynomial([K22, sense * POLAR / order - DIAMETRAL])
            squares = (bending * tilting - K12**2).roots()
            expected += [(order, math.sqrt(w.real) / order, word) for w in squares if w.real > 0.0 and not w.imag]
    expected = sorted(item for item in expected if item[1] < 2500.0)
    assert len(expected) >= 6
    assert len(diagram.crossings) == len(expected)
    for found, (order, speed, word) in zip(diagram.crossings, expected, strict=True):
        assert found.order == order and found.whirl == word
        assert found.speed == pytest.approx(speed, rel=1e-9)
        assert found.frequency == pytest.approx(order * speed, rel=1e-9)
    of_order_1 = [speed for order, speed, _ in expected if order == 1]
    np.testing.assert_allclose(diagram.critical_speeds, of_order_1, rtol=1e-9)
    assert [row[0] for row in diagram.rows] == ["1"] * len(of_order_1) + ["2"] * (len(expected) - len(of_order_1))
    assert f"1x at {of_order_1[0]:.6g}" in repr(diagram) and "<td" in diagram._repr_html_()


def test_modes_have_the_numbers_of_a_table_at_any_speed() -> None:
    """Of the model at the speed, also between two values; modes that the model lacks come last."""
    speeds = np.linspace(0.0, 1500.0, 5)

    def numbered(speed: float, model: Linearization) -> tuple[Any, np.ndarray, np.ndarray]:
        diagram = campbell("spin", "rad/s", speeds, overhung_by_hand, reference=(speed, model))
        return diagram, diagram.angular_frequencies[np.argmin(np.abs(speeds - speed))], np.array(diagram.numbers)

    for speed in (0.0, 700.0, 1500.0):
        diagram, here, numbers = numbered(speed, overhung_by_hand(speed))
        of_table = overhung_by_hand(speed).modes().angular_frequency
        assert [diagram.number(k) for k in range(4)] == numbers.tolist()
        assert sorted(numbers) == [1, 2, 3, 4]
        np.testing.assert_array_equal(np.argsort(here), np.argsort(of_table[numbers - 1]))
    overdamped = overhung_by_hand(0.0)
    C = np.diag([0.0, 0.0, 1e4, 1e4])
    few = linear_model(overdamped.M0, C, overdamped.K0, overdamped.coordinates)
    _, _, numbers = numbered(0.0, few)
    oscillating = np.flatnonzero(few.modes().oscillating) + 1
    assert set(oscillating) < set(numbers) and max(numbers) > len(few.modes())
    other = linear_model(np.eye(1), np.zeros((1, 1)), np.eye(1), ["z"])
    assert campbell("spin", "rad/s", speeds, overhung_by_hand, reference=(0.0, other)).numbers == ()


def test_orbits_between_the_frequencies_of_unequal_bearings_are_lines() -> None:
    """Bearings k_x and k_y: w = sqrt(k / m) each, at all speeds."""
    bearings = linear_model(3.0 * np.eye(2), np.zeros((2, 2)), np.diag([3e4, 4.8e4]), ("x", "y"))
    diagram = campbell("speed", "rad/s", np.linspace(40.0, 190.0, 4), lambda *_: bearings, (1,), [("x", "y")])
    np.testing.assert_allclose(diagram.critical_speeds, [100.0, math.sqrt(1.6e4)], rtol=1e-7)
    assert np.all(diagram.whirl == 0) and [item.whirl for item in diagram.crossings] == ["", ""]


def test_modes_and_frequencies_of_a_picture_are_chosen() -> None:
    diagram = campbell("spin", "rad/s", [0.0, 100.0], overhung_by_hand, (1, 2), PLANES)
    chosen = Figure().subplots()
    diagram.plot(chosen, frequencies=(5.0, 90.0), modes=np.array([0]))
    assert chosen.get_ylim() == (5.0, 90.0)
    speeds = {f"{item.speed:.4g}" for item in diagram.crossings if item.mode == 0}
    assert {text.get_text() for text in chosen.texts} == {"1x", "2x", "mode 1", *speeds}
    heights = [line.get_ydata()[-1] for line in chosen.lines if line.get_linestyle() in ("-", "--")]
    assert set(np.array(heights)[np.isfinite(heights)]) == {diagram.frequencies[-1, 0]}
    for wrong, text in (
        ({"modes": [99]}, "modes: there is no mode 99; try: numbers from 0 to"),
        ({"frequencies": (9, 3)}, r"frequencies: \(9, 3\) are not limits in Hz; try: \(0, 40\)"),
        ({"orders": [4]}, "orders: the diagram has no order 4, its orders are 1 and 2; try: mod"),
        ({"orders": 1}, r"orders: several numbers are needed, not 1; try: orders=\(1, 2\)"),
        ({"modes": "12"}, r"modes: several numbers are needed, not '12'; try: modes=\(0, 1\)"),
        ({"frequencies": ("0 Hz", "9 Hz")}, r"frequencies: several numbers are needed, not \('0 Hz', '9 Hz'\)"),
        ({"ylim": (0, 9)}, "plot: there is no argument 'ylim'; try: one of axes, frequencies, modes, orders"),
        ({"speed_unit": "Hz/s"}, "speed_unit: there is no unit 'Hz/s'; try: rad/s or rpm or Hz"),
    ):
        with pytest.raises(eomgen.UsageError, match=text):
            diagram.plot(chosen, **wrong)
    with pytest.raises(eomgen.UsageError, match=r"speed_unit: damping has no unit, and a speed in rad/s is converted"):
        replace(diagram, parameter="damping", unit="").plot(chosen, speed_unit="rpm")


@pytest.mark.parametrize(("unit", "scale"), [("rad/s", 1.0), ("rpm", 30.0 / math.pi), ("Hz", 0.5 / math.pi)])
def test_the_speed_has_the_unit_that_is_asked_for(unit: str, scale: float) -> None:
    axis = Figure().subplots()
    plot_campbell(synthetic([1.0, 1.4], crossings=[(1.0, 8.0, 1)]), axis, CampbellView(letter="P", speed_unit=unit))
    assert axis.get_xlabel() == f"speed, {unit}" and axis.get_xlim() == pytest.approx((0.0, 10.0 * scale))
    dots = next(line for line in axis.lines if line.get_marker() == "o")
    assert dots.get_xdata() == pytest.approx([8.0 * scale]) and dots.get_ydata() == pytest.approx([8.0 / 2 / math.pi])
    assert {f"{8.0 * scale:.4g}", "1P"} <= {text.get_text() for text in axis.texts}
    assert [text.get_text() for text in axis.get_legend().get_texts()] == [f"crossing, {unit}"]


def test_crossings_of_modes_and_orders_that_are_not_drawn_are_left_out() -> None:
    diagram = synthetic([1.0, 1.4], orders=(1.0, 2.0), crossings=[(1.0, 8.0, 1), (2.0, 4.0, 0), (2.0, 3.0, 1)])
    for view, speeds in (
        (CampbellView(), [8.0, 4.0, 3.0]),
        (CampbellView(modes=[1]), [8.0, 3.0]),
        (CampbellView(orders=[2.0]), [4.0, 3.0]),
        (CampbellView(modes=[0], orders=[1.0]), []),
    ):
        axis = Figure().subplots()
        plot_campbell(diagram, axis, view)
        dots = next(line for line in axis.lines if line.get_marker() == "o")
        assert list(dots.get_xdata()) == speeds


def synthetic(
    heights: list[float],
    orders: tuple[float, ...] = (1.0,),
    crossings: list[tuple[float, float, int]] | None = None,
    bend: float = 0.1,
) -> Any:
    """Return a diagram of modes from ``heights`` in Hz on, over speeds to 10 rad/s, with (order, speed, mode)."""
    speeds = np.linspace(0.0, 10.0, 5)
    frequencies = np.outer(np.linspace(1.0, 1.0 + bend, 5), heights)
    dots = [SimpleNamespace(order=o, speed=s, frequency=o * s, mode=k) for o, s, k in crossings or ()]
    return SimpleNamespace(
        parameter="speed", unit="rad/s", values=speeds, frequencies=frequencies, orders=orders, crossings=dots,
        whirl=np.zeros(frequencies.shape, int), numbers=(), number=lambda mode: mode + 1,
    )  # fmt: skip  # a table


def test_boxes_of_labels_overlap_up_to_the_sum_of_their_half_sides() -> None:
    box = LabelBox(1.0, 2.0, 3.0, 1.0)
    met = [box.meets(LabelBox(1.0 + x, 2.0 + y, 2.0, 0.5)) for x in (-5.0, -4.9, 4.9, 5.0) for y in (-1.5, -1.4, 1.4)]
    assert met == [False] * 4 + [True] * 2 + [False] + [True] * 2 + [False] * 3


def test_a_label_stands_at_its_first_free_place_within_the_axes() -> None:
    """Two letters of 5.6 points and a line of 12: a box of half sides 5.6 and 6, 4 points from the dot."""
    places = ((1, 0.0), (-1, 5.0), (0, -20.0))
    assert free_box((50.0, 40.0), "ab", places, []) == LabelBox(50.0 + 9.6, 40.0, 5.6, 6.0)
    assert free_box((50.0, 40.0), "ab", places, [LabelBox(60.0, 40.0, 1.0, 1.0)]) == LabelBox(40.4, 45.0, 5.6, 6.0)
    taken = [LabelBox(x, 40.0, 1.0, 1.0) for x in (60.0, 40.0)]
    assert free_box((50.0, 40.0), "ab", places, taken) == LabelBox(50.0, 20.0, 5.6, 6.0)
    assert free_box((50.0, 40.0), "ab", places, [*taken, LabelBox(50.0, 20.0, 1.0, 1.0)]) is None
    for size, place in (((65.2, 46.0), (59.6, 40.0)), ((65.1, 51.0), (40.4, 45.0)), ((55.6, 40.0), (50.0, 20.0))):
        box = free_box((50.0, 40.0), "ab", places, [], size)
        assert box is not None and box[:2] == pytest.approx(place)
    assert free_box((50.0, 40.0), "ab", places, [], (55.5, 40.0)) is None
    assert free_box((4.0, 5.0), "ab", ((0, 0.0), (1, 1.0)), [], (60.0, 60.0)) == LabelBox(13.6, 6.0, 5.6, 6.0)
    assert LabelBox.dot(1.0, 2.0) == LabelBox(1.0, 2.0, 3.5, 3.5)


def test_diagrams_that_cannot_be(overhung: eomgen.Model) -> None:
    for call, text in (
        (lambda: overhung.campbell("spinn", [1.0, 2.0]), "no tunable parameter or velocity 'spinn'; try: spin"),
        (lambda: overhung.campbell("spin", [1.0]), "n from 2 on is needed"),
        (lambda: overhung.campbell("spin", [2.0, 1.0]), "values: they do not increase"),
        (lambda: overhung.campbell("spin", [1.0, 2.0], orders=(0,)), "orders: an order is 0; try: positive numbers"),
        (lambda: overhung.campbell("spin", [1.0, 2.0], whirl=["xy"]), "whirl: 'xy' is not a pair of deflections"),
        (lambda: overhung.campbell("spin", [1.0, 2.0], whirl=[("x", "z")]), "there is no output or state 'z'"),
        (lambda: overhung.campbell("spin", [1.0, 2.0], whirl=[("tilt_x", "spin")]), "whirl tilt_x:spin: spin is the"),
        (lambda: overhung.campbell("damping", [1.0, 2.0], velocities={"spin": 1.0}), "damping is a parameter, and"),
        (lambda: overhung.campbell("spin", [1.0, 2.0], coordinates={"tilt": 0.1}), "coordinate or joint 'tilt'; try: "),
    ):
        with pytest.raises(UsageError, match=text):
            call()


@pytest.mark.parametrize("pair", [("tilt_y", "tilt_x"), ("y", "x"), ("tilt_x", "tilt_y"), ("x", "tilt_x")])
def test_deflections_against_the_sense_of_the_spin_are_warned_of(overhung: eomgen.Model, pair: tuple[str, str]) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        overhung.campbell("spin", [10.0, 20.0], whirl=[pair], orders=())
    first, second = pair
    said = f"campbell: whirl {first}:{second} is against the sense of spin: the axis of {second} is a quarter turn "
    said += f"before the axis of {first}, so that forward and backward are exchanged; try: {second}:{first} [W0001]"
    found = [(str(each.message), each.filename) for each in caught]
    assert found == ([(said, __file__)] if first.endswith("y") else [])


def test_a_value_without_a_linear_model_is_left_out_and_named() -> None:
    def linearized(speed: float, before: Linearization | None) -> Linearization:
        if speed in lost:
            raise NumericalError(Problem("steady motion", "it does not last", "another speed"))
        return overhung_by_hand(speed)

    lost = {60.0}
    with pytest.warns(RuntimeWarning, match="left out: numerical error: at spin = 60: steady motion: it does not"):
        diagram = campbell("spin", "rad/s", [50.0, 60.0, 70.0], linearized)
    assert diagram.values.tolist() == [50.0, 70.0] and list(diagram.left_out) == [60.0]
    for row, speed in enumerate(diagram.values):
        np.testing.assert_allclose(
            np.sort(diagram.angular_frequencies[row]), np.sort(np.abs(frequencies(speed))), rtol=1e-9
        )
    assert "50 to 70 rad/s" in repr(diagram) and " Hz;" in repr(diagram) and "none at 60" in repr(diagram)
    lost = {50.0, 60.0}
    with pytest.raises(NumericalError, match="at spin = 50: steady motion: it does not last"):
        campbell("spin", "rad/s", [50.0, 60.0, 70.0], linearized)


def test_of_two_equal_modes_one_whirls_forward_and_one_backward() -> None:
    disc = linear_model(20.0 * np.eye(2), 150.0 * np.eye(2), 2e6 * np.eye(2), ("x", "y"))
    for whirl in ([("x", "y")], [("y", "x")]):
        diagram = campbell("spin", "rad/s", np.linspace(0.0, 800.0, 5), lambda *_: disc, (1,), whirl)
        assert [sorted(row) for row in diagram.whirl.tolist()] == [[0, 0], *[[-1, 1]] * 4]
        critical = math.sqrt(2e6 / 20 - (150 / 40) ** 2)  # the damped frequency, the same at all speeds
        np.testing.assert_allclose(diagram.critical_speeds, [critical, critical], rtol=1e-9)
        assert sorted(item.whirl for item in diagram.crossings) == ["backward", "forward"]


@pytest.mark.slow
def test_unbalance_refuses_a_diagram_with_the_body_and_its_distance() -> None:
    builder = eomgen.SceneBuilder("jeffcott", gravity=[0, 0, 0]).body("along_x", 0).body("along_y", 0)
    builder.body("disc", 20, inertia=[0.25, 0.25, 0.45], center_of_mass=[2e-4, 0, 0])
    builder.joint("x", "prismatic", "base", "along_x", axis=[1, 0, 0], stiffness=2e6, damping=150.0)
    builder.joint("y", "prismatic", "along_x", "along_y", axis=[0, 1, 0], stiffness=2e6, damping=150.0)
    builder.joint("spin", "revolute", "along_y", "disc", axis=[0, 0, 1])
    model = eomgen.build(builder.build(), profile="instant")
    with pytest.raises(NumericalError) as refusal:
        model.campbell("spin", np.linspace(0.0, 800.0, 5))
    hint = (
        "centres of mass on the axis of spin (the centre of disc is 0.0002 m off, 0.004 kg m), with gravity and springs"
    )
    assert hint in str(refusal.value)
    assert "unbalance acts on the balanced rotor as a force that turns (docs/python.md, Rotors)" in str(refusal.value)


@pytest.mark.slow
def test_a_bending_shaft_that_spins_in_a_standing_bearing_has_no_diagram_of_frozen_models() -> None:
    """Bending is measured in axes that turn, the bearing's motion in axes that stand: the linear model is periodic."""
    bending = {"shapes": "clamped_free", "modes": 1, "stiffness": 500.0}
    builder = eomgen.SceneBuilder("shaft", gravity=[0, 0, 0]).body("bearing", 0.1)
    builder.beam("shaft", 1.0, mass_per_length=1.0, polar_inertia=1e-3, bending_y=bending, bending_z=bending)
    builder.joint("y", "prismatic", "base", "bearing", axis=[0, 1, 0], stiffness=1e4)
    builder.joint("spin", "revolute", "bearing", "shaft", axis=[1, 0, 0])
    model = eomgen.build(builder.build(), profile="instant")
    with pytest.raises(NumericalError, match=r"the linear model changes with the turn of spin.*model\.floquet"):
        model.campbell("spin", [10.0, 100.0, 200.0])


@pytest.mark.parametrize(
    ("heights", "top", "words"),
    [
        ([1.0, 1.5], 1.08 * 1.65, ""),
        ([1.0, 1.5, 90.0, 300.0], 15.0 / (2.0 * np.pi), "2 modes above 2.39 Hz"),
        ([3.0, 100.0], 1.2 * 3.3, "1 mode above 3.96 Hz"),
    ],
)
def test_modes_above_the_drawn_range_are_counted(heights: list[float], top: float, words: str) -> None:
    """The range ends at one and a half times the ray of order 1 at 10 rad/s, above the lowest mode."""
    diagram = synthetic(heights)
    (axis,) = plot_campbell(diagram, Figure().subplots())
    assert [note.get_text() for note in axis.texts if " above " in note.get_text()] == ([words] if words else [])
    assert axis.get_ylim() == pytest.approx((0.0, top)) and axis.get_xlim() == (0.0, 10.0)


def veering(value: float, before: Linearization | None = None) -> Linearization:
    """Return frequencies of 1 and 1.6 rad/s whose shapes turn by a quarter of a turn from value 0 to 1."""
    angle = 0.5 * math.pi * value
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return linear_model(np.eye(2), np.zeros((2, 2)), turn @ np.diag([1.0, 2.56]) @ turn.T, ("x", "y"))


def test_shapes_that_turn_are_followed_over_values_between() -> None:
    """The values between are not those of the caller; without models there the shapes alone say which mode is which."""
    tried: list[float] = []

    def noted(value: float, before: Linearization | None) -> Linearization:
        assert (before is None) == (not tried)
        tried.append(value)
        return veering(value)

    diagram = campbell("s", "", [0.0, 1.0], noted)
    np.testing.assert_allclose(diagram.angular_frequencies, [[1.0, 1.6]] * 2, rtol=1e-12)
    assert diagram.values.tolist() == [0.0, 1.0] and sorted(tried) == [0.0, 0.25, 0.5, 0.75, 1.0]

    def at_ends(value: float, before: Linearization | None) -> Linearization:
        if 0.0 < value < 1.0:
            raise NumericalError(Problem("there", "no rest", "another value"))
        return veering(value)

    ends = campbell("s", "", [0.0, 1.0], at_ends)
    np.testing.assert_allclose(ends.angular_frequencies, [[1.0, 1.6], [1.6, 1.0]], rtol=1e-12)


def test_a_crossing_without_a_linear_model_is_left_out() -> None:
    def lost(value: float, before: Linearization | None) -> Linearization:
        if value not in (0.5, 2.0):
            raise NumericalError(Problem("there", "no rest", "another value"))
        return linear_model(1.0, 0.0, 1.0, ["x"])

    with pytest.warns(RuntimeWarning, match="Campbell diagram: a crossing with 1x is left out: .*no rest"):
        assert campbell("s", "rad/s", [0.5, 2.0], lost, (1.0,)).crossings == ()
    found = campbell("s", "rad/s", [0.5, 2.0], lambda *_: linear_model(1.0, 0.0, 1.0, ["x"]), (1.0, 0.25)).crossings
    assert [(item.order, item.mode, item.whirl) for item in found] == [(1.0, 0, "")]
    assert (found[0].speed, found[0].frequency) == pytest.approx((1.0, 1.0), rel=1e-12)


def _oscillations(frequencies: list[float], shapes: Any) -> _Oscillations:
    count = len(frequencies)
    eigenvalues = 1j * np.array(frequencies)
    return _Oscillations(eigenvalues, np.array(shapes, complex), np.zeros(count, int), np.ones(count), "stable")


@pytest.mark.parametrize(
    ("after", "turn", "expected"),
    [
        ([2.4, 10.0, 40.0], 0.0, True),  # a frequency that changes by half, far from all others
        ([1.0, 10.5, 39.0], 0.2, True),
        ([1.6, 10.0, 40.0], 0.7, False),  # shapes are mixed
        ([9.0, 10.0, 40.0], 0.0, False),  # next to another frequency
        ([1.0, 10.0, 70.0], 0.75, False),
    ],
)
def test_modes_that_cannot_be_mistaken_are_followed_without_a_value_between(
    after: list[float], turn: float, expected: bool
) -> None:
    shapes = np.eye(3)
    turned = shapes.copy()
    turned[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    now = _oscillations(after, turned)
    assert _tracks_modes(_oscillations([1.5, 10.0, 40.0], shapes), now) == expected


def test_a_mode_that_ends_is_not_followed_by_one_that_begins() -> None:
    before = _oscillations([1.0, 10.0], np.eye(3)[:, :2])
    assert not _tracks_modes(before, _oscillations([10.0, 40.0], np.eye(3)[:, 1:]))
    assert _tracks_modes(before, _oscillations([10.0], np.eye(3)[:, 1:2]))
    assert _tracks_modes(_oscillations([], np.zeros((3, 0))), before)


@pytest.mark.parametrize(("turning", "sense"), [(1e-9, 0), (1e-4, 1)])
def test_orbits_that_are_straight_but_for_rounding_have_no_sense(turning: float, sense: int) -> None:
    """Along both diagonals, with equal deflections in x and y: x'' + turning * y' + 2 x + y = 0 and the like."""
    gyroscopic = np.array([[0.0, turning], [-turning, 0.0]])
    lin = linear_model(np.eye(2), gyroscopic, [[2.0, 1.0], [1.0, 2.0]], ("x", "y"))
    diagram = campbell("spin", "rad/s", np.array([1.0, 2.0]), lambda *_: lin, (), [("x", "y")])
    assert sorted(np.abs(diagram.whirl).ravel()) == [sense] * 4


def test_crossings_are_sought_between_nodes_that_have_the_mode() -> None:
    """Frequencies 5 - speed, and 3, lost at the speeds 1 and 3, against one and two times the speed."""
    speeds, lost = np.arange(5.0), np.nan
    frequencies = np.column_stack([5.0 - speeds, [3.0, lost, 3.0, lost, 3.0]])
    followed = _FollowedModes(speeds, 1j * frequencies, np.zeros((5, 2), dtype=int), [[0, 1]] * 5)
    assert followed.candidates([1.0, 2.0]) == [(1.0, 2, 0), (2.0, 1, 0)]
