"""Heights of seas: fixed amplitudes with spreading at every place, and limits of steepness in Python and in scenes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.formula.nodes import EntryQuantity
from eomgen.scene.load import from_data
from eomgen.waves import Jonswap, Sea, Spreading, discretized, divided

SPREAD = Spreading(6.0, heading=0.4, directions=9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("how", ["divided", "discretized"])
def test_fixed_amplitudes_have_the_height_at_every_place(seed: int, how: str) -> None:
    """One direction for each frequency: over a long time every place has the variance of the spectrum, and no more."""
    spectrum = Jonswap(2.0, 8.0)
    parts = (
        divided(spectrum, 40, spreading=SPREAD, height=2.0)
        if how == "divided"
        else discretized(spectrum, spreading=SPREAD, height=2.0, length=600.0)
    )
    sea = parts.realisation(seed, "fixed")
    frequencies = np.sqrt(9.81 * np.hypot(*sea.vectors.T))
    assert len(frequencies) * 9 == len(parts.energy)
    assert np.diff(np.sort(frequencies)).min() > 1e-4  # so that no two of them stand still together
    assert 4.0 * math.sqrt(0.5 * np.sum(sea.amplitude**2)) == pytest.approx(2.0, rel=1e-12)
    random = np.random.default_rng(seed)
    places = random.uniform(-200.0, 200.0, (5, 2))
    times = np.sort(random.uniform(0.0, 3e6, 16_000))
    angles = sea.phase - np.multiply.outer(times, frequencies)
    for place in places:
        elevation = np.cos(angles + sea.vectors @ place) @ sea.amplitude
        assert 4.0 * elevation.std() == pytest.approx(2.0, rel=0.03)


def test_directions_of_fixed_amplitudes_follow_the_spreading() -> None:
    parts = divided(Jonswap(2.0, 8.0), 200, spreading=SPREAD)
    angles, shares = SPREAD.shares()
    seen = np.zeros(9)
    for seed in range(20):
        sea = parts.realisation(seed, "fixed")
        drawn = np.arctan2(sea.vectors[:, 1], sea.vectors[:, 0])
        seen += np.bincount(np.argmin(np.abs(drawn[:, None] - angles), axis=1), minlength=9)
    assert seen / seen.sum() == pytest.approx(shares, abs=1.0 / 200)
    assert not np.array_equal(parts.realisation(1, "fixed").vectors, parts.realisation(2, "fixed").vectors)
    assert np.array_equal(parts.realisation(1, "fixed").phase, parts.realisation(1, "fixed").phase)


def test_other_seas_keep_the_bits_of_their_seeds() -> None:
    """Phases of fixed amplitudes without spreading, and all of Gaussian ones, are those of the normal variables."""
    from eomgen.base.random_inputs import WAVES, standard_normals

    for spreading in (None, SPREAD):
        parts = divided(Jonswap(2.0, 8.0), 12, spreading=spreading)
        normal = standard_normals(7, 2 * len(parts.energy), WAVES).reshape(-1, 2)
        sea = parts.realisation(7)
        assert np.array_equal(sea.phase, np.arctan2(normal[:, 1], normal[:, 0]))
        assert np.array_equal(sea.amplitude, np.sqrt(parts.energy) * np.hypot(*normal.T))
        assert np.array_equal(sea.vectors, parts.vectors)
        fixed = parts.realisation(7, "fixed")
        assert set(fixed.phase) <= set(sea.phase)
        if spreading is None:
            assert np.array_equal(fixed.phase, sea.phase)


def _one(steepness: float, depth: float = math.inf, **options: Any) -> Sea:
    return Sea.of_one_wave(0.05, steepness / 0.05 * math.tanh(min(0.05 * depth, 700.0)), depth, **options)


@pytest.mark.parametrize("depth", [math.inf, 40.0])
def test_waves_that_break_are_refused_at_second_order(depth: float) -> None:
    """Scenes and Python have one bound: a height of 0.142 tanh k h wave lengths."""
    assert _one(0.44, depth).order == 2
    for steepness in (0.45, 0.6, 0.99):
        with pytest.raises(UsageError, match=r"a wave of 125\.7 m, breaks from an amplitude of .* m on, and has .* m"):
            _one(steepness, depth)
        assert _one(steepness, depth, order=1).order == 1
    amplitude, period = 0.44 / 0.05, 2 * math.pi / math.sqrt(9.81 * 0.05)
    from_data(_scene({"regular": [{"amplitude": amplitude, "period": period}], "order": 2}))
    with pytest.raises(Exception, match="breaks from an amplitude"):
        from_data(_scene({"regular": [{"amplitude": 1.02 * amplitude, "period": period}], "order": 2}))


def _scene(sea: dict[str, Any]) -> dict[str, Any]:
    return {
        "format": 1,
        "name": "buoy_in_waves",
        "bodies": {"buoy": {"mass": 1.0, "inertia": [1, 1, 1]}},
        "joints": {"moves": {"type": "prismatic", "axis": [0, 0, 1], "parent": "base", "child": "buoy"}},
        "waves": {"sea": sea},
        "outputs": {"surface": {"formula": "elevation.sea(0, 0)"}},
    }


@pytest.mark.parametrize(
    ("steepness", "depth", "order", "percent"),
    [
        (0.29, None, 1, 0),
        (0.32, None, 1, 16),
        (0.43, None, 1, 22),
        (0.43, None, 2, 0),
        (0.1, 20.0, 1, 0),
        (0.2, 20.0, 1, 27),
    ],
)
def test_steep_waves_of_first_order_are_noted(steepness: float, depth: float | None, order: int, percent: int) -> None:
    """By the crest of Stokes's second order in the same water, held against bound waves of a scene of order 2."""
    k = 0.05
    tanh = 1.0 if depth is None else math.tanh(k * depth)
    wave = {"amplitude": steepness / k, "period": 2 * math.pi / math.sqrt(9.81 * k * tanh)}
    sea = {"regular": [wave], "order": order} | ({} if depth is None else {"depth": depth})
    scene = from_data(_scene(sea))
    notes = [note for note in scene.notes if "first order" in note]
    assert len(notes) == (percent > 0)
    (elevation,) = from_data(_scene(sea | {"order": 2})).outputs[0].values
    assert isinstance(elevation, EntryQuantity)
    bound = elevation.item.components[-1].amplitude
    if percent:
        assert f"has crests that are {percent} % too low, and troughs as much too deep: order = 2" in notes[0]
        assert round(100 * abs(bound) / wave["amplitude"]) == percent
    elif order == 1:
        assert abs(bound) < 0.15 * wave["amplitude"]
