"""Linear models of geometrically exact beams of any number of elements: published frequencies, also in rotation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.model import Model
from tests.anchors import anchor
from tests.models.cosserat import beam_scene
from tests.oracles.evaluation import Array

#: L^2 sqrt(rho A / EI) of the beams here.
UNIT = 10.0**2 * np.sqrt(1.0 / 500.0)


def slender(elements: int, **more: Any) -> Model:
    """Return a clamped beam that hardly stretches and shears, with little rotary inertia."""
    stiffness = dict.fromkeys(("torsion", "bending_y", "bending_z"), 500.0)
    stiffness |= dict.fromkeys(("stretch", "shear_y", "shear_z"), 1e6)
    scene = beam_scene(elements, {}, {"stiffness": stiffness, "rotary_inertia": [1e-3, 1e-3, 1e-3]})
    del scene["forces"]
    return eomgen.build({**scene, **more}, profile="instant")


def extrapolated(coarse: Array, fine: Array) -> Array:
    result: Array = (4.0 * fine - coarse) / 3.0
    return result


@pytest.mark.slow
def test_a_cantilever_has_its_published_frequencies_without_terms_by_hand() -> None:
    found = []
    for elements in (8, 16):
        model = slender(elements)
        found.append(model.linearize().modes().angular_frequency[:6:2] * UNIT)
    assert "partials" not in model.functions
    anchor("cantilever_frequencies").check(extrapolated(*found))


@pytest.mark.slow
def test_outputs_of_a_beam_of_many_elements_are_linearized_with_it() -> None:
    """The place of the tip is that of the last node."""
    outputs = {
        "points": {"tip": {"body": "rope", "position": [10, 0, 0]}},
        "outputs": {"tip": {"position": "tip"}, "root": {"section_moment": "rope", "at": 0.0}},
    }
    found = slender(12, **outputs).linearize()
    assert found.modes().angular_frequency[0] * UNIT == pytest.approx(3.5160, rel=5e-3)
    outputs_by_states = found.state_space().C
    assert outputs_by_states.shape[0] == 6 and np.all(np.isfinite(outputs_by_states))
    assert np.abs(outputs_by_states[:3]).max() == pytest.approx(1.0, rel=1e-6)


@pytest.mark.slow
def test_constraints_leave_sparse_partials_as_they_are() -> None:
    """Clamped and pinned: tan x = tanh x has 3.92660 and 7.06858."""
    ends = {
        "points": {"end": {"body": "rope", "position": [10, 0, 0]}, "pin": {"body": "base", "position": [10, 0, 0]}},
        "constraints": {"hinge": {"type": "spherical", "first": "end", "second": "pin"}},
    }
    found = [slender(n, **ends).linearize().modes().angular_frequency[:4:2] * UNIT for n in (8, 16)]
    assert extrapolated(*found) == pytest.approx([3.92660**2, 7.06858**2], rel=2e-3)


@pytest.mark.slow
def test_a_rotating_beam_has_its_published_frequencies() -> None:
    """Flapping, by the speed of the hub: Wright, Smith, Thresher and Wang, J. Appl. Mech. 49 (1982) 197, table 1.

    In the plane of rotation squares of frequencies are less by that of the speed.
    """
    speeds = np.array([1.0, 4.0, 12.0])
    flapping = np.array([[3.6817, 22.1810], [5.5850, 24.2733], [13.1702, 37.6031]])
    base = {"rotation": [{"axis": [0, 0, 1], "angle": "omega * t"}]}
    parameters = {"omega": {"value": 0.0, "tunable": True}}
    found = []
    for elements in (4, 8):
        model = slender(elements, base=base, parameters=parameters)
        linear = [model.linearize(parameters={"omega": speed / UNIT}) for speed in speeds]
        assert [item.reference.what for item in linear] == ["steady motion"] * 3
        found.append([item.modes().angular_frequency[:4] * UNIT for item in linear])
    bending = extrapolated(*np.array(found))
    assert bending[:, [1, 3]] == pytest.approx(flapping, rel=0.01)
    in_plane = np.sqrt(flapping**2 - speeds[:, np.newaxis] ** 2)
    assert bending[:, [0, 2]] == pytest.approx(in_plane, rel=0.01)
