"""Steady motions of what rolls: wheels straight on and in circles, against the disc's closed form, and carts that
steer."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen import NumericalError
from eomgen.lie.numeric import rotated
from eomgen.products.statics.steady_motion import SteadyMotion, _conditions
from eomgen.products.statics.symmetries import symmetries
from eomgen.system.terms import PURPOSES

MASS, RADIUS, ACROSS, ALONG, G = 2.0, 0.3, 0.05, 0.09, 9.81
TRACK, BASE, WHEEL = 0.5, 1.1, 0.2  # of the carts


def scene(name: str, coordinates: str = "joint") -> dict[str, Any]:
    disc = {"mass": MASS, "inertia": [ACROSS, ALONG, ACROSS]}
    data = {"format": 1, "name": name, "coordinates": coordinates, "gravity": [0, 0, -G], "bodies": {"disc": disc}}
    return data | {"joints": {}, "constraints": {"ground": rolling("disc", RADIUS)}}


def rolling(body: str, radius: float) -> dict[str, Any]:
    first, second = {"body": "base", "position": [0, 0, 0], "axis": [0, 0, 1]}, {"body": body, "axis": [0, 1, 0]}
    return {"type": "rolling", "first": first, "second": second, "radius": radius, "shape": "disc"}


def afloat(body: str) -> dict[str, Any]:
    """Return a free joint of a body at the height of the disc's centre."""
    return {"type": "free", "parent": "base", "child": body, "initial": {"position": [0, 0, RADIUS]}}


def on_axes() -> dict[str, Any]:
    """Return the disc on three rails and three hinges: heading, lean and spin."""
    data = scene("disc_on_axes")
    carriers = ["base", "along", "across", "up", "heading", "tilt", "disc"]
    data["bodies"] = {name: {"mass": 0} for name in carriers[1:-1]} | data["bodies"]
    axes = {"x": [1, 0, 0], "y": [0, 1, 0], "rise": [0, 0, 1], "yaw": [0, 0, 1], "lean": [1, 0, 0], "spin": [0, 1, 0]}
    for k, (name, axis) in enumerate(axes.items()):
        kind = "prismatic" if k < 3 else "revolute"
        data["joints"][name] = {"type": kind, "parent": carriers[k], "child": carriers[k + 1], "axis": axis}
    return data


def freely(coordinates: str = "joint", group: str = "SE3") -> dict[str, Any]:
    data = scene(f"disc_{coordinates}_{group}", coordinates)
    if coordinates == "absolute":
        data["bodies"]["disc"]["group"] = group
    return data | {"joints": {"disc": afloat("disc")}}


def in_frame() -> dict[str, Any]:
    """Return the disc in a frame that leans with it, with next to no mass, and its spin as a joint of its own."""
    data = scene("disc_in_frame")
    data["bodies"]["frame"] = {"mass": 1e-3, "inertia": [1e-6, 1e-6, 2e-6], "center_of_mass": [0, 0, -0.1]}
    spin = {"type": "revolute", "parent": "frame", "child": "disc", "axis": [0, 1, 0]}
    return data | {"joints": {"frame": afloat("frame"), "spin": spin}}


@cache
def model_of(name: str) -> eomgen.Model:
    makers = {
        "axes": on_axes,
        "free": freely,
        "frame": in_frame,
        "SE3": lambda: freely("absolute"),
        "R3xSO3": lambda: freely("absolute", "R3xSO3"),
    }
    return eomgen.build(makers[name](), profile="instant")


def balance(lean: float, yaw_rate: float, spin: float) -> float:
    """Return the moment about the line of nodes that is left of a disc in a circle (Routh 1905, section 244), N m.

    ``spin`` is the rate against the leaning frame; the axis of the disc is ``lean`` from the level.
    """
    about_axis = spin + yaw_rate * math.sin(lean)
    turning = (ALONG + MASS * RADIUS**2) * about_axis * yaw_rate * math.cos(lean)
    return turning - ACROSS * yaw_rate**2 * math.sin(lean) * math.cos(lean) + MASS * G * RADIUS * math.sin(lean)


def circle_of(model: eomgen.Model, found: SteadyMotion) -> tuple[float, float, float]:
    """Return lean, yaw rate and spin of the disc, from its pose and twist alone."""
    pose, twist = model.pose("disc", found.q), model.twist("disc", found.q, found.v)
    axis, omega = rotated(pose[:4], np.array([0.0, 1.0, 0.0])), rotated(pose[:4], twist[:3])
    lean = math.asin(axis[2])
    rolling_part = omega - (omega @ axis) * axis  # yaw rate times what of the vertical is across the axis
    upward = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    yaw_rate = float(rolling_part @ upward) / float(upward @ upward)
    assert np.linalg.norm(rolling_part - yaw_rate * upward) < 1e-8  # it does not fall
    return lean, yaw_rate, float(omega @ axis) - yaw_rate * axis[2]


