"""Mistakes with solutions, simulators and files that nothing, or Python alone, once answered."""

from __future__ import annotations

import copy
import json
import pickle
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from tests.failures.failure import SCENE
from tests.failures.mistakes import arm

pytestmark = pytest.mark.slow


def run(t_end: float = 0.1, **options: Any) -> eomgen.Solution:
    return arm().simulate(t_end, 1e-3, error_estimate=False, **options)


def set_parameter_of(owner: Callable[[], Any]) -> None:
    owner().parameters["load"] = 2.0


CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: run().poses["tip"], 'tip is a point, and only bodies have poses; try: outputs["tip"] of the solution'),
    (lambda: run().poses["uper"], "there is no pose 'uper'; try: upper"),
    (lambda: set_parameter_of(lambda: arm().start(step=1e-3)), "parameters: these are read, and not assigned to;"),
    (lambda: eomgen.generate(arm().scene, "arm.c"), "arm.c: arm.c is the name of a file, and a folder of several"),
    (lambda: run().followed_by(run(0.2)), "followed_by: the second part begins at t = 0 s, as the first part does,"),
    (lambda: run().followed_by([]), "followed_by: a solution is needed, not list; try: first.followed_by(second)"),  # type: ignore[arg-type]
    (lambda: run().plot(0), "plot: the solution has no curve 0; try: one of coordinates"),  # type: ignore[arg-type]
    (lambda: run().plot(""), "plot: the solution has no curve ''; try: "),
    (lambda: arm().simulate_many(0.1, vary=np.zeros(2)), "vary: a mapping from names to distributions is needed, not"),
]


@pytest.mark.parametrize(("call", "piece"), CALLS, ids=[piece[:40] for _, piece in CALLS])
def test_each_is_answered_with_what_to_try(call: Callable[[], Any], piece: str) -> None:
    with pytest.raises(eomgen.EomgenError, match=re.escape(piece)):
        call()


def test_a_part_of_another_motion_does_not_go_on(tmp_path: Path) -> None:
    checkpoint, other = tmp_path / "a.npz", tmp_path / "b.npz"
    first = run(0.2, checkpoint=checkpoint, checkpoint_every=100)
    run(0.2, checkpoint=other, checkpoint_every=100, initial={"shoulder": 0.3})
    whole = first.followed_by(arm().resume(checkpoint, 0.3))
    assert whole.t[-1] == pytest.approx(0.3)
    with pytest.raises(eomgen.UsageError, match=r"at t = 0.2 s q.shoulder is .* first part and .* in the second"):
        first.followed_by(arm().resume(other, 0.3))


def test_curves_are_plotted_by_a_list_of_names() -> None:
    drawn = run().plot(["q.shoulder", "tip[2]"])
    assert len(drawn) == len(run().plot("q.shoulder", "tip[2]")) == 2


def test_a_run_without_events_has_none_of_them(tmp_path: Path) -> None:
    solution = run()
    assert not solution.events and list(solution.events) == [] and solution.events.counts == {}
    again = eomgen.Solution.load(solution.save(tmp_path / "run.npz"))
    assert again.events.counts == pickle.loads(pickle.dumps(solution)).events.counts == {}
    assert "events" not in again.metadata


def test_parameters_of_a_simulator_are_those_of_now_and_can_be_copied() -> None:
    simulator = arm().start(step=1e-3)
    simulator.set_parameter("load", 1.5)
    assert simulator.parameters == {"load": 1.5} == copy.deepcopy(simulator.parameters) == dict(simulator.parameters)


def test_the_time_that_the_last_advance_went_to_is_no_span() -> None:
    simulator = arm().start(step=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulator.advance(0.0)  # where a loop over times begins
        simulator.advance(0.5)
    with pytest.warns(RuntimeWarning, match=r"advance\(0.5\) takes the time .* try: advance\(run.t \+ 0.5\)") as told:
        simulator.advance(0.5)
    assert told[0].filename == __file__ and simulator.t == 0.5


def test_folders_that_are_there_may_have_any_name(tmp_path: Path) -> None:
    (tmp_path / "arm.c").mkdir()
    assert eomgen.generate(arm().scene, tmp_path / "arm.c")


def test_an_equilibrium_is_written_as_json_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "arm.toml").write_text(SCENE)
    words = ["equilibrium", str(tmp_path / "arm.toml"), "--out"]
    assert main([*words, str(tmp_path / "e.csv")]) == eomgen.UsageError.exit_code
    assert "an equilibrium is written as a .json file; try: --out rest.json" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["arm.toml"]
    assert main([*words, str(tmp_path / "e.json")]) == 0
    assert json.loads((tmp_path / "e.json").read_text())["scene"] == "arm"
