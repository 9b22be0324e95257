"""Load paths past limit points and bifurcations, and linear buckling loads, against closed forms and published
numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import eomgen
from eomgen.compiled.functions import Functions
from eomgen.errors import NumericalError, UsageError
from eomgen.pipeline.model import Model
from eomgen.solvers import equilibrium_path
from eomgen.solvers.bordered_newton import CorrectedPoint
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.models.library import scene
from tests.oracles.evaluation import Array
from tests.statics.test_critical_points import elastica

LENGTH = 10.0
TUNABLE = {"value": 4.0, "unit": "N/m", "tunable": True}
SLENDER = {"stretch": 1e8, "shear_y": 1e8, "shear_z": 1e8}


def truss() -> dict[str, Any]:
    """Return half of von Mises' truss: a bar from a pin to an apex on a slide, 1 m across and 0.2 m below it."""
    return {
        "format": 1,
        "name": "truss",
        "gravity": [0, 0, 0],
        "parameters": {"load": {"value": 0.0, "tunable": True}, "fixed": 1.0},
        "bodies": {"apex": {"mass": 1.0}},
        "joints": {"slide": {"type": "prismatic", "parent": "base", "child": "apex", "axis": [0, 0, 1]}},
        "points": {
            "pin": {"body": "base", "position": [-1.0, 0.0, -0.2]},
            "top": {"body": "apex", "position": [0.0, 0.0, 0.0]},
        },
        "springs": {"bar": {"first": "pin", "second": "top", "stiffness": 1000.0, "length": float(np.hypot(1.0, 0.2))}},
        "forces": {"push": {"body": "apex", "force": [0.0, 0.0, "-load"]}},
    }


def truss_load(height: float) -> float:
    """Return the load at which the apex rests at a height above the pin."""
    return 1000.0 * (np.hypot(1.0, 0.2) / np.hypot(1.0, height) - 1.0) * height


@pytest.fixture(scope="module")
def snap() -> Model:
    return eomgen.build(truss(), profile="instant")


def test_a_truss_snaps_through_at_its_limit_loads(snap: Model) -> None:
    path = snap.equilibrium_path("load", 20.0)
    assert path.success
    heights = 0.2 + path.column("apex.z")
    np.testing.assert_allclose(path.values, [truss_load(height) for height in heights], atol=1e-9)
    limit = minimize_scalar(
        lambda height: -truss_load(height), bounds=(0.0, 0.2), method="bounded", options={"xatol": 1e-12}
    )
    assert [item.kind for item in path.critical] == ["limit point", "limit point"]
    assert [item.value for item in path.critical] == pytest.approx([-limit.fun, limit.fun], rel=1e-10)
    assert [item.columns["apex.z"] for item in path.critical] == pytest.approx(
        [limit.x - 0.2, -limit.x - 0.2], abs=1e-6
    )
    between = (heights < limit.x) & (heights > -limit.x)
    np.testing.assert_array_equal(path.negative, between.astype(int))


@pytest.mark.slow
def test_a_path_goes_on_by_time_as_slowly_as_rest_asks(snap: Model) -> None:
    scene = truss()
    scene["forces"]["push"]["force"] = [0.0, 0.0, "-2 * t"]
    found = eomgen.build(scene, profile="instant").equilibrium_path("t", 10.0)
    expected = snap.equilibrium_path("load", 20.0)
    assert found.success
    assert [2.0 * item.value for item in found.critical] == pytest.approx([item.value for item in expected.critical])


