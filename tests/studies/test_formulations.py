"""Formulations of one scene: names and groups, one initial state in other coordinates, and runs on a common grid of
times; nothing is compiled."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.errors import EomgenError, NumericalError
from eomgen.lie.product import Factor
from eomgen.products.studies.work_precision import running
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.formulations import (
    Formulations,
    formulations,
    rebuild,
    same_start,
    simplify,
)
from eomgen.products.studies.work_precision.running import Grid, Runner, _shorten_state, per_coarsest
from eomgen.results.finding import NOTE, WARNING
from tests.studies.runs_of_laws import motion

#: A rod on a ball joint, thrown: no constraint in joint coordinates, three rows in absolute ones.
THROWN: dict[str, Any] = {
    "format": 1,
    "name": "thrown_rod",
    "bodies": {"rod": {"mass": 2.0, "inertia": [0.05, 0.06, 0.02]}, "bob": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
    "joints": {
        "ball": {"type": "spherical", "parent": "base", "child": "rod"},
        "pin": {"type": "revolute", "parent": "rod", "child": "bob", "axis": [0, 1, 0]},
    },
}


def test_scenes_have_joint_coordinates_and_absolute_ones_on_two_groups() -> None:
    found = formulations(THROWN, {}, others=True)
    assert list(found.scenes) == ["joint", "SE3", "R3xSO3"] and found.own == "joint" and found.refused == {}
    groups = {name: {scene.groups.get(body, "SE3") for body in ("rod", "bob")} for name, scene in found.scenes.items()}
    assert groups["SE3"] == {"SE3"} and groups["R3xSO3"] == {"R3xSO3"}
    assert {name: scene.coordinates for name, scene in found.scenes.items()} == {
        "joint": "joint", "SE3": "absolute", "R3xSO3": "absolute"
    }  # fmt: skip
    assert found.description.simulation.step == found.scenes["joint"].simulation.step
    assert list(formulations(THROWN, {}, others=False).scenes) == ["joint"]
    mixed = formulations({**THROWN, "coordinates": "absolute", "bodies": {
        **THROWN["bodies"], "bob": {**THROWN["bodies"]["bob"], "group": "R3xSO3"}
    }}, {}, others=True)  # fmt: skip
    assert list(mixed.scenes) == ["absolute, mixed groups", "joint", "SE3", "R3xSO3"]
    given = formulations(eomgen.load(THROWN), {}, others=True)
    assert list(given.scenes) == ["joint"]
    absolute = formulations(eomgen.load(THROWN, coordinates="absolute"), {}, others=True)
    assert list(absolute.scenes) == ["SE3", "R3xSO3"]


def test_beams_are_not_absolute_and_may_be_simpler() -> None:
    bending = {"modes": 5, "shapes": "polynomial", "stiffness": 70.0, "initial": {"position": [0, 0.1, 0, 0, 0]}}
    scene = {
        "format": 1, "name": "mast",
        "beams": {"mast": {
            "length": 2.0, "mass_per_length": 1.0, "order": 2, "bending_y": bending,
            "bending_z": {"modes": 2, "stiffness": 9.0},
        }},
        "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "mast"}},
        "outputs": {"tip": {"formula": "q.mast[1] + 3 * q.mast[5] + q.mast[6] + q.mast[0]"}},
    }  # fmt: skip  # a table
    found = formulations(scene, {}, others=True, fidelity=True)
    names = ("at most 4 modes", "at most 2 modes", "at most 1 mode", "order 1", "no stiffening", "rigid")
    assert list(found.scenes) == ["joint", *(f"joint, {name}" for name in names)]
    assert found.simplified == tuple(list(found.scenes)[1:]) and list(found.refused) == ["absolute"]
    less = dict(simplify(found.scenes["joint"]))
    (beam,) = (body.beam for body in less["at most 1 mode"].bodies)
    assert beam is not None and [item.modes for item in beam.deformations] == [1, 1]
    assert [len(item.initial_position) for item in beam.deformations] == [1, 0]
    texts = {name: str(one.outputs[0]) for name, one in less.items()}
    # the second of five modes is left out, the first of the other direction is number 1 in place of 5
    assert all(text not in texts["at most 1 mode"] for text in ("index=5", "index=6"))
    assert "index=1" in texts["at most 1 mode"] and "index=0" in texts["at most 1 mode"]
    assert "index=2" in texts["at most 2 modes"] and "index=3" in texts["at most 2 modes"]
    assert "mast" not in texts["rigid"] and less["rigid"].bodies[0].beam is None
    (soft,), (first,) = ([body.beam for body in less[name].bodies] for name in ("no stiffening", "order 1"))
    assert soft is not None and first is not None and (soft.stiffening, first.order) == (False, 1)


def test_rebuilt_data_share_what_does_not_change() -> None:
    pair = cast(Any, Fraction(1, 2))
    data = {"a": (1.0, ("x", 2.0)), "b": ("y", pair)}
    assert rebuild(data, lambda value: NotImplemented) is data
    changed = rebuild(data, lambda value: 2.0 * value if isinstance(value, float) else NotImplemented)
    assert changed == {"a": (2.0, ("x", 4.0)), "b": ("y", pair)} and changed["b"] is data["b"]


class Body:
    """A body on a pivot: turned by an angle about y, or absolute; its centre is 2 m from the pivot."""

    def __init__(self, absolute: bool, scale: float = 1.0) -> None:
        self.absolute, self.bodies, self.name, self.scale = absolute, ("rod",), "rod", scale
        self.nv, self.factors = (
            (6, (Factor("SE3", "rod", 0, 7, 0, 6),)) if absolute else (1, (Factor("R", "pin", 0, 1, 0, 1),))
        )
        self.initial_q = [1.0, 0, 0, 0, 0, 0, 0] if absolute else [0.0]

    def pose(self, body: str, q: np.ndarray, t: float, parameters: Any) -> np.ndarray:
        if self.absolute:
            return np.asarray(q, dtype=float)
        turn = Rotation.from_rotvec([0.0, q[0], 0.0])
        place = turn.apply([0.0, 0.0, -2.0 * self.scale]) + np.array([t, 0.0, 0.0])
        return np.concatenate([turn.as_quat(scalar_first=True), place])

    def twist(self, body: str, q: np.ndarray, v: np.ndarray, t: float, parameters: Any) -> np.ndarray:
        if self.absolute:
            return np.asarray(v, dtype=float)
        drift = Rotation.from_rotvec([0.0, q[0], 0.0]).inv().apply([1.0, 0, 0])  # the pivot moves by 1 m/s
        return np.concatenate([[0.0, v[0], 0.0], np.array([-2.0 * self.scale * v[0], 0.0, 0.0]) + drift])


def test_states_of_other_coordinates_have_the_same_poses_and_twists() -> None:
    joint, absolute = cast(Any, Body(False)), cast(Any, Body(True))
    q, v = np.array([0.7]), np.array([-1.5])
    there = same_start(joint, q, v, absolute, 0.3, {"p": 1.0})
    np.testing.assert_allclose(there["q"], joint.pose("rod", q, 0.3, None), atol=1e-12)
    np.testing.assert_allclose(there["v"], joint.twist("rod", q, v, 0.3, None), atol=1e-12)
    back = same_start(absolute, there["q"], there["v"], joint, 0.3, None)
    assert (back["q"], back["v"]) == (pytest.approx(q, abs=1e-12), pytest.approx(v, abs=1e-12))
    with pytest.raises(
        NumericalError, match="rod cannot begin at the start of the scene's own formulation: bodies are"
    ):
        same_start(absolute, there["q"], there["v"], cast(Any, Body(False, 1.0 + 1e-6)), 0.3, None)
    same_start(absolute, there["q"], there["v"], cast(Any, Body(False, 1.0 + 1e-10)), 0.3, None)


def test_states_of_simpler_scenes_are_the_first_components() -> None:
    source: Any = SimpleNamespace(factors=(Factor("R", "a", 0, 3, 0, 3), Factor("R", "b", 3, 1, 3, 1)))
    target: Any = SimpleNamespace(
        factors=(Factor("R", "b", 0, 1, 0, 1), Factor("R", "a", 1, 2, 1, 2), Factor("R", "c", 3, 1, 3, 1)),
        initial_q=[9.0, 9.0, 9.0, 9.0], nv=4,
    )  # fmt: skip
    state = _shorten_state(source, target, {"q": [1.0, 2.0, 3.0, 4.0], "v": [5.0, 6.0, 7.0, 8.0]})
    assert (state["q"].tolist(), state["v"].tolist()) == ([4.0, 1.0, 2.0, 9.0], [8.0, 5.0, 6.0, 0.0])


# -- runs --------------------------------------------------------------------------------------------------------------

GRID = Grid(0.25, 24, start=0.5, coarsest=8, recorded=4)


class Model:
    """A model whose runs have the rows that are asked for; arguments are kept."""

    def __init__(self, **run: Any) -> None:
        self.changes, self.given, self.prepared = run, {}, list[str]()
        self.multipliers, self.nz, self.factors, self.functions = (), 1, (), ("poses", "twists")
        self.library = SimpleNamespace(layout={"defaults": {}, "built_method": "rk4"})

    def stepper(self, name: str) -> None:
        self.prepared.append(name)

    def simulate(self, end: float, step: float, progress: Any = None, **given: Any) -> Any:
        self.given = {"end": end, "step": step, **given}
        if isinstance(fault := self.changes.get("fault"), EomgenError):
            raise fault
        if progress is not None:
            progress(1, 2)
        rows = round((end - given["t_start"]) / (step * given.get("record_every", 1)))
        finding = [SimpleNamespace(severity=severity) for severity in (WARNING, NOTE)]
        return SimpleNamespace(**{
            "t": given["t_start"] + step * given.get("record_every", 1) * np.arange(rows + 1.0), "success": True,
            "stats": {"steps": 8, "wall_time": 1.0, "name": "x"}, "message": "m", "findings": finding[1:],
            "model": None, "q": np.array([[3.0]]), "v": np.array([[4.0]]), "z": np.array([[5.0]]),
        } | self.changes)  # fmt: skip  # a table


@pytest.fixture
def runner(monkeypatch: pytest.MonkeyPatch) -> Runner:
    described = SimpleNamespace(parameters=(), inputs=(), fixed=())
    scenes = Formulations({"joint": None, "SE3": None, "joint, rigid": None}, {}, ("joint, rigid",))
    vars(scenes)["description"] = described
    made = Runner(scenes, GRID)
    monkeypatch.setattr(running, "observe", lambda model, solution: motion(0.0))
    monkeypatch.setattr(running, "RepeatedRun", lambda *given: given)
    made._models["joint", "double", Configuration("", "").profile] = cast(Any, Model())
    return made


def model_of(runner: Runner, name: str = "joint", **run: Any) -> Any:
    runner._models[name, "double", Configuration("", "").profile] = cast(Any, Model(**run))
    return runner.model(name)


#: Steps in rows of 0.25 s, of which a file records every fourth; later rows, and whether all rows are recorded.
RUNS: list[tuple[Mapping[str, Any], float, int, float, float]] = [
    ({"per_row": 1}, 0.25, 4, 0.5, 6.5),
    ({"per_row": 8}, 0.25 / 8, 32, 0.5, 6.5),
    ({"per_row": Fraction(1, 2)}, 0.5, 2, 0.5, 6.5),
    ({"per_row": Fraction(1, 8)}, 2.0, 1, 0.5, 6.5),
    ({"per_row": Fraction(1, 5)}, 1.25, 1, 0.5, 5.5),
    ({"per_row": 2, "dense": True}, 0.125, 2, 0.5, 6.5),
    ({"tolerance": 1e-6}, 1.0, 1, 0.5, 6.5),
    ({"tolerance": 1e-6, "dense": True}, 0.25, 1, 0.5, 6.5),
    ({"per_row": 1, "later": 6}, 0.25, 4, 2.0, 6.0),
]


@pytest.mark.parametrize(("asked", "step", "every", "start", "end"), RUNS)
def test_runs_record_the_rows_of_the_grid_that_the_file_would(
    asked: Mapping[str, Any], step: float, every: int, start: float, end: float, runner: Runner
) -> None:
    method, parameters = ("rk45", {}) if "tolerance" in asked else ("rk4", {"rho_inf": 0.5})
    found = runner.run(Configuration("joint", method, parameters, settings={"rtol": 1e-3}), **asked)
    given = cast(Any, runner.model("joint")).given
    assert (given["step"], given["record_every"], given["t_start"], given["end"]) == pytest.approx(
        (step, every, start, end)
    )
    assert found.ended == "reached" and found.stats == {"steps": 8}
    assert (given["method"], given["settings"], given.get("rho_inf")) == (
        method,
        {"rtol": 1e-3},
        parameters.get("rho_inf"),
    )
    assert given.get("tolerance") == asked.get("tolerance") and given["error_estimate"] is True
    assert found.repeated is not None and found.reference is found.observation


def test_arguments_of_a_run_replace_those_of_the_study(runner: Runner) -> None:
    model = model_of(runner)
    runner.parameters, runner.inputs = {"a": 1.0}, {"u": 2.0}
    runner.run(Configuration("joint", "rk4"), timed=False, estimated=False)
    assert (model.given["parameters"], model.given["inputs"], model.given["error_estimate"]) == (
        {"a": 1.0},
        {"u": 2.0},
        False,
    )
    initial = {"q": np.array([1.0]), "v": np.array([2.0])}
    found = runner.run(
        Configuration("joint", "rk4"), initial=initial, parameters={"a": 3.0}, inputs={"u": 4.0}, timed=False
    )
    assert (model.given["parameters"], model.given["inputs"]) == ({"a": 3.0}, {"u": 4.0})
    assert model.given["initial"] is initial and found.repeated is None and model.given["settings"] is None
    assert model.prepared == ["rk4"] and list(runner.compiled) == [runner.build_name(Configuration("joint", "rk4"))]


@pytest.mark.parametrize(
    ("run", "ended", "said"),
    [
        ({"success": False}, "stopped", "m"),
        ({"t": np.zeros(3)}, "stopped", "its rows are not at the times of the grid, or not finite"),
        ({"fault": EomgenError("no start", "another")}, "refused", "no start"),
    ],
)
def test_runs_that_do_not_reach_the_end(run: dict[str, Any], ended: str, said: str, runner: Runner) -> None:
    model_of(runner, **run)
    found = runner.run(Configuration("joint", "rk4"))
    assert found.ended == ended and said in found.said and found.observation is None is found.reference


def test_limits_warnings_and_common_faults(runner: Runner, monkeypatch: pytest.MonkeyPatch) -> None:
    class Finding(SimpleNamespace):
        def __str__(self) -> str:
            return str(self.text)

    findings = [Finding(severity=WARNING, text="doubtful"), Finding(severity=NOTE, text="noted")]
    alike = SimpleNamespace(alike=lambda: iter(["friction", "more"]))
    model_of(runner, findings=findings, model=alike)
    found = runner.run(Configuration("joint", "rk4"))
    assert (found.said, found.unresolved, found.reference) == ("doubtful", "friction", None)
    assert found.observation is not None
    monkeypatch.setattr(running, "observe", lambda model, solution: motion(np.nan))
    assert runner.run(Configuration("joint", "rk4")).ended == "stopped"
    runner.limit = -1.0
    late = runner.run(Configuration("joint", "rk4"))
    assert (late.ended, late.said) == ("too long", "more than -1 s of computation")


def test_other_formulations_start_where_the_scene_does(runner: Runner, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def start(*given: Any) -> dict[str, Any]:
        asked.append(given)
        return {"q": 1.0, "v": 2.0}

    monkeypatch.setattr(running, "same_start", start)
    monkeypatch.setattr(running, "_shorten_state", lambda source, target, initial: ("short", initial))
    own, other, _ = model_of(runner), model_of(runner, "SE3"), model_of(runner, "joint, rigid")
    initial = {"q": np.array([7.0])}
    runner.run(Configuration("SE3", "rk4"), initial=initial, parameters={"a": 3.0}, inputs={"u": 4.0})
    assert other.given["initial"] == {"q": 1.0, "v": 2.0, "z": 5.0}
    source, q, v, target, t, parameters = asked[0]
    assert (source, target, t, parameters) == (own, other, 0.5, {"a": 3.0}) and (q.tolist(), v.tolist()) == (
        [3.0],
        [4.0],
    )
    h = 1e-6 * GRID.row
    assert own.given == {"end": 0.5 + h, "step": h, "t_start": 0.5, "initial": initial, "parameters": {"a": 3.0},
                         "inputs": {"u": 4.0}, "error_estimate": False}  # fmt: skip
    runner.run(Configuration("SE3", "rk4"), initial=initial, parameters={"a": 3.0})
    assert len(asked) == 1
    runner.run(Configuration("SE3", "rk4"), initial={"q": np.array([8.0])}, parameters={"a": 3.0})
    runner.run(Configuration("SE3", "rk4"), parameters={"a": 3.0}, later=2)
    assert len(asked) == 3 and asked[-1][4] == 1.0
    other.nz = 0
    runner.run(Configuration("SE3", "rk4"))
    assert other.given["initial"] == {"q": 1.0, "v": 2.0}
    assert runner._start("joint, rigid", 0.5, None, None, None) is None
    assert runner._start("joint, rigid", 0.5, initial, None, None) == ("short", initial)
    own.functions = ("poses",)
    assert runner._start("SE3", 9.0, None, None, None) is None


def test_ladders_without_given_steps_are_halved_twelve_times() -> None:
    assert per_coarsest(Grid(1.0, 1), ()) == tuple(2**k for k in range(13))
    assert per_coarsest(Grid(0.02, 1), (0.01, 0.02, 0.01, 0.005)) == (1, 2, 4)