# -- a disc ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spin, lean", [(8.0, 0.3), (12.0, -0.6), (-9.0, 0.4)])
def test_a_disc_in_a_circle(spin: float, lean: float) -> None:
    model = model_of("axes")
    turn = {"velocity": -math.copysign(1.0, spin * lean)}
    start = {"yaw": turn, "rise": RADIUS * math.cos(lean), "x": {"velocity": spin * RADIUS}}
    found = model.steady_motion({"spin": spin}, {"lean": lean}, start)
    v = dict(zip(model.v_names, found.v, strict=True))
    assert abs(v["v.yaw"]) > 0.1 and not found.undetermined
    assert balance(lean, v["v.yaw"], spin) == pytest.approx(0.0, abs=1e-9)
    assert circle_of(model, found) == pytest.approx((lean, v["v.yaw"], spin), abs=1e-9)
    np.testing.assert_allclose(found.a[:2], v["v.yaw"] * np.array([-v["v.y"], v["v.x"]]), atol=1e-9)
    run = model.simulate(1.0, 1e-3, method="rk4_partitioned", initial=found.initial)
    np.testing.assert_allclose(run.a[0], found.a, atol=1e-6)
    np.testing.assert_allclose(run.v[:, 3:], np.tile(found.v[3:], (len(run.t), 1)), atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["free", "SE3", "R3xSO3", "frame"])
def test_a_disc_in_a_circle_in_other_coordinates(name: str) -> None:
    """A free body's own axes spin with it, and its steady motion with them; those of a frame that does not spin
    stay."""
    model, lean, spin = model_of(name), 0.3, 9.0
    tilted = [math.cos(lean / 2), math.sin(lean / 2), 0.0, 0.0, 0.0, 0.0, RADIUS * math.cos(lean)]
    about, moving = ("frame", {"spin": {"velocity": spin}}) if name == "frame" else ("disc", {})
    twist = [0.0, 0.0 if moving else spin, -1.0, spin * RADIUS, 0.0, 0.0]
    given = {"spin": spin} if moving else {f"disc{'.orientation' if name == 'R3xSO3' else ''}[1]": spin}
    start: dict[str, Any] = {about: {"position": tilted, "velocity": twist}} | moving
    if name == "R3xSO3":
        start = {"q": tilted, "v": twist}
    found = model.steady_motion(given, initial=start)
    of_circle = circle_of(model, found)
    assert balance(*of_circle) == pytest.approx(0.0, abs=1e-2 if moving else 1e-8)  # the frame has some weight
    assert abs(of_circle[1]) > 0.1
    run = model.simulate(0.5, 1e-3, method="rk4_partitioned", initial=found.initial)
    np.testing.assert_allclose(run.a[0], found.a, atol=1e-5)
    height = model.pose("disc", run.q)[:, 6]
    np.testing.assert_allclose(height, height[0], atol=1e-7)


def test_velocities_that_rows_force_are_free() -> None:
    model = model_of("axes")
    start = {"rise": RADIUS}
    from_speed = model.steady_motion({"x": 2.4}, initial=start)
    from_spin = model.steady_motion({"spin": 8.0}, initial=start)
    for found in (from_speed, from_spin):
        np.testing.assert_allclose(found.v, [2.4, 0.0, 0.0, 0.0, 0.0, 8.0], atol=1e-10)
        assert not np.any(found.a)
    both = model.steady_motion({"spin": 8.0, "x": 2.4}, {"lean": 0.0, "rise": RADIUS})
    np.testing.assert_allclose(both.v, from_spin.v, atol=1e-10)


def test_a_disc_stays_upright_above_its_critical_spin() -> None:
    """It does for spin^2 > A m g r / (C (C + m r^2)), the moment about a diameter times the tipping one over the axial
    ones."""
    critical = math.sqrt(ACROSS * MASS * G * RADIUS / (ALONG * (ALONG + MASS * RADIUS**2)))
    model = model_of("axes")
    for share, stable in ((0.97, False), (1.03, True)):
        found = model.steady_motion({"spin": share * critical}, initial={"rise": RADIUS})
        modes = model.linearize(at=found).modes()
        growth = np.max(modes.eigenvalues.real)
        assert (growth < 1e-3) if stable else (growth > 0.1)


@pytest.mark.parametrize("name", ["axes", "free", "SE3", "R3xSO3", "frame"])
def test_symmetries_of_discs(name: str) -> None:
    """Two travels, a turn about the vertical and the spin, however the disc is described; a frame has its own pitch
    besides."""
    model = model_of(name).having(PURPOSES["linearization"])
    p = model.parameter_array(None)
    conditions = _conditions(model, p, 0.0, None, model.initial_q, np.ones(model.nv))
    assert len(symmetries(conditions, model.initial_q, model.initial_z)) == 4


def test_a_linear_model_about_velocities_that_turn_is_warned_of() -> None:
    model = model_of("axes")
    found = model.steady_motion({"spin": 8.0}, {"lean": 0.3}, {"yaw": {"velocity": -1.0}, "rise": 0.28})
    with pytest.warns(
        RuntimeWarning, match="linear about a steady motion: its velocities turn in these coordinates, so the"
    ):
        model.linearize(at=found)