def test_a_path_that_is_too_long_says_where_it_ends(snap: Model) -> None:
    path = snap.equilibrium_path("load", 1e200, max_points=6)
    assert not path.success and len(path.values) == 6
    assert path.message.startswith(f"the path ends at load = {path.values[-1]:.6g}, not at 1e+200: 6 points are not")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("lod", 1.0), "there is no tunable parameter or input 'lod' to be varied; try: load"),
        (("fixed", 1.0), "'fixed' to be varied; try: tunable = true, where the scene gives it"),
        (("load", 0.0), "load is to go from 0 to the same value; try: another value of to or start"),
        (("load", float("nan")), "to: to is nan, not a finite number; try: a finite number"),
        (("load", 1.7e308, -1.7e308), "to - start: to - start is inf, not a finite number; try: a finite number"),
    ],
)
def test_calls_that_cannot_be_answered(snap: Model, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        snap.equilibrium_path(*arguments)
    assert message in str(caught.value)


@pytest.mark.slow
def test_a_path_ends_at_the_value_that_its_corrections_pass() -> None:
    """A weight on a spring: the path turns within the step to the last value."""
    scene = truss() | {"gravity": [0.0, 0.0, -9.81], "parameters": {"k": {"value": 4.0, "tunable": True}}}
    scene["joints"]["slide"] |= {"stiffness": "k"}
    del scene["points"], scene["springs"], scene["forces"]
    path = eomgen.build(scene, profile="instant").equilibrium_path("k", 8.0, 4.0)
    assert path.success
    assert path.column("apex.z")[[0, -1]] == pytest.approx([-9.81 / 4.0, -9.81 / 8.0], rel=1e-9)


def column(elements: int, **joint: Any) -> dict[str, Any]:
    """Return a column along x that is pushed at its end, EI 500 N m^2 for deflections along z, 800 N m^2 along y."""
    stiffness = ROLL_UP | SLENDER | {"bending_y": 800.0, "bending_z": 500.0}
    scene = beam_scene(elements, {"force": ["-load", 0.0, 0.0]}, {"stiffness": stiffness}, **joint)
    scene["parameters"]["load"]["value"] = 0.0
    return scene


@pytest.fixture(scope="module")
def euler() -> Model:
    return eomgen.build(column(8), profile="instant")


@pytest.mark.slow
def test_a_column_bifurcates_at_eulers_loads_and_goes_on_as_the_elastica(euler: Model) -> None:
    path = euler.equilibrium_path("load", 30.0)
    expected = [np.pi**2 * EI / (4.0 * LENGTH**2) for EI in (500.0, 800.0)]
    assert [item.kind for item in path.critical] == ["bifurcation", "bifurcation"]
    assert [item.value for item in path.critical] == pytest.approx(expected, rel=np.pi**2 / (24.0 * 8.0**2))
    assert euler.buckling_loads("load", count=2).values == pytest.approx([c.value for c in path.critical], rel=1e-5)
    linear = euler.buckling_loads("load", at=20.0 - 9.0, count=1).values
    assert linear == pytest.approx(path.critical[0].value, rel=1e-5)
    for side in (1.0, -1.0):
        branch = path.branch(0, 25.0, size=side)
        assert branch.success and not branch.negative.any()
        ends = zip(branch.values, branch.column("rope.8.x"), branch.column("rope.8.z"), strict=True)
        for load, along, across in ends:
            if load > 1.02 * expected[0]:
                assert [along, abs(across)] == pytest.approx(
                    LENGTH * np.array(elastica(load * LENGTH**2 / 500.0)), abs=0.02 * LENGTH
                )


def extrapolated(load: Callable[[int], float], elements: int) -> float:
    """Return a load by Richardson's extrapolation over two numbers of elements."""
    return (4.0 * load(2 * elements) - load(elements)) / 3.0


@pytest.mark.slow
def test_a_cantilever_buckles_sideways_at_prandtls_load() -> None:
    """4.013 sqrt(B C) / L^2, B bending about the weak axis, C torsion: Timoshenko and Gere 1961, section 6.3."""

    def load(elements: int) -> float:
        stiffness = ROLL_UP | SLENDER | {"bending_y": 50.0, "bending_z": 5e7, "torsion": 20.0}
        scene = beam_scene(elements, {"force": [0.0, 0.0, "-load"]}, {"stiffness": stiffness})
        scene["parameters"]["load"]["value"] = 0.0
        return float(eomgen.build(scene, profile="instant").buckling_loads("load", count=2).values[0])

    assert extrapolated(load, 3) == pytest.approx(4.0126 * np.sqrt(50.0 * 20.0) / LENGTH**2, rel=2e-3)  # of 3, 6


def follower_tip(load: float, EI: float) -> Array:
    """Return where the tip of a clamped beam is under a force that stays across its end, by integration from the
    tip."""

    def slopes(_: float, y: Array) -> Array:
        return np.array([np.cos(y[2]), np.sin(y[2]), y[3] / EI, -load * np.cos(y[2])])

    # from the tip inwards, in axes of the tip: the arc length runs against the beam
    run = solve_ivp(slopes, (0.0, LENGTH), [0.0, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-11, atol=1e-11)
    x, y, angle, _ = run.y[:, -1]
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(turn @ [x, y])


@pytest.mark.slow
def test_a_force_that_follows_the_end_bends_a_beam_round() -> None:
    scene = beam_scene(8, {"force": [0.0, "load", 0.0], "axes": "body"}, {"stiffness": ROLL_UP | SLENDER})
    scene["parameters"]["load"]["value"] = 0.0
    path = eomgen.build(scene, profile="instant").equilibrium_path("load", 60.0)
    assert path.success
    tip = [path.column(f"rope.8.{axis}")[-1] for axis in "xy"]
    np.testing.assert_allclose(tip, follower_tip(60.0, 500.0), atol=0.05 * LENGTH)  # coarse elements


def frame(elements: int) -> Model:
    """Return the right-angle frame of Lee, Manuel and Rossow 1968, hinged at both ends; EI = 1.44e7, L = 120."""
    stiffness = dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e10)
    stiffness |= {"torsion": 1e9, "bending_y": 1.44e7, "bending_z": 1e9}
    beam = {"model": "cosserat", "mass_per_length": 1.0, "rotary_inertia": [1.0, 1.0, 1.0], "stiffness": stiffness}
    builder = eomgen.SceneBuilder("lee_frame", gravity=[0, 0, 0]).parameter("load", 0.0, tunable=True)
    for name, length, count in (("column", 120.0, 5), ("left", 24.0, 1), ("right", 96.0, 4)):
        builder.beam(name, length=length, elements=count * elements, **beam)
    up, down = ([([0, 0, 1], f"{sign}pi / 2")] for sign in ("", "-"))
    builder.joint("foot", "revolute", "base", "column", axis=[0, 0, 1], rotation=up)
    builder.joint("corner", "fixed", "column", "left", position=[120.0, 0, 0], rotation=down)
    builder.joint("along", "fixed", "left", "right", position=[24.0, 0, 0])
    end, pin = {"body": "right", "position": [96.0, 0, 0]}, {"body": "base", "position": [120.0, 120.0, 0]}
    builder.constraint("hinge", "spherical", pin, end).force("push", "right", force=[0, "-load", 0])
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.long
def test_the_frame_of_lee_snaps_at_its_published_load() -> None:
    """18.55 EI / L^2 with inextensible legs (Lee, Manuel and Rossow, J. Engrg. Mech. Div. ASCE 94 (1968) 521)."""

    def load(elements: int) -> float:
        path = frame(elements).equilibrium_path("load", 30000.0)
        assert path.success and [item.kind for item in path.critical] == ["limit point", "limit point"]
        return path.critical[0].value

    assert extrapolated(load, 1) * 120.0**2 / 1.44e7 == pytest.approx(18.55, rel=5e-3)


def arch(elements: int) -> Model:
    """Return a circular arch of 215 degrees, clamped at one end and hinged at the other, pushed at its top: EI and R
    are 1."""
    angle = np.deg2rad(215.0)
    stiffness = dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e6)
    stiffness |= {"torsion": 100.0, "bending_y": 1.0, "bending_z": 100.0}
    masses = {"mass_per_length": 1.0, "rotary_inertia": [0.01, 0.01, 0.01]}
    builder = eomgen.SceneBuilder("arch", gravity=[0, 0, 0]).parameter("load", 0.0, tunable=True)
    bent = {"length": angle, "elements": elements, "curvature": [0, 0, -1.0]}
    builder.beam("arch", model="cosserat", stiffness=stiffness, **masses, **bent)
    builder.joint("clamp", "fixed", "base", "arch", rotation=[([0, 0, 1], angle / 2.0)])
    end = {"body": "arch", "position": [angle, 0, 0]}
    pin = {"body": "base", "position": [2.0 * np.sin(angle / 2.0), 0, 0]}
    builder.constraint("hinge", "spherical", pin, end)
    builder.force("push", "arch", point=[angle / 2.0, 0, 0], force=[0, "-load", 0])
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.long
def test_a_deep_arch_snaps_at_its_published_load_and_linear_buckling_says_that_it_misleads() -> None:
    """8.97 EI / R^2: DaDeppo and Schmidt, J. Appl. Mech. 42 (1975) 839."""
    models = {elements: arch(elements) for elements in (8, 16)}

    def load(elements: int) -> float:
        path = models[elements].equilibrium_path("load", 10.0, max_points=30)
        assert path.critical[0].kind == "limit point"
        return path.critical[0].value

    assert extrapolated(load, 8) == pytest.approx(8.97, abs=0.01)
    said = "half way there .*: the load bends the structure, so extrapolation misleads; try: equilibrium_path"
    with pytest.warns(RuntimeWarning, match=said) as caught:
        found = models[8].buckling_loads("load", count=1)
    assert found.warning and caught[0].filename == __file__


