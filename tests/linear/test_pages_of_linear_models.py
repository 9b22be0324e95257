"""Pages of linear models in notebooks: the cells of each table, of models written by hand."""

from __future__ import annotations

import re
from html import unescape
from typing import Any

import numpy as np
import pytest

from eomgen.products.linear.control import notebook as control
from eomgen.products.linear.control.margins import Margins
from eomgen.products.linear.state_space import StateSpace, with_more
from eomgen.products.linear.state_space import labels as labels_of


def cells(html: str) -> list[list[str]]:
    """Return the rows of a table, the headings first."""
    return [
        [unescape(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)]
        for row in re.findall(r"<tr>(.*?)</tr>", html)
    ]


def heading(html: str) -> str:
    return unescape(re.findall(r"<strong>(.*?)</strong>", html)[0])


def space(A: Any = ((0.0, 1.0), (-4.0, -0.4)), **changes: Any) -> StateSpace:
    given = {
        "A": np.array(A), "B": np.zeros((2, 1)), "E": np.zeros((2, 1)), "C": np.zeros((1, 2)), "D": np.zeros((1, 1)),
        "F": np.zeros((1, 1)), "states": ("hinge", "v.hinge"), "inputs": ("push",), "disturbances": ("road",),
        "outputs": ("tip",), "units": {"states": ("rad", "rad/s"), "inputs": ("N",), "outputs": ("m",)},
        "references": {"states": np.array([0.5, 0.25])},
    }  # fmt: skip
    return StateSpace(**(given | changes))


def test_signals_of_a_state_space_are_numbered_by_kind() -> None:
    html = space()._repr_html_()
    assert cells(html)[1:] == [
        ["s[0]", "hinge", "rad", "state"], ["s[1]", "v.hinge", "rad/s", "state"], ["u[0]", "push", "N", "input"],
        ["w[0]", "road", "", "disturbance"], ["y[0]", "tip", "m", "output"],
    ]  # fmt: skip
    assert heading(html).startswith("State space") and heading(html).endswith(", stable")


def test_gains_deviations_and_eigenvalues_are_listed_by_state() -> None:
    assert cells(control.gains_html(space(), np.array([[1.5, 2.0], [-3.25, 1e-7]]), ["push", "pull"])) == [
        ["gain", "unit of the state", "push", "pull"], ["hinge", "rad", "1.5", "2"],
        ["v.hinge", "rad/s", "-3.25", "1e-07"],
    ]  # fmt: skip
    assert cells(control.deviations_html(space(), {"v.hinge": 0.12345, "hinge": 2.0})) == [
        ["estimate of", "standard deviation of its error", "unit"],
        ["v.hinge", "0.1235", "rad/s"], ["hinge", "2", "rad"],
    ]  # fmt: skip
    html = control.eigenvalues_html("Regulator", space())
    imaginary = np.sqrt(4.0 - 0.04)
    assert heading(html) == "Regulator, stable"
    assert cells(html) == [["eigenvalue, 1/s"], [f"-0.2 ± {imaginary:.6g}j"]]
    sampled = control.eigenvalues_html("Observer", space(((0.5, 0.0), (0.0, -2.0)), sample=0.1))
    assert heading(sampled) == "Observer, unstable"
    assert cells(sampled) == [["eigenvalue, from sample to sample"], ["-2"], ["0.5"]]


def test_margins_are_listed_by_loop() -> None:
    margins = {"push": Margins(3.0, 0.25, 45.5, 0.125, 0.625, (1.0,), np.zeros(1), np.zeros(1, complex))}
    assert cells(control.margins_html(margins)) == [
        ["loop at", "gain", "phase, °", "delay, s", "modulus"], ["push", "0.25 to 3", "45.5", "0.125", "0.625"],
    ]  # fmt: skip


def test_labels_are_kept_and_appended_by_kind() -> None:
    model = space()
    (angle, _), (push,) = (
        labels_of(model, "states", ["hinge", "v.hinge"]),
        labels_of(model, "inputs", ["push"]),
    )
    assert angle == ("rad", 0.5) and push == ("N", pytest.approx(np.nan, nan_ok=True))
    labels = with_more(model, {"states": [("V", 7.0)], "outputs": [("A", 8.0), ("s", 9.0)]})
    assert labels["units"] == {
        "states": ("rad", "rad/s", "V"), "inputs": ("N",), "disturbances": ("",), "outputs": ("m", "A", "s")
    }  # fmt: skip
    assert labels["references"]["states"].tolist() == [0.5, 0.25, 7.0]
    assert labels["references"]["outputs"].tolist()[1:] == [8.0, 9.0] and np.isnan(labels["references"]["outputs"][0])
