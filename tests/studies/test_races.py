"""Races of methods whose errors and times follow laws, against the cheapest steps that a search one by one finds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import islice
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.errors import ModelError, NumericalError
from eomgen.products.studies.run_commands import _print_tuned
from eomgen.products.studies.tuning import judge as judging
from eomgen.products.studies.tuning.judge import Condition, Demand, conditions
from eomgen.products.studies.tuning.race import DEARER, MARGIN, Contender, Race, RaceEntries, RaceRun
from eomgen.products.studies.tuning.tune import _rivals, _Tuning
from eomgen.products.studies.work_precision.axes import Configuration, candidates
from eomgen.products.studies.work_precision.running import Grid
from tests.studies.runs_of_laws import Law, LawRunner, cheapest, model_of, motion

GRID = Grid(0.01, 100, coarsest=16, recorded=1)
#: Methods of two families with fixed steps, and one that chooses its steps.
LAWS = {"rk4": Law(1.0, 4, 4e-6), "generalized_alpha": Law(1e-3, 2, 1e-6), "rk45": Law(30.0, 5, 2e-5)}
#: A motion that is known better than any demand of these tests.
EXACT = Law(1e-9, 6, 1e-3)


def law_of(laws: Mapping[str, Law | str | None] = LAWS) -> Callable[[Configuration], Law | str | None]:
    return lambda configuration: laws.get(configuration.method)


def race_of(runner: LawRunner, demand: float) -> Race:
    judge: Any = SimpleNamespace(runner=runner, error=lambda observation, condition=None: observation.q[-1, 0] - 1.0)
    return Race(judge, demand, lambda _: None)


def contenders_of(runner: LawRunner, *methods: str) -> list[Contender]:
    entries = entries_of(race_of(runner, 1e-4), *methods)
    return [entries._contender(one, one.configuration({})) for one in entries.own]


def entries_of(race: Race, *methods: str, others: tuple[str, ...] = (), axes: tuple[str, ...] = ()) -> RaceEntries:
    runner = cast(Any, race.judge.runner)
    own = candidates("joint", runner.model("joint"), methods, {})
    defaults = runner.formulations.description.simulation
    return RaceEntries(race, own, others, axes, methods, replace(defaults, step=0.01))


@pytest.mark.parametrize("demand", [1e-2, 1e-4, 1e-6, 1e-8])
def test_the_cheapest_steps_that_meet_a_demand_win(demand: float) -> None:
    runner = LawRunner(law_of(), GRID)
    race = race_of(runner, demand)
    winner = race.run(contenders_of(runner, "rk4", "generalized_alpha"))
    found = {name: cheapest(LAWS[name], GRID.rows, demand, 16) for name in ("rk4", "generalized_alpha")}
    best = min(found, key=lambda name: found[name][1])
    assert winner is not None and winner.configuration.method == best
    run = winner.best(demand)
    assert run is not None and run.error <= demand and run.error == run.own
    resolution, seconds = cheapest(LAWS[best], GRID.rows, MARGIN * demand, 16)
    assert found[best][1] <= run.seconds <= seconds and run.resolution <= resolution
    assert run.steps == pytest.approx(GRID.rows * run.resolution) and run.seconds == pytest.approx(
        LAWS[best].step * run.steps
    )
    assert race.runs <= 8 and len(runner.made) == race.runs
    met = [run.error <= demand for contender in race.entered for run in contender.runs]
    # after a first time three times; of runs that meet the demand nine
    assert sorted(repeated.taken for repeated in runner.repeated if repeated.time < 2e-3) == sorted(
        10 if one else 4
        for one, run in zip(met, (run for contender in race.entered for run in contender.runs), strict=True)
        if run.seconds < 2e-3
    )
    assert all(given == {"estimated": False} for *_, given in runner.made)
    assert [contender.configuration.method for contender in race.entered] == ["rk4", "generalized_alpha"]


def test_what_promises_more_than_the_best_is_not_run_again() -> None:
    runner, demand = LawRunner(law_of(), GRID), 1e-10
    race = race_of(runner, demand)
    rk4, alpha = contenders_of(runner, "rk4", "generalized_alpha")
    assert race.run([rk4, alpha]) is rk4
    assert alpha.best(demand) is None and alpha.predict_seconds(demand) > rk4.seconds(demand)
    (dear,) = contenders_of(runner, "generalized_alpha")
    assert race.run([dear], best=1e-9) is None and len(dear.runs) == 1  # its first run costs more already


def test_tolerances_are_lowered_until_a_demand_is_met() -> None:
    runner = LawRunner(law_of(), GRID)
    for demand in (1e-3, 1e-6):
        race = race_of(runner, demand)
        (contender,) = contenders_of(runner, "rk45")
        contender.start = 1e1
        assert contender.kind == "tolerance" and race.run([contender]) is contender
        run = contender.best(demand)
        assert run is not None
        assert demand / 30.0 * MARGIN == pytest.approx(1.0 / run.resolution, rel=1e-6)  # the error is 30 tolerances
        assert contender.how(run) == {"configuration": contender.configuration, "tolerance": 1.0 / run.resolution}


def test_refused_runs_and_builds_that_fail_leave_the_race_with_their_reason() -> None:
    runner = LawRunner(law_of({"rk4": None, "generalized_alpha": "no such build"}), GRID)
    race = race_of(runner, 1e-4)
    contenders = contenders_of(runner, "rk4", "generalized_alpha")
    assert race.run(contenders) is None and all(contender.closed for contender in contenders)
    assert race.left_out == {"rk4, joint": "rk4 is refused", "generalized_alpha, joint": "no such build"}
    assert [run.error for run in contenders[0].runs] == [math.inf] and not contenders[1].runs


def test_a_run_counts_if_it_meets_the_demand_under_all_conditions_of_the_training() -> None:
    """Errors are three times as large from other starts: steps are refined by the fourth root of it."""
    runner = LawRunner(law_of(), GRID, harder=lambda start: 3.0)
    race = race_of(runner, 1e-6)
    cast(Any, race.judge).reference = lambda condition: SimpleNamespace(
        observation=SimpleNamespace(q=[condition.arguments["initial"]["q"]], v=[0.0])
    )
    cast(Any, race.judge).error = lambda one, condition=None: one.q[-1, 0] - one.q[0, 0] - 1.0
    race.training = [Condition(f"{k}", {"initial": {"q": np.array([0.1 * k])}}) for k in (1, 2)]
    winner = race.run(contenders_of(runner, "rk4"))
    run = None if winner is None else winner.best(1e-6)
    assert run is not None and run.conditions == 2
    assert run.error == pytest.approx(3.0 * run.own) and run.error <= 1e-6
    assert run.resolution <= 1.1 * cheapest(LAWS["rk4"], GRID.rows, MARGIN * 1e-6 / 3.0, 16)[0]
    trained = [given for *_, given in runner.made if "initial" in given]
    assert {float(given["initial"]["q"][0]) for given in trained} == {0.1, 0.2}
    assert all((given["timed"], given["estimated"]) == (False, False) for given in trained)


def test_relatives_and_settings_of_the_best_race_from_its_steps_on() -> None:
    """rho_inf 0.9 has a quarter of the error of 0.8, and single precision half of the time of a step."""

    def law(configuration: Configuration) -> Law:
        size = 1e-3 * (0.25 if configuration.parameters.get("rho_inf") == 0.9 else 1.0)
        return Law(size, 2, 1e-6 * (0.5 if configuration.real == "float" else 1.0))

    runner = LawRunner(law, GRID)
    race = race_of(runner, 1e-6)
    entries = entries_of(race, "generalized_alpha", axes=("parameters", "policy", "arithmetic"))
    contenders = entries.run_race()
    best = min(contenders, key=lambda one: one.seconds(1e-6))
    assert best.configuration.parameters == {"rho_inf": 0.9}
    raced = [one.configuration for one in contenders]
    assert {one.parameters.get("rho_inf") for one in raced} == {0.0, 0.5, 0.8, 0.9, 1.0}
    assert {one.policy for one in raced} == {"", "rtol 1e-08", "rtol 1e-06", "rtol 0.0001", "factors at every step"}
    assert all(one.parameters == {"rho_inf": 0.9} for one in raced if one.policy)
    assert not any(one.real == "float" for one in raced)  # for smaller demands than 1e-5
    assert len({one.key for one in raced}) == len(raced)
    near = [one for one in contenders[1:] if one.kind == contenders[0].kind]
    first = contenders[0].best(1e-6)
    assert first is not None and near and all(one.start >= 0.5 * first.resolution for one in near)
    single = entries_of(race_of(runner, 1e-4), "generalized_alpha", axes=("arithmetic",)).run_race()
    assert min(single, key=lambda one: one.seconds(1e-4)).configuration.real == "float" and len(single) == 2
    alone = entries_of(race_of(runner, 1e-4), "generalized_alpha").run_race()
    assert len(alone) == 1


@pytest.mark.parametrize(("ratio", "raced"), [(0.9 * DEARER, ["SE3", "R3xSO3"]), (1.1 * DEARER, ["SE3"])])
def test_formulations_race_until_their_steps_are_much_dearer(ratio: float, raced: list[str]) -> None:
    def law(configuration: Configuration) -> Law:
        return replace(LAWS["rk4"], step=4e-6 * (1.0 if configuration.formulation == "joint" else ratio))

    runner = LawRunner(law, GRID, scenes=("joint", "SE3", "R3xSO3"))
    race = race_of(runner, 1e-6)
    contenders = entries_of(race, "rk4", others=("SE3", "R3xSO3")).run_race()
    assert [one.configuration.formulation for one in contenders] == ["joint", *raced]
    start = contenders[0].best(1e-6)
    assert start is not None and all(one.start == start.resolution for one in contenders[1:])
    why = f"a step on SE3 takes more than {DEARER:g} times as long as the best one's"
    assert race.left_out == ({} if len(raced) == 2 else {"R3xSO3": why})


def test_formulations_without_a_model_are_left_out_and_faster_ones_win() -> None:
    def law(configuration: Configuration) -> Law:
        return replace(LAWS["rk4"], step=4e-6 * (1.0 if configuration.formulation == "joint" else 0.5))

    runner = LawRunner(law, GRID, scenes=("joint", "SE3", "R3xSO3"), models={"SE3": "no beam is absolute"})
    race = race_of(runner, 1e-6)
    contenders = entries_of(race, "rk4", others=("SE3", "R3xSO3")).run_race()
    assert race.left_out == {"SE3": "no beam is absolute"}
    best = min(contenders, key=lambda one: one.seconds(1e-6))
    assert best.configuration.formulation == "R3xSO3"


# -- whole searches ----------------------------------------------------------------------------------------------------


def tuning(runner: LawRunner, error: float = 1e-5, methods: tuple[str, ...] = ("rk4", "generalized_alpha")) -> _Tuning:
    defaults = replace(runner.formulations.description.simulation, step=0.01, record_every=2)
    axes = ("method", "resolution", "parameters")
    return _Tuning(cast(Any, runner), Demand(error, "way", "largest"), defaults, methods, axes, 1e9, lambda _: None)


@pytest.fixture(autouse=True)
def judges(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference of a tuning is by the one method that is exact."""
    monkeypatch.setattr(judging, "rank", lambda runner, candidate: candidate.row.name != "taylor")


