"""What `info --method` counts is what the generated C does."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

import eomgen
from eomgen.cli import main
from eomgen.integrators.families import rosenbrock
from eomgen.integrators.families.register import method_named, terms_of
from eomgen.integrators.newton.matrix import WEIGHTS
from eomgen.integrators.step_work import _operations_of_groups, work_of_system
from eomgen.integrators.stepper_data import method_data
from eomgen.pipeline import step_operations
from eomgen.pipeline.documents import load
from eomgen.pipeline.pipeline import derive
from tests.integrators.executed import Executed
from tests.models.scenes import PENDULUM_TOML

#: Tests of states, and what functions of the model, on groups and of inputs do.
NOT_ENTERED = ("finite", "rotation_too_large", "note_growth", "prepare", "note_conditions")
#: Tests that end a function early, or begin anew, and hold in a step.
CHOSEN = (
    "!work->whole",
    "!state->damped",
    "work->factored_step != step || (settings->matrix_every && work->steps_left <= 0)",
)


@pytest.mark.slow_except("shear_frame_with_pendulum-tdg2s", "free_spinning_body-tdg1", "pi_servo-corrected_predictor")
@pytest.mark.long_cases("robot_arm-rosenbrock", "active_vehicle-tdg2")
@pytest.mark.parametrize(
    ("name", "method"),
    [
        *(("shear_frame_with_pendulum", method) for method in ("rosenbrock", "corrected_predictor", "tdg1", "tdg2s")),
        *(("free_spinning_body", method) for method in ("lsrt2", "tdg1", "tdg2")),
        *(("pi_servo", method) for method in ("rosenbrock", "corrected_predictor", "tdg1_star", "tdg3")),
        ("active_vehicle", "tdg2"),
        ("robot_arm", "rosenbrock"),
    ],
)
def test_steps_execute_what_is_counted(name: str, method: str, tmp_path: Path) -> None:
    """Every operation of a step, from the text of its C, with loops as often as their bounds say."""
    path, made = f"examples/{name}/scene.toml", method_named(method)
    eomgen.generate(path, tmp_path, method=method)
    (file,) = tmp_path.glob("*_step.c")
    prefix = file.name.removesuffix("_step.c")
    system = made.prepared(derive(load(path), list(method_terms(path, method))))
    data = method_data(made, system)
    on_groups = {kernel["name"] for kernel in data["lie"]["kernels"]}
    eliminated = f"{prefix}_eliminate(work->entries, work->unit, work->factors)"
    text = Executed(file.read_text(encoding="utf-8"), prefix, {*NOT_ENTERED, *on_groups}, (*CHOSEN, eliminated))
    executed, parts = text.of("take_step"), made.work(system, data)
    own = [part for part in parts if not part.of_model and part.what not in on_groups]
    for sign in ("additions", "multiplications", "divisions"):
        assert executed[sign] == sum(part.times * getattr(part, sign) for part in own), sign
    for part in parts:
        if part.what in on_groups or (part.of_model and part.what not in ("inputs", "base")):
            assert executed[part.what] == part.times, part.what


def method_terms(path: str, method: str) -> tuple[str, ...]:
    facts = derive(load(path), []).facts
    return terms_of(method, facts.constraints, facts.internal_states)


def test_info_counts_a_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(PENDULUM_TOML, encoding="utf-8")
    assert main(["info", str(scene), "--method", "rosenbrock", "--json"]) == 0
    step = json.loads(capsys.readouterr().out)["step"]
    assert step["total"]["flops"] == sum(
        part["times"] * (part["additions"] + part["multiplications"]) for part in step["parts"]
    )
    assert [part["times"] for part in step["parts"] if part["what"] in ("residual", "partials")] == [2, 1]
    assert main(["info", str(scene), "--method", "lsrt2"]) == 0
    assert "A step of lsrt2:" in capsys.readouterr().out
    assert main(["info", str(scene), "--method", "tdg3", "--json"]) == 0
    step = json.loads(capsys.readouterr().out)["step"]
    assert [part["times"] for part in step["parts"] if part["what"] in ("residual", "partials")] == [6 * 4, 1]
    for method in ("generalized_alpha", "rattlie", "rk4"):
        assert main(["info", str(scene), "--method", method]) == 2
        assert f"--method: the work of a step of {method} is not counted" in capsys.readouterr().err


@pytest.mark.parametrize("ill_scaled", [False, True])
def test_steps_are_counted_with_the_terms_that_runs_take(ill_scaled: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of scenes whose M loses digits in elimination runs take forward dynamics by articulated bodies, without M."""
    asked: list[object] = []

    def terms(*arguments: object) -> object:
        asked.append(arguments)
        raise StopIteration

    facts = SimpleNamespace(constraints=False, internal_states=True, ill_scaled=ill_scaled)
    monkeypatch.setattr(step_operations, "derive", lambda scene, names: SimpleNamespace(facts=facts))
    monkeypatch.setattr(step_operations, "terms_of", terms)
    with pytest.raises(StopIteration):
        step_operations.operations_of_step(cast(Any, None), "rosenbrock")
    assert asked == [("rosenbrock", False, True, not ill_scaled)]


