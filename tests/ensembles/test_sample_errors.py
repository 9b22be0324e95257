"""Discretisation errors of samples against closed forms; processes that steps do not resolve; warnings passed on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.ensembles.discretisation import spread_samples
from tests.ensembles.carts import VARY, bits, built_cart, small_blocks
from tests.models.doubtful_scenes import END, STEP, UNRESOLVED, oscillator, share_of_state, stuck
from tests.models.library import scene


def sliding(force: str, **more: Any) -> dict[str, Any]:
    """Return an oscillator along x that a formula pulls."""
    return scene(
        "oscillator",
        name="slider",
        parameters__k={"value": 100, "tunable": True},
        joints__slide__stiffness=None,
        efforts={"all": {"joint": "slide", "effort": force}},
        outputs={"x": {"formula": "q.slide", "unit": "m"}},
        simulation={"method": "generalized_alpha", "step": 0.02, "duration": 2},
        **more,
    )


@pytest.fixture(scope="module")
def slider() -> eomgen.Model:
    return eomgen.build(sliding("-k*q.slide"))


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.02, 0.005])
def test_errors_of_samples_are_those_of_the_closed_form(slider: eomgen.Model, step: float) -> None:
    found = slider.simulate_many(2.0, step, vary={"k": "uniform(50, 150)"}, samples=32)
    true = [np.abs(_true_error(slider, 100.0, step)).max()]
    true += [np.abs(_true_error(slider, found.values["k"][number], step)).max() for number in found.error.of_samples]
    assert len(found.error.of_samples) == 4
    assert max(true) / 1.5 < found.error.columns["output.x"] < 1.5 * max(true)
    number, largest = found.error.worst or (None, None)
    assert number is not None and largest is not None
    assert found.values["k"][number] > 140.0  # the fastest of the examined ones
    assert f"the estimated error of samples is {largest} (sample {number}, the worst of 5 runs" in found.message
    assert found.to_dict()["error"]["columns"] == dict(found.error.columns)
    assert ("try: a step smaller than" in found.message) == (step == 0.02)


def _true_error(model: eomgen.Model, k: float, step: float) -> np.ndarray:
    run = model.simulate(2.0, step, parameters={"k": k}, error_estimate=False)
    return np.asarray(run["output.x"] - 0.1 * np.cos(np.sqrt(k) * run.t))


@pytest.mark.parametrize("damage", ["reduced", "part", 60, 0.4, 0.6, -200])
def test_damaged_parts_are_run_again(tmp_path: Path, damage: str | float) -> None:
    """Cut short, or inverted bytes in headers and data: each kept part has the samples of a run without damage."""
    options = {"vary": VARY, "samples": 40, "folder": tmp_path / "out"}
    with small_blocks():
        whole = built_cart().simulate_many(**options)
        part = sorted((tmp_path / "out" / "samples").glob("*.npz"))[1]
        file = tmp_path / "out" / "reduced.npz" if damage == "reduced" else part
        data = bytearray(file.read_bytes())
        if isinstance(damage, str):
            del data[-100:]
        else:
            data[int(damage * len(data)) if 0 < damage < 1 else int(damage)] ^= 0xFF
        file.write_bytes(bytes(data))
        again = built_cart().simulate_many(resume=True, **options)
    assert bits(again) == bits(whole)
    told = "all samples are run again" if damage == "reduced" else "part of the folder was cut short or damaged"
    assert (told in again.message) == (file.read_bytes() != bytes(data)) and told not in whole.message


@pytest.mark.parametrize("far", range(8))
def test_the_first_sample_examined_is_the_farthest_value(far: int) -> None:
    """Both ends of a design are as far in ranks; the farthest from the middle may be either, at any place."""
    others = np.array([0.3, 0.2, 0.25, 0.22, 0.21, 0.26, 0.28])
    for value in (0.003, 7.0):
        values = np.insert(others, far, value)[:, np.newaxis]
        assert spread_samples(values, 1) == [far]
        assert spread_samples(np.hstack([values, np.full((8, 1), 5.0)]), 1) == [far]


@pytest.mark.slow
def test_the_error_of_an_internal_state_is_that_of_a_run() -> None:
    model = eomgen.build(oscillator(), profile="quick")
    result = model.simulate_many(END, STEP, table={"push": [0.1, 0.11]}, columns=["q.rail"], points=2)
    assert result.error.worst is not None and result.error.worst[1].name.startswith("z.")
    assert result.error.relative == pytest.approx(share_of_state(), rel=1.0)


@pytest.mark.slow
def test_friction_that_steps_do_not_resolve_is_noted() -> None:
    model = eomgen.build(stuck(), profile="quick")
    found = model.simulate_many(table={"pull": [400.0, 410.0]}, columns=["q.rail"], points=2)
    assert UNRESOLVED in "; ".join(found.notes)
