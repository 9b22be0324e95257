"""What a scene costs as it is asked against variants that ask for more: each is there, and has the same motion."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.documents import load
from eomgen.products.studies.model_commands import _print_costs
from eomgen.products.studies.savings import Savings, Variant, VariantCost, _quartiles, variants
from eomgen.scene.scene import Scene

QUARTER, ARM, BEAM = (f"examples/{name}/scene.toml" for name in ("quarter_car", "robot_arm", "spin_up_beam"))
NAMES = ["as asked", "a run", "terms of a step", "all terms", "tunable", "moving base", "absolute", "everything"]


def _variants(path: str) -> dict[str, Variant]:
    absolute: Scene | str
    try:
        absolute = load(path, coordinates="absolute")
    except eomgen.EomgenError as error:
        absolute = str(error)
    return {variant.name: variant for variant in variants(load(path), ("residual", "partials"), absolute)}


@pytest.mark.slow
def test_variants_have_the_same_motion() -> None:
    ends = {}
    for name, variant in _variants(QUARTER).items():
        if variant.scene is None or name in ("a run", "terms of a step"):
            continue
        terms = ["residual", "partials", "mass", "poses"] if variant.scene.coordinates == "joint" else None
        model = eomgen.build(variant.scene, terms, profile="quick")
        poses = model.simulate(0.2, 1e-3, error_estimate=False).poses
        ends[name] = np.array([poses[body][-1] for body in model.bodies])
    asked = ends.pop("as asked")
    assert set(ends) >= {"all terms", "tunable", "moving base", "everything"}
    for name, poses in ends.items():
        np.testing.assert_allclose(poses, asked, rtol=0, atol=1e-6 if name in ("absolute", "everything") else 1e-12)


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
