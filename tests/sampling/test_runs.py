"""Runs of sampling: what they find and write, going on from checkpoints to the same bits, the command line."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import tracemalloc
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from eomgen.cli import INTERRUPTED, main
from eomgen.errors import DescriptionError, EomgenError
from eomgen.fields import Sampler
from eomgen.products.fields.documents.field_reading import fields_from_data
from eomgen.sampling import FieldSamples, field_problem, sample
from tests.hamiltonian.systems import OSCILLATOR
from tests.models.toml_text import toml_text
from tests.sampling.files import changed

FILE = """\
format = 1
kind = "hamiltonian"
name = "small"
[mesh]
cells = [8, 8]
length = 40.0
[operators]
s = { power = "300*exp(-(4*k)**2)" }
[truth]
seed = 3
[data]
counts = { poisson = "exp(s - s_variance/2)" }
[cell]
energy = "exp(s - s_variance/2) - counts*s"
[sampling]
warm_up = 8
samples = 12
watched = 30
bins = 3
"""


def equal(one: FieldSamples, two: FieldSamples) -> None:
    for name in ("accepted", "energy_errors", "potential", "gradients", "cells", "power", "mean", "deviation", "steps"):
        assert np.array_equal(getattr(one.samples, name), getattr(two.samples, name), equal_nan=True), name
    assert np.array_equal(one.warm_up, two.warm_up)
    assert one.gradients == two.gradients


def press_at(count: int) -> Any:
    """Return a function of progress that presses Ctrl-C when so many trajectories are done."""

    def progress(done: int, _: int) -> None:
        if done == count:
            os.kill(os.getpid(), signal.SIGINT)

    return progress


@pytest.mark.parametrize("at", [3, 12, 13, 27])  # in the warm-up, at its end, and in the middle of a round of chains
def test_a_run_that_is_interrupted_goes_on_to_the_same_bits(at: int, tmp_path: Path) -> None:
    data = changed(mesh={"cells": [8, 8], "length": 40.0})
    whole = sample(data)
    part = sample(data, folder=tmp_path, progress=press_at(at))
    assert part.interrupted and part.message.startswith("interrupted: ")
    assert part.warm_up.shape[1] == min(at // 2, 6) and part.count == max(at // 2 - 6, 0)
    end = sample(data, folder=tmp_path, resume=True)
    assert not end.interrupted and end.count == 10
    equal(whole, end)


def test_a_run_by_fftw_in_single_precision_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    data = changed(sampling={"chains": 2, "warm_up": 6, "samples": 10, "watched": 20, "bins": 3, "transforms": "fftw"})
    whole = sample(data, precision="single")
    part = sample(data, precision="single", folder=tmp_path, progress=press_at(17))
    assert part.interrupted
    with pytest.raises(EomgenError, match="it belongs to a run with transforms = 'fftw', and here it is 'scipy'"):
        sample(data, precision="single", transforms="scipy", folder=tmp_path, resume=True)
    equal(whole, sample(data, precision="single", folder=tmp_path, resume=True))
    by_scipy = sample(changed())
    assert whole.samples.potential == pytest.approx(by_scipy.samples.potential, rel=1e-4)
    assert not np.array_equal(whole.samples.potential, by_scipy.samples.potential)


def test_a_run_may_be_made_longer(tmp_path: Path) -> None:
    whole = sample(changed(), samples=14)
    first = sample(changed(), folder=tmp_path, samples=5)
    assert first.count == 5
    equal(whole, sample(changed(), folder=tmp_path, resume=True, samples=14))
    with pytest.raises(EomgenError, match="it has 14 samples of each chain, and 3 are asked for; try: samples from 14"):
        sample(changed(), folder=tmp_path, resume=True, samples=3)
    with pytest.raises(
        EomgenError, match="it belongs to a run with seed = 0, and here it is 5; try: the same settings"
    ):
        sample(changed(), folder=tmp_path, resume=True, samples=14, seed=5)
    with pytest.raises(EomgenError, match="it belongs to another posterior: the file or its data have changed since"):
        sample(changed(parameters__mean=0.8), folder=tmp_path, resume=True, samples=14)
    with pytest.raises(EomgenError, match=r"checkpoint\.npz: cannot be read"):
        sample(changed(), folder=tmp_path / "none", resume=True)
    with pytest.raises(EomgenError, match="a run goes on from the checkpoint of a folder"):
        sample(changed(), resume=True)


def test_chains_start_where_a_file_says(tmp_path: Path) -> None:
    mesh = field_problem(fields_from_data(changed())).mesh
    fields = np.random.default_rng(3).standard_normal((2, *mesh.cells))
    np.save(tmp_path / "start.npy", fields)
    made = sample(changed(), start=str(tmp_path / "start.npy"), warm_up=0, samples=1, step=1e-9, duration=1e-9)
    problem = made.problem
    starts = [problem.posterior.energy(mesh.spectrum(field)) for field in fields]
    assert made.samples.potential[:, 0] == pytest.approx(starts, rel=1e-6)
    np.save(tmp_path / "flat.npy", np.ones(3))
    with pytest.raises(EomgenError, match=r"it has the shape \(3,\), or numbers that are not finite"):
        sample(changed(), start=str(tmp_path / "flat.npy"))


def test_paths_of_starts_in_a_file_begin_at_its_folder(tmp_path: Path) -> None:
    data = changed()
    data["sampling"] = {**data.get("sampling", {}), "start": "start.npy"}
    assert fields_from_data(data, folder=tmp_path).sampling.start == str(tmp_path / "start.npy")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"sample": 3}, "sample: sample: there is no such setting; try: samples"),
        ({"samples": 2.5}, "sample: samples: a whole number is needed, not 2.5"),
        ({"field": "r"}, "sample: field: there is no field 'r'; try: one of s"),
        ({"chains": 0}, "sample: chains: 0 is invalid; try: from 1 on"),
        ({"step": -1.0}, "Sampler: step: -1 is invalid"),
        ({"step": 1e-320}, "step, guard and duration: inf steps of 9.99989e-321 would lead to 1.5; 1e+15 are"),
        ({"guard": 1e-320}, "step, guard and duration: inf steps of "),
        ({"duration": 1e308}, "would lead to 1e+308; 1e+15 are counted at most; try: a step of 1e+293 or more, or"),
        ({"method": "leapfrg"}, "leapfrog"),
        ({"start": "modus"}, "Sampler: start: 'modus' is not a start"),
        ({"mass": "heavy"}, "mass: there is no mass 'heavy'"),
        ({"transforms": "fft"}, "transforms: there is no library 'fft'; try: fftw"),
        ({"precision": "half"}, "precision: there is no precision 'half'; try: one of double, single"),
    ],
)
def test_settings_that_cannot_be(options: dict[str, Any], text: str) -> None:
    with pytest.raises(EomgenError) as caught:
        sample(changed(), **options)
    assert text in str(caught.value)


@pytest.mark.slow
@pytest.mark.long_cases("fftw-single")
@pytest.mark.parametrize(("transforms", "precision"), [("scipy", "double"), ("fftw", "single")])
def test_a_run_takes_no_more_memory_than_it_says(transforms: str, precision: str) -> None:
    data = changed(mesh={"cells": [32, 32, 32], "length": 160.0})
    sample(data, warm_up=1, samples=1, transforms=transforms, precision=precision)  # imports, C
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        made = sample(data, warm_up=2, samples=4, transforms=transforms, precision=precision)
        peak = tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()
    assert 0.7 * made.problem.memory < peak <= made.problem.memory


def test_scales_are_those_of_the_fields() -> None:
    made = sample(changed(mesh={"cells": [12, 10], "length": [60.0, 50.0]}), samples=30)
    mesh, truth = made.problem.mesh, made.problem.true_field()
    assert truth is not None
    t, m = np.fft.fft2(truth, norm="ortho"), np.fft.fft2(made.samples.mean, norm="ortho")
    kx = 2 * np.pi * np.fft.fftfreq(12, 5.0)[:, None]
    ky = 2 * np.pi * np.fft.fftfreq(10, 5.0)
    number = np.ceil(np.hypot(kx, ky) / (np.pi / 5.0) * 3 - 1e-12)
    for place, scale in enumerate(made.scales(), 1):
        chosen = number == place
        of_truth, of_mean = (np.mean(np.abs(field[chosen]) ** 2) for field in (t, m))
        assert scale.truth == pytest.approx(of_truth, rel=1e-12)
        assert scale.of_mean == pytest.approx(of_mean, rel=1e-12)
        together = np.mean((t[chosen] * m[chosen].conj()).real)
        assert scale.correlation == pytest.approx(together / np.sqrt(of_truth * of_mean), rel=1e-10)
        prior = np.mean(300.0 * np.exp(-((4.0 * np.hypot(kx, ky)[chosen]) ** 2)) / mesh.cell_volume)
        assert scale.prior == pytest.approx(prior, rel=1e-12)
        assert scale.mean == pytest.approx(made.samples.power[:, :, place - 1].mean(), rel=1e-14)


@pytest.mark.slow
def test_the_command_line_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(FILE, encoding="utf-8")
    assert main(["sample", "small.toml", "--out", "out", "--seed", "4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["success"] and told["samples"] == 12 and told["settings"]["seed"] == 4
    assert told["r_hat_of_cells"] > 0.9 and len(told["scales"]) == 3
    assert set(told["files"]) == {
        "samples.npz", "trajectories.csv", "scales.csv", "summary.json", "slices.png", "power.png", "chains.png"
    }  # fmt: skip
    written = {path.name for path in Path("out").iterdir()}
    assert written == {*told["files"], "checkpoint.npz"}
    arguments = ["sample", "small.toml", "--out", "out", "--seed", "4", "--resume", "--samples", "16", "--no-plots"]
    assert main(arguments) == 0
    shown = capsys.readouterr()
    for word in (
        "acceptance",
        "r hat of cells",
        "gradients per independent sample",
        "memory",
        "scales: power of a mode",
    ):
        assert word in shown.out
    assert "16 samples of each of 2 chains after 8 trajectories of warm-up" in shown.err


def test_the_command_line_says_what_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(FILE, encoding="utf-8")
    Path("few.toml").write_text(toml_text(OSCILLATOR), encoding="utf-8")
    Path("wrong.toml").write_text(FILE.replace("300*exp", "-300*exp"), encoding="utf-8")
    for arguments, code, text in (
        (["sample", "few.toml"], 3, "there is no mesh: sampling draws fields on the cells of a mesh, not motions"),
        (["sample", "wrong.toml"], 4, "wrong.toml:8 (operators.s): the power is -"),
        (["simulate", "small.toml"], 3, "small.toml:4 (mesh): this is a system of fields on a mesh"),
        (["sample", "none.toml"], 7, "none.toml"),
        (["sample", "small.toml", "--chains", "0"], 2, "sample: chains: 0 is invalid"),
    ):
        assert main([*arguments, "--out", "out"]) == code
        assert text in capsys.readouterr().err


@pytest.mark.slow
def test_ctrl_c_keeps_what_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(FILE, encoding="utf-8")
    original, calls = Sampler._trajectory, [0]

    def pressing(self: Sampler, *arguments: Any) -> Any:
        calls[0] += 1
        if calls[0] == 25:
            os.kill(os.getpid(), signal.SIGINT)
        return original(self, *arguments)

    monkeypatch.setattr(Sampler, "_trajectory", pressing)
    assert main(["sample", "small.toml", "--out", "out"]) == INTERRUPTED
    text = "4 samples of each of 2 chains after 8 trajectories of warm-up, of 12; with a folder, --resume goes on"
    assert text in capsys.readouterr().err
    assert Path("out/chains.png").exists() and Path("out/checkpoint.npz").exists()
    assert main(["sample", "small.toml", "--out", "out", "--resume", "--no-plots"]) == 0


def test_mean_and_deviation_are_those_of_all_samples() -> None:
    made = sample(changed(), watched=240)
    cells = made.samples.cells.reshape(-1, 240)
    assert cells.shape[0] == 20
    assert made.samples.mean.ravel() == pytest.approx(cells.mean(axis=0), abs=1e-13)
    assert made.samples.deviation.ravel() == pytest.approx(cells.std(axis=0, ddof=1), abs=1e-13)


def test_info_shows_a_system_of_fields(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(FILE, encoding="utf-8")
    assert main(["info", "small.toml", "--method", "suzuki4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["operators"] == {"s": "power"} and told["data"] == {"counts": "poisson"}
    assert told["transforms_per_gradient"] == 2 and told["fields"] == ["s"]
    assert told["method"]["gradients"] == 5 and told["method"]["order"] == 4
    assert told["wave_numbers"] == pytest.approx([2 * np.pi / 40, np.pi / 5])
    assert told["memory"] == sample("small.toml").problem.memory
    assert main(["info", "small.toml"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert (
        shown.startswith("small cells 8, 8 lengths 40, 40 memory 0.0")
        and "MiB at most wave numbers 0.157079633, 0.628" in shown
    )
    assert "energy exp(s - s_variance/2) - counts*s fields s transforms per gradient 2 mass fisher" in shown
    assert "method name = minimum_norm2 order = 2 gradients = 2 stability_limit = 2.5531" in shown
    Path("large.toml").write_text(FILE.replace("[8, 8]", "[10000000, 10000000]"), encoding="utf-8")
    assert main(["info", "large.toml"]) == 4
    assert "large.toml:5 (mesh.cells): sampling with 2 chains on 10000000 x 10000000 cells" in capsys.readouterr().err


def test_a_run_says_what_was_not_as_asked() -> None:
    """Steps that the guard has cut, and trajectories that went where the energy has no values."""
    cut = sample(changed(), step=100.0)
    assert f"of warm-up; steps are {cut.largest_step:.4g}, not 100: the guard allows no larger ones" in cut.message
    assert cut.samples.steps == pytest.approx([cut.largest_step] * 2, rel=1e-15)
    behind = changed(cell={"energy": "-0.1*log(0.4 - s)"}, data=None, truth=None, mass={"choice": "prior"})
    lost = sample(behind, start="zero", warm_up=0, samples=60, step=0.5, guard=0.9)
    count = int(np.sum(np.isinf(lost.samples.energy_errors)))
    assert 0 < count < 120
    text = f"; {count} of 120 trajectories ended at states whose energy is not finite, and were rejected; try"
    assert text in lost.message
    assert sample(changed()).message.endswith("of warm-up")


@pytest.mark.slow
def test_chains_that_stand_still_have_no_diagnostics(tmp_path: Path) -> None:
    """Where no trajectory ends at a finite energy: the message says it, and nothing of NumPy stands beside it."""
    falling = changed(cell={"energy": "-s**4"}, data=None, truth=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lost = sample(falling, start="prior", warm_up=10, samples=60, folder=tmp_path)
        told = lost.to_dict()
        lost.save(tmp_path)
    assert "trajectories ended at states whose energy is not finite, and were rejected" in lost.message
    assert told["acceptance"] == 0.0 and math.isnan(told["half_variance_of_energy_errors"])
    assert math.isnan(told["r_hat_of_cells"]) and math.isnan(told["r_hat_of_cells_at_99_percent"])
    assert not lost.message.endswith("nan in a cell")


@pytest.mark.slow
def test_chains_that_do_not_agree_are_said_to() -> None:
    """A third of a line is not seen, and a mass that is of the rest is too heavy there; that of the prior is not."""
    data = changed(
        mesh={"cells": 256, "length": 256.0},
        operators={"s": {"power": "20*exp(-(6*k)**2)"}},
        data={"seen": "1 if x < 180 else 0", "counts": {"poisson": "seen*2*exp(s)"}},
        cell={"energy": "seen*2*exp(s) - counts*s"},
    )
    apart = sample(data, samples=80, warm_up=50, watched=256)
    assert "chains do not agree yet: split R-hat is " in apart.message and apart.r_hats().max() > 1.3
    together = sample(data, samples=80, warm_up=50, watched=256, mass="prior")
    assert together.message.endswith("of warm-up") and together.r_hats().max() < 1.3
    still = sample(data, samples=8, warm_up=2, watched=256, step=1e-18, duration=1e-18)
    assert "chains did not move: watched cells change by rounding alone" in still.message


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ('method = "omf5"', "there is no composition 'omf5'; try: omf4"),
        ('transforms = "fftq"', "'fftq' is not known here; try: one of scipy or fftw"),
        ('precision = "singel"', "'singel' is not known here; try: one of double or single"),
        ('first = "x"', "'x' is not known here; try: one of random, drift or kick"),
        ('start = "x"', "'x' is not a start; try: mode, prior, zero or the path of a .npy file of white fields"),
        ('method = ""', "there is no composition ''; try: one of leapfrog, minimum_norm2"),
    ],
)
def test_settings_of_a_file_are_named_with_their_line(
    setting: str, text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "fields.md").read_text(encoding="utf-8")
    content = page.split("```toml\n")[1].split("```")[0].replace('method = "omf4"', setting)
    file = tmp_path / "counts.toml"
    file.write_text(content, encoding="utf-8")
    line = content[: content.index(setting)].count("\n") + 1
    key, _, _ = setting.partition(" ")
    assert main(["sample", str(file), "--out", str(tmp_path / "out")]) == DescriptionError.exit_code
    said = capsys.readouterr().err
    assert f"counts.toml:{line} (sampling.{key}): {text}" in said
    assert main(["info", str(file)]) == DescriptionError.exit_code
    assert f"counts.toml:{line} (sampling.{key}): {text}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "description error: small.toml:5 (sampling.transforms): FFTW comes with the package pyfftw, which is not"),
        ({"transforms": "fftw"}, "usage error: transforms: FFTW comes with the package pyfftw, which is not installed"),
    ],
)
def test_transforms_without_their_package_are_named_where_they_are_chosen(
    options: dict[str, Any], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyfftw", None)  # an import fails
    system = fields_from_data(changed(sampling__transforms="fftw"), file="small.toml", lines={"sampling.transforms": 5})
    with pytest.raises(EomgenError) as caught:
        sample(system, **options)
    assert str(caught.value).startswith(text)
