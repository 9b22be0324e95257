"""Slender hulls in water: against closed forms of floating and fixed columns, and added mass in all forms of M."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.errors import DescriptionError, UsageError
from eomgen.pipeline.model import Model
from eomgen.scene.load import from_data
from eomgen.system.system import System
from tests.oracles.states import tape_evaluator

RHO, G, D = 1025.0, 9.81, 2.0
AREA = math.pi * D**2 / 4.0
DRAUGHT, EXTRA = 6.0, 2000.0
MASS = RHO * AREA * DRAUGHT
COLUMN: dict[str, Any] = {
    "body": "buoy",
    "start": [0, 0, -DRAUGHT],
    "end": [0, 0, 4],
    "diameter": D,
    "wet": DRAUGHT,
    "drag": 0,
    "axial_added_mass": EXTRA,
    "stations": 10,
}
INERTIA = {"xx": 9.0 * MASS, "yy": 9.0 * MASS, "zz": MASS}


def _data(
    joint: dict[str, Any] | None = None,
    waves: dict[str, Any] | None = None,
    hulls: dict[str, Any] | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Return a buoy that floats at its draught; on a heave joint unless another is given."""
    joint = {"type": "prismatic", "axis": [0, 0, 1]} if joint is None else joint
    in_waves = {} if waves is None else {"waves": "sea"}
    return {
        "format": 1,
        "name": "buoy",
        "bodies": {"buoy": {"mass": MASS, "center_of_mass": [0, 0, -3.5], "inertia": INERTIA}},
        "joints": {"moves": {"parent": "base", "child": "buoy", **joint}},
        "points": {"middle": {"body": "buoy"}},
        "hulls": {"column": COLUMN | in_waves} if hulls is None else {n: hull | in_waves for n, hull in hulls.items()},
        "outputs": {"place": {"position": "middle"}},
        **({} if waves is None else {"waves": {"sea": waves}}),
        **more,
    }


def _model(*args: Any, **kwargs: Any) -> Model:
    return eomgen.build(from_data(_data(*args, **kwargs)))


def _system(*args: Any, **kwargs: Any) -> System:
    return eomgen.derive(from_data(_data(*args, **kwargs)), ["force", "mass"])


def _at_start(system: System, function: str, t: float = 0.0, v: Any = None) -> Array:
    """Return a function of a system on the tape, where the buoy was built, at rest by default."""
    q = np.zeros(1) if system.nq == 1 else np.array([1.0, 0, 0, 0, 0, 0, 0])
    state = {"q": q, "v": np.zeros(system.nv) if v is None else np.asarray(v, float), "t": np.array([t])}
    (found,) = tape_evaluator(system)(function, state).values()
    return found


def test_a_buoy_floats_at_its_draught_with_the_mass_of_its_water() -> None:
    system = _system()
    assert _at_start(system, "mass")[0, 0] == pytest.approx(MASS + EXTRA, rel=1e-14)
    assert _at_start(system, "force")[0] == pytest.approx(0.0, abs=1e-8 * MASS)


@pytest.mark.parametrize("period", [6.0, 60.0])
def test_waves_lift_a_column_as_in_linear_theory(period: float) -> None:
    """By (rho g A - a w^2) exp(-k T) times the elevation: pressure on the end, and the inertia of the water there."""
    amplitude, w = 1e-4, 2.0 * math.pi / period
    column = {"column": COLUMN | {"stations": 40}}
    system = _system(waves={"regular": [{"amplitude": amplitude, "period": period}]}, hulls=column)
    lift = (RHO * G * AREA - EXTRA * w**2) * math.exp(-(w**2) / G * DRAUGHT) * amplitude
    for t in np.linspace(0.0, period, 5):
        assert _at_start(system, "force", t)[0] == pytest.approx(lift * math.cos(w * t), abs=2e-3 * lift)


def test_a_fixed_column_has_the_force_of_morison() -> None:
    """In deep water rho (1 + C_a) A g a at the steepest slope, and rho C_d D a^2 w^2/(4 k) under a crest."""
    a, period = 0.05, 5.0
    w = 2.0 * math.pi / period
    k = w**2 / G
    waves = {"regular": [{"amplitude": a, "period": period}], "stretching": "none"}
    column = COLUMN | {"start": [0, 0, -40], "end": [0, 0, 2], "stations": 42, "added_mass": 0.8, "wet": 40}
    smooth, rough = (
        _system({"type": "prismatic", "axis": [1, 0, 0]}, waves, {"column": column | {"drag": drag}})
        for drag in (0.0, 1.3)
    )
    # a quarter of a period before a crest water is pushed along x
    assert _at_start(smooth, "force", 0.75 * period)[0] == pytest.approx(RHO * 1.8 * AREA * G * a, rel=0.02)
    drag = _at_start(rough, "force")[0] - _at_start(smooth, "force")[0]
    assert drag == pytest.approx(RHO * 1.3 * D * (a * w) ** 2 / (4.0 * k), rel=0.03)


