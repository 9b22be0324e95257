"""Defaults of a generated folder that a caller chooses: values of parameters, and the number type of its command."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.cli import main
from eomgen.pipeline.generated_defaults import with_parameters
from tests.codegen.test_stand_alone import compiled, run
from tests.models.lattice import Lattice, describe
from tests.models.scenes import PENDULUM_TOML
from tests.pipeline.test_equilibrium_start import SERVO


def loop() -> eomgen.Scene:
    """Return a loop of three rods whose start follows from the length of the last one."""
    builder = eomgen.SceneBuilder("loop").parameter("reach", 0.4, tunable=True, unit="m")
    before = "base"
    for name, length, angle in (("crank", 0.3, 0.6), ("coupler", 0.5, -0.3), ("rocker", 0.4, 1.2)):
        inertia = [1e-4, length**2 / 12, length**2 / 12]
        builder.body(name, 1.0, center_of_mass=[length / 2, 0, 0], inertia=inertia)
        place = [{"base": 0.0, "crank": 0.3, "coupler": 0.5}[before], 0, 0]
        builder.joint(
            f"pin_{name}", "revolute", before, name, axis=[0, 1, 0], position=place, initial={"position": angle}
        )
        before = name
    ground = {"body": "base", "position": [0.6, 0, 0], "axis": [0, 1, 0]}
    builder.constraint("end", "point_on_line", ground, {"body": "rocker", "position": ["reach", 0, 0]})
    return builder.build()


def rows_of(folder: Path) -> Array:
    """Return the rows of the program of a folder: t, q, v and accelerations."""
    result = run(compiled(folder), "0.02", "1e-3", "10")
    assert (result.returncode, result.stderr) == (0, "")
    return np.array([[float(text) for text in line.split(",")] for line in result.stdout.splitlines()[1:]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "name", "value"),
    [
        (lambda: eomgen.load(tomllib.loads(PENDULUM_TOML)), "length", 0.3),
        pytest.param(lambda: eomgen.load(tomllib.loads(SERVO)), "load", 3.0),
        pytest.param(loop, "reach", 0.45),
    ],
    ids=["tree", "equilibrium", "loop"],
)
def test_the_code_starts_and_moves_as_a_run_with_these_parameters(
    make: Callable[[], eomgen.Scene], name: str, value: float, tmp_path: Path
) -> None:
    scene = make()
    eomgen.generate(scene, tmp_path / "c", parameters={name: value})
    model = eomgen.build(scene, profile="reproducible")
    expected = model.simulate(0.02, 1e-3, record_every=10, parameters={name: value})
    own = model.simulate(0.02, 1e-3, record_every=10)
    rows = rows_of(tmp_path / "c")
    state = np.column_stack([expected.t, expected.q, expected.v])
    np.testing.assert_allclose(rows[:, : state.shape[1]], state, rtol=1e-8, atol=1e-9)
    assert np.max(np.abs(own.q - expected.q)) > 1e-6


def test_the_number_type_is_the_scenes_unless_it_is_given(tmp_path: Path) -> None:
    scene = eomgen.load(tomllib.loads(PENDULUM_TOML + 'real = "float"\n'))
    for real, flag in ((None, True), ("double", False)):
        eomgen.generate(scene, tmp_path / str(real), real=real)
        told = (tmp_path / str(real) / "README.md").read_text(encoding="utf-8")
        assert ("-DEOMGEN_REAL_FLOAT main.c" in told) == flag


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (["--set", "lenth=1"], "usage error: there is no parameter 'lenth'; try: length"),
        (["--set", "length=1 kg"], "'1 kg' is a mass, a length in m is expected"),
        (["--set", "length=nan"], "length is nan, not a finite number"),
        (["--set", "torque=1"], "usage error: --set torque: torque is an input; try: --input torque=1"),
    ],
)
def test_values_that_runs_refuse_are_refused(
    given: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(PENDULUM_TOML, encoding="utf-8")
    assert main(["generate", "scene.toml", *given, "--out", "c"]) == 2
    assert text in capsys.readouterr().err and not Path("c").exists()


def test_python_is_refused_what_no_scene_can_have(tmp_path: Path) -> None:
    scene = eomgen.load(tomllib.loads(PENDULUM_TOML))
    with pytest.raises(eomgen.UsageError, match="one set of parameters is needed, not a batch; try: a number for each"):
        eomgen.generate(scene, tmp_path / "c", parameters={"length": [0.3, 0.4]})  # type: ignore[dict-item]
    told = "pair is not a scene, and only scenes are written with other values of their parameters; try: leave them out"
    with pytest.raises(eomgen.UsageError, match=told):
        lattice = Lattice("pair", "fput", (0.1, 0.2))
        with_parameters(lattice, describe(lattice), {"k": 1.0})
    with pytest.raises(eomgen.UsageError, match="load = -1"):
        eomgen.generate(eomgen.load(tomllib.loads(SERVO)), tmp_path / "c", parameters={"load": -1.0})
    with pytest.raises(eomgen.UsageError, match="a model cannot be built with real = 'half'; try: double or float"):
        eomgen.generate(scene, tmp_path / "c", real="half")
