"""Accelerations at the start of a run that lose digits are reported, by methods that eliminate M."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.products.doubts import start_checks
from tests.oracles.planar_trees import PlanarTree

#: Methods that take accelerations from M, and others that record such beside iterations on the residual, which loses no
#: digits.
ELIMINATING, RECORDING = ("rk4", "taylor", "rk45"), ("generalized_alpha", "tdg2")


@pytest.mark.parametrize("method", [*ELIMINATING, *RECORDING])
def test_values_of_a_run_that_cost_digits_are_reported(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = PlanarTree.chain([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]).text()
    path = tmp_path / "chain.toml"
    path.write_text(text.replace("mass = 1.0", 'mass = "m"', 1) + "\n[parameters.m]\nvalue = 1\ntunable = true")
    model = eomgen.build(path, profile="quick", method=method)
    with monkeypatch.context() as patch:  # a factorization shows that no digits are lost
        patch.setattr(start_checks, "cancellation", lambda *_: pytest.fail("M was eliminated joint by joint"))
        assert not model.simulate(0.01, 1e-3, error_estimate=False).findings
    run = model.simulate(1e-4, 1e-5, parameters={"m": 1e-12}, error_estimate=False)
    (found,) = (finding for finding in run.findings if finding.name == "lost_digits")
    if method in RECORDING:
        assert found.text.startswith("where forward dynamics gives them, at the start or at each recorded step, acc")
        assert found.hint == "the parameters of this run as defaults of the scene"
    else:
        assert 1e-4 < found.value < 1e-2 and "accelerations keep some 2 digits, since light" in found.text
        assert found.hint == "generalized_alpha, or the parameters of this run as defaults of the scene"