def test_drag_is_across_the_axis_and_against_the_relative_velocity() -> None:
    system = _system({"type": "free"}, hulls={"column": COLUMN | {"drag": 1.2, "axial_drag": 300.0, "stations": 10}})
    still = _at_start(system, "force")
    across = _at_start(system, "force", v=[0, 0, 0, 2.0, 0, 0]) - still
    assert across[3] == pytest.approx(-0.5 * RHO * 1.2 * D * DRAUGHT * 4.0, rel=1e-3)
    assert np.abs(across[[4, 5]]).max() < 1e-6
    for speed in (2.0, -3.0):  # at start, which is under water
        along = _at_start(system, "force", v=[0, 0, 0, 0, 0, speed]) - still
        assert along[5] == pytest.approx(-300.0 * abs(speed) * speed, rel=1e-3)
    spun = _at_start(system, "force", v=[0, 0.5, 0, 0, 0, 0])[1] - still[1]
    # filaments dz of the part under water at the depths 0 to 6 m: 1/2 rho C_d D w^2 z^3 dz, in ten slices of 1 m
    depths = np.arange(6) + 0.5
    assert spun == pytest.approx(-0.5 * RHO * 1.2 * D * 0.25 * np.sum(depths**3), rel=1e-3)


def test_added_mass_is_across_the_axis() -> None:
    """By hand, of an upright column: rho C_a A T across, its moments about the origin, and what moves along."""
    bare = {"column": COLUMN | {"added_mass": 0, "axial_added_mass": 0}}
    own = RHO * AREA * DRAUGHT
    added = _at_start(_system({"type": "free"}), "mass") - _at_start(_system({"type": "free"}, hulls=bare), "mass")
    np.testing.assert_allclose(np.diag(added)[3:], [own, own, EXTRA], rtol=1e-10)
    np.testing.assert_allclose(np.diag(added)[:3], [own * DRAUGHT**2 / 3.0] * 2 + [0.0], rtol=1e-10, atol=1e-6 * own)
    assert added[1, 3] == pytest.approx(-own * DRAUGHT / 2.0, rel=1e-10)


@pytest.mark.slow
def test_inverse_dynamics_of_references_and_momenta_leave_water_out() -> None:
    with_water = _model(outputs={"hold": {"formula": "gravity.moves"}})
    state = np.zeros(1)
    assert with_water.outputs(state, state)["hold"] == pytest.approx(MASS * G)


REGULAR = {"regular": [{"amplitude": 1, "period": 8}]}
REFUSED: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"body": "base"}, {}, r"\(hulls\.column\.body\): a hull on the base has no effect: its motion is prescribed"),
    (
        {"end": [0, 0, -DRAUGHT]},
        {},
        r"end\): both ends are at the same place, so it has no axis; try: ends at two places",
    ),
    ({"wet": 12}, {}, r"wet\): 12 m of it move water, and it is 10 m long; try: the distance of its ends or less"),
    ({"end": [0, 0, 1e300], "wet": 2e300}, {}, r"wet\): 2e\+300 m of it move water, and it is 1e\+300 m long"),
    ({"diameter": 0}, {}, r"diameter\): the diameter of a hull is 0; try: a number above 0"),
    ({"added_mass": -1}, {}, r"the coefficient of added mass is -1; try: 0 or more"),
    ({"waves": "see"}, {}, r"waves\): there is no wave 'see'; try: a \[waves\] section"),
    ({"stations": 0}, {}, r"hulls\.column\.stations"),
    ({}, {"gravity": [0, 0, 9.81]}, r"gravity is \[0, 0, 9\.81\]; try: gravity = \[0, 0, -9\.81\], and z up"),
    ({"level": 1}, {"waves": REGULAR}, r"level\): the waves have a level of their own; try: level of \[waves\.sea\]"),
]


@pytest.mark.parametrize(("changes", "more", "message"), REFUSED)
def test_what_is_wrong_with_a_hull_is_said_once(changes: dict[str, Any], more: dict[str, Any], message: str) -> None:
    with pytest.raises(DescriptionError, match=message) as caught:
        from_data(_data(hulls={"column": COLUMN | changes}, **more))
    assert len(caught.value.problems) == 1


@pytest.mark.slow
def test_parameters_of_a_run_keep_a_hull_its_length() -> None:
    known = {"top": {"value": 4, "tunable": True}, "wet": {"value": DRAUGHT, "tunable": True}}
    model = _model(hulls={"column": COLUMN | {"end": [0, 0, "top"], "wet": "wet"}}, parameters=known)
    state = np.zeros(1)
    with pytest.raises(UsageError, match=r"hulls\.column\.wet\): 12 m of it move water, and it is 10 m long at top ="):
        model.energy(state, state, parameters={"wet": 12})
    with pytest.raises(UsageError, match=r"hulls\.column\.end\): both ends are at the same place, so it has no axis"):
        model.energy(state, state, parameters={"top": -DRAUGHT})


def _noted(changes: dict[str, Any], **more: Any) -> list[str]:
    hull = {key: value for key, value in (COLUMN | changes).items() if value is not None}
    return [note for note in from_data(_data(hulls={"column": hull}, **more)).notes if note.startswith("hulls.column")]


@pytest.mark.parametrize(
    ("changes", "joint", "text"),
    [
        ({"wet": None}, None, "hulls.column: all of its 10 m move water, and 4 m of it begin above the water at rest"),
        ({}, {"type": "prismatic", "axis": [0, 0, 1], "initial": {"position": 8}}, "hulls.column: it begins 2 m above"),
        ({"level": 5}, {"type": "free", "initial": {"position": [0, 0, 20]}}, "hulls.column: it begins 9 m above the"),
    ],
)
def test_what_hardly_anyone_means_is_noted(changes: dict[str, Any], joint: dict[str, Any] | None, text: str) -> None:
    (note,) = _noted(changes, joint=joint)
    assert text in note
