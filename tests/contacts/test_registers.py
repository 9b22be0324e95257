"""A law is one row in one file, and a shape a row in two: both are added in memory, before the section is imported."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import tomllib
from eomgen.mechanics.forces import contact_pairs
from eomgen.products.contacts import friction_laws
from eomgen.products.contacts.laws import ContactLaw, LawKey

quadratic = ContactLaw(
    "quadratic",
    {"factor": LawKey("force by load and squared slip", "s^2/m^2", example="0.1")},
    {f"force_{axis}": f"-size * slip_velocity_{axis}" for axis in "xy"},
    definitions={"size": "factor * load * sqrt(slip_velocity_x**2 + slip_velocity_y**2)"},
)
friction_laws.LAWS["quadratic"] = quadratic
contact_pairs.LOWEST["ball"] = contact_pairs.LOWEST["sphere"]
from eomgen.products.contacts import section
section.SHAPES["ball"] = section.SHAPES["sphere"]

from eomgen.mechanics.derive import derive
from tests.oracles.evaluation import tape_evaluator
from eomgen.scene.load import from_data
import numpy as np

scene = from_data(tomllib.loads('''
format = 1
name = "ball"
bodies.ball = { mass = 1 }
joints.ball = { type = "prismatic", parent = "base", child = "ball", axis = [0.6, 0, 0.8] }
outputs.forces = { formula = ["normal_force.floor", "friction_force_x.floor"] }
[contacts.floor]
first = { body = "base", axis = [0, 0, 1], x_axis = [1, 0, 0] }
second = { body = "ball" }
shape = "ball"
radius = 0.2
normal = { type = "formula", force = "1e3 * deflection" }
tangential = { type = "quadratic", factor = 0.5 }
'''))
evaluate = tape_evaluator(derive(scene, ["outputs"]))
print(evaluate("outputs", {"q": np.array([[0.125]]), "v": np.array([[2.0]]), "t": np.zeros((1, 1))})["y"][0].tolist())
"""


@pytest.mark.slow
def test_a_law_is_a_row_and_a_shape_is_two() -> None:
    run = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    normal, friction = (float(word) for word in run.stdout.strip("[]\n").split(","))
    assert normal == pytest.approx(100.0) and friction == pytest.approx(-0.5 * 100.0 * 1.2**2)
