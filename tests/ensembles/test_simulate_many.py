"""Ensembles of a mass under a force, whose place is known for each sample; bits, failures, folders."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.progress import Reporter
from eomgen.cli import main
from eomgen.errors import FileError, UsageError
from eomgen.products.ensembles import command
from eomgen.products.ensembles.journal import BlockJournal
from eomgen.products.ensembles.samples import SampleRunner
from eomgen.products.ensembles.statistics import Reduction
from tests.ensembles.carts import CART, VARY, bits, built_cart, small_blocks


@pytest.fixture
def cart() -> eomgen.Model:
    return built_cart()


def place(values: dict[str, np.ndarray], t: np.ndarray) -> np.ndarray:
    """Return where carts are, (samples, times)."""
    mass, push, q, v = (values[name][:, np.newaxis] for name in VARY)
    return q + v * t + 0.5 * push / mass * t**2


def test_the_message_has_the_most_frequent_reason_of_failures(cart: eomgen.Model) -> None:
    """Reasons that differ in numbers alone count together."""
    found = cart.simulate_many(table={"mass": [1.0, 0.0, -2.0, -3.0]})
    cause = "cart.toml:10 (bodies.cart.mass): the mass -2 is negative at mass = -2"
    assert f"3 of which failed (2 as sample 2: {cause})" in found.message


def test_the_ranking_of_a_result_has_the_error_of_its_column(cart: eomgen.Model) -> None:
    """The place at the end is q + 2 v + 1: variances 0.09 and 4/12."""
    vary = {"q.rail": "normal(0, 0.3)", "v.rail": "uniform(-0.5, 0.5)"}
    fixed = {"parameters": {"mass": 2.0}, "inputs": {"push": 1.0}, "columns": ["place", "input.push"]}
    found = cart.simulate_many(vary=vary, samples=64, design="sobol", **fixed)
    judged: Any = SimpleNamespace(error=SimpleNamespace(columns={"output.place": 0.02, "input.push": 0.1}), notes=())
    found = replace(found, judgement=judged)
    of_place = found.sensitivity("output.place.final")
    assert list(of_place.first) == ["v.rail", "q.rail"]
    assert of_place.first["v.rail"] == pytest.approx((1 / 3) / (1 / 3 + 0.09), abs=0.06)
    assert of_place.error == pytest.approx(0.02 / np.std(found.results["output.place.final"]), rel=1e-12)
    assert np.isnan(found.sensitivity("input.push.max").error)  # the same in all samples
    with pytest.raises(UsageError, match=r"there is no result 'output.place.maxi'; try: output.place.max"):
        found.sensitivity("output.place.maxi")


def test_events_are_counted_until_each_time() -> None:
    """Events that are only counted have no times, and no column."""
    ball = eomgen.build("examples/bouncing_ball/scene.toml", method="rk4", profile="quick")
    given: dict[str, Any] = {"table": {"restitution": [0.6, 0.9]}, "error_estimate": False}
    found = ball.simulate_many(1.0, 0.01, columns=["event.bounce", "t"], **given)
    runs = [ball.simulate(1.0, 0.01, parameters={"restitution": value}) for value in (0.6, 0.9)]
    counts = np.array([[(run.events["bounce"].t <= t).sum() for t in run.t] for run in runs])
    np.testing.assert_array_equal(found.mean("event.bounce"), counts.mean(axis=0))
    np.testing.assert_array_equal(found.results["event.bounce.final"], [run.events.counts["bounce"] for run in runs])
    assert (found.results["t.final"] == 1.0).all() and found.results["event.bounce.final"].min() >= 1.0
    with pytest.raises(UsageError, match=r"there is no column 'event.edge'"):
        ball.simulate_many(1.0, 0.01, columns=["event.edge"], **given)


def test_a_grid_and_a_table_run_their_samples(cart: eomgen.Model) -> None:
    grid = cart.simulate_many(vary={"mass": "values(1, 2, 4)", "push": "linspace(0, 4, 2)"})
    assert grid.design == "grid"
    np.testing.assert_allclose(grid.results["output.place.final"], [0, 8, 0, 4, 0, 2], atol=1e-10)
    table = cart.simulate_many(table={"push": [1.0, 3.0]})
    np.testing.assert_allclose(table.results["output.place.final"], [1.0, 3.0], atol=1e-10)
    measured = cart.simulate_many(table={"push": ["0.001 kN", "3"], "mass": ["1000 g", "3"]})
    np.testing.assert_allclose(measured.results["output.place.final"], [2.0, 2.0], atol=1e-10)


@pytest.fixture
def several_blocks() -> Iterator[None]:
    with small_blocks():
        yield


@pytest.mark.usefixtures("several_blocks")
def test_bits_do_not_depend_on_workers_or_interruptions(cart: eomgen.Model, tmp_path: Path) -> None:
    options = {"vary": VARY, "samples": 120, "design": "sobol", "seed": 1}
    straight = bits(cart.simulate_many(**options, workers=1))
    assert bits(cart.simulate_many(**options, workers=3)) == straight

    def interrupt(done: int, total: int) -> None:
        if done >= 40:
            raise KeyboardInterrupt

    part = cart.simulate_many(**options, folder=tmp_path / "out", progress=interrupt)
    assert part.interrupted and 40 <= part.done < 120 and len(part.values["mass"]) == part.done
    assert "ended by Ctrl-C" in part.message
    with pytest.raises(FileError, match=r"holds an ensemble, ensemble\.json; try: --resume"):
        cart.simulate_many(**options, folder=tmp_path / "out")
    with pytest.raises(FileError, match="holds an ensemble with other seed; try: the same options again"):
        cart.simulate_many(**{**options, "seed": 2}, folder=tmp_path / "out", resume=True)
    again = cart.simulate_many(**options, folder=tmp_path / "out", resume=True)
    assert again.done == 120 and not again.interrupted and bits(again) == straight


def test_blocks_by_time_change_no_bit_and_ctrl_c_keeps_finished_samples(
    cart: eomgen.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs so long that a block has one sample."""
    options = {"vary": VARY, "samples": 40, "seed": 1}
    straight = bits(cart.simulate_many(**options))
    monkeypatch.setattr(import_module("eomgen.products.ensembles.simulate_many"), "PART", 0.0)
    done: list[int] = []

    def interrupt(number: int, total: int) -> None:
        done.append(number)
        if number == 23:
            raise KeyboardInterrupt

    part = cart.simulate_many(**options, folder=tmp_path / "out", progress=interrupt)
    assert done == [*range(1, 24)]
    assert part.interrupted and part.done == 23 == part.count("place")[-1]
    np.testing.assert_allclose(part.mean("place"), place(part.values, part.t).mean(axis=0), rtol=1e-9)
    expected = np.quantile(part.results["output.place.final"], [0.05, 0.5, 0.95])
    np.testing.assert_allclose(part.quantile("place", [0.05, 0.5, 0.95])[:, -1], expected, rtol=1e-12)
    again = cart.simulate_many(**options, folder=tmp_path / "out", resume=True)
    assert again.done == 40 and bits(again) == straight
    assert (np.diff(again.quantile("place", [0.1, 0.5, 0.9]), axis=0) > 0.0).all()


