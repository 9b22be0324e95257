"""Accelerations and rates of generalized-alpha decay at rest to zero; sums with subnormal numbers are slow."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from tests.models.c_programs import printed, program

MAIN = """
#include <stdio.h>
#include "sled.h"
int main(void)
{
    static const long steps[3] = { 8, 1000, 3000 };
    static sled_simulator run;
    sled_status status;
    int part;
    sled_simulator_default(&run);
    run.settings.rho_inf = 0.9;
    status = sled_simulator_start(&run, NULL);
    for (part = 0; part < 3; ++part) {
        if (status == SLED_OK)
            status = sled_simulator_step(&run, steps[part], NULL, NULL);
        printf("%u %.17g %.17g\\n", (unsigned)status, run.state.a[0], run.state.z_rate[0]);
    }
    return 0;
}
"""


def test_rates_at_rest_decay_to_zero(tmp_path: Path) -> None:
    builder = eomgen.SceneBuilder("sled", gravity=[0, 0, 0]).body("sled", 1.0)
    builder.joint("rail", "prismatic", "base", "sled", axis=[1, 0, 0])
    builder.effort("push", "rail", "max(0, 0.01 - t)").state("work", "max(0, 0.01 - t)")
    scene = builder.simulation(method="generalized_alpha", step=1e-3, duration=1).build()
    status, acceleration, rate = printed(program(tmp_path, scene, "generalized_alpha", MAIN)).T
    # in a step after the pulse by (2 rho - 1)/(2 - rho) = 0.8/1.1 and (3 rho - 1)/(3 - rho) = 1.7/2.1
    assert not status.any()
    assert acceleration[0] == pytest.approx(0.01 - 0.008, rel=0.1) and rate[0] == pytest.approx(0.01 - 0.008, rel=0.1)
    assert abs(acceleration[1]) == pytest.approx(acceleration[0] * (0.8 / 1.1) ** 998, rel=1.0)
    assert abs(rate[1]) == pytest.approx(rate[0] * (1.7 / 2.1) ** 998, rel=1.0)
    assert acceleration[2] == rate[2] == 0.0
