"""Calls of linear models and designs of control that are hardly meant: what they are answered."""

from __future__ import annotations

import importlib
import re
import warnings
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.control import OutputFeedback, kalman, lqr, place
from eomgen.products.linear.augmentation import delay_line, shaping_filter
from eomgen.products.linear.control.riccati_equation import without_cross_terms
from eomgen.products.linear.control.second_order import placed_modal_gains
from eomgen.products.linear.control.stationary import stationary_covariance
from eomgen.products.linear.spectra import MeasuredRoad, PowerSpectrum
from eomgen.products.linear.state_space import StateSpace, linear_model_name
from eomgen.spectra import InputSpectrum, Road, RoadExcitation
from tests.linear.by_hand import linear_model

#: A mass on a spring and a damper that an input pushes.
LINEAR = linear_model(2.0, 0.5, 50.0, ["x"], {"f": [1.0]}, None, {"place": {"q": [1.0]}}, ["m"])
SPACE, FREE = LINEAR.state_space(), linear_model(1.0, 0.0, 4.0, ["x"], {"f": [1.0]})


def regulator(**options: Any) -> Any:
    return lqr(SPACE, {"place": 1.0}, {"f": 0.1}, **options)


def observer() -> Any:
    return kalman(SPACE, {"f": 1.0}, {"place": 1e-4})


def unpacked(result: Any) -> None:
    _, _ = result


NARROW = PowerSpectrum("y", "m", np.array([1.0, 5.0]), np.ones(2))
ONE = np.ones((1, 1))
CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: FREE.frequency_response([1.0, 2.0], "f", "x"), "a frequency is equal to the frequency of an undamped mod"),
    (lambda: delay_line("u", "y", 0, 0.1), "samples: a whole number from 1 on is needed, not 0; try: 1"),
    (lambda: delay_line("u", "y", 2, 0.0), "sample: the time between two samples is 0 s; try: a time above zero"),
    (lambda: shaping_filter([1.0], [0.0, 0.0], "w", "u"), "shaping_filter: the coefficients are not finite numbers"),
    (lambda: shaping_filter(["one"], [1.0, 2.0], "w", "u"), "numerator: an array of real numbers is needed, not list"),
    (lambda: OutputFeedback(observer(), regulator()), "OutputFeedback: a Regulator comes first, not an Observer; try:"),
    (lambda: stationary_covariance(SPACE, {"wind": 1.0}), "noise: there is no disturbance or input 'wind'"),
    (lambda: stationary_covariance(SPACE, 1.0), "noise: a mapping is needed, not float"),  # type: ignore[arg-type]
    (lambda: SPACE.unit("outputs", "z"), "unit: there is no output 'z'; try: one of place"),
    (lambda: SPACE.reference("output", "y"), "reference: there is no kind 'output' of signals; try: outputs"),
    (lambda: regulator().gain("f", "z"), "gain: there is no 'z' among the gains; try: one of x, v.x"),
    (lambda: without_cross_terms(ONE, 1.1 * ONE), "the cost has no minimum: its cross terms outweigh the weights of"),
    (lambda: placed_modal_gains([2.0], [0.1], [0.0], [0.5]), "a frequency of 0 rad/s is asked for; try: a number"),
    (lambda: InputSpectrum("w", [0.0, 1.0], [1, 1]), "InputSpectrum: w: frequencies have to be two or more positive"),
    (lambda: NARROW.rms(4.0, 2.0), "rms: 4 to 2 Hz is reversed; try: low <= high"),
    (lambda: MeasuredRoad([1.0, 2.0], [1.0, -1e-9]), "MeasuredRoad: frequencies have to be two or more"),
    (lambda: OutputFeedback(regulator(), regulator()), "an Observer comes second, not a Regulator"),
    (
        lambda: eomgen.with_controller(LINEAR, regulator()),  # type: ignore[arg-type]
        "with_controller: the path of a scene file, or its nested data, is needed, not Linearization; try: with_cont",
    ),
    (lambda: eomgen.with_controller("scene.toml", regulator().gains), "with_controller: a Regulator or an OutputFeed"),
    (lambda: unpacked(regulator()), "a Regulator is one object, and not several to be unpacked; try: law = ..., and"),
    (lambda: unpacked(observer()), "an Observer is one object, and not several to be unpacked; try: observer = ..."),
    (lambda: LINEAR.rms("place", "C"), "rms: an excitation is needed, not 'C'"),
    (lambda: LINEAR.psd("place", 3.0), "psd: an excitation is needed, not float"),
    (lambda: LINEAR.ride_table(cast(Any, InputSpectrum("m", [1, 2], [1, 1]))), "ride_table: the excitation"),
    (
        lambda: LINEAR.rms_on_white_noise_road("place", cast(Any, InputSpectrum("m", [1, 2], [1, 1]))),
        "rms_on_white_noise_road: the excitation by a road is needed, not InputSpectrum",
    ),
]