def test_the_plan_and_its_time_are_told_first(cart: eomgen.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    for setting in ("_SELDOM", "PART"):
        monkeypatch.setattr(import_module("eomgen.products.ensembles.simulate_many"), setting, -1.0)
    told: list[object] = []
    reporter = Reporter(lambda *done: told.append(done), told.append)
    cart.simulate_many(vary=VARY, samples=8, progress=reporter, workers=2)
    assert re.fullmatch(r"8 samples side by side: \d+ lanes, by 2 threads: about 0 s more", str(told[0])), told[0]
    monkeypatch.setenv("EOMGEN_LANES", "off")
    cart.simulate_many(vary=VARY, samples=8, progress=reporter, workers=1)
    assert "8 samples one after the other: EOMGEN_LANES is off, by 1 thread: about 0 s more" in told


@pytest.mark.slow
def test_samples_at_equilibrium_run_side_by_side_from_that_of_the_run_before(tmp_path: Path) -> None:
    model = eomgen.build(eomgen.load(Path(__file__).parent / "scenes" / "resting.toml"))
    vary = {"stiffness": "uniform(500, 2000)", "push": "normal(0, 10)"}
    found = model.simulate_many(vary=vary, samples=40, keep=[3], folder=tmp_path / "out")
    assert found.how.startswith("side by side")
    stiffness, push = found.values["stiffness"], found.values["push"]
    place = found.results["output.place.final"]
    np.testing.assert_allclose(stiffness * (place + 40.0 * place**3), push - 2.0 * 9.81, rtol=1e-7)
    np.testing.assert_allclose(found.results["output.place.max"], found.results["output.place.min"], atol=1e-9)
    alone = eomgen.Solution.load(tmp_path / "out" / "runs" / "sample_0000003.npz")
    assert alone["output.place"][-1] == pytest.approx(place[3], rel=1e-9)


@pytest.mark.usefixtures("several_blocks")
def test_ctrl_c_within_a_reduction_leaves_it_whole(
    cart: eomgen.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = {"vary": VARY, "samples": 60, "seed": 1}
    straight = bits(cart.simulate_many(**options))
    products, calls = Reduction._merge_products, []
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)  # shells have those in the background ignore it

    def interrupted(self: Reduction, *moments: np.ndarray) -> None:
        calls.append(len(moments))
        if len(calls) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        products(self, *moments)

    monkeypatch.setattr(Reduction, "_merge_products", interrupted)
    try:
        part = cart.simulate_many(**options, folder=tmp_path / "out")
    finally:
        signal.signal(signal.SIGINT, usual)
    assert part.interrupted and part.reduction.count.max() == part.done < 60
    again = cart.simulate_many(**options, folder=tmp_path / "out", resume=True)
    assert again.done == 60 and bits(again) == straight


@pytest.mark.parametrize(
    ("samples", "work", "numbers", "size"),
    [(10_000, 1, 1, 2500), (100_000, 1, 1, 4096), (10_000, 1, 2**14, 256), (10_000, 10**6, 1, 256), (64, 10**6, 1, 4)],
)
def test_blocks_of_short_runs_keep_to_some_memory(samples: int, work: int, numbers: int, size: int) -> None:
    assert SampleRunner.block_size(samples, work, numbers) == size


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the killed process is a fork of this one")
@pytest.mark.parametrize(
    ("owner", "name"), [(BlockJournal, "keep"), (BlockJournal, "write"), (Reduction, "_merge_products")]
)
def test_a_killed_ensemble_goes_on_to_the_same_bits(
    cart: eomgen.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, owner: type, name: str
) -> None:
    """Killed by the system at the seventh block, before it is kept, written, or reduced whole."""
    options = {"vary": VARY, "samples": 60, "seed": 1}
    # what is reduced is written at once; several blocks
    monkeypatch.setattr(import_module("eomgen.products.ensembles.simulate_many"), "_SELDOM", 0)
    monkeypatch.setattr("eomgen.products.ensembles.samples._WORTH_A_BLOCK", 0)
    straight = bits(cart.simulate_many(**options))
    if not (child := os.fork()):
        usual, calls = getattr(owner, name), []

        def killed(*arguments: object) -> object:
            calls.append(name)
            if len(calls) == 7:
                os.kill(os.getpid(), signal.SIGKILL)
            return usual(*arguments)

        try:
            monkeypatch.setattr(owner, name, killed)
            cart.simulate_many(**options, folder=tmp_path / "out")
        finally:  # whatever happens, no second run of the tests goes on from here
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    done = []
    again = cart.simulate_many(
        **options, folder=tmp_path / "out", resume=True, progress=lambda number, _: done.append(number)
    )
    assert done[0] == 28 and again.done == 60 and bits(again) == straight  # six blocks of four were not run again


def test_a_folder_takes_one_ensemble_at_a_time(cart: eomgen.Model, tmp_path: Path) -> None:
    said = []

    def second(done: int, total: int) -> None:
        with pytest.raises(FileError) as caught:
            cart.simulate_many(vary=VARY, samples=4, folder=tmp_path, resume=True)
        said.append(str(caught.value))

    assert cart.simulate_many(vary=VARY, samples=4, folder=tmp_path, progress=second).done == 4
    assert said and "another ensemble is writing to it; try: another folder" in said[0]
    assert cart.simulate_many(vary=VARY, samples=4, folder=tmp_path, resume=True).done == 4


def test_a_folder_is_gone_on_with_by_the_same_inputs_only(cart: eomgen.Model, tmp_path: Path) -> None:
    laws = ({"push": lambda t: 3.0 * t}, {"push": np.linspace(0.0, 2.0, 41)})
    for number, inputs in enumerate(laws):
        options = {"vary": {"mass": "uniform(1, 2)"}, "samples": 4, "folder": tmp_path / str(number)}
        cart.simulate_many(**options, inputs=inputs)
        assert cart.simulate_many(**options, inputs=inputs, resume=True).done == 4
        for other in ({"push": lambda t: 3.0 * t**2}, {"push": np.linspace(0.0, 2.0, 41) ** 2}):
            with pytest.raises(FileError, match="holds an ensemble with other inputs, motion without variations"):
                cart.simulate_many(**options, inputs=other, resume=True)


def test_a_solution_is_kept_also_when_its_sample_is_done(cart: eomgen.Model, tmp_path: Path) -> None:
    options = {"table": {"push": [1.0, 2.0, 3.0]}, "folder": tmp_path}
    cart.simulate_many(**options, keep=[0])
    found = cart.simulate_many(**options, keep=[2], resume=True)
    kept = eomgen.Solution.load(tmp_path / "runs" / "sample_0000002.npz")
    assert kept["output.place"][-1] == found.results["output.place.final"][2]
    assert len(list((tmp_path / "runs").iterdir())) == 2


@pytest.mark.slow
def test_columns_of_a_sample_are_kept_as_parquet(cart: eomgen.Model, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    cart.simulate_many(table={"push": [1.0, 2.0]}, folder=tmp_path, keep=[1], keep_as="parquet")
    table = parquet.read_table(tmp_path / "runs" / "sample_0000001.parquet")
    columns = cart.simulate(inputs={"push": 2.0}).columns()
    assert table.column_names == list(columns) and table.schema.field("output.place").metadata == {b"unit": b"m"}
    for name, values in columns.items():
        np.testing.assert_array_equal(table[name].to_numpy(), values)


def test_parquet_needs_its_package_before_the_first_sample(
    cart: eomgen.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = {"table": {"push": [1.0, 2.0]}, "folder": tmp_path / "out", "keep": [1]}
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UsageError, match=r"pyarrow, which is not installed; try: pip install 'eomgen\[parquet\]'"):
        cart.simulate_many(**options, keep_as="parquet")
    with pytest.raises(UsageError, match="keep_as: solutions are not kept as 'csv'; try: npz or parquet"):
        cart.simulate_many(**options, keep_as="csv")
    assert not (tmp_path / "out").exists()


def test_histograms_hold_all_samples(cart: eomgen.Model) -> None:
    found = cart.simulate_many(vary={"push": "uniform(0, 1)"}, samples=100)
    for t in (0.0, 1.0):  # all begin at 0
        probabilities, edges = found.histogram("place", t, bins=5)
        assert probabilities.sum() == pytest.approx(1.0, abs=1e-12) and probabilities.min() >= 0.0
        low, high = found.envelope("place")
        place = int(np.abs(found.t - t).argmin())
        assert edges[0] < low[place] and high[place] < edges[-1]
    with pytest.raises(UsageError, match="bins: a whole number from 1 on is needed, not 0"):
        found.histogram("place", 1.0, bins=0)


def test_what_is_refused_leaves_no_ensemble_behind(cart: eomgen.Model, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="workers: a whole number from 1 on is needed, not 0"):
        cart.simulate_many(vary=VARY, folder=tmp_path / "out", workers=0)
    for inputs in (5, np.zeros((3, 2))):
        kind = type(inputs).__name__
        with pytest.raises(UsageError, match=f"inputs: a mapping from the names of inputs is needed, not {kind}"):
            cart.simulate_many(vary=VARY, folder=tmp_path / "out", inputs=inputs)
    assert not (tmp_path / "out").exists()


def test_a_failed_sample_is_kept_with_its_reason(
    cart: eomgen.Model, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fastest carts come to 4 and 2 m, and the third one to 1 m."""
    table = {"mass": [1.0, -1.0, 2.0, 4.0], "push": [2.0, 2.0, 2.0, 2.0]}
    found = cart.simulate_many(table=table, folder=tmp_path / "out", keep=[2])
    (failed,) = found.failed
    assert failed.number == 1 and failed.values == {"mass": -1.0, "push": 2.0}
    assert failed.reason.startswith("cart.toml:10 (bodies.cart.mass): the mass -1 is negative")
    told = "4 samples, 1 of which failed (1 as sample 1: cart.toml:10 (bodies.cart.mass): the mass -1 is negative"
    assert told in found.message
    np.testing.assert_allclose(found.mean("place")[-1], 7.0 / 3.0, atol=1e-10)
    assert np.isnan(found.results["output.place.final"][1])
    files = found.save(tmp_path / "files")
    assert [file.name for file in files] == ["statistics.csv", "samples.csv", "failed.csv", "summary.json"]
    assert files[2].read_text().splitlines()[1].startswith('1,-1,2,"cart.toml:10 (bodies')
    rows = np.genfromtxt(files[0], delimiter=",", names=True, deletechars="")
    place = 0.5 * np.outer([2.0, 1.0, 0.5], rows["t"] ** 2)
    of_place = {"count": np.full(len(found.t), 3.0), "mean": place.mean(0), "deviation": place.std(0, ddof=1)}
    of_place |= {"min": place[2], "max": place[0], "q5": np.quantile(place, 0.05, axis=0), "q50": place[1]}
    for name, values in of_place.items():
        np.testing.assert_allclose(rows[f"output.place.{name}"], values, atol=1e-9, err_msg=name)
    rows = np.genfromtxt(files[1], delimiter=",", names=True, deletechars="")
    assert rows["sample"].tolist() == [0, 1, 2, 3] and rows["mass"].tolist() == table["mass"]
    np.testing.assert_allclose(rows["output.place.max"], [4.0, np.nan, 2.0, 1.0], atol=1e-9)
    summary = json.loads(files[3].read_text())
    assert summary["failed"] == 1 and summary["varied"] == ["mass", "push"] and summary["t_end"] == 2.0
    assert summary["final"]["output.place"]["quantile 0.5"] == pytest.approx(2.0)
    command._print(found)
    command._say_failures(found)
    told = capsys.readouterr()
    deviation = np.std([4.0, 2.0, 1.0], ddof=1)
    cells = ["output.place", "m", "2.3333", "-", f"{deviation:.5g}", "1", "1.1", "2", "3.8", "4"]
    assert cells in [line.split()[: len(cells)] for line in told.out.splitlines()]
    assert "cart: 3 samples, table, at t = 2 s" in told.out
    assert told.err.startswith("sample 1 failed (mass = -1, push = 2): cart.toml:10")
    cart.simulate_many(table={"mass": [1.0], "push": [2.0]}).save(tmp_path / "files")
    assert not (tmp_path / "files" / "failed.csv").exists()
    kept = eomgen.Solution.load(tmp_path / "out" / "runs" / "sample_0000002.npz")
    assert kept["output.place"][-1] == pytest.approx(2.0)


def test_what_is_drawn_depends_on_varied_quantities_and_the_number_of_samples(
    cart: eomgen.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = import_module("eomgen.products.ensembles.ensemble")
    for name in ("_fans", "_scatter"):
        monkeypatch.setattr(module, name, lambda found, name=name: name)
    monkeypatch.setattr(module, "save_figure", lambda figure, file: file)
    monkeypatch.setattr(module, "_rankings", lambda found: None if found.done < 3 else "bars")
    for mass, names in (
        ([1.0, 1.0, 2.0], ["fan.png", "scatter.png", "sensitivity.png"]),
        ([1.0, 2.0], ["fan.png", "scatter.png"]),
        ([-1.0, -1.0, -2.0], []),
    ):
        found = cart.simulate_many(table={"mass": mass})
        assert [file.name for file in found.plot(tmp_path / "plots")] == names
    few = cart.simulate_many(table={"mass": [1.0, 2.0]})
    assert command._why_unranked(few) == (
        "without sensitivity.png: too few samples for 1 number that varies: 2; it takes 8 samples or more"
    )
    unvaried = replace(few, varied=())
    assert [file.name for file in unvaried.plot(tmp_path)] == ["fan.png"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "vary: nothing varies: all samples would be the same"),
        ({"vary": {"masss": "normal(1, 0.1)"}}, "there is no parameter, input or initial state 'masss'; try: mass"),
        ({"vary": {"mass": 1.0}}, "vary mass: a distribution is needed, not float"),
        ({"vary": VARY, "design": "sobl"}, "design: there is no design 'sobl'; try: sobol"),
        ({"vary": VARY, "samples": 0}, "samples: a whole number from 1 on is needed, not 0"),
        ({"vary": {3: "normal(1, 0.1)"}}, "there is no parameter, input or initial state '3'"),
        ({"vary": VARY, "checkpoint": "run.npz"}, "checkpoint: samples write no checkpoints of their own"),
        ({"vary": VARY, "seed": -1}, "seed: a whole number from 0 on is needed, not -1"),
        ({"vary": VARY, "keep": [1]}, "keep: solutions of samples are kept in a folder, and none is given"),
        ({"table": {"mass": [1.0]}, "vary": VARY}, "a table says the values of all samples, and vary is given too"),
        ({"table": {"mass": [1.0], "push": [1.0, 2.0]}}, "table: push has 2 values, mass has 1"),
        ({"table": {"mass": [1.0, "1 N"]}}, "table mass[1]: '1 N' is a force, a mass in kg is expected"),
        ({"table": {"mass": ["1", "heavy"]}}, "table mass[1]: 'heavy' is not a number"),
    ],
)
def test_what_cannot_be_run_is_told_before_the_first_sample(
    cart: eomgen.Model, options: dict[str, object], said: str
) -> None:
    with pytest.raises(UsageError) as caught:
        cart.simulate_many(**options)
    assert said in str(caught.value)


@pytest.fixture
def built_once(cart: eomgen.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command takes the model that is there, and draws in no file."""
    module = import_module("eomgen.products.ensembles.ensemble")
    monkeypatch.setattr("eomgen.pipeline.pipeline.build_for_run", lambda *given: cart)
    monkeypatch.setattr(module, "save_figure", lambda figure, file: file)
    for name in ("_fans", "_scatter"):
        monkeypatch.setattr(module, name, lambda found: None)


@pytest.mark.usefixtures("built_once")
def test_the_command_writes_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, out = tmp_path / "cart.toml", tmp_path / "out"
    scene.write_text(CART, encoding="utf-8")
    call = ["ensemble", str(scene), "--out", str(out), "--vary", "mass=uniform(1, 3)", "--samples", "20", "--json"]
    assert main([*call, "--input", "push=2", "--workers", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["done"] == 20 and told["failed"] == 0 and told["final"]["output.place"]["min"] > 4.0 / 3.0 - 1e-9
    assert told["files"] == [
        "statistics.csv", "samples.csv", "summary.json", "fan.png", "scatter.png", "sensitivity.png"
    ]  # fmt: skip  # a list of files
    assert main([*call, "--input", "push=2"]) == 7
    assert "--resume, which goes on with it, or another folder" in capsys.readouterr().err
    table = tmp_path / "table.csv"
    table.write_text("mass,push\n1,2\n-1,2\n", encoding="utf-8")
    assert main(["ensemble", str(scene), "--out", str(tmp_path / "t"), "--table", str(table), "--no-plots"]) == 0
    captured = capsys.readouterr()
    assert "sensitivity" not in captured.err  # nobody has asked for plots
    assert "place" in captured.out and "sample 1 failed (mass = -1, push = 2)" in captured.err
    assert f"written to {tmp_path / 't'}: statistics.csv, samples.csv, failed.csv, summary.json" in captured.err
    assert main(["ensemble", str(scene), "--out", str(tmp_path / "v"), "--table", str(table)]) == 0
    said = "without sensitivity.png: too few samples for 2 numbers that vary: 1; it takes 16 samples or more"
    assert said in capsys.readouterr().err
    table.write_text("mass,push\n" + "-1,1\n" * 23, encoding="utf-8")
    assert main(["ensemble", str(scene), "--out", str(tmp_path / "w"), "--table", str(table)]) == 6
    captured = capsys.readouterr()
    assert "sample 2 failed" in captured.err and "20 more failed samples, in failed.csv" in captured.err
    assert "sample 3 failed" not in captured.err and "all of which failed" in captured.err
    table.write_text("mass,push\n1\n", encoding="utf-8")
    assert main(["ensemble", str(scene), "--out", str(tmp_path / "u"), "--table", str(table)]) == 7
    assert "line 2: the row has 1 cell, and there are 2 names; try: a cell for each name" in capsys.readouterr().err
    assert main(["ensemble", str(scene), "--out", str(tmp_path / "x")]) == 2
    assert "--vary: nothing varies: all samples would be the same" in capsys.readouterr().err


@pytest.mark.usefixtures("built_once")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("\ufeffmass;push\n# of Monday\n1;0\n\n2000 g;2 N\n", ""),
        ("mass\tpush\n1\t0\n2\t0.002 kN\n", ""),
        (
            "mass,push\n\n1,0\n2,\n",
            "line 4, column push: a cell is empty; try: numbers in the scene's units, or with units: 250 mm",
        ),
        ("mass,push\n1,x\n", "line 2, column push: 'x' is not a number"),
        ("mass,push\n", "the table has no rows below its names"),
        ("mass,mass\n1,2\n", "the column 'mass' is there twice"),
    ],
    ids=["semicolons", "tabs", "empty cell", "word", "no rows", "twice"],
)
def test_tables_from_files(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str) -> None:
    scene, table, out = tmp_path / "cart.toml", tmp_path / "table.csv", tmp_path / "out"
    scene.write_text(CART, encoding="utf-8")
    table.write_text(text, encoding="utf-8")
    code = main(["ensemble", str(scene), "--out", str(out), "--table", str(table), "--no-plots", "--json"])
    captured = capsys.readouterr()
    assert said in captured.err and code == (7 if said else 0)
    if not said:
        assert json.loads(captured.out)["final"]["output.place"]["max"] == pytest.approx(2.0)
        assert (out / "samples.csv").read_text(encoding="utf-8").splitlines()[2].startswith("1,2.0,2.0,")
