"""A run cut in two has the bits of a run in one piece; what a checkpoint does not belong to is refused with the
difference."""

from __future__ import annotations

import os
import re
import shutil
import signal
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.files import write_arrays
from eomgen.cli import main
from eomgen.simulation.checkpoint import Checkpoint
from tests.models.scenes import PENDULUM_TOML, absolute, breaking, flyer, pendulum

STATES = ("t", "q", "v", "a", "z", "multipliers")


def same(first: eomgen.Solution, second: eomgen.Solution) -> bool:
    """Tell whether two solutions have the same bits, row by row."""
    pairs = [(getattr(first, name), getattr(second, name)) for name in STATES]
    pairs += [(array, second.outputs[name]) for name, array in first.outputs.items()]
    pairs += [(array, second.energy[name]) for name, array in first.energy.items()]
    return all(np.array_equal(one, other) for one, other in pairs)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "run.ckpt"


# -- the same bits -----------------------------------------------------------------------------------------------------


def filtered() -> eomgen.Model:
    """Return a pendulum with a first-order actuator: an internal state."""
    data = tomllib.loads(PENDULUM_TOML)
    data |= {"name": "filtered", "states": {"lag": {"rate": "(torque - lag) / 0.05", "initial": 0.1}}}
    data["efforts"]["motor"]["effort"] = "lag"
    return eomgen.build(data, profile="quick")


CASES = [
    (filtered, {"method": "generalized_alpha"}),
    (filtered, {"method": "rk4"}),
    (pendulum, {"method": "generalized_alpha"}),
    (pendulum, {"method": "rk4", "parameters": {"length": 0.45}, "t_start": 1.25}),
    (flyer, {"method": "generalized_alpha", "step": 2e-3}),
    (flyer, {"method": "rk4"}),
    (absolute, {"method": "generalized_alpha_index3"}),
    (absolute, {"method": "rk4_partitioned"}),
    (absolute, {"method": "rattlie"}),
]


def parts(
    model: eomgen.Model, file: Path, middle: float, end: float, *times: float, **options: Any
) -> tuple[eomgen.Solution, eomgen.Solution]:
    """Return a run in one piece, and from two parts with a checkpoint between."""
    one = model.simulate(end, *times, **options)
    first = model.simulate(middle, *times, checkpoint=file, **options)
    rest = model.resume(file, end)
    assert one.success and rest.success and rest.t[0] == first.t[-1]
    assert one.message.startswith(rest.message)
    return one, first.followed_by(rest)


@pytest.mark.slow_except("pendulum-generalized_alpha")
@pytest.mark.parametrize(
    ("build", "options"), CASES, ids=[f"{build.__name__}-{options['method']}" for build, options in CASES]
)
def test_two_parts_are_one_run(build: Any, options: dict[str, Any], file: Path) -> None:
    start = options.get("t_start", 0.0)
    one, whole = parts(build(), file, start + 0.114, start + 0.4, record_every=7, **options)
    assert whole.t.shape == one.t.shape and same(whole, one)
    for name in ("steps", "newton_iterations", "factorizations", "evaluations", "max_residual"):
        assert whole.stats[name] == one.stats[name], name


def test_halved_steps_and_late_factors_are_part_of_the_memory(file: Path) -> None:
    one = flyer().simulate(2.0, 0.05, settings={"max_iterations": 2, "max_halvings": 8})
    assert one.stats["halvings"] > 5 and one.stats["factorizations"] > 5
    first = flyer().simulate(0.85, 0.05, settings={"max_iterations": 2, "max_halvings": 8}, checkpoint=file)
    assert same(first.followed_by(flyer().resume(file, 2.0)), one)


def test_inputs_go_on(file: Path) -> None:
    model, table = pendulum(), np.sin(np.arange(301) * 0.01)
    for signal_given, again in ((0.3, {}), (table, {}), (np.cos, {"torque": np.cos})):
        one = model.simulate(0.3, 1e-3, inputs={"torque": signal_given})

        def breaks(t: float, signal_given: Any = signal_given) -> float:
            return float(signal_given(t)) if t < 0.2 else float("nan")

        given = breaks if callable(signal_given) else signal_given
        first = model.simulate(0.3, 1e-3, inputs={"torque": given}, checkpoint=file, checkpoint_every=70)
        assert first.success is not callable(signal_given)
        if not callable(signal_given):
            shutil.copy(file, file.with_suffix(".end"))
            first = model.simulate(0.3, 1e-3, inputs={"torque": given}, checkpoint=file, checkpoint_every=70)
        assert same(first.followed_by(model.resume(file, inputs=again)), one)


