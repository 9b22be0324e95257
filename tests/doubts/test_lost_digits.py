"""Accelerations at the start of a run that lose digits are reported, by methods that eliminate M."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.products.doubts import start_checks
from tests.oracles.planar_trees import PlanarTree

#: Methods that take accelerations from M, or record such beside iterations on the residual, which loses no digits.
OTHER_METHODS = [("taylor", True), ("rk45", True), ("tdg2", True)]


@pytest.mark.parametrize(
    ("method", "reported"),
    [
        ("rk4", True),
        ("generalized_alpha", True),
        *(pytest.param(name, found, marks=pytest.mark.slow) for name, found in OTHER_METHODS),
    ],
)
def test_values_of_a_run_that_cost_digits_are_reported(
    method: str, reported: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = PlanarTree.chain([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]).text()
    text = text.replace("mass = 1.0", 'mass = "m"', 1) + "\n[parameters.m]\nvalue = 1\ntunable = true"
    path = tmp_path / "chain.toml"
    path.write_text(text)
    model = eomgen.build(path, profile="quick", method=method)
    with monkeypatch.context() as patch:  # a factorization shows that no digits are lost
        patch.setattr(start_checks, "cancellation", lambda *_: pytest.fail("M was eliminated joint by joint"))
        assert not model.simulate(0.01, 1e-3, error_estimate=False).findings
    run = model.simulate(1e-4, 1e-5, parameters={"m": 1e-12}, error_estimate=False)
    found = [finding for finding in run.findings if finding.name == "lost_digits"]
    assert len(found) == reported
    for finding in found:
        if method in ("generalized_alpha", "tdg2"):
            assert finding.text.startswith(
                "where forward dynamics gives them, at the start or at each recorded step, acc"
            )
            assert finding.hint == "the parameters of this run as defaults of the scene"
            continue
        assert 1e-4 < finding.value < 1e-2 and "accelerations keep some 2 digits, since light" in finding.text
        assert finding.hint == "generalized_alpha, or the parameters of this run as defaults of the scene"
