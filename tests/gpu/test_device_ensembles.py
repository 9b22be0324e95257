"""Ensembles on a device, by the stand-in: bits of runs on the processor, statistics but for rounding, refusals."""

from __future__ import annotations

import ctypes
import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.products.ensembles.samples import SampleRunner
from eomgen.products.gpu import ensembles
from eomgen.products.gpu.ensembles import DeviceSamples, compile_runs
from eomgen.products.gpu.nvrtc import AS_CALLS
from tests.examples.covering import covering
from tests.models.library import scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SWING = scene(
    "pendulum",
    name="swing",
    gravity=[0, 0, -9.81],
    parameters__mass={"value": 1.0, "unit": "kg", "tunable": True},
    bodies__rod__mass="mass",
    points__tip={"body": "rod", "position": [0, 0, -1]},
    efforts={"coil": {"joint": "hinge", "effort": "-20 * q.hinge"}},
    outputs={"height": {"position": "tip"}, "pull": {"formula": "mass * push"}},
    inputs={"push": {"formula": "sin(3 * t)"}},
    simulation=None,
)
SIZE = "sizeof(swing_state) + sizeof(swing_workspace)"
VARY = {"mass": "uniform(0.8 kg, 1.2 kg)", "q.hinge": "uniform(-1, 1)"}


def built(description: Any, method: str) -> eomgen.Model:
    return eomgen.build(description, method=method, profile="reproducible")


def both(model: eomgen.Model, *run: float, **options: Any) -> tuple[eomgen.Ensemble, eomgen.Ensemble]:
    """Return an ensemble of the processor, and the same of the device."""
    cpu = model.simulate_many(*run, **options)
    return cpu, model.simulate_many(*run, **options, device="gpu")


def compare(cpu: eomgen.Ensemble, gpu: eomgen.Ensemble) -> None:
    """Assert that ends, extremes, counts and quantiles are equal, and moments up to rounding."""
    assert gpu.how == "on the device stand-in"
    assert (cpu.columns, cpu.done, cpu.failed) == (gpu.columns, gpu.done, gpu.failed)
    for name in cpu.results:
        np.testing.assert_array_equal(cpu.results[name], gpu.results[name], err_msg=name)
    for column in cpu.columns:
        np.testing.assert_array_equal(cpu.count(column), gpu.count(column))
        np.testing.assert_array_equal(cpu.envelope(column), gpu.envelope(column))
        np.testing.assert_array_equal(
            cpu.quantile(column, [0.0, 0.05, 0.5, 1.0]), gpu.quantile(column, [0.0, 0.05, 0.5, 1.0])
        )
        scale = np.nanmax(np.abs(cpu.envelope(column)))
        np.testing.assert_allclose(gpu.mean(column), cpu.mean(column), rtol=0.0, atol=1e-14 * scale)
        np.testing.assert_allclose(gpu.deviation(column), cpu.deviation(column), rtol=0.0, atol=1e-14 * scale)
    scales = np.nanmax([np.abs(cpu.envelope(column)) for column in cpu.columns], axis=(1, 2))
    apart = np.nanmax(np.abs(gpu.covariance - cpu.covariance), axis=0)
    assert (apart <= 1e-14 * np.multiply.outer(scales, scales)).all()


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"points": 3, "columns": ["q.hinge", "a.hinge", "energy.kinetic", "input.push", "height"]},
        {"run": (0.505, 0.01), "record_every": 7, "settings": {}},
        {"vary": {"push": "uniform(-1, 1)"}},
        {"inputs": {"push": np.cos}},
        {"vary": {"scale.push": "uniform(0.5, 2)"}},
        {"keep": [3], "t_start": 0.25},
        {"method": "yoshida4"},
    ],
    ids=["plain", "columns", "shorter last step", "held inputs", "common table", "tables", "kept", "composition"],
)
def test_samples_have_the_bits_of_the_processor(options: dict[str, Any], tmp_path: Path) -> None:
    run = options.pop("run", (0.5, 0.01))
    model = built(SWING, "rk4")
    given = {"vary": VARY, "samples": 23, "seed": 1} | options
    if "keep" not in given:
        return compare(*both(model, *run, **given))
    cpu = model.simulate_many(*run, **given, folder=tmp_path / "cpu")
    gpu = model.simulate_many(*run, **given, folder=tmp_path / "gpu", device="gpu")
    compare(cpu, gpu)
    files = [tmp_path / kind / "runs" / "sample_0000003.npz" for kind in ("cpu", "gpu")]
    np.testing.assert_array_equal(*(eomgen.Solution.load(file).q for file in files))


