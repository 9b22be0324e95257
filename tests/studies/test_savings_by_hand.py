"""Costs of variants of a scene from builds and runs with given sizes and times: sums, medians, turns and faults."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.errors import EomgenError, UsageError
from eomgen.mechanics.derive import derive
from eomgen.pipeline.documents import load
from eomgen.products.studies import savings as measuring
from eomgen.products.studies.savings import (
    FEWEST,
    MOST,
    Savings,
    VariantCost,
    _build_variant,
    _measure_steps,
    _moving_base,
    _tunable,
    savings,
)
from eomgen.scene.load import from_data
from eomgen.symbolic.evaluate import evaluate
from tests.models.library import scene

COSTS = {"residual": 40, "partials": 90, "poses": 7}


class Timed:
    """A model whose steps take a given time, and twice that with rows; its runs are kept."""

    def __init__(self, step: float, fails: str = "", iterations: float = 0.0) -> None:
        self.step, self.fails, self.iterations, self.made = step, fails, iterations, list[tuple[int, int]]()
        self.terms, self.finished = ("residual",), False

    def finish_compilation(self) -> None:
        self.finished = True

    def simulate(self, end: float, step: float, record_every: int, error_estimate: bool) -> Any:
        assert not error_estimate
        count = round(end / step)
        self.made.append((count, record_every))
        if self.fails == "raises":
            raise EomgenError("no start")
        stats = {"wall_time": self.step * count, "steps": count}
        if self.iterations:
            stats["newton_iterations"] = self.iterations * count
        alike = [SimpleNamespace()] if self.fails == "doubtful" else []
        return SimpleNamespace(
            success=self.fails not in ("stops",), message="stopped", stats=stats,
            model=SimpleNamespace(alike=lambda: iter(["friction"] * len(alike))),
        )  # fmt: skip


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """Each look at the clock is 0.5 s later."""
    made = SimpleNamespace(now=0.0)

    def look() -> float:
        made.now += 0.5
        return float(made.now)

    monkeypatch.setattr(measuring, "time", SimpleNamespace(perf_counter=look))
    yield made


def test_runs_take_turns_and_medians_count() -> None:
    fast, slow, none = Timed(1e-5, iterations=2.5), Timed(1e-3), VariantCost("none", "", problem="refused")
    measured: Any = [(VariantCost("fast", ""), fast), (none, None), (VariantCost("slow", ""), slow)]
    costs = _measure_steps(measured, 0.01, 60.0, 3)
    assert costs[1] == none
    # 0.05 s of steps of 10 us, and at least 200 steps of 1 ms
    assert fast.made == [(FEWEST, FEWEST), *[(5000, 5000), (5000, 1)] * 3]
    assert slow.made == [(FEWEST, FEWEST), *[(FEWEST, FEWEST), (FEWEST, 1)] * 3]
    assert (costs[0].step_seconds, costs[2].step_seconds) == (pytest.approx(1e-5), pytest.approx(1e-3))
    assert costs[0].step_quartiles == pytest.approx((1e-5, 1e-5))
    assert (costs[0].iterations, costs[2].iterations) == (2.5, None)
    assert costs[0].observed_seconds == pytest.approx(0.5 / 5000) and costs[2].observed_seconds == 0.5 / FEWEST
    assert costs[0].observed_quartiles == pytest.approx((1e-4, 1e-4))
    single = _measure_steps(measured[:1], 0.01, 60.0, 1)[0]
    assert single.step_quartiles is None is single.observed_quartiles and single.step_seconds == pytest.approx(1e-5)


@pytest.mark.parametrize(
    ("step", "duration", "count"), [(1e-12, 1e6, MOST), (1e-5, 2.0, 200), (1e-5, 0.5, 50), (1.0, 5e-3, 1)]
)
def test_runs_are_neither_too_long_nor_longer_than_the_scenes(step: float, duration: float, count: int) -> None:
    model = Timed(step)
    _measure_steps(cast(Any, [(VariantCost("a", ""), model)]), 0.01, duration, 1)
    assert model.made[1:] == [(count, count), (count, 1)]
    assert model.made[0] == (min(FEWEST, max(1, int(duration / 0.01))),) * 2


def test_runs_that_fail_are_problems_of_their_variant() -> None:
    models = [Timed(1e-3, fails) for fails in ("raises", "stops", "")]
    costs = _measure_steps(cast(Any, [(VariantCost(str(k), ""), one) for k, one in enumerate(models)]), 0.01, 9.0, 2)
    assert ["no start" in costs[0].problem, costs[1].problem, costs[2].problem] == [True, "stopped", ""]
    assert [len(model.made) for model in models] == [1, 1, 5]
    assert costs[0].step_seconds is None is costs[1].step_seconds


def test_ctrl_c_keeps_the_rounds_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Timed(1e-3)
    own = model.simulate

    def stopped(*given: Any, **more: Any) -> Any:
        if len(model.made) == 4:
            raise KeyboardInterrupt
        return own(*given, **more)

    model.simulate = stopped  # type: ignore[method-assign]
    (cost,) = _measure_steps(cast(Any, [(VariantCost("a", ""), model)]), 0.01, 60.0, 3)
    assert cost.step_seconds == pytest.approx(1e-3) and cost.observed_seconds == 0.5 / FEWEST
    assert cost.step_quartiles == pytest.approx((1e-3, 1e-3)) and cost.observed_quartiles is None


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Builds by the content of scenes; each has two files of C, and two that all scenes have."""
    made: dict[str, Any] = {"models": {}, "asked": []}

    def build_in(cache: Path, scene: Any, terms: Any, method: str, profile: str, start: str = "") -> Any:
        made["asked"].append((cache.name, scene.content[-9:], terms, method, profile, start))
        name = scene.content.partition(b"\0")[2].decode()
        if scene.coordinates == "absolute":
            raise EomgenError("no such build")
        return made["models"].setdefault(name, Timed(2e-3 if name else 1e-3))

    def generate(scene: Any, folder: Path, terms: Any, method: str) -> list[Path]:
        folder.mkdir(parents=True)
        sizes = {"model.c": 100, "model.h": 20, "eomgen_real.h": 1000, "main.c": 2000, "notes.txt": 500}
        for name, size in sizes.items():
            (folder / name).write_bytes(b"x" * size)
        return sorted(folder.iterdir())

    monkeypatch.setattr(measuring, "build_in", build_in)
    monkeypatch.setattr(measuring, "generate", generate)
    counts = {name: SimpleNamespace(flops=flops) for name, flops in COSTS.items()}
    monkeypatch.setattr(
        measuring, "derive", lambda scene, terms: SimpleNamespace(counts=counts, of=(scene.content, *(terms or ())))
    )
    monkeypatch.setattr(measuring, "terms_of_step", lambda scene, method: ("residual", "partials", "outside"))
    return made