@pytest.mark.slow
def test_a_checkpoint_of_the_middle_survives_a_failure(file: Path) -> None:
    run = breaking().simulate(1.0, 1e-3, checkpoint=file, checkpoint_every=130)
    assert not run.success and run.t[-1] > 0.49
    again = breaking().resume(file)
    assert again.t[0] == pytest.approx(0.39) and np.array_equal(again.q[-1], run.q[-1])
    assert again.message.startswith(run.message.split(";")[0])


def test_ctrl_c_leaves_a_checkpoint(file: Path) -> None:
    sent = []

    def progress(done: int, total: int) -> None:
        if done > 100 and not sent:
            sent.append(done)
            os.kill(os.getpid(), signal.SIGINT)

    model = pendulum()
    run = model.simulate(30.0, 1e-3, record_every=10, checkpoint=file, progress=progress)
    assert run.interrupted and run.message.endswith(f"; the checkpoint {file} holds its last state")
    rest = model.resume(file)
    assert rest.success and rest.t[0] == run.t[-1] and rest.t[-1] == pytest.approx(30.0)
    assert same(run.followed_by(rest), model.simulate(30.0, 1e-3, record_every=10))


# -- writing -----------------------------------------------------------------------------------------------------------


def test_checkpoints_are_written_as_often_as_asked_and_as_a_whole(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[float] = []
    saved = Checkpoint.save

    def save(self: Checkpoint, path: Path) -> None:
        times.append(float(self.start["t"][0]))
        saved(self, path)
        assert [item.name for item in path.parent.iterdir()] == [path.name]

    monkeypatch.setattr(Checkpoint, "save", save)
    pendulum().simulate(0.1, 1e-3, checkpoint=file, checkpoint_every=40)
    np.testing.assert_allclose(times, [0.0, 0.04, 0.08, 0.1], atol=1e-12)
    assert Checkpoint.load(file).start["q"].shape == (1,)


def test_a_place_that_cannot_be_written_to_is_said_at_once(tmp_path: Path) -> None:
    with pytest.raises(eomgen.FileError, match=r"missing/run\.ckpt: cannot be written"):
        pendulum().simulate(1e4, 1e-3, checkpoint=tmp_path / "missing" / "run.ckpt")


def test_a_disk_that_fails_later_does_not_end_the_run(tmp_path: Path) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()

    def progress(done: int, total: int) -> None:
        shutil.rmtree(folder, ignore_errors=True)

    run = pendulum().simulate(0.2, 1e-3, checkpoint=folder / "run.ckpt", progress=progress)
    assert run.success and len(run.t) == 201
    assert re.match(
        r"reached t = 0\.2 s in 200 steps; no checkpoint was written after 0 steps: .*cannot be", run.message
    )


# -- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_what_a_checkpoint_does_not_belong_to_is_refused(file: Path) -> None:
    pendulum().simulate(0.1, 1e-3, checkpoint=file, inputs={"torque": 0.5}, parameters={"length": 0.45})
    text = PENDULUM_TOML.replace("damping = 0.05", "damping = 0.06")
    assert text != PENDULUM_TOML
    other = eomgen.build(tomllib.loads(text), profile="quick")
    for call, said in (
        (lambda: flyer().resume(file), r"this checkpoint is one of the scene 'shaken', the model is 'flyer'.*start\.q"),
        (lambda: other.resume(file), "written by another model 'shaken': the scene or eomgen changed"),
        (lambda: pendulum().resume(file, parameters={"length": 0.5}), r"parameter length: the run has 0\.45, not 0\.5"),
        (lambda: pendulum().resume(file, inputs={"torque": 0.6}), "input torque: the run has another number; try: no"),
        (lambda: pendulum().resume(file, 0.05), r"t_end: the end 0\.05 s lies before the checkpoint's time 0\.1 s"),
    ):
        with pytest.raises((eomgen.ModelError, eomgen.UsageError), match=said):
            call()
    assert pendulum().resume(file, 0.15, parameters={"length": 0.45}, inputs={"torque": 0.5}).success


def test_functions_are_asked_for_and_others_left_out(file: Path) -> None:
    pendulum().simulate(0.05, 1e-3, checkpoint=file, inputs={"torque": np.sin})
    with pytest.raises(eomgen.UsageError, match="input torque: the run had a function of t here, which no file holds"):
        pendulum().resume(file, 0.1)
    pendulum().simulate(0.05, 1e-3, checkpoint=file)
    with pytest.raises(eomgen.UsageError, match="input torque: the run followed the scene here; try: leave it out"):
        pendulum().resume(file, 0.1, inputs={"torque": np.sin})


def test_another_compilation_is_refused(file: Path) -> None:
    pendulum().simulate(0.05, 1e-3, checkpoint=file)
    saved = Checkpoint.load(file)
    replace(saved, run={**saved.run, "build": "0"}).save(file)
    with pytest.raises(eomgen.ModelError, match="another compilation of 'shaken', whose last bits may differ; try: th"):
        pendulum().resume(file, 0.1)


def test_other_files_are_no_checkpoints(file: Path, tmp_path: Path) -> None:
    def refused(path: Path, said: str) -> None:
        with pytest.raises(eomgen.FileError, match=said):
            pendulum().resume(path)

    for data in (b"", b"hello", b"PK\x03\x04 cut short"):
        file.write_bytes(data)
        refused(file, r"run\.ckpt: this is not a checkpoint written by eomgen: it is not ")
    solution = pendulum().simulate(0.05, 1e-3, checkpoint=file).save(tmp_path / "solution.npz")
    refused(solution, r"solution\.npz: this is not a checkpoint written by eomgen")
    refused(tmp_path / "missing.ckpt", r"missing\.ckpt: cannot be read: No such file")
    saved = Checkpoint.load(file)
    write_arrays(file, {"state": saved.state}, {"kind": "checkpoint", "format": 2, "version": "9.0"})
    refused(file, r"a checkpoint of format 2, written by eomgen 9\.0; this one reads 1")
    write_arrays(file, {"state": saved.state}, {"kind": "checkpoint", "format": 1})
    refused(file, r"this is not a whole checkpoint: scene, method, .* missing")


# -- the command line --------------------------------------------------------------------------------------------------


def test_the_command_line_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, saved = tmp_path / "scene.toml", tmp_path / "run.ckpt"
    scene.write_text(PENDULUM_TOML, encoding="utf-8")
    shared = ["simulate", str(scene), "--no-plots", "--set", "length=0.4", "--out"]
    assert main([*shared, str(tmp_path / "one"), "--t-end", "0.3", "--method", "rk4"]) == 0
    assert (
        main([*shared, str(tmp_path / "first"), "--t-end", "0.1", "--method", "rk4", "--checkpoint", str(saved)]) == 0
    )
    assert main([*shared, str(tmp_path / "rest"), "--t-end", "0.3", "--resume", str(saved)]) == 0
    one, first, rest = (eomgen.Solution.load(tmp_path / name / "solution.npz") for name in ("one", "first", "rest"))
    assert same(first.followed_by(rest), one)
    capsys.readouterr()
    assert main([*shared, str(tmp_path / "rest"), "--resume", str(saved), "--step", "1e-2", "--method", "rk4"]) == 2
    text = " ".join(capsys.readouterr().err.split())
    assert (
        "--step, --method: the run that goes on has its method, step and rows settled; try: --resume without them"
        in text
    )
    assert main([*shared, str(tmp_path / "rest"), "--resume", str(tmp_path / "no.ckpt")]) == 7
    assert main([*shared[:3], "--set", "length=0.6", "--out", str(tmp_path / "rest"), "--resume", str(saved)]) == 2
    assert "parameter length: the run has 0.4, not 0.6" in " ".join(capsys.readouterr().err.split())
