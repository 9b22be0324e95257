"""The symmetric top of Simo and Wong, the flipping body and the hanging chain, in joint and in absolute coordinates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import Model
from tests.anchors import anchor

EXAMPLES = Path(__file__).parents[2] / "examples"


def _model(name: str, coordinates: str = "joint") -> Model:
    return eomgen.build(eomgen.load(EXAMPLES / name / "scene.toml", coordinates=coordinates))


AXIS_AT_10 = anchor("symmetric_top_axis").reference
SPIN_AT_10 = np.array([-0.0306183994, 0.0286529742, 50.0])


@pytest.mark.slow_except("joint")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_symmetric_top_of_simo_and_wong(coordinates: str) -> None:
    model, errors = _model("symmetric_top", coordinates), []
    for step in (1e-3, 5e-4):
        run = model.simulate(step=step)
        errors.append(float(np.linalg.norm(run.outputs["axis"][-1] - AXIS_AT_10)))
        assert run.outputs["energy"][0] == pytest.approx(1269.975, abs=1e-3)
    assert errors[0] < 3e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    coarse = model.simulate(step=9e-3)  # 26 degrees per step
    assert np.ptp(coarse.outputs["energy"]) < 1e-3 * 1269.975
    assert np.ptp(coarse.outputs["energy"]) < 1e-4  # with rho_inf = 1, far below what was published


@pytest.mark.slow
def test_symmetric_top_by_runge_kutta_munthe_kaas() -> None:
    run = _model("symmetric_top").simulate(method="rk4")
    anchor("symmetric_top_axis").check(run.outputs["axis"][-1])
    anchor("symmetric_top_energy").check(run.outputs["energy"][0])
    np.testing.assert_allclose(run.v[-1], SPIN_AT_10, atol=1e-6)


TIP_OF_TEN_BALLS = anchor("chain_of_ten_balls").reference  # at 0.5 s, by MuJoCo at 25 us


@pytest.mark.long
def test_hanging_chain_reaches_the_tip_of_another_engine() -> None:
    joint, absolute = _model("hanging_chain"), _model("hanging_chain", "absolute")
    exact = joint.simulate(0.5, method="rk4", parameters={"shake": 0.0})
    anchor("chain_of_ten_balls").check(exact.outputs["tip"][-1])
    for model in (joint, absolute):
        errors = []
        for step in (2e-3, 1e-3):
            run = model.simulate(0.5, step, parameters={"shake": 0.0})
            assert run.success, run.message
            errors.append(float(np.linalg.norm(run.outputs["tip"][-1] - TIP_OF_TEN_BALLS)))
        assert errors[0] < 2e-5
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
