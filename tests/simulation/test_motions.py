"""Motions that a caller gives: what follows them moves as it does by the same law as a formula, and what is missing or
cannot be is refused."""

from __future__ import annotations

import math
import pickle
import re
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.docs.parts import whole

START = {"x": {"position": 0.2, "velocity": 0.3}, "swing": {"position": 0.3, "velocity": 0.0}}
LAW = "0.2 + 0.1 * sin(3 * t)"
METHODS = ("generalized_alpha", "generalized_alpha_index3", "rk4_partitioned", "rattlie")


def sine(t: float) -> tuple[float, float, float]:
    """Return position, rate and acceleration of ``LAW``."""
    return 0.2 + 0.1 * math.sin(3 * t), 0.3 * math.cos(3 * t), -0.9 * math.sin(3 * t)


@cache
def cart(drive: str, coordinates: str = "joint") -> eomgen.Model:
    """Return a cart that is driven, with a pendulum on it."""
    builder = eomgen.SceneBuilder("cart", coordinates=coordinates).body("cart", 2.0, inertia=[0.1] * 3)
    builder.body("bob", 0.5, center_of_mass=[0, 0, -0.5], inertia=[0.01, 0.01, 0.01])
    if "lift" in drive:
        builder.input("lift", motion=True, initial="200 mm", description="where the cart has to be")
        builder.output("given", formula="lift")
    builder.joint("x", "prismatic", "base", "cart", axis=[1, 0, 0], drive=drive)
    builder.joint("swing", "revolute", "cart", "bob", axis=[0, 1, 0])
    builder.output("effort", formula="drive_effort.x", unit="N")
    return eomgen.build(builder.build(), profile="quick")


def followed(method: str = "generalized_alpha", **options: Any) -> Any:
    return cart("lift").start(START, method=method, step=1e-3, motions={"lift": sine}, **options)


def block(*, stops: bool = False) -> eomgen.Scene:
    """Return a body of 2 kg that a motion drives."""
    builder = eomgen.SceneBuilder("followed", gravity=[0, 0, 0]).body("block", 2.0).input("feed", motion=True, unit="m")
    builder.joint("x", "prismatic", "base", "block", axis=[1, 0, 0], drive="feed")
    if stops:
        builder.event("end", when="q.x - 0.05", action="stop")
    return builder.output("effort", formula="drive_effort.x", unit="N").build()


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_motion_moves_the_machine_as_the_same_law_as_a_formula(method: str) -> None:
    """Quintics over steps of 1 ms are off the sine by 0.1 (3 h)^6 / 46080 = 2e-21 m, and their second derivatives by
    0.1 3^6 h^4 / 384 = 2e-13 m/s^2, to rounding of 60 eps 0.3 m / h^2 = 4e-9 m/s^2."""
    run = followed(method)
    run.advance(0.5, motions={"lift": sine})
    whole = cart(LAW).simulate(0.5, 1e-3, method=method, initial=START, error_estimate=False)
    assert run.q == pytest.approx(whole.q[-1], abs=1e-9) and run.v == pytest.approx(whole.v[-1], abs=1e-8)
    assert run.outputs["effort"] == pytest.approx(whole.outputs["effort"][-1], abs=1e-6)
    assert run.q[0] == pytest.approx(sine(0.5)[0], abs=1e-14) and abs(run.q[1] - 0.3) > 0.2
    assert run.motions["lift"] == pytest.approx(sine(0.5), abs=1e-15)


@pytest.mark.slow
def test_the_effort_of_a_drive_is_mass_by_acceleration() -> None:
    """Without a pendulum: a body of 2 kg, whose acceleration 12 t^2 the method has to h^2 times its second rate, 24."""
    run = eomgen.build(block(), profile="quick").start(step=1e-3, method="generalized_alpha")
    efforts, t = [], 0.01 * np.arange(1, 31)
    for end in t:
        run.advance(end, motions={"feed": (end**4, 4 * end**3, 12 * end**2)})
        efforts.append(float(run.outputs["effort"]))
    assert efforts == pytest.approx(2.0 * 12.0 * t**2, abs=2.0 * 24.0 * 1e-6)
    assert run.q[0] == pytest.approx(t[-1] ** 4, abs=1e-14)


