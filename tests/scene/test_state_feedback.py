"""State feedback and skyhook in scene files: parameters with generated names, included files, and what is refused
how."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.errors import DescriptionError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Symbol
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

QUARTER = """\
format = 1
name = "quarter"
gravity = [0, 0, 0]
[parameters]
soft = { value = 300, tunable = true }
[inputs]
road = { unit = "m" }
[bodies]
wheel = { mass = 36 }
body = { mass = 240 }
[joints]
wheel = { type = "prismatic", parent = "base", child = "wheel", axis = [0, 0, 1], stiffness = 160000 }
body = { type = "prismatic", parent = "base", child = "body", axis = [0, 0, 1], position = [0, 0, 0.4] }
[points]
hub = { body = "wheel" }
mount = { body = "body" }
[springs.suspension]
first = "hub"
second = "mount"
stiffness = 16000
damping = 980
length = 0.4
force = "TENSION"
[outputs]
acceleration = { formula = "a.body" }
"""
GIVEN = """\
[controllers.ride]
type = "state_feedback"
coordinates = ["body"]
signals = { tyre = "q.wheel - road" }
position_gains = { body = 100 }
velocity_gains = { body = 2000 }
signal_gains = { tyre = -500 }
position_references = { body = "0.01 * t" }
"""


def read(text: str, force: str = "ride") -> Scene:
    return load_toml(QUARTER.replace("TENSION", force) + text)


def problems(text: str, force: str = "0") -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        read(text, force)
    return [str(problem).split("): ", 1)[-1] for problem in caught.value.problems]


def test_the_output_is_minus_gains_times_deviations() -> None:
    (controller,) = read(GIVEN).controllers
    state = {("q", "body"): 0.03, ("v", "body"): -0.2, ("q", "wheel"): 0.004, ("input", "road"): 0.001}
    state["time", ""] = 2.0
    gains = {"ride_position_gain_body": 7.0, "ride_velocity_gain_body": 11.0, "ride_gain_tyre": 13.0}

    def value(symbol: Symbol) -> float:
        return gains[symbol.name] if symbol.kind == "parameter" else state[symbol.kind, symbol.name]

    assert evaluate(controller.output, value) == pytest.approx(-(7.0 * (0.03 - 0.02) + 11.0 * -0.2 + 13.0 * 0.003))


def test_several_outputs_have_gains_each() -> None:
    scene = read(
        '[controllers.ride]\ntype = "state_feedback"\noutputs = ["up", "down"]\ncoordinates = ["body"]\n'
        "position_gains = { body = [1, 2] }\nmaximum = 50\n",
        "ride_up - ride_down",
    )
    assert [item.name for item in scene.controllers] == ["ride_up", "ride_down"]
    assert scene.feedback[0].gains == (
        ("ride_up_position_gain_body", "ride_up_velocity_gain_body"),
        ("ride_down_position_gain_body", "ride_down_velocity_gain_body"),
    )
    values = {item.name: item.value for item in scene.parameters}
    assert (values["ride_up_position_gain_body"], values["ride_down_position_gain_body"]) == (1.0, 2.0)
    assert values["ride_down_velocity_gain_body"] == 0.0
    # limited outputs are operations
    assert {item.output.name for item in scene.controllers} == {"min"}  # type: ignore[union-attr]


CALIBRATED = """\
[controllers.ride]
type = "state_feedback"
coordinates = ["body", "wheel"]
signals = { tyre = "q.wheel - road" }
signal_references = { tyre = 0 }
[controllers.ride.calibration]
method = "lqr"
effort_weights = 1e-4
position_weights = { wheel = 3 }
output_weights = { acceleration = 1 }
"""


def test_references_of_what_is_calibrated_are_parameters() -> None:
    (feedback,) = read(CALIBRATED).feedback
    assert feedback.references == ("ride_position_reference_body", "ride_position_reference_wheel", "", "", "")
    assert feedback.calibration is not None
    assert feedback.calibration.position_weights == {"wheel": 3.0}


def test_formulas_may_use_gains() -> None:
    scene = read(GIVEN + '[outputs.share]\nformula = "ride_gain_tyre * ride"\n')
    # a product
    assert Symbol("parameter", "ride_gain_tyre") in scene.outputs[-1].values[0].arguments  # type: ignore[union-attr]


def test_an_included_file_brings_its_feedback(tmp_path: Path) -> None:
    """Every name of it gets the prefix, those of joints inside the names of gains too."""
    inner = QUARTER.replace("TENSION", "ride + 0 * ride_position_gain_body") + CALIBRATED
    (tmp_path / "quarter.toml").write_text(inner)
    outer = (
        'format = 1\nname = "half"\n[include]\nleft = { file = "quarter.toml" }\nright = { file = "quarter.toml" }\n'
    )
    (tmp_path / "half.toml").write_text(outer)
    scene = eomgen.load(tmp_path / "half.toml")
    left, right = scene.feedback
    assert left.labels == ("q.left_body", "q.left_wheel", "v.left_body", "v.left_wheel", "tyre")
    assert right.gains[0][0] == "right_ride_position_gain_right_body"
    assert left.calibration is not None
    assert left.calibration.position_weights == {"left_wheel": 3.0}
    assert left.calibration.output_weights == {"left_acceleration": 1.0}
    assert left.references[0] == "left_ride_position_reference_left_body" and left.references[-1] == ""


FEEDBACK = '[controllers.ride]\ntype = "state_feedback"\n'
HELD = FEEDBACK + 'coordinates = ["body", "wheel"]\n'
GAINS = "position_gains = { body = 1 }\n"
LQR = HELD + 'calibration = { method = "lqr", '
POLES = HELD + 'calibration = { method = "pole_placement", '
SKY = '[controllers.sky]\ntype = "skyhook"\nspring = "suspension"\n'
ONE = 'type = "state_feedback"\ncoordinates = ["body"]\n' + GAINS


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FEEDBACK, 'a state_feedback needs coordinates or signals; try: coordinates = ["joint"]'),
        (FEEDBACK + 'coordinates = ["bodi"]\nposition_gains = { bodi = 1 }', "there is no joint 'bodi'; try: body"),
        (FEEDBACK + GAINS + 'coordinates = ["body", "body"]', "the joint body is named twice; try: each joint once"),
        (HELD + "position_gains = { bodi = 1 }", "there is no coordinate of ride 'bodi'; try: body"),
        (HELD + "position_gains = { body = [1, 2] }", "2 gains given for 1 output; try: one gain for each output"),
        (
            LQR + "effort_weights = 1 }\n" + GAINS,
            "gains are given, and a calibration that would find them, too; try: one",
        ),
        (LQR + "velocity_weights = { body = -2 } }", "the weight -2 is negative; try: 0 or more"),
        (LQR.replace("lqr", "imsc") + "effort_weights = 0 }", "effort_weights of 0 is not allowed"),
        (POLES.rstrip(", ") + " }", "pole_placement needs damping_ratios of modes, or poles; try: damping_ratios"),
        (POLES + "modes = [1, 2], damping_ratios = 0.3, frequencies = [1] }", "1 number given for 2 modes"),
        (POLES + "poles = [[-1, 2]], modes = [1] }", "poles are given, and modes, frequencies or damping ratios too;"),
        ('[controllers.sky]\ntype = "skyhook"\n', 'the type skyhook needs the key spring; try: spring = "suspension"'),
        (SKY, "a skyhook controller needs damping or groundhook; try: damping = 2000"),
        (SKY + "damping = -1", "damping is negative (-1); try: 0 or more"),
        (SKY + "damping = 1\nwidth = 1", "width has no meaning for a skyhook that is not clipped; try: clipped = true"),
        (SKY + "damping = 1\nclipped = true", "a clipped skyhook needs maximum_damping: no damper is infinitely hard"),
        (
            SKY + 'damping = 1\nclipped = true\nminimum_damping = "soft"\nmaximum_damping = 200',
            "the range is empty: minimum_damping 300 is not below maximum_damping 200; try: a smaller minimum_damping",
        ),
        (SKY + "damping = 1\nclipped = true\nmaximum_damping = 200\nwidth = 0", "the width 0 m/s is not positive"),
        (
            f'[controllers.a]\noutputs = ["b_c"]\n{ONE}[controllers.a_b]\noutputs = ["c"]\n{ONE}',
            "the controllers a and a_b both make a parameter a_b_c_position_gain_body; try: another name",
        ),
    ],
)
def test_what_cannot_be(text: str, message: str) -> None:
    found = problems(text)
    assert any(problem.startswith(message) for problem in found), found
