"""Undamped and damped frequencies have one name each, in tables, files and pictures."""

import csv
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.products.linear import files as linear_files
from eomgen.products.linear.modes import caption

#: A mass on a spring with half of the critical damping: m x'' + c x' + k x = 0.
SCENE = """
format = 1
name = "slide"
gravity = [0, 0, 0]
[bodies.block]
mass = 2.0
[joints.x]
type = "prismatic"
parent = "base"
child = "block"
axis = [1, 0, 0]
stiffness = "k"
damping = 12.0
[parameters.k]
value = 72.0
tunable = true
"""
OMEGA, ZETA = 6.0, 0.5
UNDAMPED = OMEGA / (2.0 * math.pi)
DAMPED = UNDAMPED * math.sqrt(1.0 - ZETA**2)


def columns(path: Path) -> dict[str, list[float]]:
    header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(header)}


@pytest.mark.slow
def test_names_of_frequencies_in_files_and_pictures(tmp_path: Path) -> None:
    model = eomgen.build(tomllib.loads(SCENE))
    modes = model.linearize().modes()
    assert modes.undamped_frequency == pytest.approx([UNDAMPED]) == modes.frequency
    assert modes.damped_frequency == pytest.approx([DAMPED])
    assert f"{UNDAMPED:.5g} Hz undamped" in caption(modes, 0)
    diagram = model.campbell("k", [72.0, 80.0])
    assert diagram.frequencies[0] == pytest.approx([DAMPED])
    assert diagram.plot()[0].get_ylabel() == "damped frequency, Hz"

    table = columns(linear_files.write_modes(modes, tmp_path / "modes.csv"))
    assert table["undamped frequency [Hz]"] == pytest.approx([UNDAMPED])
    assert table["damped frequency [Hz]"] == pytest.approx([DAMPED])
    table = columns(linear_files.write_campbell(diagram, tmp_path / "campbell.csv"))
    assert table["mode1 damped frequency [Hz]"][0] == pytest.approx(DAMPED)
    described = linear_files.to_json_data(model.linearize(), "slide")
    (mode,) = json.loads(json.dumps(described))["modes"]
    assert (mode["undamped_frequency"], mode["damped_frequency"]) == pytest.approx((UNDAMPED, DAMPED))


def test_a_frequency_in_a_heading_is_damped_or_undamped() -> None:
    """No table of modes, of a Campbell diagram or of multipliers says "frequency" alone."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in Path(eomgen.__file__).parent.rglob("*.py"))
    assert '"mode", "frequency, Hz"' not in text
    assert np.all([f'"{kind} frequency, Hz"' in text for kind in ("damped", "undamped")])