@pytest.mark.slow
def test_what_a_distance_and_a_moving_base_follow() -> None:
    """A weight on a winch in a frame that is lifted: both motions together, in one formula each."""
    builder = eomgen.SceneBuilder("winch").body("weight", 3.0)
    builder.input("rope", motion=True, initial=1.0, unit="m").input("height", motion=True, unit="m")
    builder.base(position=[0, 0, "height"])
    builder.joint("fall", "prismatic", "base", "weight", axis=[0, 0, -1], initial={"position": 1.0})
    builder.constraint("cable", "distance", {"body": "base"}, {"body": "weight"}, length="rope")
    builder.output("tension", formula="-drive_effort.cable", unit="N")
    builder.output("place", position="hook").point("hook", "weight", [0, 0, 0])
    run = eomgen.build(builder.build(), profile="quick").start(step=1e-3, method="generalized_alpha")
    for t in 1e-3 * np.arange(1, 201):
        run.step(motions={"rope": (1.0 - t**3, -3 * t**2, -6 * t), "height": (t**4, 4 * t**3, 12 * t**2)})
    t = run.t
    assert run.outputs["place"] == pytest.approx([0.0, 0.0, t**4 - 1.0 + t**3], abs=1e-9)
    assert run.outputs["tension"] == pytest.approx(3.0 * (9.81 + 12 * t**2 + 6 * t), rel=1e-6)


MAIN = (Path(__file__).parent / "followed_motion.c").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_shows_how_c_moves_a_motion(tmp_path: Path) -> None:
    page = whole("python")
    (snippet,) = (block for block in re.findall(r"```c\n(.*?)```", page, re.DOTALL) if "followed_parameters" in block)
    eomgen.generate(block(), tmp_path, method="generalized_alpha")
    (tmp_path / "main.c").write_text(MAIN.replace("SNIPPET", snippet.replace("lift", "feed")))
    sources = sorted(path.name for path in tmp_path.glob("*.c"))
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]
    command = ["gcc", *flags, *sources, "-o", "followed", "-lm"]
    built = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([tmp_path / "followed"], capture_output=True, text=True, check=True)
    x, v, a = map(float, done.stdout.split())
    assert (x, v) == pytest.approx((1e-3, 3e-2), abs=1e-14) and a == pytest.approx(0.6, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "error"), [("rk4", 1e-8), ("generalized_alpha", 1e-11)])
def test_methods_without_constraints_follow_the_base(method: str, error: float) -> None:
    """At steps of 5 ms. Quintics have the sine's acceleration within steps to 0.05 7^6 h^4 / 384 = 1e-8 m/s^2, of which
    generalized-alpha takes the ends alone."""

    def swaying(position: str) -> eomgen.Model:
        builder = eomgen.SceneBuilder("swaying").body("bob", 0.5, center_of_mass=[0, 0, -0.5], inertia=[0.01] * 3)
        if position == "sway":
            builder.input("sway", motion=True, unit="m")
        builder.base(position=[position, 0, 0])
        builder.joint("swing", "revolute", "base", "bob", axis=[0, 1, 0], initial={"position": 0.3})
        return eomgen.build(builder.build(), profile="quick", method=method)

    def sway(t: float) -> tuple[float, float, float]:
        return 0.05 * math.sin(7 * t), 0.35 * math.cos(7 * t), -2.45 * math.sin(7 * t)

    run = swaying("sway").start(step=5e-3, motions={"sway": sway})
    run.advance(1.0, motions={"sway": sway})
    whole = swaying("0.05 * sin(7 * t)").simulate(1.0, 5e-3, error_estimate=False)
    assert run.q == pytest.approx(whole.q[-1], abs=error) and run.v == pytest.approx(whole.v[-1], abs=10 * error)


def test_targets_of_several_steps_are_one_polynomial() -> None:
    """From rest to rest: 10 s^3 - 15 s^4 + 6 s^5."""
    run = cart("lift").start(step=1e-3)
    run.record()
    for _ in range(2):
        run.step(n=25, motions={"lift": (0.3, 0.0, 0.0)} if run.t == 0 else None)
        run.record()
    assert run.q[0] == pytest.approx(0.3, abs=1e-15) and list(run.motions["lift"]) == [0.3, 0.0, 0.0]
    middle = cart("lift").start(step=1e-3)
    middle.advance(0.0125, motions={"lift": sine})
    assert middle.motions["lift"] == pytest.approx(sine(0.0125), abs=1e-15)
    assert run.solution().outputs_at(0.0125)["given"] == pytest.approx(0.25, abs=1e-12)


def test_copies_and_restored_states_go_on_to_the_same_bits() -> None:
    run = followed()
    run.advance(0.05, motions={"lift": sine})
    other, kept = run.copy(), pickle.loads(pickle.dumps(run.state))
    ends = []
    for simulator in (run, other):
        simulator.advance(0.1, motions={"lift": sine})
        ends.append(simulator.q)
    run.restore(kept)
    run.advance(0.1, motions={"lift": sine})
    assert np.array_equal(run.q, ends[0]) and np.array_equal(ends[1], ends[0])


