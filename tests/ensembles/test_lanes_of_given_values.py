"""Parameters, inputs and starts of samples side by side, by a model that has these alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.base.random_inputs import standard_normals
from eomgen.errors import EomgenError
from eomgen.formula.nodes import Symbol
from eomgen.products.ensembles import samples
from eomgen.products.ensembles.samples import LaneRunner, SampleRunner, extremes_of
from eomgen.products.ensembles.variations import Variation, VariedOptions
from eomgen.simulation.option_types import LawOverTime

COMMON = np.array([1.0, 2.0, 3.0, 4.0])
TIMES = np.array([0.0, 0.5, 1.0])


def model(**more: Any) -> Any:
    """Return a model with the parameters a, gust_z1, gust_z2, b, of which a may not be negative."""
    series = SimpleNamespace(name="gust", own_variables=("gust_z1", "gust_z2"))

    def parameter_array(given: Any = None) -> Array:
        values = COMMON if given is None else np.asarray(given)
        if np.any(values[..., 0] < 0.0):
            raise EomgenError("negative")
        return values

    given: dict[str, Any] = {
        "parameters": dict.fromkeys(("a", "gust_z1", "gust_z2", "b"), 0.0), "parameter_array": parameter_array,
        "inputs": ["push", "pull", "gust"], "nq": 1, "nv": 1, "nz": 1, "initial_at": None, "multipliers": (),
        "description": SimpleNamespace(
            inputs=[SimpleNamespace(series=None), SimpleNamespace(series=None), SimpleNamespace(series=series)],
            laws=[SimpleNamespace(formula=Symbol("parameter", "b"))],
        ),
        "library": SimpleNamespace(layout={"left_out": ()}), "initial_q": [0.1], "initial_v": [0.2], "initial_z": [0.3],
        "evaluator": SimpleNamespace(
            formula_inputs=lambda data: np.stack([10.0 * data["t"], data["p"][3] * data["t"], 0.0 * data["t"]], axis=-1)
        ),
    }  # fmt: skip
    return SimpleNamespace(**(given | more))


def runner(made: Any, *items: Variation, common: Any = None, **run: Any) -> LaneRunner:
    given: dict[str, Any] = {"parameters": COMMON, "method": "rk4", "grid": SimpleNamespace(start=0.0)}
    runs: Any = SimpleNamespace(run=SimpleNamespace(**(given | run)), input_times=TIMES, at_rest=False)
    return LaneRunner(made, VariedOptions(made, items, common or {}), runs)


A, SEED = Variation("a", "parameters", 0, ""), Variation("seed.gust", "process", 2, "")
PULL, PLACE, STATE = (Variation(name, block, 0, "") for name, block in (("pull", "inputs"), ("q.x", "q"), ("s", "z")))
START = SimpleNamespace(q=np.array([0.1]), v=np.array([0.2]), z=np.array([0.3]))


def test_parameters_have_varied_values_and_the_variables_of_seeds() -> None:
    found, alone = runner(model(), A, SEED)._parameters(np.array([[5.0, 1.0], [-1.0, 2.0], [6.0, 2.0]]))
    assert alone.tolist() == [False, True, False]
    np.testing.assert_array_equal(found[[0, 2], 0], [5.0, 6.0])
    for row, seed in ((0, 1), (2, 2)):
        np.testing.assert_array_equal(found[row, 1:3], standard_normals(seed, 2, "gust"))
    np.testing.assert_array_equal(found[1], COMMON)  # in place of refused ones
    np.testing.assert_array_equal(found[:, 3], 4.0)


@pytest.mark.parametrize("left_to_stepper", [False, True])
def test_inputs_follow_formulas_values_and_laws(left_to_stepper: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    common = np.array([[1.0, 4.0, 9.0], [6.0, 6.0, 9.0], [11.0, 8.0, 9.0]])
    signals = SimpleNamespace(
        given={"push": None}, formulas=True, left_to_stepper=left_to_stepper, table=lambda times: common.copy()
    )
    law = LawOverTime(lambda t: np.where(t > 0.7, np.nan, 7.0 * t))
    monkeypatch.setattr(
        VariedOptions, "laws", lambda self, values, parameters: {"gust": law} if values[0] == 1.0 else {}
    )
    made = runner(model(), PULL, signals=signals)
    parameters = np.array([COMMON, COMMON, COMMON])
    parameters[1:, 3] = [5.0, 6.0]
    found = made._input_tables(np.array([[0.0], [1.0], [2.0]]), parameters)
    np.testing.assert_array_equal(found[:, :, 0], np.tile([1.0, 6.0, 11.0], (3, 1)))  # push is given
    np.testing.assert_array_equal(found[:, :, 1], np.repeat([[0.0], [1.0], [2.0]], 3, axis=1))  # pull varies
    of_third = [9.0, 9.0, 9.0] if left_to_stepper else [0.0, 0.0, 0.0]
    np.testing.assert_array_equal(found[:, :, 2], [[9.0, 9.0, 9.0], [0.0, 3.5, np.inf], of_third])


def initial(of: Any, common: Any, p: Array, *, asked: bool) -> Any:
    """Return the state at parameters, whose place is a tenth of b; refused for b = 9."""
    if p[3] == 9.0:
        raise EomgenError("no place")
    return SimpleNamespace(q=p[3:] / 10.0 if asked else START.q, v=START.v, z=START.z)


@pytest.mark.parametrize("chooses_steps", [False, True])
def test_blocks_of_lanes_leave_some_samples_to_runs_alone(chooses_steps: bool, tmp_path: Any) -> None:
    """Of eleven samples in groups of four, one is kept, one refused, one has unknown numbers, and one stops."""
    rows = np.arange(5.0)
    count, seen = 11, []

    def tables(values: Array) -> Any:
        seen.append(values[:, 0].tolist())
        columns = np.stack([np.add.outer(values[:, 0], rows), -np.add.outer(values[:, 0], rows)], axis=1)
        number = np.where(values[:, 0] == 8.0, 3, 5)
        columns[values[:, 0] == 8.0, :, 3:] = np.nan
        columns[values[:, 0] == 6.0, 1, 4] = np.nan
        alone = values[:, 0] == 1.0
        return SimpleNamespace(columns=columns, alone=alone, rows=number, ends=np.where(number == 3, 0.5, 1.0))

    lanes: Any = LaneRunner.__new__(LaneRunner)
    lanes.tables = tables
    method = SimpleNamespace(chooses_steps=chooses_steps)
    lanes.runs = SimpleNamespace(together=4, run=SimpleNamespace(method=method), count=2)
    none: Any = None
    work = SampleRunner(
        none, none, none, (0.0, 1.0), ["x", "y"], np.linspace(0.0, 1.0, 5), np.array([0, 2, 4]), none,
        frozenset([103, 50]), folder=tmp_path,
    )  # fmt: skip
    work._made = lanes
    values = np.arange(float(count))[:, np.newaxis]
    reduced, extremes = work.unknown(count)
    assert work._side_by_side(100, values, reduced, extremes) == [1, 3, 6]
    groups = [sorted(group) for group in seen]
    assert groups == [[0.0, 1.0, 2.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0]]
    for k in (0, 2, 4, 5, 7, 9, 10):
        np.testing.assert_array_equal(reduced[k], [[k, k + 2.0, k + 4.0], [-k, -k - 2.0, -k - 4.0]])
        np.testing.assert_array_equal(extremes[k], [[k, k + 4.0, k + 4.0], [-k - 4.0, -k, -k - 4.0]])
    np.testing.assert_array_equal(reduced[8], [[8.0, 10.0, np.nan], [-8.0, -10.0, np.nan]])
    np.testing.assert_array_equal(extremes[8], [[8.0, 10.0, 10.0], [-10.0, -8.0, -10.0]])
    assert np.isnan(reduced[[1, 3, 6]]).all() and np.isnan(extremes[[1, 3, 6]]).all()
    work.stop.set()
    seen.clear()
    assert work._side_by_side(100, values, reduced, extremes) == [3] and not seen


def test_extremes_leave_out_what_is_unknown() -> None:
    table = np.array([[[1.0, np.nan, 3.0], [2.0, 5.0, -1.0]]])
    np.testing.assert_array_equal(extremes_of(table), [[[1.0, 3.0, 3.0], [-1.0, 5.0, -1.0]]])


def test_starts_are_varied_and_meet_their_constraints(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops whose rows may be redundant, and rest, are searched one after the other; the second sample fails."""

    def consistent(of: Any, q: Array, v: Array, t: float, p: Array, starts: Any) -> Any:
        return SimpleNamespace(q=q + 1.0, v=v + 2.0, met=p[:, 0] < 5.5)

    def start_of(self: LaneRunner, p: Array, options: Any, *, changed: bool) -> Array:
        if p[0] > 5.5:
            raise EomgenError("no rest")
        return np.array([p[0], float(changed), options["parameters"]["a"]])

    for name, of in (("initial_state", initial), ("consistent_samples", consistent), ("starts_of", lambda *_: "held")):
        monkeypatch.setattr(samples, name, of)
    monkeypatch.setattr(LaneRunner, "_start_of", start_of)
    values, parameters = np.array([[5.0, 7.0, 8.0], [6.0, 9.0, 3.0]]), np.tile(COMMON, (2, 1))
    parameters[:, 0] = values[:, 0]
    open_chain, loop, own = model(), model(multipliers=("loop",)), [0.1, 0.2, 0.3]
    redundant = model(multipliers=("loop",), library=SimpleNamespace(layout={"left_out": (3,)}))
    placed = np.column_stack([parameters[:, :3], [4.0, 9.0]])
    for made, items, p, rests, expected, refused in (
        (open_chain, (A, PLACE, STATE), parameters, False, [[7.0, 0.2, 8.0], [9.0, 0.2, 3.0]], False),
        (open_chain, (PULL,), parameters, False, [own, own], False),
        (model(initial_at=True), (A,), placed, False, [[0.4, 0.2, 0.3], [0.4, 0.2, 0.3]], True),
        (loop, (A, PLACE), parameters, False, [[8.0, 2.2, 0.3], [10.0, 2.2, 0.3]], True),
        (redundant, (A,), parameters, False, [[5.0, 1.0, 5.0], own], True),
        (open_chain, (A,), parameters, True, [[5.0, 1.0, 5.0], own], True),
    ):
        runs = runner(made, *items)
        runs.runs.at_rest = rests
        starts, failed = runs._starts(values[:, : len(items)], p)
        np.testing.assert_array_equal(starts, expected)
        assert failed.tolist() == [False, refused]
