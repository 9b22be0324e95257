"""What a scene costs as it is asked against variants that ask for more: each is there, and has the same motion."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.products.studies.model_commands import _print_costs
from eomgen.products.studies.savings import Savings, VariantCost, _quartiles


def costs(name: str, seconds: list[float]) -> VariantCost:
    return VariantCost(name, "", {}, 1, 1, 1.0, float(np.median(seconds)), step_quartiles=_quartiles(seconds))


def test_a_ratio_of_times_is_told_if_rounds_tell_the_times_apart(capsys: pytest.CaptureFixture[str]) -> None:
    scattered = costs("scattered", [0.9e-6, 1.1e-6, 5e-6, 9e-6])
    asked, slower = costs("as asked", [1.0e-6, 1.1e-6, 1.2e-6, 1.3e-6]), costs("slower", [2e-6, 2.2e-6, 2.4e-6])
    once = costs("once", [4e-6])
    study = Savings("scene", "rk4", 1e-3, (asked, scattered, slower, once))
    assert asked.step_quartiles == tuple(np.quantile([1.0e-6, 1.1e-6, 1.2e-6, 1.3e-6], [0.25, 0.75]))
    ratios = [study.ratio(cost, "step_seconds") for cost in study.costs]
    assert ratios == [1.0, None, pytest.approx(2.2 / 1.15), None]
    _print_costs(study)
    lines = {line.split("  ")[0].strip(): line for line in capsys.readouterr().out.splitlines()}
    assert "1 to 6" in lines["scattered"] and "2.1 to 2.3" in lines["slower"] and "1.9" in lines["slower"]
