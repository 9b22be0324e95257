"""What runs of every family of methods have: parts are the whole, rows are in balance, generated C takes the same
steps, known jumps cost no order, and long chains, whose recursion's steps are unknowns, are moved as others."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.register import BUILT_IN, row_of
from tests.codegen.test_stand_alone import compiled, run
from tests.integrators.test_taylor import controlled_scene, pushed

STATES = ("t", "q", "v", "a", "z", "multipliers")
SCENES: dict[str, Callable[[], Any]] = {
    "tree": controlled_scene,
    "spring": lambda: pushed("sin(3 * t)"),
    "loop": lambda: "examples/four_bar/scene.toml",
}
CASES = [
    *(("tree", name) for name in ("generalized_alpha", "generalized_alpha_adaptive", "rk4", "rk45", "taylor")),
    *(("tree", name) for name in ("rosenbrock", "lsrt2", "corrected_predictor", "rattlie", "tdg1", "tdg3")),
    ("spring", "omf4"),
    *(("loop", name) for name in ("generalized_alpha", "generalized_alpha_adaptive", "rk4_partitioned")),
    *(("loop", name) for name in ("rk45_partitioned", "rosenbrock", "lsrt2", "rattlie")),
]
#: Rows of generalized-alpha on constraints have what its order and its iterations leave.
IN_BALANCE = [(scene, name) for scene, name in CASES if not name.startswith("generalized_alpha")]
#: Factors that are kept from the start are part of what a run remembers.
OPTIONS: dict[str, dict[str, Any]] = {"corrected_predictor": {"settings": {"matrix_every": 0}}}


@cache
def model(scene: str) -> eomgen.Model:
    return eomgen.build(SCENES[scene](), profile="quick")


def options_of(scene: str, method: str) -> tuple[float, dict[str, Any]]:
    """Return a step, and what a run is told."""
    return 0.002 if scene == "loop" else 0.013, {"method": method, "error_estimate": False, **OPTIONS.get(method, {})}


def test_no_family_is_left_out() -> None:
    assert {row_of(name)[0] for _, name in CASES} == set(BUILT_IN)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "method"), CASES)
def test_a_run_in_two_parts_has_the_bits_of_one(scene: str, method: str, tmp_path: Path) -> None:
    file, (step, options) = tmp_path / "run.ckpt", options_of(scene, method)
    one = model(scene).simulate(40 * step, step, **options)
    first = model(scene).simulate(15 * step, step, checkpoint=file, **options)
    whole = first.followed_by(model(scene).resume(file, 40 * step, error_estimate=False))
    assert one.success and whole.success
    assert all(np.array_equal(getattr(whole, name), getattr(one, name)) for name in STATES)
    for name in {"own_steps", "expansions", "evaluations"} & one.stats.keys():
        assert whole.stats[name] == one.stats[name], name


@pytest.mark.slow_except("tree-lsrt2")
@pytest.mark.parametrize(("scene", "method"), IN_BALANCE)
def test_rows_hold_accelerations_and_multipliers_of_their_states(scene: str, method: str) -> None:
    made, (step, options) = model(scene), options_of(scene, method)
    found = made.simulate(40 * step, step, record_every=5, **options)
    q, v, t, z = found.q, found.v, found.t, found.z
    if made.multipliers:
        wanted = made.constrained_dynamics(q, v, t)
    else:
        wanted = (made.forward_dynamics(q, v, t, z=z), np.zeros_like(found.multipliers))
    for ours, other in zip((found.a, found.multipliers), wanted, strict=True):
        apart = np.abs(ours - other).max(initial=0.0)
        assert apart <= 1e-10 * np.abs(other).max(initial=1.0)


#: What codegen/test_stand_alone.py has not.
IN_C = [
    *(("tree", name) for name in ("generalized_alpha_adaptive", "rk45", "lsrt2", "corrected_predictor", "tdg1")),
    ("spring", "omf4"),
    *(("loop", name) for name in ("rosenbrock", "rk4_partitioned", "rk45_partitioned")),
]


@pytest.mark.slow
@pytest.mark.long_except("tree-generalized_alpha_adaptive", "tree-tdg1", "loop-rosenbrock", "loop-rk45_partitioned")
@pytest.mark.parametrize(("scene", "method"), IN_C)
def test_generated_c_takes_the_same_steps(scene: str, method: str, tmp_path: Path) -> None:
    eomgen.generate(SCENES[scene](), tmp_path / "c", method=method)
    text = run(compiled(tmp_path / "c"), "0.2", "0.002", "1").stdout
    rows = np.array([[float(x) for x in line.split(",")] for line in text.splitlines()[1:]])
    made = eomgen.build(SCENES[scene](), method=method, profile="reproducible")
    found = made.simulate(0.2, 0.002, method=method)
    columns = [found.t[:, np.newaxis], found.q, found.v, found.a]
    assert np.array_equal(rows[:, : 1 + made.nq + 2 * made.nv], np.hstack(columns))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rosenbrock", "lsrt2", "corrected_predictor", "rattlie"])
def test_order_across_a_known_jump(method: str) -> None:
    made = eomgen.build(pushed("3 if t > late else 0"))
    exact = made.simulate(1.2, 0.1, method="taylor", tolerance=1e-14)
    errors = [abs(made.simulate(1.2, 1.2 / n, method=method).q[-1, 0] - exact.q[-1, 0]) for n in (160, 320, 640)]
    assert np.diff(np.log2(errors)) == pytest.approx(-2.0, abs=0.1)


@cache
def long_chain() -> tuple[eomgen.Model, np.ndarray]:
    """Return a chain of 40 links on hinges whose axes alternate, and q after 0.05 s."""
    builder, last = eomgen.SceneBuilder("long_chain"), "base"
    for number in range(40):
        link, axis = f"link{number}", [0, 1, 0] if number % 2 else [1, 0, 0]
        builder.body(link, 1.0, center_of_mass=[0, 0, -0.05], inertia=[0.01, 0.01, 0.001])
        hinge = {"axis": axis, "position": [0, 0, -0.1 if number else 0], "damping": 0.1}
        builder.joint(f"hinge{number}", "revolute", last, link, initial={"position": 0.02}, **hinge)
        last = link
    made = eomgen.build(builder.build(), profile="quick")
    return made, made.simulate(0.05, 5e-5, method="rk4", record_every=1000, error_estimate=False).q[-1]


@pytest.mark.long
@pytest.mark.parametrize(("method", "order"), [("rosenbrock", 2), ("tdg2", 5), ("rattlie", 2)])
def test_order_on_a_long_chain(method: str, order: int) -> None:
    made, exact = long_chain()
    counts = (8, 16, 32) if order == 5 else (20, 40, 80)
    ends = [made.simulate(0.05, 0.05 / n, method=method, error_estimate=False).q[-1] for n in counts]
    errors = [np.abs(end - exact).max() for end in ends]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.4 if order == 5 else 0.05)
