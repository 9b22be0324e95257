"""The demo of Duffing's oscillator under random excitation."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DEMO = Path(__file__).parents[2] / "examples" / "duffing_random_excitation" / "demo.py"


@pytest.mark.long
def test_the_demo_says_its_statistics_and_draws(tmp_path: Path) -> None:
    """A million samples have the mean 0.4999 and the standard deviation 0.5333 (dossier, 4.6); 2000 within 4 errors."""
    command = [sys.executable, str(DEMO), "--samples", "2000", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "21 modes capture 99.99" in done.stdout
    said = re.search(r"mean (\S+) m, standard deviation (\S+) m", done.stdout)
    assert said is not None
    assert abs(float(said[1]) - 0.4999) < 4.0 * 0.5333 / 2000**0.5
    assert abs(float(said[2]) - 0.5333) < 4.0 * 0.5333 / 4000**0.5
    assert (tmp_path / "duffing_random_excitation.png").stat().st_size > 20_000
