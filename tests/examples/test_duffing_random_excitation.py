"""The demo of Duffing's oscillator under random excitation."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.examples.demos import run_demo


@pytest.mark.long
def test_the_demo_says_its_statistics_and_draws(tmp_path: Path) -> None:
    """A million samples have the mean 0.4999 and the standard deviation 0.5333 (dossier, 4.6); 2000 within 4 errors."""
    text = run_demo("duffing_random_excitation", "--samples", "2000", "--out", tmp_path)
    assert "21 modes capture 99.99" in text
    said = re.search(r"mean (\S+) m, standard deviation (\S+) m", text)
    assert said is not None
    assert abs(float(said[1]) - 0.4999) < 4.0 * 0.5333 / 2000**0.5
    assert abs(float(said[2]) - 0.5333) < 4.0 * 0.5333 / 4000**0.5
    assert (tmp_path / "duffing_random_excitation.png").stat().st_size > 20_000
