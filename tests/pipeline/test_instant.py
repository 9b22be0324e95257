"""Profile ``instant``: a model runs on the tape engine at once, and on the compiled library once that is there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.data import replace
from eomgen.cli import main
from eomgen.errors import ModelError, ToolchainError, UsageError
from eomgen.pipeline.model import Model
from eomgen.toolchain.builder import Builder
from eomgen.toolchain.compiler import RunningCompilers
from eomgen.toolchain.library import Library, Successor
from eomgen.toolchain.profiles import PROFILES, compiler_seconds, run_seconds_on_tape

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "examples" / "quarter_car_on_bump" / "scene.toml"
Release = Callable[[Model], None]


@pytest.fixture
def release(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Release:
    """Return a function that lets the compiler in the background of a model begin, and waits for its end."""
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    begun, work = threading.Event(), Successor._work

    def later(self: Successor, running: RunningCompilers) -> None:
        begun.wait(60.0)
        work(self, running)

    monkeypatch.setattr(Successor, "_work", later)

    def released(model: Model) -> None:
        successor = model.library.successor
        assert successor is not None
        begun.set()
        assert successor.wait(60.0)

    return released


@pytest.mark.slow
def test_the_compiled_library_takes_over_between_two_runs_or_calls(release: Release) -> None:
    model = eomgen.build(SCENE, profile="instant")
    first, mass = model.simulate(0.05), model.mass(model.initial_q)
    assert first.metadata["profile"] == model.library.profile == "instant"
    on_tape = model.library
    seen: list[Library] = []

    def report(done: int, total: int) -> None:
        if not seen:
            release(model)
        model.mass(model.initial_q)  # a call within a run
        seen.append(model.library)

    during = model.simulate(0.05, progress=report)
    assert set(seen) == {on_tape}
    assert during.metadata["profile"] == "instant"
    assert np.array_equal(during.q, first.q)
    assert np.array_equal(model.mass(model.initial_q), mass)
    assert model.library.profile == "quick"
    after = model.simulate(0.05)
    assert after.metadata["profile"] == "quick"
    assert np.array_equal(after.q, first.q)  # quick has the bits of the tape engine, fast may differ in the last ones
    assert eomgen.build(SCENE, profile="instant").library.profile == "quick"  # from the cache


@pytest.mark.slow
def test_steppers_of_other_methods_are_instant_and_taken_over_too(release: Release) -> None:
    model = eomgen.build(SCENE, profile="instant")
    first = model.simulate(0.05, method="rk4")
    assert first.metadata["profile"] == "instant"
    release(model)
    successor = model.stepper("rk4").successor
    if successor is not None:
        successor.wait(60.0)
    second = model.simulate(0.05, method="rk4")
    assert second.metadata["profile"] == "quick"
    assert np.array_equal(first.q, second.q)


@pytest.mark.slow
def test_a_failure_of_the_compiler_is_told_when_it_would_take_over(
    release: Release, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = eomgen.build(SCENE, profile="instant")

    def fails(*_: object, **__: object) -> None:
        raise ToolchainError("the compiler ran out of memory", "fewer functions")

    monkeypatch.setattr(Builder, "build", fails)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.simulate(0.01)
    release(model)
    told = "the model stays on the tape engine: toolchain error: the compiler ran out of memory; try: fewer functions"
    with pytest.warns(RuntimeWarning, match=told):
        assert model.simulate(0.01).metadata["profile"] == "instant"
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # once
        assert model.simulate(0.01).success


@pytest.mark.slow
def test_a_checkpoint_of_the_tape_engine_is_resumed_by_it(
    release: Release, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(PROFILES, "instant", replace(PROFILES["instant"], successor="reproducible"))
    model = eomgen.build(SCENE, profile="instant")
    whole = model.simulate(0.1)
    model.simulate(0.05, checkpoint=tmp_path / "run.ckpt")
    release(model)
    model.finish_compilation()
    assert model.library.profile == "reproducible"
    resumed = model.resume(tmp_path / "run.ckpt", 0.1)
    assert resumed.metadata["profile"] == "instant"
    assert resumed.q[-1].tobytes() == whole.q[-1].tobytes()
    other = eomgen.build(SCENE, profile="reproducible")
    with pytest.raises(ModelError, match="another compilation"):
        other.resume(tmp_path / "run.ckpt", 0.1)


@pytest.mark.slow
def test_ensembles_wait_for_the_compiler(release: Release) -> None:
    model = eomgen.build(SCENE, profile="instant")
    waited = threading.Timer(0.3, release, (model,))
    waited.start()
    model.simulate_many(4, 0.02, vary={next(iter(model.parameters)): "uniform(900, 1100)"})
    assert model.library.profile == "quick"
    waited.join()


@pytest.mark.slow
def test_batches_have_no_lanes_on_the_tape_engine(release: Release) -> None:
    model = eomgen.build(SCENE, profile="instant")
    assert model.library.companion is None
    refused = model.stepper_in_lanes(model.library, "", lambda files, preprocess: {})
    assert refused == "the model is on the tape engine until its compiler is done"
    q = np.tile(model.initial_q, (64, 1))
    assert np.array_equal(model.mass(q)[5], model.mass(model.initial_q))


@pytest.mark.long
def test_a_compiler_in_the_background_keeps_no_process_from_its_end(tmp_path: Path) -> None:
    scene = ROOT / "examples" / "misaligned_four_bar" / "scene.toml"
    code = (
        "import eomgen, time; from eomgen.toolchain import library; library._DELAY = 0\n"
        f"model = eomgen.build({str(scene)!r}, profile='instant')\n"
        "time.sleep(1.0); print(model.simulate(0.002, error_estimate=False).metadata['profile'], flush=True)"
    )
    environment = {**os.environ, "EOMGEN_CACHE": str(tmp_path), "EOMGEN_PROFILE": "fast", "PYTHONPATH": str(ROOT)}
    command, pipe = [sys.executable, "-c", code], subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "instant\n"
        process.wait(timeout=20.0)  # compilers of this model take longer
        assert process.stderr.read() == ""


def _simulated(words: list[str], folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[str, str]:
    """Return the profile that stepped a run of the command line, and the talk on stderr."""
    command = ["simulate", str(SCENE), "--out", str(folder), "--no-plots", "--json", *words]
    assert main(command) == 0
    out, err = capsys.readouterr()
    return json.loads(out)["profile"], err


@pytest.mark.slow
def test_the_command_line_steps_short_first_runs_on_the_tape_engine(
    release: Release, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("EOMGEN_PROFILE")
    for _ in range(2):  # then from the cache
        profile, talk = _simulated(["--t-end", "0.05"], tmp_path / "out", capsys)
        assert profile == "instant"
        assert "tape" not in talk
    assert _simulated(["--t-end", "0.05", "--checkpoint", str(tmp_path / "c")], tmp_path / "out", capsys)[0] == "quick"
    profile, talk = _simulated(["--t-end", "0.05"], tmp_path / "out", capsys)
    assert profile == "quick"  # the compiled library is in the cache by now


@pytest.mark.parametrize(
    ("words", "variable"),
    [(["--profile", "reproducible"], ""), (["--t-end", "1e7"], ""), (["--tolerance", "1e-6"], ""), ([], "quick")],
    ids=["chosen profile", "long run", "steps of its own", "variable"],
)
def test_other_runs_of_the_command_line_may_not_be_stepped_by_it(
    words: list[str], variable: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[float | None] = []

    def built(*_: object, steps: float | None, **__: object) -> None:
        given.append(steps)
        raise KeyboardInterrupt

    monkeypatch.setenv("EOMGEN_PROFILE", variable)
    monkeypatch.setattr("eomgen.pipeline.pipeline.build_for_run", built)
    assert main(["simulate", str(SCENE), "--out", str(tmp_path), "--no-plots", *words]) == 130
    functions = [{"operations": 10_000, "counts": {"additions": 10_000}}]
    (steps,) = given
    assert steps is None or run_seconds_on_tape(functions, steps) > 1e3 * compiler_seconds(functions, 2)


def test_a_first_run_is_estimated_by_its_steps_and_operations() -> None:
    arm = [{"operations": 7400, "counts": {"additions": 3700, "multiplications": 3700}}]
    assert run_seconds_on_tape(arm, 1000.0) < compiler_seconds(arm, 2) < run_seconds_on_tape(arm, 100_000.0)
    assert compiler_seconds(arm, 8) < compiler_seconds(arm, 2)
    assert compiler_seconds(arm, 2, loops=6000) == pytest.approx(compiler_seconds(arm, 2) + 0.66)


def test_hamiltonian_systems_are_not_for_the_tape_engine() -> None:
    told = "profile: the tape engine is for mechanical scenes, and henon_heiles is a Hamiltonian system; try: fast"
    with pytest.raises(UsageError, match=told):
        eomgen.build(ROOT / "examples" / "henon_heiles" / "system" / "henon_heiles.toml", profile="instant")
