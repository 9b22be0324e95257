"""C of a controller alone whose law was designed for a linear model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.control import OutputFeedback, kalman, lqr
from tests.codegen.test_controller_alone import answers, compiled
from tests.models.library import scene


@pytest.mark.slow
def test_an_observer_with_a_regulator_gives_the_commands_of_the_closed_loop(tmp_path: Path) -> None:
    data = scene(
        "oscillator",
        bodies__cart__mass=2.0,
        joints__slide__stiffness=40.0,
        inputs={"push": {"unit": "N"}},
        efforts={"motor": {"joint": "slide", "effort": "push"}},
        outputs={"place": {"formula": "q.slide + 0.02 * sin(q.slide)", "unit": "m"}},
        simulation=None,
    )
    space = eomgen.build(data, profile="instant").linearize(at="initial", initial={"slide": 0.0}).state_space()
    law = OutputFeedback(
        lqr(space, {"place": 400.0}, {"push": 0.1}, sample="10 ms", delay="5 ms"),
        kalman(space, {"push": 0.1}, {"place": 1e-6}, sample="10 ms", delay="5 ms"),
    )
    closed = eomgen.with_controller(data, law)
    eomgen.generate(closed, tmp_path / "c", only="controller")
    run = eomgen.build(closed, profile="instant").simulate(0.5, 2.5e-3, method="rk4")
    calls = slice(0, -2, 2)  # each 5 ms
    held = answers(compiled(tmp_path / "c"), run.outputs["place"][calls, None])
    names = [state.name for state in eomgen.load(closed).states]
    after = run.z[1::2, names.index("push")][: len(held)]
    np.testing.assert_allclose(held[:, 1], after, rtol=1e-13, atol=1e-13)
    assert np.ptp(after) > 0.1
