"""Products on scenes with contacts: one of bristles, one of a brush and one of a tyre's file."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen
from eomgen.products.contacts.info import INFO
from eomgen.products.ensembles.samples import SampleRunner
from tests.contacts.pairs import scene_of
from tests.contacts.states import OWN
from tests.fmu.importers import columns, recorded, run, written
from tests.fmu.test_every_example import library_of, unpacked
from tests.gpu.host import Pair, same_bits
from tests.optimisers.test_casadi import derivatives
from tests.oracles.evaluation import Array
from tests.pages.test_live_pages import in_node, numbers

TEXT = """format = 1
name = "{name}"
gravity = [0, 0, -9.81]
parameters.grip = {{ value = 0.8, tunable = true }}
bodies.body = {{ mass = 20, inertia = [0.6, 1.1, 0.6] }}
[joints.free]
type = "free"
parent = "base"
child = "body"
initial = {{ position = [0, 0, {height}], velocity = {velocity} }}
[contacts.road]
first = {{ body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }}
second = {{ body = "body"{axis} }}
{laws}
[outputs]
seen = {{ formula = ["normal_force.road", "friction_force_x.road", "friction_force_y.road", "gap.road"] }}
[simulation]
method = "rk4"
step = 1e-4
duration = 0.05
"""
WHEEL = {"height": 0.309, "velocity": "[0, 30, 0, 10, 0.3, 0]", "axis": ", axis = [0, 1, 0]"}
NORMAL = 'normal = { type = "linear", stiffness = 1e5, damping = 300 }'
SCENES = {
    "bristles": {
        "height": 0.2005,
        "velocity": "[0, 4, 0, 0.5, 0.1, 0]",
        "axis": "",
        "laws": f'shape = "sphere"\nradius = 0.2\n{NORMAL}\ntangential = {{ type = "bristles", friction = "grip" }}',
    },
    "brush": {
        **WHEEL,
        "laws": f'shape = "disc"\nradius = 0.31\n{NORMAL}\n'
        'tangential = { type = "brush", coefficients = { STIFFNESS = 15, FRICTION = "grip" } }',
    },
    "magic_formula": {
        **WHEEL,
        "laws": f'shape = "disc"\n'
        f'tangential = {{ type = "magic_formula", file = "{OWN.as_posix()}", coefficients = {{ LMUX = "grip" }} }}',
    },
}
in_turn = pytest.mark.parametrize("name", SCENES)
#: Bristles are in the tier above.
long_others = pytest.mark.long_except("bristles")


@cache
def scene_by(name: str) -> eomgen.Scene:
    return scene_of(TEXT.format(name=name, **SCENES[name]))


@cache
def model_of(name: str, profile: str = "quick") -> eomgen.Model:
    return eomgen.build(scene_by(name), profile=profile)


def states(model: eomgen.Model) -> list[dict[str, Array]]:
    """Return states in the air, at the gap 0, at rest in the road, and of the start."""
    start = model.start(step=1e-4)
    first = {"q": np.array(start.q), "v": np.array(start.v)}
    radius = float(first["q"][6]) + (-5e-4 if model.name == "bristles" else 1e-3)
    result = [first]
    for height in (radius + 0.01, radius, radius - 1e-3):
        result.append({"q": np.array([1.0, 0, 0, 0, 0, 0, height]), "v": np.zeros(6)})
    return [{**state, "z": np.zeros(2)} for state in result]


@pytest.mark.slow
@long_others
@in_turn
def test_functions_for_casadi_are_finite_at_the_edges_and_of_the_model(name: str) -> None:
    """First and second derivatives in the air, at the gap 0, in a standing and in a moving contact."""
    model = model_of(name)
    function = eomgen.casadi(model, profile="quick")["forward_dynamics"]
    for state in states(model):
        blocks = {**state, "p": model.parameter_array(), "t": np.zeros(1)}
        point = [blocks[block] for block in function.name_in()]
        jacobian, hessian = derivatives(function, point, np.linspace(-1.0, 1.0, 6))
        assert np.isfinite(jacobian).all() and np.isfinite(hessian).all()
        value = model.forward_dynamics(**state)
        np.testing.assert_allclose(np.array(function(*point)).ravel(), value, rtol=1e-13, atol=1e-12)
    assert isinstance(function, ca.Function) and np.abs(value[5]) > 0.1


@pytest.mark.slow
@long_others
@in_turn
def test_functions_for_jax_have_the_values_and_slopes_of_the_model(name: str) -> None:
    jax = import_module("jax")
    jax.config.update("jax_enable_x64", True)
    model = model_of(name)
    functions = eomgen.jax(model)
    for state in states(model):
        q, v, z = (np.array(state[block]) for block in ("q", "v", "z"))
        assert np.array_equal(functions.forward_dynamics(q, v, z=z), model.forward_dynamics(q, v, z=z))
    state = states(model)[0]
    q, v = state["q"], state["v"]
    slope = jax.jacfwd(lambda v: functions.forward_dynamics(q, v, z=state["z"]))(v)
    step = 1e-6 * np.eye(6)
    both = [model.forward_dynamics(q, v + sign * step, z=state["z"]) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(slope, (both[0] - both[1]).T / 2e-6, rtol=1e-5, atol=1e-4)


@pytest.mark.slow
@long_others
@in_turn
def test_derivatives_of_runs_are_differences_of_runs(name: str) -> None:
    model, options = model_of(name), {"t_end": 0.02, "step": 2e-5, "method": "trapezoidal"}
    found = model.sensitivities(**options)
    ends = [model.simulate(**options, parameters={"grip": 0.8 + change})["seen"][-1] for change in (1e-4, -1e-4)]
    difference = (ends[0] - ends[1]) / 2e-4
    assert np.abs(difference[1:3]).max() > 0.1
    scale = np.abs(difference).max()
    np.testing.assert_allclose(found.derivatives["seen"][-1, :, 0], difference, rtol=1e-4, atol=1e-5 * scale)


@pytest.mark.slow
@long_others
@in_turn
def test_lanes_have_the_bits_of_single_runs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model, used = model_of(name, "reproducible"), list[Any]()
    block = SampleRunner.block

    def watched(self: SampleRunner, first: int, count: int) -> object:
        used.append(self.lanes)
        return block(self, first, count)

    monkeypatch.setattr(SampleRunner, "block", watched)
    options: Any = {"vary": {"grip": "uniform(0.5, 1)"}, "samples": 9, "columns": ["output.seen[0]", "output.seen[1]"]}
    beside = model.simulate_many(0.02, 1e-4, **options)
    assert used and not any(isinstance(item, str) for item in used), used
    monkeypatch.setenv("EOMGEN_LANES", "off")
    alone = model.simulate_many(0.02, 1e-4, **options)
    for column in beside.columns:
        assert np.ptp(beside.mean(column)) > 0.0
        np.testing.assert_array_equal(beside.mean(column), alone.mean(column))


@pytest.mark.slow
@pytest.mark.long_except("bristles-2")
@pytest.mark.parametrize("version", [2, 3])
@in_turn
def test_fmus_run_in_both_kinds(name: str, version: int) -> None:
    """The C compiles without warnings; co-simulation has the bits of ``simulate``."""
    folder = library_of(unpacked(written(scene_by(name), version, binary=False)), version)
    solution = model_of(name).simulate(0.01, 1e-4, error_estimate=False)
    known = columns(solution, recorded(folder))
    assert {"seen[0]", "seen[1]"} <= known.keys()
    rows = run(folder, "CoSimulation", 0.01, 1e-4)
    for column, values in known.items():
        assert np.array_equal(rows[column][: len(values)], values), column
    rows = run(folder, "ModelExchange", 0.01, 1e-4, relative_tolerance=1e-9)
    for column, values in known.items():
        size = np.abs(values).max()
        np.testing.assert_allclose(rows[column][len(values) - 1], values[-1], rtol=1e-4, atol=2e-4 * size)


@pytest.mark.slow
@long_others
@in_turn
def test_live_pages_have_the_digits_of_the_run(name: str, tmp_path: Path) -> None:
    model = model_of(name, "reproducible")
    solution = model.simulate(0.05)
    page = model.live(tmp_path / "page.html", solution=solution)
    told = in_node(page, 0.05)
    assert (told["fault"], told["status"]) == ("", 0)
    expected = np.concatenate([[solution.t[-1]], solution.q[-1], solution.v[-1], solution.a[-1]])
    np.testing.assert_array_equal(numbers(told["row"])[: len(expected)], expected)
    np.testing.assert_array_equal(numbers(told["outputs"]), solution["seen"][-1])


@pytest.mark.slow
@long_others
@in_turn
def test_the_text_for_a_card_has_the_bits_of_the_c(name: str, tmp_path: Path, rng: np.random.Generator) -> None:
    """Compiled by g++ for the host."""
    pair = Pair(scene_by(name), tmp_path, method="rk4", level="-O0")
    for term, kernel in pair.kernels.items():
        inputs = pair.inputs(kernel, rng, 3)
        made = pair.by_kernel(term, inputs, ["rows"], "rows")
        assert all(map(same_bits, pair.by_c(kernel, inputs), made)), term
    (status, rows, values), (other_status, other_rows, other_values) = pair.runs(20)
    assert (other_status, other_rows) == (status, rows) and rows > 0 and same_bits(values, other_values)


@in_turn
def test_pictures_and_texts_show_the_contact(name: str, tmp_path: Path) -> None:
    """The shape of the body, the ground, and the laws in the table of ``eomgen info``."""
    model = model_of(name)
    drawing = model.description.drawing
    assert [(shape.body, shape.kind) for shape in drawing.shapes] == [
        ("body", "sphere" if name == "bristles" else "wheel")
    ]
    assert len(drawing.ground) == 3
    solution = model.simulate(0.01, 1e-4, error_estimate=False)
    page = solution.animate(tmp_path / "page.html")
    assert '"wheel"' in page.read_text(encoding="utf-8") or name == "bristles"
    table = {"name": "road", "of": "body", "on": "plane of base", "tangential": name}
    assert INFO.describe(scene_by(name))["contacts"][0].items() >= table.items()
