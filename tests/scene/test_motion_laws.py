"""Drives and motions of the base that jump are refused at the build and at the run; laws that are smooth enough are
not."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.formula.motion_faults import first_jump, jumps
from eomgen.formula.prescribed_motion import smooth
from eomgen.mechanics.describe import laws_of

FRAME = {"axis": [0, 0, 1], "x_axis": [1, 0, 0]}


def driven(drive: str, kind: str = "revolute", duration: float = 10.0, **curves: object) -> eomgen.Scene:
    """Return a body on a joint that a drive moves: curves by name, ``late`` and ``size`` tunable."""
    builder = eomgen.SceneBuilder("driven").body("wheel", 1.0, inertia=[1, 1, 1]).parameter("width", 1e-3)
    builder.joint("turn", kind, "base", "wheel", axis=[0, 0, 1]).simulation(duration=duration)
    builder.parameter("late", 0.5, tunable=True).parameter("size", 0.0, tunable=True)
    for name, entry in curves.items():
        builder.curve(name, **entry)  # type: ignore[arg-type]
    first, second = {"body": "base", **FRAME}, {"body": "wheel", **FRAME}
    return builder.constraint("motor", kind, first, second, drive=drive).build()


def jumping(scene: eomgen.Scene) -> list[eomgen.Problem]:
    """Return the problems of laws that jump over the scene's own duration."""
    return jumps(laws_of(scene), {item.name: item.value for item in scene.parameters}, 0.0, scene.simulation.duration)


@pytest.mark.parametrize(
    ("drive", "what"),
    [
        ("1 if t > 0.5 else 0", "the driven angle jumps from 0 to 1 rad at t = 0.5 s, and no motion can follow that"),
        ("1 if 4 < t and t < 4 + 1e-6 else 0", "the driven angle jumps from 0 to 1 rad at t = 4 s"),
        (
            "0 if t < 0.5 else 2 * (t - 0.5)",
            "the rate of the driven angle jumps from 0 to 2 rad/s at t = 0.5 s, which takes an impulse that no step",
        ),
        ("abs(t - 1)", "the rate of the driven angle jumps from -1 to 1 rad/s at t = 1 s"),
        *(
            (f"abs(0.3 * sin(t) - {0.1 + 0.009 * k})", "the rate of the driven angle jumps from -0.2")
            for k in (5, 8, 11)
        ),
        ("sqrt((t - 2.3)**2)", "the rate of the driven angle jumps from -1 to 1 rad/s at t = 2.3 s"),
        ("acos(cos(t + 1))", "the rate of the driven angle jumps from "),
    ],
)
def test_a_drive_that_jumps_is_refused_with_its_place_and_time(drive: str, what: str) -> None:
    scene = driven(drive)
    with pytest.raises(eomgen.DescriptionError) as caught:
        eomgen.build(scene, profile="quick")
    [problem] = caught.value.problems
    assert re.fullmatch(r"test_motion_laws\.py:\d+ \(constraints\.motor\.drive\)", problem.where)
    assert problem.what.startswith(what)
    assert problem.hint.startswith(
        'smooth = "10 ms" with the law, or a law that is smooth there, such as a curve with interpolation'
    )


@pytest.mark.parametrize(
    "drive",
    [
        "0.3 * sin(2 * t) + late * t**2",
        "0.5 * (1 - cos(pi * t)) if t < 1 else 1",
        "max(0, t - 1)**2",
        "0.3333333 * t**3 if t < 1 else 0.3333333 + (t - 1)",
        "atan2(sin(3 * t), cos(3 * t))",
        "100 * t if t < 1 else 100 * t + 2 * pi",
        "size * sign(t - 2)",
    ],
)
def test_a_drive_that_is_smooth_enough_is_not_refused(drive: str) -> None:
    assert not jumping(driven(drive))


def test_curves_in_drives() -> None:
    points = [[0, 0], [1, 0.2], [2, 0.5], [3, 0.1]]
    spline = {"points": points, "outside": "hold"}
    for drive in ("way(t)", "derivative.way(t - 0.5)", "bump(t) * t"):
        assert not jumping(driven(drive, way=spline, bump={"bump": {"position": 1, "length": 2, "height": 0.1}}))
    [problem] = jumping(driven("second_derivative.way(t + 0.3)", way=spline))
    assert problem.what.startswith("the rate of the driven angle jumps")
    with pytest.raises(eomgen.DescriptionError, match="a motion cannot follow way, which bends at 0"):
        driven("way(t)", way={"points": points, "interpolation": "linear"})


