"""The simulator in C: a step starts again from a state that was written, and refuses counts below one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.scene.load import load_toml
from tests.codegen.test_stand_alone import compiled, run
from tests.models.scenes import PENDULUM_TOML

DRIVER = (Path(__file__).parent / "written_state.c").read_text(encoding="utf-8")
OTHERS = ("generalized_alpha", "rk45", "taylor", "rosenbrock", "tdg2", "rattlie")


@pytest.mark.parametrize("method", ["rk4", *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)])
def test_a_written_state_is_started_again(method: str, tmp_path: Path) -> None:
    paths = eomgen.generate(load_toml(PENDULUM_TOML), tmp_path / "c", method=method)
    name = next(path.stem for path in paths if path.name.endswith("_step.c")).removesuffix("_step")
    (tmp_path / "c" / "main.c").write_text(DRIVER.replace("NAME", name), encoding="utf-8")
    result = run(compiled(tmp_path / "c"))
    assert result.returncode == 0, (result.returncode, result.stderr)
    written, started = (np.array(line.split(), float) for line in result.stdout.splitlines())
    assert np.array_equal(written, started)
