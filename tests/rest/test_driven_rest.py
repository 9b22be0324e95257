"""Rest beside drives of constant rate, against closed forms: governor, gyroscopic rotor, oscillator on a turntable."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import NumericalError, UsageError
from tests.simulation.rails import built

G, LENGTH, DAMPING = 9.81, 0.3, 0.5
STIFFNESS, ACROSS, ALONG = 7200.0, 0.18, 0.31


def governor_of(law: str = "w*t", **keys: Any) -> eomgen.SceneBuilder:
    """Return a shaft that is driven, with a ball on an arm."""
    builder = eomgen.SceneBuilder("governor", **keys).parameter("w", 12.0, tunable=True)
    builder.body("shaft", 1, inertia=[0.01] * 3).body("ball", 1, center_of_mass=[0, 0, -LENGTH], inertia=[0, 0, 0])
    builder.joint("shaft", "revolute", "base", "shaft", axis=[0, 0, 1], drive=law)
    start = {"position": 0.4}
    return builder.joint("arm", "revolute", "shaft", "ball", axis=[0, 1, 0], damping=DAMPING, initial=start)


def rotor_of(**disc: Any) -> eomgen.Model:
    """Return a disc that is driven about an axis that tilts on springs."""
    builder = eomgen.SceneBuilder("rotor", gravity=[0, 0, 0]).parameter("w", 300.0, unit="rad/s", tunable=True)
    builder.body("a", 0).body("b", 0).body("disc", 5, **{"inertia": [ACROSS, ACROSS, ALONG], **disc})
    builder.joint("tx", "revolute", "base", "a", axis=[1, 0, 0], stiffness=STIFFNESS)
    builder.joint("ty", "revolute", "a", "b", axis=[0, 1, 0], stiffness=STIFFNESS)
    return built(builder.joint("spin", "revolute", "b", "disc", axis=[0, 0, 1], drive="w*t"))


@pytest.fixture(scope="module")
def governor() -> eomgen.Model:
    return built(governor_of())


@pytest.fixture(scope="module")
def rotor() -> eomgen.Model:
    return rotor_of()


def arm_at(w: float) -> float:
    """Return where the arm stands: weight and centrifugal force balance at cos = g / (l w^2)."""
    return float(np.arccos(min(1.0, G / (LENGTH * w * w))))


def arm_eigenvalue(w: float) -> complex:
    """Return the root with the positive imaginary part of s^2 + c/(m l^2) s + k = 0; k is the second derivative of the
    effective potential per m l^2."""
    angle = arm_at(w)
    k = G / LENGTH * np.cos(angle) - w * w * np.cos(2.0 * angle)
    half = 0.5 * DAMPING / LENGTH**2
    return complex(-half, np.sqrt(k - half * half))


@pytest.mark.slow
def test_a_governor_rests_where_centrifugal_force_balances_weight(governor: eomgen.Model) -> None:
    rest = governor.equilibrium()
    assert rest.q == pytest.approx([0.0, arm_at(12.0)], abs=1e-9)
    assert rest.v.tolist() == [12.0, 0.0]
    assert rest.stable is True
    assert rest.message.startswith("at rest relative to the drive of shaft at 12 rad/s after ")
    run = governor.simulate(2.0, 1e-3, start="equilibrium")
    assert run.v[0] == pytest.approx([12.0, 0.0], abs=1e-12)
    assert run.q[:, 1] == pytest.approx(np.full(len(run.q), arm_at(12.0)), abs=1e-8)


@pytest.mark.slow
def test_linear_models_and_root_loci_are_about_rest_beside_the_drive(governor: eomgen.Model) -> None:
    found = governor.linearize().modes().eigenvalues
    assert found == pytest.approx([arm_eigenvalue(12.0)], rel=1e-7)
    speeds = [1.0, 4.0, 8.0, 12.0]  # below and above sqrt(g/l) = 5.72
    roots = governor.root_locus("w", speeds).eigenvalues
    for w, row in zip(speeds, roots, strict=True):
        assert max(row, key=lambda root: root.imag) == pytest.approx(arm_eigenvalue(w), rel=1e-6)


@pytest.mark.slow
def test_the_nearest_equilibrium_of_any_kind_is_the_unstable_one_on_the_axis(governor: eomgen.Model) -> None:
    rest = governor.equilibrium({"arm": 0.02}, any_kind=True)
    assert rest.q[1] == pytest.approx(0.0, abs=1e-9)
    assert rest.stable is False
    # k = g/l - w^2 < 0
    assert rest.frequencies == pytest.approx([-np.sqrt(144.0 - G / LENGTH)], rel=1e-9)


def tilts(w: float) -> list[float]:
    """Return the angular frequencies of tilts in both senses: ACROSS s^2 -+ ALONG w s - STIFFNESS = 0."""
    root = np.sqrt((ALONG * w) ** 2 + 4.0 * ACROSS * STIFFNESS)
    return [(root - ALONG * w) / (2.0 * ACROSS), (root + ALONG * w) / (2.0 * ACROSS)]


@pytest.mark.slow
@pytest.mark.parametrize("at", [None, "equilibrium", "steady", "initial"])
def test_a_driven_rotor_has_its_gyroscopic_forces(rotor: eomgen.Model, at: str | None) -> None:
    """At the start, and at rest and in steady motion hours later."""
    for t in (0.0, 7200.0) if at in ("equilibrium", "steady") else (0.0,):
        assert rotor.linearize(at=at, t=t).modes().angular_frequency == pytest.approx(tilts(300.0), rel=1e-8)


@pytest.mark.slow
def test_a_campbell_diagram_over_the_rate_of_a_drive(rotor: eomgen.Model) -> None:
    diagram = rotor.campbell("w", [0.0, 100.0, 200.0, 300.0], whirl=[("tx", "ty")])
    for w, row in zip(diagram.values, diagram.angular_frequencies, strict=True):
        assert sorted(row) == pytest.approx(tilts(float(w)), rel=1e-9)
    # backward, s = w: (ACROSS + ALONG) w^2 = STIFFNESS; forward it is never met, for ALONG > ACROSS
    assert diagram.critical_speeds == pytest.approx([np.sqrt(STIFFNESS / (ACROSS + ALONG))], rel=1e-9)
    assert [item.whirl for item in diagram.crossings] == ["backward"]


@pytest.mark.slow
def test_a_velocity_that_a_drive_has_is_no_unknown(rotor: eomgen.Model) -> None:
    assert rotor.steady_motion({"spin": 300.0}).v.tolist() == [0.0, 0.0, 300.0]
    with pytest.raises(UsageError, match="at spin = 0: velocity spin: it is driven at 300 rad/s, and 0 rad/s is given"):
        rotor.campbell("spin", [0.0, 100.0])


@pytest.mark.slow
def test_gyroscopic_forces_hold_an_oscillator_that_stiffness_does_not() -> None:
    """On a turntable faster than its own frequency: seen from it, an oscillator has the frequencies w -+ sqrt(k/m)."""
    table = eomgen.SceneBuilder("turntable").body("table", 1, inertia=[0.01] * 3).body("slide", 0)
    table.body("ball", 2, inertia=[0.01] * 3)
    table.joint("table", "revolute", "base", "table", axis=[0, 0, 1], drive="20*t")
    table.joint("x", "prismatic", "table", "slide", axis=[1, 0, 0], stiffness=200)
    model = built(table.joint("y", "prismatic", "slide", "ball", axis=[0, 1, 0], stiffness=200))
    rest = model.equilibrium(any_kind=True)
    assert rest.stable is None
    assert rest.frequencies == pytest.approx([-np.sqrt(400.0 - 100.0)] * 2, rel=1e-9)
    assert model.linearize(at=rest).modes().angular_frequency == pytest.approx([10.0, 30.0], rel=1e-9)


@pytest.mark.slow
def test_a_drive_whose_rate_changes_leaves_nothing_at_rest() -> None:
    model = built(governor_of("150*t**2/2"))
    assert model.equilibrium().q[1] == pytest.approx(0.0, abs=1e-9)  # its rate is zero at t = 0
    with pytest.raises(NumericalError) as refusal:
        model.equilibrium(t=1.0)
    there_is_none = "there is no rest relative to the drive of shaft at 150 rad/s, for v.shaft changes along it:"
    assert f"{there_is_none} 150 rad/s at t = 1 s, 150." in str(refusal.value)
    assert 'a law of constant rate such as "w*t", a t at which its rate is zero, at="initial", or' in str(refusal.value)
    with pytest.warns(RuntimeWarning, match="linear about the initial state, which does not last: there is no rest"):
        model.linearize(t=0.1)
    turning_back = built(governor_of("0.3*sin(5*t)"))
    assert turning_back.equilibrium(t=np.pi / 10.0).v.tolist() == [0.0, 0.0]  # a rate of zero but for rounding


@pytest.mark.slow
def test_forces_that_change_with_the_driven_angle_are_refused_with_their_centre_of_mass() -> None:
    with pytest.raises(NumericalError) as refusal:
        rotor_of(center_of_mass=[0.01, 0, 0.02]).equilibrium()  # 0.02 m above the pivot, so that it tilts
    changes = "there is no rest relative to the drive of spin at 300 rad/s, for forces change as it moves: at t = "
    assert changes in str(refusal.value)
    assert "centres of mass on the axis of spin (the centre of disc is 0.01 m off, 0.05 kg m)" in str(refusal.value)


@pytest.mark.slow
def test_a_rotor_of_two_blades_has_no_lasting_linear_model() -> None:
    """Unequal inertias across the axis: forces balance at all angles, their slopes change with the angle."""
    with pytest.warns(RuntimeWarning, match="the linear model changes with the turn of spin at 300 rad/s"):
        rotor_of(inertia=[0.1, 0.2, 0.25]).linearize()


@pytest.mark.slow
def test_a_slide_that_a_rope_pulls_evenly_carries_a_pendulum_at_rest() -> None:
    """A distance of changing length: of constant rate in line with a slide, a frame in which the pendulum hangs."""

    def pulled(length: str) -> eomgen.Model:
        builder = eomgen.SceneBuilder("rope").body("slide", 0.1).body("bob", 2, center_of_mass=[0, 0, -0.1])
        builder.joint("x", "prismatic", "base", "slide", axis=[1, 0, 0])
        builder.joint("hinge", "revolute", "slide", "bob", axis=[0, 1, 0])
        first = {"body": "base", "position": [-1, 0, 0]}
        return built(builder.constraint("rope", "distance", first, {"body": "slide"}, length=length))

    rest = pulled("1 + 0.1*t").equilibrium({"hinge": 0.5})
    assert rest.q[1] == pytest.approx(0.0, abs=1e-9)
    assert rest.v == pytest.approx([0.1, 0.0], abs=1e-12)
    said = r"there is no rest relative to the drive of x at 0\.3 m/s, for v\.x changes"
    with pytest.raises(NumericalError, match=said):
        pulled("1 + 0.1*sin(3*t)").equilibrium()
