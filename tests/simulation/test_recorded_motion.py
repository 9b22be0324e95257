"""A motion that a caller steps, as a solution of the rows that it recorded, and springs whose ends meet in a run."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from tests.simulation.rails import built, on_rail


@cache
def cart() -> eomgen.Model:
    builder = on_rail("force", stiffness=40, damping=0.5).parameter("gain", 2.0, tunable=True).input("force", unit="N")
    return built(builder.output("seen", formula="gain * q.x + force"), method="rk4")


@pytest.mark.slow
def test_rows_are_those_of_a_run(tmp_path: Path) -> None:
    run, expected = cart().start({"x": 0.1}, step=1e-2), cart().simulate(1.0, 1e-2, initial={"x": 0.1})
    run.record()
    for _ in range(100):
        run.step()
        run.record()
    found = run.solution()
    for name in ("t", "q", "v", "a"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    np.testing.assert_allclose(found["energy.total"], expected["energy.total"], rtol=1e-14)
    np.testing.assert_array_equal(found["seen"], expected.outputs["seen"])
    np.testing.assert_array_equal(found.at(0.505).q, expected.at(0.505).q)
    np.testing.assert_array_equal(found.poses["b"], expected.poses["b"])
    assert found.success and "101 recorded rows to t = 1 s" in found.message and not found.error.available
    assert eomgen.Solution.load(found.save(tmp_path / "run.npz"))["q.x"][-1] == expected.q[-1, 0]
    assert "rail" in found._repr_html_()


def test_inputs_and_parameters_are_those_of_each_row() -> None:
    run = cart().start(step=1e-2)
    for force, gain in ((1.0, 2.0), (-3.0, 5.0)):
        run.set_parameter("gain", gain)
        run.step([force], 10)
        run.record()
    found = run.solution()
    np.testing.assert_array_equal(found.inputs["force"], [1.0, -3.0])
    np.testing.assert_allclose(found["seen"], [2.0, 5.0] * found.q[:, 0] + [1.0, -3.0], rtol=1e-14)
    np.testing.assert_allclose(found["energy.kinetic"], 0.5 * found.v[:, 0] ** 2, rtol=1e-14)


def test_a_state_of_before_takes_the_place_of_what_came_later() -> None:
    run = cart().start({"x": 0.1}, step=1e-2)
    run.record()
    before = run.state
    for force in (1.0, 2.0):
        run.restore(before)
        run.step([force], 5)
        run.record()
    other = run.copy()
    other.step([0.0])
    other.record()
    np.testing.assert_allclose(run.solution().t, [0.0, 0.05], atol=1e-15)
    assert run.solution().inputs["force"][-1] == 2.0 and len(other.solution().t) == 3
    with pytest.raises(UsageError, match=r"solution: there are no rows: .* try: run.record\(\) at the start"):
        cart().start(step=1e-2).solution()