def test_a_state_set_at_another_time_keeps_its_motions() -> None:
    run = followed()
    run.advance(0.05, motions={"lift": sine})
    run.set_state(t=2.0)
    assert run.motions["lift"] == pytest.approx(sine(0.05), abs=1e-15)
    run.step(motions={"lift": sine(0.051)})
    assert run.q[0] == pytest.approx(sine(0.051)[0], abs=1e-14)


def test_a_run_as_a_whole_has_its_motions_at_rest_or_at_a_rate() -> None:
    model = cart("lift")
    assert model.simulate(0.01, 1e-3, error_estimate=False).q[-1, 0] == pytest.approx(0.2, abs=1e-14)
    moved = model.simulate(0.1, 1e-3, parameters={"lift_1": 0.5}, error_estimate=False)
    assert moved.q[-1, 0] == pytest.approx(0.25, abs=1e-13)


def under_way() -> Any:
    run = followed()
    run.step(motions={"lift": sine})
    return run


REFUSED: list[tuple[str, Callable[[], object], str]] = [
    ("a position alone", lambda: followed().step(motions={"lift": 0.3}), "motion lift: its position, rate and "
     "acceleration are needed, three numbers, not shape ()"),
    ("a function of a position", lambda: followed().step(motions={"lift": lambda t: t}), "motion lift: its position, "
     "rate and acceleration at t = 0.001 s are needed, three numbers, not shape ()"),
    ("a function that fails", lambda: followed().step(motions={"lift": lambda t: 1 / 0}), "motion lift: the function "
     "failed at t = 0.001 s: ZeroDivisionError: division by zero"),
    ("no number", lambda: followed().step(motions={"lift": (0.1, math.nan, 0.0)}), "motion lift[1] is nan"),
    ("no target", lambda: under_way().step(), "motion lift: it is under way, with a rate of 0.299999 and an "
     "acceleration of -0.0027, and has no target; try: motions={'lift': (position, rate, acceleration)}"),
    ("another name", lambda: followed().step(motions={"left": (0, 0, 0)}), "there is no motion 'left'; try: lift"),
    ("no mapping", lambda: followed().step(motions=[0, 0, 0]), "motions: a mapping from the names of motions is "
     "needed, not list"),
    ("steps of its own", lambda: followed("rk45_partitioned").step(motions={"lift": sine}), "motions: "
     "rk45_partitioned chooses its steps, which lie ahead of the time to which motions are known; try: "
     "generalized_alpha"),
    ("as an input of a run", lambda: cart("lift").simulate(0.1, inputs={"lift": 0.3}), "input lift: this is a motion, "
     "which its caller gives with rate and acceleration from step to step; try: run = model.start(...)"),
    ("as an input of a start", lambda: cart("lift").start(inputs={"lift": 0.3}), "input lift: this is a motion"),
    ("as an input of a step", lambda: cart("lift").start().step({"lift": 0.3}), "input lift: this is a motion"),
    ("a scene without motions", lambda: cart(LAW).start().step(motions={"lift": sine}), "there is no motion 'lift': "
     "the scene has no motions"),
]  # fmt: skip  # a table


@pytest.mark.slow_cases("a scene without motions", "steps of its own")
@pytest.mark.parametrize(("refused", "message"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED])
def test_what_is_no_motion_is_refused(refused: Callable[[], object], message: str) -> None:
    with pytest.raises(eomgen.UsageError) as caught:
        refused()
    assert message in str(caught.value)


@pytest.mark.slow
def test_a_kink_behind_a_motion_is_refused_where_it_comes() -> None:
    run = cart("abs(lift - 0.21)").start(step=1e-3)
    run.step(motions={"lift": (0.205, 0.0, 0.0)})
    with pytest.raises(eomgen.UsageError, match="the rate of the driven travel jumps from"):
        run.step(n=10, motions={"lift": (0.22, 0.0, 0.0)})


@pytest.mark.slow
def test_steps_before_and_behind_an_event_that_stops() -> None:
    """A motion that an event has stopped goes on from where it was then, with its rate and acceleration."""
    run = eomgen.build(block(stops=True), profile="quick").start(step=1e-3)
    run.step(n=100, motions={"feed": (0.1, 0.0, 0.0)})
    assert run.stopped and run.motions["feed"] == pytest.approx([0.05, 1.875, 0.0], abs=1e-6)
    assert run.t == pytest.approx(0.05, abs=1e-8)