def test_costs_of_a_build_are_operations_bytes_and_seconds(builds: dict[str, Any], tmp_path: Path) -> None:
    document = from_data(scene("pendulum"))
    variant = measuring.Variant("a run", "words", document, ("residual",), "initial")
    cost, model = _build_variant(variant, "rk4", tmp_path, "quick")
    assert (cost.name, cost.what, cost.operations, cost.problem) == ("a run", "words", COSTS, "")
    assert (cost.step_operations, cost.c_bytes, cost.build_seconds) == (130, 120, 0.5)
    assert builds["models"][""].finished
    assert model is builds["models"][""] and builds["asked"][0][2:] == (["residual"], "rk4", "quick", "initial")
    none, model = _build_variant(measuring.Variant("b", "c", None, problem="why"), "rk4", tmp_path, "quick")
    assert (none.problem, none.what, none.operations, model) == ("why", "c", {}, None)


def test_a_study_has_the_variants_that_are_asked_for(builds: dict[str, Any]) -> None:
    document, seen = from_data(scene("pendulum")), list[tuple[int, int, str]]()
    only = ["tunable", "terms of a step", "absolute"]
    found = savings(document, method="rk4", rounds=2, only=only, progress=lambda *work: seen.append(work))
    names = ["as asked", "terms of a step", "tunable", "absolute"]
    assert [cost.name for cost in found.costs] == names and seen == [(k, 4, name) for k, name in enumerate(names)]
    assert (found.scene, found.method, found.step, found.doubt) == ("pendulum", "rk4", 0.01, "")
    assert [one[2] for one in builds["asked"]] == [["residual"], None, ["residual", "partials", "outside"], None, None]
    asked, _, tunable, absolute = found.costs
    assert asked.step_seconds == pytest.approx(1e-3) and found.ratio(tunable, "step_seconds") == pytest.approx(2.0)
    assert found.ratio(tunable, "c_bytes") == 1.0 and found.ratio(absolute, "c_bytes") is None
    assert "no such build" in absolute.problem and absolute.step_seconds is None
    runs = builds["models"][""].made
    assert runs[-1] == (100, 1)  # of the whole scene, for its doubts


