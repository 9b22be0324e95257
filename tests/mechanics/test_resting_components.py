"""Components of the base's state that its law keeps at zero cost nothing, and what is left is what it was with them."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.errors import UsageError
from eomgen.integrators.families.register import method_named
from eomgen.integrators.stepper_data import method_data
from eomgen.mechanics.derive import derive
from eomgen.pipeline.pipeline import build
from eomgen.scene.load import from_data
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol
from eomgen.system.system import BASE_SIZE, System

TERMS = [
    "force",
    "base_motion",
    "inverse_dynamics",
    "forward_dynamics",
    "residual",
    "partials",
    "twists",
    "energy",
    "rates",
]
#: Example, its base's components that are not zero, and additions and multiplications with them alone and with all.
SCENES = {
    "spin_up_beam": ((0, 3, 9, 15), {"forward_dynamics": (43, 94), "residual": (46, 97), "energy": (86, 296)}),
    "pendulum_on_shaking_base": ((0, 6, 12, 18), {"forward_dynamics": (3, 5), "residual": (5, 7), "energy": (31, 50)}),
    "double_pendulum_on_shaking_base": (
        (0, 4, 6, 10, 12, 16, 18),
        {"forward_dynamics": (51, 51), "residual": (41, 41), "energy": (102, 110)},
    ),
}


def _scene(name: str) -> dict[str, Any]:
    return tomllib.loads(Path(f"examples/{name}/scene.toml").read_text(encoding="utf-8"))


def _trembling(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scene with a base that moves in all six ways, in those of its own much as before."""
    moved = copy.deepcopy(dict(scene))
    own = moved["base"].get("position", [0, 0, 0])
    moved["base"]["position"] = [f"({law}) + 1e-300 * sin({k + 1} * t)" for k, law in enumerate(own)]
    if "rotation" in moved["base"]:
        moved["base"]["rotation"] += [{"axis": axis, "angle": "1e-300 * sin(t)"} for axis in ([1, 0, 0], [0, 1, 0])]
    return moved


def _values(system: System, name: str, rng: np.random.Generator, t: float) -> np.ndarray:
    point: dict[str, Any] = {"t": t, "p": [parameter.value for parameter in system.parameters]}
    point["base"] = evaluate(system.tape, system.functions["base"].refs, point)
    sizes = {"q": system.nq, "v": system.nv, "a": system.nv, "j": system.nv, "s": system.nv, "u": system.nu}
    point |= {block: rng.uniform(-1.0, 1.0, size) for block, size in sizes.items()}
    point["base_rates"] = evaluate(system.tape, system.functions["base_rates"].refs, point)
    return np.array(evaluate(system.tape, system.functions[name].refs, point), dtype=float)


@pytest.mark.parametrize("name", SCENES)
def test_values_are_those_with_all_components_for_fewer_operations(name: str) -> None:
    moving, budget = SCENES[name]
    scene = _scene(name)
    folded, whole = derive(from_data(scene), TERMS), derive(from_data(_trembling(scene)), TERMS)
    assert folded.base_zeros == tuple(k for k in range(BASE_SIZE) if k not in moving)
    for term in TERMS:
        for t in (0.0, 0.37, 12.0):
            here = _values(folded, term, np.random.default_rng(3), t)
            there = _values(whole, term, np.random.default_rng(3), t)
            np.testing.assert_allclose(here, there, rtol=1e-12, atol=1e-13 * (1.0 + np.abs(there).max()))
    assert {term: folded.counts[term].flops for term in budget} == {term: count for term, (count, _) in budget.items()}
    for term, (count, before) in budget.items():
        assert count <= before <= whole.counts[term].flops, term


@pytest.mark.parametrize("name", SCENES)
def test_no_function_reads_what_is_zero(name: str) -> None:
    system = derive(from_data(_scene(name)))
    read = system.tape.depends_on([ref for function in system.functions.values() for ref in function.refs])
    assert not {InputSymbol("base", k) for k in system.base_zeros} & read


def test_accelerations_that_disturb_linear_models_stay() -> None:
    system = derive(from_data(_scene("spin_up_beam")), ["residual", "linearization"])
    assert set(range(13, 19)).isdisjoint(system.base_zeros)
    assert set(system.base_zeros) <= set(derive(from_data(_scene("spin_up_beam")), ["residual"]).base_zeros)
    (blocks,) = [function.outputs for name, function in system.functions.items() if name == "linearization"]
    [disturbed] = [block for block in blocks if block.name == "E0"]
    assert any(system.tape.value(ref) != 0.0 for ref in disturbed.refs)


def test_callers_cannot_move_the_base_where_it_rests() -> None:
    model = build("examples/spin_up_beam/scene.toml", ["residual", "forward_dynamics", "rates"], profile="quick")
    q, v = model.initial_q, model.initial_v
    base = model.base(1.0)
    same = model.forward_dynamics(q, v, 1.0)
    np.testing.assert_array_equal(model.forward_dynamics(q, v, 1.0, base=base), same)
    base[15] += 0.25
    assert not np.array_equal(model.forward_dynamics(q, v, 1.0, base=base), same)
    base[7] = 0.3
    with pytest.raises(UsageError) as caught:
        model.forward_dynamics(q, v, 1.0, base=base)
    assert str(caught.value) == (
        "usage error: base: component 7 is 0.3, but omega[0] of the base is 0 at all times by the scene's law, and the"
        " equations are without it; try: 0 there, or a law in [base] by which omega[0] changes"
    )
    rates = np.zeros((2, 6))
    rates[1, 5] = -1.5
    nothing = np.zeros(model.nv)
    with pytest.raises(UsageError) as caught:
        model.rates(q, v, nothing, nothing, nothing, 1.0, base=model.base(1.0), base_rates=rates)
    assert "base_rates: component 11 is -1.5, but velocity_dot[2] of the base is 0 at all times" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "read", "functions"),
    [("spin_up_beam", (9, 15), ("sincos",)), ("pendulum_on_shaking_base", (18,), ("COS",))],
)
def test_steps_evaluate_what_equations_read_of_the_base(
    name: str, read: tuple[int, ...], functions: tuple[str, ...]
) -> None:
    """The quaternion of a base that turns is for poses alone: no sine and cosine of half its angle in a step."""
    system = derive(from_data(_scene(name)))
    program = to_program(system, method_data(method_named("rk4"), system, 1e-3))
    assert program.base_read == read
    assert program.base_of_step is not None
    text = str(program.base_of_step.statements)
    assert all(text.count(f"{function!r}") == 1 for function in functions)
    step, outputs = generate_files(program)[f"{name}_step.c"].split(f"\n{name}_status {name}_simulator_outputs(")
    assert outputs.count(f"{name}_base(") == 1  # outputs of the scene may read all components
    assert step.count(f"{name}_base(") == 0
    assert step.count(f"{name}_base_of_step(") == 2


def test_tables_of_the_base_stay_in_the_file_of_the_model() -> None:
    scene = _scene("pendulum_on_shaking_base")
    scene["curves"] = {"shake": {"points": [[0, 0], [1, 0.1], [2, 0.0], [3, 0.1], [100, 0]], "outside": "hold"}}
    scene["base"]["position"] = [0, 0, "shake(t)"]
    system = derive(from_data(scene))
    program = to_program(system, method_data(method_named("rk4"), system, 1e-3))
    assert program.base_read == (18,)
    assert program.base_of_step is None
    step = generate_files(program)[f"{system.name}_step.c"]
    assert f"{system.name}_base(t, &work->base);" in step
    assert "base_of_step" not in step
