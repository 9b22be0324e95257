"""Warnings about states on both sides of their thresholds, of poses and matrices that are given here."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.compiled.rest.state_warnings import (
    LargestBending,
    SceneMeasures,
    beams_beyond_linear_range,
    inertia_warning,
    largest_bending,
    off_axis_hint,
)
from eomgen.formula.nodes import Number, Symbol

IDENTITY = [1.0, 0.0, 0.0, 0.0]


def vector(*numbers: float) -> tuple[Number, ...]:
    return tuple(map(Number, numbers))


def machine(
    positions: dict[str, list[tuple[float, float, float]]], turned: dict[str, list[float]] | None = None, **drawing: Any
) -> tuple[SceneMeasures, list[np.ndarray[Any, Any]]]:
    """Return measures of a scene whose bodies are at given places, row by row, and turned about z by given angles."""
    names, rows = tuple(positions), len(next(iter(positions.values())))
    poses = np.zeros((rows, len(names), 7))
    for k, name in enumerate(names):
        angles = np.array((turned or {}).get(name, [0.0] * rows))
        poses[:, k, 0], poses[:, k, 3] = np.cos(angles / 2.0), np.sin(angles / 2.0)
        poses[:, k, 4:] = positions[name]
    parts = {"points": (), "lines": (), "wheels": (), "solids": (), **drawing}
    description = SimpleNamespace(
        values=lambda tunable: tunable, lengths=(vector(1.0, 0.0, 0.0),), element_stiffness=(),
        drawing=SimpleNamespace(**parts), gravity=vector(0.0, 3.0, -4.0), parts={},
    )  # fmt: skip  # two lines
    model = SimpleNamespace(
        functions=("poses",), parameters=(), bodies=names, inputs=("lift",), description=description, q_units=("rad",),
        evaluate=lambda name, path, **_: {"pose": poses[: len(path)]}, input_values=lambda t, parameters: np.zeros(1),
    )  # fmt: skip  # two lines
    return SceneMeasures(cast(Any, model), np.zeros(0), 0.0, None), [np.zeros(1)] * rows


def point(name: str, body: str, *place: float) -> SimpleNamespace:
    return SimpleNamespace(name=name, body=body, position=vector(*(place or (0.0, 0.0, 0.0))))


def line(name: str, first: str, second: str) -> SimpleNamespace:
    return SimpleNamespace(name=name, first=first, second=second)


def test_measures_of_a_scene() -> None:
    solids = tuple(SimpleNamespace(mass=Number(mass)) for mass in (2.0, 3.5))
    measures, _ = machine({"mass": [(0.0, 0.0, 0.0)]}, solids=solids)
    assert measures.gravity() == 5.0 and measures.mass() == 5.5
    assert measures.length(np.array([9.0])) == 1.0  # an angle is no length
    cast(Any, measures.model).q_units = ("m",)
    assert measures.length(np.array([-9.0])) == 9.0
    measures.model.description.lengths = ()  # type: ignore[misc]
    assert measures.length(np.array([0.0])) == 1.0 and measures.length(np.array([math.inf])) == 1.0
    assert measures.number(Symbol("parameter", "unknown")) == 0.0
    assert measures.number(Number(1.0) / Number(0.0)) == 0.0


@pytest.mark.parametrize(("off", "told"), [(0.9e-12, False), (1.1e-12, True), (0.02, True)])
def test_unbalance_is_the_mass_by_its_distance_from_the_axis(off: float, told: bool) -> None:
    """The rotor turns by half a turn about z from its first to its second row."""
    solid = SimpleNamespace(name="disc", mass=Number(3.0), center_of_mass=vector(off, 0.0, 0.5))
    measures, _ = machine({"disc": [(0.0, 0.0, 0.0)] * 2}, {"disc": [0.0, math.pi]}, solids=(solid,))
    model = cast(Any, measures.model)
    model.factors = (SimpleNamespace(name="spin", group="R", q=slice(0, 1), v_start=0, v_size=1),)
    model.v_units = ("rad/s",)
    hint = off_axis_hint(model, measures, np.zeros(1), np.array([7.0]))
    assert bool(hint) == told
    if told:
        size = f"(the centre of disc is {off:.6g} m off, {3.0 * off:.6g} kg m)"
        assert f"centres of mass on the axis of spin {size}" in hint
    assert off_axis_hint(model, measures, np.zeros(1), np.array([0.0])) == ""
    model.v_units = ("m/s",)
    assert off_axis_hint(model, measures, np.zeros(1), np.array([7.0])) == ""


def bent(names: tuple[str, ...] = ("boom", "mast")) -> Any:
    """Return a model of beams with one coordinate each, whose slope is the coordinate: it shortens by q^2 / 2."""
    factors = tuple(SimpleNamespace(name=name, q=slice(k, k + 1)) for k, name in enumerate(names))
    slopes = [{"name": name, "squares": [[2.0]], "length": 2.0} for name in names]
    return SimpleNamespace(factors=factors, library=SimpleNamespace(layout={"slopes": slopes}))


def test_the_most_bent_beam_is_told_from_a_twentieth_of_its_length() -> None:
    t, q = np.array([0.0, 0.5, 1.0]), np.array([[0.1, 0.0], [0.2, -0.4], [0.3, 0.1]])
    found = largest_bending(bent(), t, q)
    assert found == LargestBending("mast", 0.5, pytest.approx(0.08)) and found is not None and found.possible
    assert str(found).startswith("the beam mast bends by slopes of 0.4 (root mean square) at t = 0.5 s, which shortens")
    assert "it by 8 % of its length" in str(found)
    at, above = math.sqrt(0.1), math.sqrt(0.1) + 1e-9
    assert largest_bending(bent(), t, np.full((3, 2), at - 1e-9)) is None
    assert largest_bending(bent(), t, np.full((3, 2), above)) is not None
    assert not LargestBending("mast", 0.0, 1.0).possible and LargestBending("mast", 0.0, 0.999).possible
    lost = largest_bending(bent(), t, np.array([[0.0, 0.0], [math.nan, 0.0], [0.0, 0.0]]))
    assert lost == LargestBending("boom", 0.5, math.inf)


def softening(limit: float = 1.0) -> Any:
    """Return a model with two beams, the inertia of which is not definite from a deflection on, and a joint."""

    def mass(q: Any, parameters: Any) -> Any:
        return np.diag([limit - abs(float(q[0])), limit - abs(float(q[1])), 1.0])

    names = ("boom", "mast", "hinge")
    factors = tuple(SimpleNamespace(name=name, q=slice(k, k + 1)) for k, name in enumerate(names))
    coordinates = tuple(SimpleNamespace(name=name, linear=name != "hinge") for name in names)
    description = SimpleNamespace(coordinates=coordinates)
    return SimpleNamespace(functions=("mass",), mass=mass, factors=factors, description=description)


NO = np.zeros(0)


@pytest.mark.parametrize(
    ("q", "beams"),
    [
        ([0.9, 0.9, 5.0], ()),
        ([1.0, 0.9, 5.0], ("boom",)),
        ([0.0, -1.5, 5.0], ("mast",)),
        ([1.1, -1.5, 5.0], ("boom", "mast")),
    ],
)
def test_beams_without_whose_deflection_the_inertia_is_definite(q: list[float], beams: tuple[str, ...]) -> None:
    model = softening()
    assert tuple(beams_beyond_linear_range(model, np.array(q), NO)) == beams
    warning = inertia_warning(model, np.array(q), NO)
    assert (warning is None) == (not beams)
    if warning is not None:
        named = f"beam{'s' * (len(beams) > 1)} {', '.join(beams)}"
        assert (
            warning.text.endswith(f": this is beyond the range of order = 1 of {named}") and warning.hint == "order = 2"
        )
        later = inertia_warning(model, np.array(q), NO, np.zeros(3), 0.25, "at the end")
        assert later is not None and later.hint == "a step smaller than 0.25 s, then order = 2"
        assert later.text.startswith(
            "the inertia matrix at the end is not positive definite, its smallest eigenvalue is"
        )


def test_masses_that_are_not_definite_anywhere_are_no_fault_of_beams() -> None:
    model = softening(-1.0)
    warning = inertia_warning(model, np.zeros(3), NO, np.zeros(3), 0.25)
    assert warning is not None and warning.hint == "masses and inertias that bodies can have"
    assert warning.text == "the inertia matrix there is not positive definite, its smallest eigenvalue is -1"
    assert beams_beyond_linear_range(model, np.zeros(3), NO) == ()
    assert inertia_warning(cast(Any, SimpleNamespace(functions=())), np.zeros(3), NO) is None