@pytest.mark.parametrize("size", [1, 2, 3, 6])
def test_operations_of_a_dense_matrix_are_those_of_gaussian_elimination(size: int) -> None:
    """Counted by its loops; entries have one partial of weight one, and none is on the diagonal of the rates."""
    counts = dict.fromkeys(("updates", "factors", "below", "pivots"), 0)
    for pivot in range(size):
        for _ in range(pivot + 1, size):
            counts["factors"] += 1
            counts["updates"] += size - 1 - pivot
        counts["below"] += size - 1 - pivot
        counts["pivots"] += 1
    one = WEIGHTS.index("one")
    solver = {"entries": [{"linear": [(one, 0)]}] * size**2, "rate_diagonal": (), "moved": ()}
    assembly, factors, substitution = work_of_system(solver, size)
    assert (assembly.additions, assembly.multiplications) == (0, 0)
    assert (factors.additions, factors.multiplications) == (counts["updates"], counts["updates"])
    assert factors.divisions == counts["factors"]
    assert substitution.additions == substitution.multiplications == 2 * counts["below"]
    assert substitution.divisions == counts["pivots"]
    other = one + 1 if one + 1 < len(WEIGHTS) else one - 1
    entries = [{"linear": [(one, 0), (other, 1), (other, 2)]}, {"linear": [(other, 0)]}, {"linear": []}]
    more = {"entries": entries, "rate_diagonal": (0, 1), "moved": ([1, 2, 3], [4])}
    assembly, _, _ = work_of_system(more, size)
    assert (assembly.additions, assembly.multiplications) == (2 + 2 + 2, 3 + 4)


@pytest.mark.parametrize("group", [-1, 0])
@pytest.mark.parametrize("size", [1, 4, 7])
def test_operations_without_subtraction_of_full_rows(size: int, group: int) -> None:
    """The loops of ``elimination.c.jinja``: each earlier row changes all columns to its right, and the sum by those of
    the row's own group, or of none; a pivot of a group is that sum minus the entries beside it."""
    distances = [[column - row for column in range(size)] for row in range(size)]
    data = {
        "groups": [group] * size,
        "kind_of": [*range(size)],
        "left": [*range(size)],
        "begin": [size * row for row in range(size + 1)],
        "distance": [step for row in distances for step in row],
    }
    beside = [size - 1 - row for row in range(size)]
    additions = sum(k * (2 * k + 1) for k in beside) + (sum(beside) if group == 0 else 0)
    multiplications = sum(k * (k + 2) for k in beside) + sum(beside) + size
    assert _operations_of_groups(data) == (additions, multiplications)


@pytest.mark.parametrize(("held", "stages"), [(0, 1), (2, 3)])
def test_constraints_add_their_calls_and_one_division_for_each_judged_row(held: int, stages: int) -> None:
    """Rows of velocities: three, of which some hold positions as well; four velocities."""
    method = {"unknowns": {"v": 4, "lam": 3}, "positions_held": held}
    parts = {part.what: part for part in rosenbrock._work_of_rows(method, 5, 6, stages)}
    own = parts.pop("constraints")
    assert all(part.of_model for part in parts.values()) and not own.of_model
    calls = {"jacobian_values": 1, "constraint_velocity": 8} | ({"constraint": 6} if held else {})
    assert {what: part.times for what, part in parts.items()} == calls
    judged = 3 + held
    assert (own.additions, own.multiplications, own.divisions) == (4 * 7 + 3 * stages + judged, 11, 3 + judged)
