"""The storm of examples/storm_in_lagrangian_waves: its table, and its figure."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

DEMO = Path(__file__).parents[2] / "examples" / "storm_in_lagrangian_waves" / "demo.py"


def test_velocities_of_linear_theory_are_too_large_and_first_order_has_no_crests() -> None:
    rows = runpy.run_path(str(DEMO))["table"](6)
    first, second, linear = (rows[name] for name in ("order 1", "order 2", "linear"))
    assert linear["u"][1] > 1.3 * second["u"][1] > 1.1 * first["u"][1]
    assert second["z"][1] > -1.1 * second["z"][0]
    assert first["z"][1] == pytest.approx(-first["z"][0], rel=0.15)
    known = {"linear": (-2.82, 7.65), "order 1": (-4.32, 3.93), "order 2": (-2.94, 4.92)}
    for name, quantiles in known.items():
        assert rows[name]["u"] == pytest.approx(quantiles, rel=0.12)


@pytest.mark.long
def test_the_demo_draws_its_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(DEMO))["main"](2, 3, tmp_path, 125.0)
    said = capsys.readouterr().out
    assert "skewness of order 2 0.2183, drift 0.3259 m/s" in said
    assert (tmp_path / "storm_in_lagrangian_waves.png").stat().st_size > 50_000