@pytest.mark.slow
@pytest.mark.long_except("rk45")
@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    ("name", "method", "vary"),
    [
        ("double_pendulum_on_shaking_base", "rk45", {"m2": "normal(0.6, 5%)", "q.shoulder": "uniform(-0.5, 0.5)"}),
        ("double_pendulum_on_shaking_base", "taylor", {"m2": "normal(0.6, 5%)"}),
        ("spin_up_beam", "rosenbrock", {"v.blade[0]": "uniform(-0.1, 0.1)"}),
        ("quarter_car", "generalized_alpha", {"damper": "uniform(800, 1200)", "seed.road": "integers(0, 99)"}),
        ("shear_frame_with_pendulum", "rosenbrock", {"shake": "uniform(0.5, 2)"}),
        ("spherical_pendulum", "rattlie", {"v.ball[0]": "uniform(-1, 1)"}),
        ("active_vehicle", "generalized_alpha", {"skyhook": "uniform(800, 1200)"}),
    ],
    ids=["rk45", "taylor", "beam", "inputs", "rosenbrock", "rattlie", "harmonics"],
)
def test_methods_have_the_bits_of_the_processor(name: str, method: str, vary: dict[str, str]) -> None:
    compare(*both(built(EXAMPLES / name / "scene.toml", method), 0.25, 1e-3, vary=vary, samples=64, seed=1))


@pytest.mark.long
@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    "name", covering(sorted(f"{file.parent.name}/scene.toml" for file in EXAMPLES.glob("*/scene.toml")))
)
def test_examples_have_the_bits_of_the_processor(name: str) -> None:
    """Twenty steps and a shorter one, all columns."""
    model = eomgen.build(EXAMPLES / name, profile="reproducible")
    step = float(model.library.layout["defaults"]["step"])
    columns = [column for column in model.simulate(step, step, error_estimate=False).columns() if column != "t"]
    given: dict[str, Any] = {"vary": {model.v_names[0]: "uniform(0.01, 0.02)"}, "samples": 4, "columns": columns}
    cpu = model.simulate_many(20.3 * step, step, **given)
    gpu = model.simulate_many(20.3 * step, step, **given, device="gpu")
    for result in cpu.results:
        np.testing.assert_array_equal(cpu.results[result], gpu.results[result], err_msg=result)


@pytest.mark.usefixtures("stand_in")
def test_tolerances_in_float_are_the_processors() -> None:
    """Tolerances for double are below the last digits of single precision: steppers raise them."""
    model = eomgen.build(SWING, method="generalized_alpha", profile="reproducible", real="float")
    compare(*both(model, 0.2, 0.01, vary=VARY, samples=6, seed=1))


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_harmonics_of_a_road_have_tables_that_threads_share() -> None:
    """Two tables: of the step, and of the shorter one at the end."""
    car = built(EXAMPLES / "quarter_car" / "scene.toml", "generalized_alpha")
    assert car.library.layout["method"]["harmonics"]["frequencies"] == 200
    compare(*both(car, 0.1503, 1e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1))


@pytest.mark.long
@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize("method", ["generalized_alpha", "rosenbrock", "rattlie"])
def test_closed_loops_have_the_bits_of_the_processor(method: str) -> None:
    model = built(EXAMPLES / "four_bar" / "scene.toml", method)
    compare(*both(model, 0.3, 1e-3, vary={"v.drive": "uniform(0.5, 2)"}, samples=64))