def exact_law(laws: Mapping[str, Law | str | None] = LAWS) -> Callable[[Configuration], Law | str | None]:
    return law_of({**laws, "taylor": EXACT})


def test_the_settings_of_a_demand_are_those_of_the_cheapest_steps() -> None:
    runner = LawRunner(exact_law(), GRID)
    tuned = tuning(runner).result(None)
    demand = 1e-5
    found = {name: cheapest(LAWS[name], GRID.rows, demand, 16) for name in ("rk4", "generalized_alpha")}
    best = min(found, key=lambda name: found[name][1])
    assert tuned.configuration.method == best and (tuned.demand, tuned.quantity) == (demand, "way")
    steps = cheapest(LAWS[best], GRID.rows, MARGIN * demand, 16)[0]
    assert tuned.value == pytest.approx(0.01 / steps) and tuned.kind == "step"
    assert tuned.error == pytest.approx(LAWS[best].size / steps ** LAWS[best].order, rel=1e-3)
    assert tuned.seconds == pytest.approx(LAWS[best].step * GRID.rows * steps)
    assert (tuned.steps, tuned.span) == (GRID.rows * steps, pytest.approx(1.0))
    assert tuned.simulation == {
        "method": best, "step": pytest.approx(tuned.value, rel=1e-15), "record_every": round(0.02 / tuned.value),
        **tuned.configuration.simulation_keys(),
    }  # fmt: skip
    assert tuned.written == (tuned.error, tuned.seconds)
    assert tuned.met and len(tuned.verified) == 3 and all(run.by.startswith("taylor") for run in tuned.verified)
    words, error, seconds = tuned.own
    assert words == "rk4, step 0.01 s" and error == pytest.approx(LAWS["rk4"].size, rel=1e-3)
    assert seconds == pytest.approx(LAWS["rk4"].step * GRID.rows)
    rivals = [rival.label for rival in tuned.rivals]
    assert rivals and not any(label.startswith(best) for label in rivals)
    assert (tuned.coordinates, tuned.group, tuned.simplified, tuned.source) == ("", "", "", None)
    assert tuned.built == sum(runner.compiled.values()) > 0.0
    # a tenth of the error: 10^(1/4) of the steps of order 4
    assert 1.0 < tuned.next_digit <= 1.3 * 10.0 ** (1.0 / LAWS[best].order)