def test_the_motion_of_the_base_is_held_to_the_same() -> None:
    def scene(position: str, angle: str = "0") -> eomgen.Scene:
        builder = eomgen.SceneBuilder("based").body("arm", 1.0, center_of_mass=[0.1, 0, 0], inertia=[1, 1, 1])
        builder.base(position=[0, 0, position], rotation=[([0, 0, 1], "0.1 * t"), ([1, 0, 0], angle)])
        return builder.joint("hinge", "revolute", "base", "arm", axis=[0, 0, 1]).build()

    assert not jumping(scene("0.1 * sin(t)", "0.2 * t"))
    assert not jumping(scene("0.1 * (1 - cos(t)) if t < 2 * pi else 0"))
    with pytest.raises(eomgen.DescriptionError) as caught:
        eomgen.derive(scene("0 if t < 1 else 0.1", "max(0, t - 2)"))
    first, second = caught.value.problems
    assert "(base.position[2])" in first.where and "(base.rotation[1].angle)" in second.where
    assert first.what.startswith("the position of the base jumps from 0 to 0.1 m at t = 1 s")
    assert second.what.startswith("the rate of the angle of the base jumps from 0 to 1 rad/s at t = 2 s")


@pytest.mark.slow
def test_a_run_looks_at_its_own_times_and_parameters() -> None:
    model = eomgen.build(driven("size * (1 if t > late else 0) + 0.3 * t", duration=1.0), profile="quick")
    assert model.simulate(0.1, 1e-2).success
    with pytest.raises(
        eomgen.UsageError, match=r"\(constraints\.motor\.drive\): the driven angle jumps from 0\.12 to 0\.92 rad"
    ):
        model.simulate(0.5, 1e-2, parameters={"size": 0.8, "late": 0.4})
    assert model.simulate(0.3, 1e-2, parameters={"size": 0.8, "late": 0.4}).success
    later = eomgen.build(driven("0.1 * t if t < 2 else 0.2", duration=1.0), profile="quick")
    with pytest.raises(eomgen.UsageError, match=r"the rate of the driven angle jumps from 0\.1 to 0 rad/s at t = 2 s"):
        later.simulate(3.0, 1e-2)


@pytest.mark.slow
def test_a_run_that_goes_on_meets_the_jump_too(tmp_path: Path) -> None:
    model = eomgen.build(driven("0.1 * t if t < 2 else 0.2", duration=1.0), profile="quick")
    model.simulate(0.5, 1e-2, checkpoint=tmp_path / "run.ckpt")
    assert model.resume(tmp_path / "run.ckpt", 1.0).success
    with pytest.raises(eomgen.UsageError, match="the rate of the driven angle jumps"):
        model.resume(tmp_path / "run.ckpt", 3.0)


@pytest.mark.slow
def test_random_laws_are_judged_by_what_they_do(rng: np.random.Generator) -> None:
    """Two polynomials that meet with a gap in the value, in the rate, or in neither, at a time that a formula hides or
    shows."""
    for trial in range(60):
        place = float(rng.uniform(0.5, 9.5))
        a, b, c, d = rng.normal(size=4).tolist()
        value, rate = (float(np.exp(rng.uniform(-6, 2))) * (trial % 3 == k) for k in (1, 2))
        condition = (f"t < {place!r}", f"exp(t / 3) < {math.exp(place / 3)!r}")[trial % 2]
        u = f"(t - {place!r})"
        drive = (
            f"({a!r} + {b!r}*{u} + {c!r}*{u}**2 if {condition} else {a + value!r} + {b + rate!r}*{u} + {d!r}*{u}**2)"
        )
        [law] = laws_of(driven(drive))
        assert not smooth(law.formula)
        jump = first_jump(law.formula, (), 0.0, 10.0, False)
        if trial % 3 == 0:
            assert jump is None
            continue
        assert jump is not None and jump.order == (0 if value else 1)
        assert jump.time == pytest.approx(place, rel=1e-9)
        assert jump.after - jump.before == pytest.approx(value or rate, rel=1e-4)


@pytest.mark.parametrize("duration", [1e-4, 1e-2, 1.0, 20.0])
def test_a_start_from_rest_whose_summands_cancel_is_smooth(duration: float) -> None:
    scene = eomgen.load(Path(__file__).parents[2] / "examples" / "spin_up_beam" / "scene.toml")
    assert not jumps(laws_of(scene), {item.name: item.value for item in scene.parameters}, 0.0, duration)


