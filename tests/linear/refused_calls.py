"""Refused calls of linear from Python with their texts, and calls at the border that are taken."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np

from eomgen.control import OutputFeedback, Regulator, kalman, lqr
from eomgen.products.linear.augmentation import delay, delay_line, shaping_filter
from eomgen.products.linear.control.riccati_equation import without_cross_terms
from eomgen.products.linear.control.second_order import optimal_modal_gains, placed_modal_gains
from eomgen.products.linear.control.stationary import stationary_covariance
from eomgen.products.linear.sampling import seconds
from eomgen.products.linear.spectra import InputSpectrum, MeasuredRoad, PowerSpectrum
from eomgen.products.linear.state_space import StateSpace
from tests.failures.mistakes import arm


def oscillator(feedthrough: float = 0.0) -> StateSpace:
    A, B = np.array([[0.0, 1.0], [-4.0, -0.4]]), np.array([[0.0], [1.0]])
    D = np.array([[feedthrough]])
    return StateSpace(
        A, B, np.zeros((2, 1)) + B, np.array([[1.0, 0.0]]), D, np.zeros((1, 1)),
        states=("x", "v"), inputs=("u",), disturbances=("w",), outputs=("y",),
    )  # fmt: skip  # two lines


LAW, SEEN = lqr(oscillator(), {"x": 1.0}, {"u": 1.0}), kalman(oscillator(), {"w": 1.0}, {"y": 1.0})

REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "delay of no sample": (
        lambda: delay_line("u", "y", 0, 0.1),
        "samples: a whole number from 1 on is needed, not 0; try: 1",
    ),
    "delay line of samples at once": (
        lambda: delay_line("u", "y", 2, 0.0),
        "sample: the time between two samples is 0 s; try: a time above zero",
    ),
    "filter of nothing": (
        lambda: shaping_filter([1.0], [0.0, 0.0], "w", "u"),
        "shaping_filter: the coefficients are not finite numbers; try: [2.0], [1.0, 0.5]",
    ),
    "filter of texts": (
        lambda: shaping_filter(["one"], [1.0, 2.0], "w", "u"),
        "numerator: an array of real numbers is needed, not list: <U3 is not real numbers",
    ),
    "regulator first": (
        lambda: OutputFeedback(cast(Any, SEEN), cast(Any, LAW)),
        "OutputFeedback: a Regulator comes first, not an Observer; try: OutputFeedback(regulator, observer), of lqr or"
        " place, and of kalman or place_observer",
    ),
    "noise that is none": (
        lambda: stationary_covariance(oscillator(), {"wind": 1.0}),
        "noise: there is no disturbance or input 'wind'; try: one of w, u",
    ),
    "unit of a name that is none": (
        lambda: oscillator().unit("outputs", "z"),
        "unit: there is no output 'z'; try: one of y",
    ),
    "reference of a kind that is none": (
        lambda: oscillator().reference("output", "y"),
        "reference: there is no kind 'output' of signals; try: outputs",
    ),
    "noise without names": (
        lambda: stationary_covariance(oscillator(), cast(Any, 1.0)),
        "noise: a mapping is needed, not float; try: one of w, u, and the intensity of each",
    ),
    "gain that is none": (lambda: LAW.gain("u", "z"), "gain: there is no 'z' among the gains; try: one of x, v"),
    "cross terms": (
        lambda: without_cross_terms(np.eye(2), np.array([[1.1], [0.0]])),
        "the cost has no minimum: its cross terms outweigh the weights of states and inputs; try: smaller cross terms",
    ),
    "weight of a modal force": (
        lambda: optimal_modal_gains([2.0, 3.0], [0.1, 0.1], [1.0, 0.0]),
        "the weight of a modal force is 0; try: a number above zero",
    ),
    "frequency of zero": (
        lambda: placed_modal_gains([2.0], [0.1], [0.0], [0.5]),
        "a frequency of 0 rad/s is asked for; try: a number above zero",
    ),
    "ratio of zero": (
        lambda: placed_modal_gains([2.0], [0.1], [1.0], [0.0]),
        "a damping ratio of 0 is asked for; try: a number above zero",
    ),
    "time": (lambda: seconds("sample", cast(Any, [1.0])), 'sample: a time is needed, not list; try: 0.001 or "1 ms"'),
    "endless time": (
        lambda: seconds("sample", math.inf),
        'sample: sample is inf, not a finite number; try: 0.001 or "1 ms"',
    ),
    "frequency of an excitation": (
        lambda: InputSpectrum("w", np.array([0.0, 1.0]), np.ones(2)),
        "InputSpectrum: w: the frequencies have to be two or more positive numbers that increase, Hz; try: [1.0, 20.0,"
        " 100.0]",
    ),
    "reversed band of a spectrum": (
        lambda: PowerSpectrum("y", "m", np.array([1.0, 5.0]), np.ones(2)).rms(4.0, 2.0),
        "rms: the band from 4 to 2 Hz is reversed; try: low <= high",
    ),
    "band of a spectrum in words": (
        lambda: PowerSpectrum("y", "m", np.array([1.0, 5.0]), np.ones(2)).rms(cast(Any, "4")),
        "low, high: an array of real numbers is needed, not list: <U32 is not real numbers",
    ),
    "spectrum of a road": (
        lambda: MeasuredRoad(frequencies=np.array([1.0, 2.0]), density=np.array([1.0, -1e-9])),
        "MeasuredRoad: a spectrum needs two or more frequencies above 0 that increase, and as many densities of 0 or"
        " more; try: MeasuredRoad.of_profile(distance, elevation)",
    ),
}
ACCEPTED: Sequence[Callable[[], object]] = (
    lambda: delay_line("u", "y", np.int64(1), 0.1),
    lambda: delay("u", "y", 0.1, np.int64(2)),
    lambda: MeasuredRoad.of_profile(np.arange(64.0), np.zeros(64), segments=np.int64(1)),
    lambda: without_cross_terms(np.eye(2), np.array([[1.0], [0.0]])),
    lambda: MeasuredRoad(frequencies=np.array([1.0, 2.0]), density=np.array([1.0, 0.0])),
)


def objects_with_names() -> list[object]:
    """Return objects whose attributes have other names elsewhere."""
    model = arm().linearize()
    space = model.state_space()
    return [model, model.modes(), space, Regulator(space, np.zeros((len(space.inputs), len(space.states))))]
