"""Random processes that steps do not resolve, and errors of samples: of scenes that are read and not compiled."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import special

from eomgen.base.arrays import Array
from eomgen.formula.evaluate import evaluate_batch
from eomgen.products.ensembles import discretisation
from eomgen.products.ensembles.discretisation import unresolved_processes
from eomgen.scene.load import from_data
from tests.models import library

SCALE, SPAN = 0.05, 2.0
FAST = {"type": "squared_exponential", "correlation_time": SCALE, "share": 0.9999, "duration": SPAN}


def model_of(**random: Any) -> Any:
    """Return a model that has the inputs of a scene alone, by their formulas."""
    scene = from_data(library.scene("oscillator", random=random))
    names = [item.name for item in scene.parameters]

    def input_values(t: Array, *, parameters: Array) -> Array:
        def value(symbol: Any) -> Any:
            return parameters[names.index(symbol.name)] if symbol.kind == "parameter" else t

        return np.stack([evaluate_batch(item.formula, value, along_motion=True) for item in scene.inputs], axis=-1)

    return SimpleNamespace(
        description=scene,
        inputs=[item.name for item in scene.inputs],
        parameters=dict.fromkeys(names, 0.0),
        parameter_array=lambda _: np.array([item.value for item in scene.parameters]),
        input_values=input_values,
    )


def run_of(step: float, **stats: Any) -> Any:
    return SimpleNamespace(stats=stats, metadata={"t_start": 0.0, "t_end": SPAN, "settings": {"step": step}})


@pytest.mark.parametrize("step", [0.04, 0.1, 0.125, 0.2])
def test_the_share_above_the_highest_frequency_is_that_of_the_spectrum(step: float) -> None:
    """G ~ exp(-2 (pi l f)^2), so the share above f is erfc(sqrt(2) pi l f)."""
    model = model_of(g=FAST)
    told = unresolved_processes(model, run_of(step), [])
    share = float(special.erfc(np.sqrt(2.0) * np.pi * SCALE * 0.5 / step))
    assert not unresolved_processes(model, run_of(step), ["g"])
    assert not unresolved_processes(model, run_of(step, own_steps=3), [])
    if share < 0.01:
        assert not told
        return
    begin = f"% of the variance of the process g lies above {0.5 / step:.3g} Hz, the highest frequency that steps of"
    (percent, needed) = re.findall(rf"^([\d.]+) {begin} {step:.3g} s .* a step of ([\d.]+) s, 10 to the", told[0])[0]
    assert float(percent) == pytest.approx(100.0 * share, rel=0.1)
    highest = special.erfcinv(0.01) / (np.sqrt(2.0) * np.pi * SCALE)  # of 99 % of the variance
    assert float(needed) == pytest.approx(0.1 / highest, abs=1e-3)


def test_a_translated_process_has_the_harmonics_of_its_modes() -> None:
    """The square of a band from 2.9 to 3.1 Hz is half near 0 and half near 6 Hz; a follower is as its leader."""
    band = {"type": "band", "band": [2.9, 3.1], "share": 0.999, "duration": SPAN}
    late = {"follows": "g", "delay": 0.25, "translation": "g * g"}
    model = model_of(g=band | {"duration": 4.0}, late=late, same={"follows": "g", "delay": 0.5})
    frequencies, power = discretisation._spectrum(model, model.description.inputs[0].series, 0.0, SPAN)
    assert power[(frequencies > 2.0) & (frequencies < 4.0)].sum() > 0.99 * power.sum()
    frequencies, power = discretisation._spectrum(model, model.description.inputs[1].series, 0.0, SPAN)
    assert power[np.abs(frequencies - 6.0) < 1.5].sum() == pytest.approx(0.5 * power.sum(), rel=0.5)
    assert power[(frequencies > 2.0) & (frequencies < 4.0)].sum() < 0.02 * power.sum()
    (told,) = unresolved_processes(model, run_of(0.1), [])
    assert "of the process late lies above 5 Hz" in told