def test_a_winner_that_misses_the_demand_under_other_conditions_is_refined() -> None:
    """Starts on the other side than that of the first condition, which races are run under, are five times as hard."""
    first = next(conditions(cast(Any, LawRunner(exact_law(), GRID)), motion(0.0))).arguments["initial"]["q"][0]
    runner = LawRunner(exact_law(), GRID, harder=lambda start: 1.0 if start * first > 0.0 else 5.0)
    tuned = tuning(runner, methods=("rk4",)).result(None)
    assert tuned.met and [int(run.what.partition(":")[0]) for run in tuned.verified] == [5, 6, 7]
    ratios = [run.error / tuned.error for run in tuned.verified]
    assert set(np.round(ratios, 2)) <= {1.0, 5.0} and tuned.error <= 1e-5 / 5.0
    everywhere = LawRunner(exact_law(), GRID, harder=lambda start: 5.0)
    found = tuning(everywhere, methods=("rk4",)).result(None)
    assert [int(run.what.partition(":")[0]) for run in found.verified] == [2, 3, 4]
    assert all(run.error == pytest.approx(5.0 * found.error, rel=1e-3) for run in found.verified)


def test_other_coordinates_are_written_and_simplified_scenes_are_not() -> None:
    def law(configuration: Configuration) -> Law | str | None:
        faster = 0.5 if configuration.formulation == "R3xSO3" else 1.0
        found = exact_law()(configuration)
        return replace(found, step=found.step * faster) if isinstance(found, Law) else found

    loop = model_of(multipliers=("a",))
    runner = LawRunner(law, GRID, scenes=("joint", "R3xSO3"), models={"joint": loop})
    search = tuning(runner, methods=("rk4",))
    assert search._others() == ["R3xSO3"]
    tree = tuning(LawRunner(law, GRID, scenes=("joint", "SE3", "joint, rigid"), simplified=("joint, rigid",)))
    assert tree._others() == ["joint, rigid"]
    assert tree.left_out == {"SE3": "joint coordinates have no constraints"}
    tuned = tuning(LawRunner(law, GRID, scenes=("absolute", "R3xSO3"), own=Configuration("absolute", "rk4")),
                   methods=("rk4",)).result(None)  # fmt: skip
    assert (tuned.configuration.formulation, tuned.coordinates, tuned.group) == ("R3xSO3", "absolute", "R3xSO3")


