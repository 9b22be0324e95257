"""The simulator in C: a step starts again from a state that was written, and refuses counts below one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.scene.load import load_toml
from tests.codegen.test_stand_alone import compiled, run
from tests.models.scenes import PENDULUM_TOML

DRIVER = """
#include <stdio.h>
#include "NAME.h"
int main(void)
{
    static NAME_simulator run, again;
    int k;
    NAME_simulator_default(&run);
    if (NAME_simulator_start(&run, NULL) != 0 || NAME_simulator_step(&run, 20, NULL, NULL) != 0)
        return 1;
    again = run;
    for (k = 0; k < 2; ++k) {
        NAME_simulator *one = k == 0 ? &run : &again;
        one->state.q[0] += 0.3;
        one->state.v[0] = -0.5;
        if (k == 1 && NAME_simulator_start(one, NULL) != 0)
            return 2;
        if (NAME_simulator_step(one, 50, NULL, NULL) != 0)
            return 3;
        printf("%.17g %.17g\\n", one->state.q[0], one->state.v[0]);
    }
    again = run;
    if (NAME_simulator_step(&run, -5, NULL, NULL) == 0 || NAME_simulator_step(&run, 0, NULL, NULL) == 0)
        return 4;
    if (NAME_simulator_step(&run, 3, NULL, NULL) != 0 || NAME_simulator_step(&again, 3, NULL, NULL) != 0)
        return 5;
    return run.state.q[0] == again.state.q[0] && run.state.t > 0.0 ? 0 : 6;
}
"""
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