def test_interrupted_builds_and_scenes_without_costs(builds: dict[str, Any]) -> None:
    document = from_data(scene("pendulum"))

    def stop(done: int, every: int, name: str) -> None:
        if done == 2:
            raise KeyboardInterrupt

    found = savings(document, rounds=1, only=["terms of a step", "tunable", "moving base"], progress=stop)
    assert found.interrupted and [cost.problem for cost in found.costs] == [
        "",
        "",
        *["interrupted before it was built"] * 2,
    ]
    with pytest.raises(KeyboardInterrupt):
        savings(document, progress=lambda done, *_: (_ for _ in ()).throw(KeyboardInterrupt))
    builds["models"][""] = Timed(1e-3, "doubtful")
    assert savings(document, rounds=1, only=["a run"]).doubt == "friction"
    builds["models"][""] = Timed(1e-3, "stops")
    with pytest.raises(UsageError, match="the scene as it is asked cannot be measured: stopped; try: another method"):
        savings(document, rounds=1, only=["a run"])
    for wrong, told in (
        ({"rounds": 0}, "rounds: a whole number"),
        ({"only": ["moving"]}, "no variant is called moving"),
    ):
        with pytest.raises(UsageError, match=told):
            savings(document, **cast(Any, wrong))


def test_tunable_numbers_and_a_trembling_base_keep_the_motion() -> None:
    """Residuals of a scene, of its tunable variant, and on a base that trembles by 1e-100 m are equal."""
    plain = from_data(scene("pendulum", joints__hinge__damping=0.3, joints__hinge__stiffness=2.0))
    state = {"q": np.array([0.4]), "v": np.array([-0.7]), "a": np.array([1.1]), "t": np.array([0.2]), "u": np.zeros(0)}
    residuals = []
    for one in (plain, _tunable(plain), _moving_base(plain)):
        system = derive(one, ("residual",))
        blocks = state | {"p": np.array([parameter.value for parameter in one.parameters])}
        if "base" in system.functions:
            blocks["base"] = evaluate(system.tape, system.functions["base"].refs, blocks)
            assert 0.0 < np.abs(blocks["base"][7:]).max() < 1e-97 and np.count_nonzero(blocks["base"][7:]) >= 6
        residuals.append(float(evaluate(system.tape, system.functions["residual"].refs, blocks)[0]))
    assert residuals == pytest.approx([residuals[0]] * 3, rel=1e-14)
    tunable = _tunable(plain)
    values = sorted(parameter.value for parameter in tunable.parameters)
    # mass, centre of mass, three moments of inertia, axis, damping, stiffness, gravity
    assert values == sorted([1.0, -0.5, 0.1, 0.1, 0.01, 1.0, 0.3, 2.0, -9.81]) or {1.0, -0.5, 0.3, 2.0} <= set(values)
    assert all(parameter.tunable for parameter in tunable.parameters)
    again = _moving_base(replace(plain, base=_moving_base(plain).base))
    assert again.base is not None and len(again.base.rotations) == 6


def test_numbers_of_beams_stay_fixed() -> None:
    beam = load("examples/spin_up_beam/scene.toml")
    made = _tunable(beam)
    assert [body.beam for body in made.bodies] == [body.beam for body in beam.bodies]
    assert made.parameters[: len(beam.parameters)] == beam.parameters


def test_files_have_all_costs_with_quartiles_and_ratios(tmp_path: Path) -> None:
    asked = VariantCost("as asked", "", {"a": 1}, 10, 1000, 2.0, 1e-6, 4e-6, (0.9e-6, 1.1e-6), (3e-6, 5e-6), 2.0)
    more = VariantCost("more", "", {"a": 3}, 30, 1500, 3.0, 3e-6, 4.5e-6, (2.9e-6, 3.1e-6), (4e-6, 6e-6), None, "odd")
    study = Savings("scene", "rk4", 1e-3, (asked, more, VariantCost("none", "", problem="refused")))
    table, data = study.write(tmp_path)
    rows = list(csv.DictReader(table.open(encoding="utf-8")))
    ratios = [float(rows[1][f"{key}_ratio"]) for key in ("step_operations", "c_bytes", "build_seconds", "step_seconds")]
    assert ratios == pytest.approx([3.0, 1.5, 1.5, 3.0]) and rows[1]["observed_seconds_ratio"] == ""  # they overlap
    names = [f"{key}_{part}_quartile" for key in ("step_seconds", "observed_seconds") for part in ("first", "third")]
    assert [float(rows[1][name]) for name in names] == [2.9e-6, 3.1e-6, 4e-6, 6e-6]
    assert [rows[2][name] for name in (*names, "c_bytes", "iterations")] == [""] * 6 and rows[2]["problem"] == "refused"
    assert (rows[0]["iterations"], rows[1]["iterations"], rows[1]["problem"]) == ("2.0", "", "odd")
    assert json.loads(data.read_text(encoding="utf-8"))["variants"][1]["ratios"]["c_bytes"] == 1.5
    assert not study.interrupted
    free = replace(asked, step_operations=0)
    assert replace(study, costs=(free, more)).ratio(more, "step_operations") is None