@pytest.mark.slow
@pytest.mark.usefixtures("stand_in")
def test_a_beam_that_is_shortened_by_nine_tenths_is_judged_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start with a deflection beyond the length of the beam."""
    model, seen = built(EXAMPLES / "spin_up_beam" / "scene.toml", "rosenbrock"), list[int]()
    alone = DeviceSamples.run_alone

    def watched(self: DeviceSamples, first: int, values: Any, samples: Any) -> Any:
        return alone(self, first, values, (seen.append(item[0]) or item for item in samples))

    monkeypatch.setattr(DeviceSamples, "run_alone", watched)
    table = {"q.blade[0]": [0.0, 0.01, 30.0, 0.02]}
    compare(*both(model, 0.2, 1e-3, table=table))
    assert seen == [2]


@pytest.mark.usefixtures("stand_in")
def test_failed_samples_are_run_again_for_their_reasons() -> None:
    """RK4 is stable up to 2.83 by the step: a heavy rod on its spring has 2.1, a light one 3.5; a mass is negative."""
    table = {"mass": [1.0, 1.0, 0.01, 1.0, -1.0, 1.0], "q.hinge": [1e-3] * 6}
    cpu, gpu = both(built(SWING, "rk4"), 60.0, 0.25, table=table, inputs={"push": 0.0})
    compare(cpu, gpu)
    assert [sample.number for sample in gpu.failed] == [2, 4] and "mass" in gpu.failed[1].reason
    assert (gpu.count("height[2]") == 4).all()


@pytest.mark.usefixtures("stand_in")
def test_chunks_are_merged_and_condensed_as_on_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.ensembles.statistics._KEPT", 2**10)
    monkeypatch.setattr(DeviceSamples, "block_size", staticmethod(lambda *sizes: 256))
    done: list[int] = []
    options: dict[str, Any] = {"vary": VARY, "samples": 1000, "points": 4, "seed": 1, "columns": ["q.hinge"]}
    model = built(SWING, "rk4")
    cpu = model.simulate_many(0.5, 0.01, **options)
    gpu = model.simulate_many(0.5, 0.01, **options, device="gpu", progress=lambda now, of: done.append(now))
    assert done == [256, 512, 768, 1000]
    np.testing.assert_array_equal(cpu.envelope("q.hinge"), gpu.envelope("q.hinge"))
    np.testing.assert_allclose(gpu.mean("q.hinge"), cpu.mean("q.hinge"), rtol=0.0, atol=1e-15)
    shares = np.array([0.01, 0.1, 0.5, 0.9, 0.99])
    np.testing.assert_allclose(gpu.quantile("q.hinge", shares), cpu.quantile("q.hinge", shares), atol=0.005)
    weights = gpu.reduction.arrays()["weights"]
    np.testing.assert_array_equal(weights.sum(axis=1), np.full(4, 1000.0))


@pytest.mark.usefixtures("stand_in")
def test_an_interrupted_ensemble_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DeviceSamples, "block_size", staticmethod(lambda *sizes: 16))
    model, options = built(SWING, "rk4"), {"vary": VARY, "samples": 40, "device": "gpu", "seed": 1}

    def stop(done: int, total: int) -> None:
        if done == 32:
            raise KeyboardInterrupt

    whole = model.simulate_many(0.5, 0.01, **options)
    part = model.simulate_many(0.5, 0.01, **options, folder=tmp_path / "out", progress=stop)
    assert part.interrupted and part.done == 32 and "ended by Ctrl-C" in part.message
    again = model.simulate_many(0.5, 0.01, **options, folder=tmp_path / "out", resume=True)
    for name, array in whole.reduction.arrays().items():
        np.testing.assert_array_equal(again.reduction.arrays()[name], array, err_msg=name)
    with pytest.raises(eomgen.FileError, match="holds an ensemble with other device"):
        model.simulate_many(0.5, 0.01, **{**options, "device": "cpu"}, folder=tmp_path / "out", resume=True)


def test_a_chunk_has_numbers_for_the_card_alone() -> None:
    assert DeviceSamples.block_size(10**6, 10**4, 301) == 2**17
    assert DeviceSamples.block_size(10**6, 10**4, 12 * 301) == 2**15
    assert DeviceSamples.block_size(10**6, 10**8, 301) == 2**13
    assert DeviceSamples.block_size(100, 10**4, 301) == 100
    assert (SampleRunner.device, DeviceSamples.device) == ("cpu", "gpu")


@pytest.mark.parametrize(
    ("description", "method", "options"),
    [(SWING, "rk4", ()), (EXAMPLES / "four_bar" / "scene.toml", "generalized_alpha", AS_CALLS)],
)
def test_functions_stay_functions_in_runs_with_large_states(
    description: Any, method: str, options: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thread of the four-bar keeps more bytes than registers hold."""
    monkeypatch.setattr(ensembles, "nvrtc", lambda: SimpleNamespace(version="13.5"))
    monkeypatch.setattr(ensembles, "compile_cubin", lambda texts, *_, **__: texts()[1])
    model = built(description, method)
    assert compile_runs(model, method, model.library, ["x"], {"x": ("q", 0)}, "sm_90") == options