def test_searches_without_a_result_are_refused() -> None:
    with pytest.raises(NumericalError, match=r"no configuration meets 1e-05 in the budget: the least error is inf"):
        tuning(LawRunner(law_of({"taylor": EXACT, "rk4": None}), GRID), methods=("rk4",)).result(None)
    cannot = tuning(LawRunner(exact_law(), GRID), methods=("rk4_partitioned",))
    with pytest.raises(ModelError, match="no method runs on this scene: partitioned needs a system with"):
        cannot.result(None)


def test_rivals_are_the_best_of_each_other_method_cheapest_first() -> None:
    runner = LawRunner(law_of(), GRID)
    (rk4, alpha, rk45) = contenders_of(runner, "rk4", "generalized_alpha", "rk45")
    (again,) = contenders_of(runner, "generalized_alpha")
    rk4.runs = [RaceRun(10.0, 1e-5, 1.0)]
    alpha.runs, again.runs = [RaceRun(20.0, 1e-5, 3.0)], [RaceRun(30.0, 1e-5, 2.0)]
    rk45.runs = [RaceRun(1e3, math.inf, 1.0)]
    (one,) = _rivals([rk4, alpha, again, rk45], rk4, 1e-4)
    assert (one.label, one.seconds, one.measured) == ("generalized_alpha, joint", 2.0, True)
    rk45.runs = [RaceRun(1e3, 1e-2, 0.5)]
    (first, second) = _rivals([rk4, again, rk45], rk4, 1e-4)
    assert (first.label, first.measured, first.seconds) == ("rk45, joint", False, rk45.predict_seconds(1e-4))
    assert second.label == one.label