def test_a_start_that_cannot_rest_is_said() -> None:
    scene = truss()
    del scene["springs"]
    with pytest.raises(NumericalError, match=r"load: no equilibrium was found at 1, where the path is to start"):
        eomgen.build(scene, profile="instant").equilibrium_path("load", 2.0, 1.0)


def test_a_path_takes_three_calls_for_a_correction(snap: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """Inputs, residuals at the load factor and at both ends of differences, and partials; the columns take two calls
    for all points."""
    calls: list[str] = []
    corrections: list[int] = []
    evaluated, corrected = Functions.__call__, equilibrium_path.correct

    def counted(functions: Functions, name: str, blocks: Mapping[str, Array]) -> tuple[Array, ...]:
        calls.append(name)
        return evaluated(functions, name, blocks)

    def counted_corrections(*arguments: Any) -> CorrectedPoint:
        result = corrected(*arguments)
        corrections.append(result.corrections)
        return result

    monkeypatch.setattr(Functions, "__call__", counted)
    monkeypatch.setattr(equilibrium_path, "correct", counted_corrections)
    path = snap.equilibrium_path("load", 20.0, stability=False)
    asked = sum(corrections) + len(corrections)  # each with the direction at its end
    assert path.success
    assert calls.count("partials") + calls.count("iteration") <= asked
    assert calls.count("residual") <= asked
    assert calls.count("outputs") + calls.count("poses") <= 4
    assert len(calls) <= 3 * asked + 12


@pytest.mark.slow
@pytest.mark.parametrize("to", [1e3, 1e6, 1e12])
def test_a_path_does_not_leap_over_an_infinite_stiffness(to: float) -> None:
    """k q = weight: two hyperbolas, whose branches are neighbours in the scale of a long path."""
    weight = scene("oscillator", gravity=[9.81, 0, 0], joints__slide__stiffness="k", parameters__k=TUNABLE)
    path = eomgen.build(weight, profile="instant").equilibrium_path("k", to, 4.0)
    assert path.success and not path.critical
    np.testing.assert_allclose(path.q[:, 0] * path.values, 9.81, rtol=1e-6)


@pytest.mark.parametrize("to", [1e12, 1e15])
def test_limit_points_do_not_depend_on_the_range(snap: Model, to: float) -> None:
    """Beside a long range the change of the load at its extreme would be rounding."""
    near, far = (snap.equilibrium_path("load", end, max_points=20).critical for end in (20.0, to))
    assert [item.value for item in far] == pytest.approx([item.value for item in near[: len(far)]], rel=1e-9)
    assert far[0].kind == "limit point"
