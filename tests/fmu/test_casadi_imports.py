"""CasADi imports an FMU of FMI 3.0 by its DaeBuilder: Jacobians by directional derivatives, and an optimum."""

from __future__ import annotations

import io
import runpy
import zipfile
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from eomgen.products.fmu.archive import packed
from eomgen.products.fmu.export import fmu_files

DEMO = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "cart_pole_swing_up" / "demo.py"))


@pytest.fixture(scope="module")
def builder(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("cart_pole")
    files = fmu_files(DEMO["SCENE"], types="me", reference=False, profile="quick").files
    zipfile.ZipFile(io.BytesIO(packed(files))).extractall(folder)
    return ca.DaeBuilder("cart_pole", str(folder), {"debug": False})


def rate_of(builder: Any) -> Any:
    """Return the rates as a function of states, inputs and parameters."""
    return builder.create("rate", ["x", "u", "p"], ["ode"])


@pytest.mark.slow
def test_the_import_knows_states_inputs_and_parameters(builder: Any) -> None:
    assert (builder.nx(), builder.nu(), builder.np()) == (4, 1, 3)
    sparsity = np.array(rate_of(builder).jac_sparsity(0, 0), dtype=bool)
    assert sparsity[:2].tolist() == [[False, False, True, False], [False, False, False, True]]


@pytest.mark.slow
def test_rates_and_jacobians_are_those_of_the_model(builder: Any, rng: np.random.Generator) -> None:
    rate = rate_of(builder)
    y = ca.MX.sym("y", 8)
    values = rate(y[:4], y[4], y[5:])
    expected = DEMO["native_rate"](y[:4], y[4], y[5:])
    made = [ca.Function("made", [y], [f, ca.jacobian(f, y)]) for f in (values, expected)]
    for _ in range(5):
        point = np.concatenate([rng.normal(size=5), rng.uniform(0.5, 2.0, 3)])
        for found, own in zip(made[0](point), made[1](point), strict=True):
            assert np.max(np.abs(np.array(found) - np.array(own))) <= 1e-12 * np.max(np.abs(np.array(own)))