@pytest.mark.parametrize(("call", "piece"), CALLS, ids=[piece[:40] for _, piece in CALLS])
def test_each_is_answered_with_what_to_try(call: Callable[[], Any], piece: str) -> None:
    with pytest.raises(eomgen.EomgenError, match=re.escape(piece)):
        call()


@pytest.mark.parametrize(
    ("call", "piece"),
    [
        (lambda: place(SPACE, [1, 2]), "place: poles with positive real parts are asked for, 1, 2: such motions"),
        (lambda: place(SPACE, [1 + 2j, 1 - 2j]), "asked for, 1+2j, 1-2j"),
        (lambda: place(SPACE, [1, 2], sample="10 ms"), "poles z = e^(s T) outside the unit circle"),
    ],
)  # fmt: skip  # a table
def test_linear_designs_that_are_hardly_meant_are_warned_of(call: Callable[[], Any], piece: str) -> None:
    with pytest.warns(RuntimeWarning) as seen:
        call()
    assert any(piece in str(item.message) for item in seen), [str(item.message) for item in seen]


def test_linear_designs_that_are_meant_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        place(SPACE, [-1, -2])
        place(SPACE, [-1, -2], sample="10 ms")


def refused(call: Callable[[], Any]) -> str:
    with pytest.raises(eomgen.EomgenError) as caught:
        call()
    return str(caught.value)


def test_names_of_states_are_taken_as_solutions_spell_them() -> None:
    space = linear_model(1.0, 0.0, 0.0, ["x"], {"u": [1.0]}).state_space()
    linear = lqr(space, {"x": 2.0, "v.x": 1.0}, {"u": 1.0})
    as_written = lqr(space, {"q.x": 2.0, "v.x": 1.0}, {"u": 1.0})
    np.testing.assert_array_equal(as_written.gains, linear.gains)
    np.testing.assert_allclose(linear.gains, [[np.sqrt(2.0), np.sqrt(1.0 + 2.0 * np.sqrt(2.0))]])
    assert linear_model_name("ff", ("heave", "v.heave", "z.ff")) == "z.ff"
    assert linear_model_name("heave", ("heave", "q.heave")) == "heave"
    assert linear_model_name("q.hight", ("heave",)) == "q.hight"
    with pytest.raises(eomgen.UsageError, match="there is no output or state"):
        lqr(space, {"q.y": 1.0}, {"u": 1.0})


def test_speeds_of_rides_have_units() -> None:
    road = RoadExcitation(Road("C"), 20.0, {"u": 0.0})
    assert road.at("72 km/h") == road
    assert "RoadExcitation: speed" in refused(lambda: road.at("72 kg"))


def test_modules_within_a_moved_one_are_imported_by_their_earlier_names() -> None:
    assert importlib.import_module("eomgen.linear.state_space").StateSpace is StateSpace