@pytest.mark.slow
def test_what_is_not_met_is_named() -> None:
    upright = {"lean": 0.0, "rise": RADIUS, "yaw": 0.0}
    with pytest.raises(NumericalError) as caught:
        model_of("axes").steady_motion({"spin": 8.0, "x": 2.0, "y": 0.0, "yaw": 0.0}, upright)
    said = str(caught.value)
    assert "no steady motion was found" in said and "the rate of ground: no slip along x is off by" in said
    assert said.endswith("an initial state nearer to it, or fewer given values")
    start = {"disc": {"velocity": [0, 5, 0, 1, 0, 0]}}
    with pytest.raises(NumericalError) as caught:
        model_of("free").steady_motion({"disc[1]": 5.0, "disc[3]": 0.8}, initial=start)
    said = str(caught.value)
    assert "v.disc[1] is" in said and "and not 5 rad/s as given" in said
    assert said.endswith("or velocities that go together as 4 symmetries of the scene let them")


# -- carts -------------------------------------------------------------------------------------------------------------


def cart(kind: str, *, round_wheels: bool = True) -> eomgen.Model:
    """Return a cart with two wheels at its back and one that steers, on a plane joint or free."""
    builder = eomgen.SceneBuilder("cart").parameter("steering", 0.0, tunable=True, unit="rad")
    builder.body("chassis", 20.0, center_of_mass=[0.4, 0, 0.1], inertia=[1.0, 2.0, 2.5])
    builder.body("fork", 1.0, inertia=[0.02, 0.02, 0.02])
    place = [0, 0, WHEEL]
    height = {"axis": [0, 0, 1], "position": place} if kind == "planar" else {"initial": {"position": place}}
    builder.joint("body", kind, "base", "chassis", **height)
    spring = {"stiffness": 500.0, "damping": 5.0, "rest": "steering"}
    builder.joint("steer", "revolute", "chassis", "fork", axis=[0, 0, 1], position=[BASE, 0, 0], **spring)
    inertia = [0.02, 0.04, 0.02] if round_wheels else [0.015, 0.04, 0.025]
    for name, parent, side in (("left", "chassis", TRACK), ("right", "chassis", -TRACK), ("front", "fork", 0.0)):
        builder.body(name, 2.0, inertia=inertia)
        builder.joint(name, "revolute", parent, name, axis=[0, 1, 0], position=[0, side, 0])
        given = rolling(name, WHEEL)
        builder.constraint(f"roll_{name}", given.pop("type"), given.pop("first"), given.pop("second"), **given)
    return eomgen.build(builder.build(), profile="instant")


@pytest.mark.slow_cases("free")
@pytest.mark.parametrize("kind", ["planar", "free"])
def test_a_cart_goes_straight_on_and_in_circles(kind: str) -> None:
    """Its steering angle d says the circle: yaw rate L = V tan(d); wheels turn with the speed at their places."""
    model = cart(kind)
    speed = "body[1]" if kind == "planar" else "body[3]"
    for angle in (0.0, 0.3, -0.5):
        for given in ({"front": 10.0}, {speed: 2.0}):
            found = model.steady_motion(given, parameters={"steering": angle})
            v = dict(zip(model.v_names, found.v, strict=True))
            steered = dict(zip(model.q_names, found.q, strict=True))["q.steer"]
            assert steered == pytest.approx(angle, abs=0.02)  # the spring gives way
            forward = float(model.twist("chassis", found.q, found.v)[3])
            turning = forward * math.tan(steered) / BASE
            assert forward == pytest.approx(10.0 * WHEEL * math.cos(steered) if "front" in given else 2.0, rel=1e-4)
            assert v["v.left"] * WHEEL == pytest.approx(forward - TRACK * turning, abs=1e-9)
            assert v["v.right"] * WHEEL == pytest.approx(forward + TRACK * turning, abs=1e-9)
            assert v["v.front"] * WHEEL == pytest.approx(forward / math.cos(steered), abs=1e-9)
    run = model.simulate(1.0, 2e-3, method="rk4_partitioned", initial=found.initial, parameters={"steering": angle})
    kept = [model.v_names.index(f"v.{name}") for name in ("left", "right", "front", "steer")]
    np.testing.assert_allclose(run.v[:, kept], np.tile(found.v[kept], (len(run.t), 1)), atol=1e-8)


@pytest.mark.slow
def test_wheels_of_three_moments_roll_straight_on() -> None:
    """Their spins are no symmetries, and forced by the rows; in a circle their moments change with the spin: none is
    steady."""
    model = cart("planar", round_wheels=False)
    found = model.steady_motion({"body[1]": 2.0})
    np.testing.assert_allclose(found.v, [0, 2.0, 0, 0, 10.0, 10.0, 10.0], atol=1e-9)
    with pytest.raises(NumericalError, match=r"no steady motion was found|forces balance at this instant only"):
        model.steady_motion({"body[1]": 2.0}, parameters={"steering": 0.3})