def test_conditions_move_starts_by_a_twentieth_and_numbers_by_three_percent() -> None:
    model = model_of(parameters={"mass": 2.0, "fixed": 5.0}, inputs=("push", "shake", "rest"), functions=("inputs",))
    sampled = np.column_stack([np.full(257, 4.0), np.sin(np.arange(257.0)), np.zeros(257)])
    model.input_values = lambda times, parameters: sampled

    def parameter_array(values: Mapping[str, float] | None) -> Any:
        if values is not None and values.get("fixed", 5.0) != 5.0:
            raise ModelError("fixed")
        return np.zeros(2)

    model.parameter_array = parameter_array
    runner = LawRunner(law_of(), GRID, models={"joint": model}, parameters={"mass": 3.0}, inputs={"shake": 7.0})
    seen = motion(0.0, start=2.0, speed=-4.0)
    made = list(islice(conditions(cast(Any, runner), seen), 4))
    for number, one in enumerate(made, 1):
        given = one.arguments
        assert abs(given["initial"]["q"][0] - 2.0) == pytest.approx(0.05)
        assert abs(given["initial"]["v"][0] + 4.0) == pytest.approx(0.2)
        assert set(given["inputs"]) == {"push", "shake"}
        assert abs(given["inputs"]["push"] - 4.0) == pytest.approx(0.12)
        assert abs(given["inputs"]["shake"] - 7.0) == pytest.approx(0.21)
        assert 1 <= given["later"] <= 3 and f"from {given['later'] * 0.01:.3g} s on" in one.label
        if number % 2:
            assert "parameters" not in given
        else:
            assert abs(given["parameters"]["mass"] - 3.0) == pytest.approx(0.09) and given["parameters"]["fixed"] == 5.0
        assert one.label.startswith(f"{number}: positions by 5 % of their motion, velocities by 5 %")
    assert len({tuple(one.arguments["initial"]["q"]) for one in made}) == 2
    still = LawRunner(law_of(), GRID)
    assert set(next(conditions(cast(Any, still), seen)).arguments) == {"initial"}


def test_a_table_says_what_was_found(capsys: pytest.CaptureFixture[str]) -> None:
    tuned = tuning(LawRunner(exact_law(), GRID)).result(None)
    _print_tuned(tuned)
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    whole = " ".join(lines)
    assert lines[0].startswith("law: largest error of way below 1e-05")
    assert f"cheapest {tuned.label}" in whole and f"error {tuned.error:.2g} of way, largest; demanded 1e-05" in whole
    assert f"time {1e3 * tuned.seconds:.4g} ms of stepping for 1 s of motion, {tuned.steps:.0f} steps" in whole
    own, error, seconds = tuned.own
    assert f"{own}: error {error:.2g}, {seconds / tuned.seconds:.3g} x the time" in whole
    assert f"costs about {tuned.next_digit:.3g} x" in whole
    for rival in tuned.rivals:
        assert f"{rival.label}: {rival.seconds / tuned.seconds:.3g} x" in whole
    assert sum(line.startswith("next ") for line in lines) == 1 == sum(line.startswith("verified ") for line in lines)
    assert whole.count(", met") == 3 and "MISSED" not in whole
    assert f"[simulation] method = '{tuned.configuration.method}'" in whole
    missed = replace(tuned, verified=(replace(tuned.verified[0], error=1.0),), said="doubtful", own=("", math.inf, 1.0))
    _print_tuned(missed)
    said = " ".join(capsys.readouterr().out.split())
    assert "error 1, MISSED" in said and "its run says doubtful" in said and "the scene's own" not in said


def test_ends_of_searches_are_the_judges(monkeypatch: pytest.MonkeyPatch) -> None:
    """Methods that do not race may be the reference; Ctrl-C while a winner is verified names the cheapest so far."""
    runner = LawRunner(exact_law(), GRID)
    search = tuning(runner, methods=("rk4",))
    said: list[str] = []

    def say(text: str) -> None:
        said.append(text)
        if text.startswith("verifying"):
            raise KeyboardInterrupt

    search.say = say
    with pytest.raises(KeyboardInterrupt) as stopped:
        search.result(None)
    assert said[0] == "reference: taylor"
    (note,) = stopped.value.__notes__
    assert note.startswith("the cheapest so far, which is not verified, has method = 'rk4', step = ")