def carried(width: float, at: float = 1.0) -> eomgen.Scene:
    """Return a driven arm with a balanced disc on a free pin, which keeps its orientation whatever the drive does."""
    builder = eomgen.SceneBuilder("carried").body("arm", 1.0, inertia=[1, 1, 1]).body("disc", 1.0, inertia=[1, 1, 1])
    builder.joint("turn", "revolute", "base", "arm", axis=[0, 0, 1])
    builder.joint("pin", "revolute", "arm", "disc", axis=[0, 0, 1])
    first, second = {"body": "base", **FRAME}, {"body": "arm", **FRAME}
    builder.constraint("motor", "revolute", first, second, drive=f"0.1 * tanh((t - {at}) / {width})")
    return builder.build()


@pytest.mark.slow
@pytest.mark.parametrize("width", [1e-7, 1e-6, 1e-5, 1e-4, 3e-4, 8e-4])
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4_partitioned"])
def test_a_drive_steeper_than_the_step_is_refused_with_a_step_that_follows_it(width: float, method: str) -> None:
    model = eomgen.build(carried(width, 1.0003), method=method, profile="quick")
    place = r"\(constraints\.motor\.drive\): the driven angle is too steep for a step of 0\.001 s near t = 1\.000"
    with pytest.raises(eomgen.UsageError, match=place) as caught:
        model.simulate(2.0, 1e-3)
    enough = float(re.search(r"a step of (\S+) s", caught.value.problems[0].hint)[1])  # type: ignore[index]
    assert width / 20.0 <= enough <= width
    if width >= 1e-4:  # a few thousand steps, from just before
        solution = eomgen.build(carried(width, 0.01), method=method, profile="quick").simulate(0.02, enough)
        assert solution.success and "too steep" not in solution.message
        turned = solution.q[-1, 0] - solution.q[0, 0]
        assert turned == pytest.approx(0.1 * (np.tanh(0.01 / width) + np.tanh(0.01 / width)), abs=1e-6)
        assert solution.q[-1] - solution.q[0] == pytest.approx([turned, -turned], abs=0.02 * turned)


@pytest.mark.slow
def test_a_drive_that_a_step_follows_badly_is_said_and_one_that_it_follows_is_not() -> None:
    said = eomgen.build(carried(1.5e-3), profile="quick").simulate(2.0, 1e-3).message
    place = (
        r"\(constraints\.motor\.drive\): the driven angle is too steep for a step of 0\.001 s near t = (1|0\.9999\d*) s"
    )
    assert re.search(place, said)
    assert "% of its range; try: a step of " in said
    assert "too steep" not in eomgen.build(carried(1e-2), profile="quick").simulate(2.0, 1e-3).message


@pytest.mark.slow
@pytest.mark.parametrize(("waves", "verdict"), [(0.4, "followed"), (0.8, "said"), (2.0, "refused"), (600.0, "refused")])
def test_waves_are_judged_by_the_steps_in_a_period_beside_any_steady_travel(waves: float, verdict: str) -> None:
    """``waves``: radians within one step."""
    model = eomgen.build(driven(f"50 * t + 0.01 * sin({waves * 1e3 + 0.1} * t)"), profile="quick")
    if verdict == "refused":
        with pytest.raises(eomgen.UsageError, match="the driven angle is too steep for a step"):
            model.simulate(0.5, 1e-3)
    else:
        assert ("too steep" in model.simulate(0.5, 1e-3).message) is (verdict == "said")


@pytest.mark.slow
def test_a_base_steeper_than_the_step_is_refused() -> None:
    builder = eomgen.SceneBuilder("kicked").body("link", 1.0, center_of_mass=[0, 0, -0.5], inertia=[0.01, 0.01, 0.01])
    builder.joint("hinge", "revolute", "base", "link", axis=[0, 1, 0])
    scene = builder.base(["0.1 * tanh((t - 1) / 1e-4)", 0, 0]).build()
    model = eomgen.build(scene, profile="quick")
    with pytest.raises(
        eomgen.UsageError, match=r"the position of the base is too steep for a step of 0\.001 s near t = 0\.9999"
    ):
        model.simulate(2.0, 1e-3)
    assert model.simulate(0.5, 1e-3).success  # before it