def test_bytes_of_structs_are_as_a_compiler_has_them(tmp_path: Path) -> None:
    eomgen.generate(SWING, tmp_path / "swing", target="cuda", method="rk4")
    manifest = json.loads((tmp_path / "swing" / "manifest.json").read_text())
    program = f'#include "swing.h"\n#include <stdio.h>\nint main(void) {{ printf("%zu", {SIZE}); }}\n'
    (tmp_path / "swing" / "size.cpp").write_text('#include "eomgen_cuda.h"\n' + program)
    subprocess.run(["c++", "-std=c++20", "size.cpp", "-o", "size"], cwd=tmp_path / "swing", check=True)
    told = subprocess.run([tmp_path / "swing" / "size"], capture_output=True, text=True, check=True)
    assert sum(manifest["thread_bytes"].values()) == int(told.stdout)


def refused(model: eomgen.Model, **options: Any) -> str:
    with pytest.raises(eomgen.EomgenError) as raised:
        model.simulate_many(0.1, 0.01, **({"vary": VARY, "samples": 8, "device": "gpu"} | options))
    return str(raised.value)


def test_refusals(stand_in: ctypes.CDLL, tmp_path: Path) -> None:
    swing = built(SWING, "rk4")
    assert "there is no device 'tpu'" in refused(swing, device="tpu")
    assert "there is no device '0'" in refused(swing, device=0)
    assert "a cluster is given too" in refused(swing, cluster="dask")
    stand_in.stand_in_room(ctypes.c_longlong(1000))
    told = refused(swing, folder=tmp_path / "runs")
    stand_in.stand_in_room(ctypes.c_longlong(2**32))
    assert "memory of stand-in: 8 samples need" in told and "1e-06 of 1e-06 GB are free" in told
    assert "record" in told and "fewer columns or points" in told
    servo = {"type": "sampled", "sample": "20 ms", "signals": {"angle": "q.hinge"}}
    efforts = {**SWING["efforts"], "motor": {"joint": "hinge", "effort": "servo"}}
    steered = built({**SWING, "controllers": {"servo": servo}, "efforts": efforts}, "rk4")
    told = refused(steered, controllers={"servo": lambda t, signals: 0.0}, folder=tmp_path / "runs")
    assert (
        "controllers are functions of Python, which no device can call" in told and "sampled controllers in C" in told
    )
    assert not (tmp_path / "runs").exists()


@pytest.mark.usefixtures("stand_in")
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(EXAMPLES / "double_pendulum_on_shaking_base" / "scene.toml")
    options = ["--t-end", "0.1", "--step", "1e-3", "--method", "rk4", "--samples", "8", "--vary", "m2=normal(0.6, 5%)"]
    call = ["ensemble", path, *options, "--device", "gpu", "--no-plots", "--json", "--out", str(tmp_path / "out")]
    assert main(call) == 0
    captured = capsys.readouterr()
    told = json.loads(captured.out)
    assert told["done"] == 8 and told["how"] == "on the device stand-in"
    assert "8 samples; on the device stand-in; " in captured.err
