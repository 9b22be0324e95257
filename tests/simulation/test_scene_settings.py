"""Settings of the iteration and arithmetic in scenes: defaults of runs and of the emitted C, and mistakes in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.scenes import SWING

LOOSE: dict[str, float] = {"rtol": 1e-3, "atol": 1e-5}


def _scene(**simulation: Any) -> dict[str, Any]:
    return {**SWING, "simulation": {**SWING["simulation"], "method": "generalized_alpha", **simulation}}


@pytest.mark.slow
def test_a_scenes_settings_are_those_of_the_call() -> None:
    plain, loose = eomgen.build(_scene()), eomgen.build(_scene(settings=LOOSE))
    told = plain.simulate(0.5, settings=LOOSE, error_estimate=False)
    of_scene = loose.simulate(0.5, error_estimate=False)
    np.testing.assert_array_equal(of_scene.q, told.q)
    assert np.abs(of_scene.q - plain.simulate(0.5, error_estimate=False).q).max() > 0.0
    assert of_scene.metadata["settings"]["rtol"] == 1e-3
    over = loose.simulate(0.5, settings={"rtol": 1e-4}, error_estimate=False)
    assert over.metadata["settings"]["rtol"] == 1e-4
    assert over.metadata["settings"]["atol"] == 1e-5


def test_the_emitted_c_has_them_as_defaults(tmp_path: Path) -> None:
    eomgen.generate(_scene(settings={"rtol": 3e-4}), tmp_path)
    text = "".join(file.read_text() for file in sorted(tmp_path.rglob("*.[ch]")))
    assert "0.0003" in text or "3e-4" in text or "3e-04" in text


@pytest.mark.slow
def test_a_scene_names_its_arithmetic_and_the_call_may_name_another() -> None:
    single = eomgen.build(_scene(real="float"))
    assert single.library.real == "float"
    assert eomgen.build(_scene(real="float"), real="double").library.real == "double"
    assert eomgen.build(_scene()).library.real == "double"
    told = eomgen.build(_scene(), real="float").simulate(0.5, error_estimate=False)
    np.testing.assert_array_equal(single.simulate(0.5, error_estimate=False).q, told.q)


MISTAKES: dict[str, dict[str, Any]] = {
    "(simulation.settings): generalized_alpha has no setting 'rtoll'; try: rtol": {"settings": {"rtoll": 1e-3}},
    "(simulation.settings): rtol is negative: -1": {"settings": {"rtol": -1.0}},
    "(simulation.settings): reuse must be 0 or 1, not 2": {"settings": {"reuse": 2}},
    "generalized_alpha has no setting 'rho_inf'": {"settings": {"rho_inf": 0.5}},
    "has no setting 'rtol'": {"method": "rk4", "settings": {"rtol": 1e-3}},
    "simulation.real": {"real": "half"},
}


@pytest.mark.parametrize("message", MISTAKES)
def test_mistakes_are_named(message: str) -> None:
    with pytest.raises(eomgen.DescriptionError) as raised:
        eomgen.build(_scene(**MISTAKES[message]))
    assert message in str(raised.value)
