"""States of many samples on the constraints: those that ``consistent`` finds one by one, and which have none."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.compiled.consistent_states import consistent_samples
from eomgen.lie import product
from tests.models.library import scene
from tests.models.scenes import absolute

ROLLING = {
    "type": "rolling",
    "shape": "sphere",
    "radius": "radius",
    "first": {"body": "base", "axis": [0, 0, 1]},
    "second": {"body": "hull"},
}


def model_of(name: str) -> eomgen.Model:
    """Return a model with a closed loop, in absolute coordinates, or with rows of velocities."""
    if name == "absolute":
        return absolute()
    if name == "four_bar":
        return eomgen.build(scene("four_bar/scene", parameters__ground__tunable=True), profile="instant")
    radius = {"value": 0.3, "unit": "m", "tunable": True}
    start = {"position": [0, 0, 0.3]}
    ball = scene(
        "free_body", gravity=None, parameters__radius=radius, constraints__roll=ROLLING, joints__root__initial=start
    )
    return eomgen.build(ball, profile="instant")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "spread"), [("four_bar", 0.4), ("absolute", 0.3), ("ball", 0.5)])
def test_samples_are_where_each_is_alone(name: str, spread: float, rng: np.random.Generator) -> None:
    model, count = model_of(name), 37
    p, q = (np.repeat(part[np.newaxis], count, axis=0) for part in (model.parameter_array(), model.initial_q))
    q = product.update(model.factors, q, rng.normal(scale=spread, size=(count, model.nv)))
    v = rng.normal(size=(count, model.nv))
    if name == "ball":
        p *= 1.0 + 0.1 * rng.random(p.shape)
    found = consistent_samples(model, q, v, 0.0, p)
    assert found.met.sum() > count // 2
    for k in np.flatnonzero(found.met):
        alone = model.consistent(q[k], v[k], parameters=p[k])
        np.testing.assert_allclose(found.q[k], alone.q, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found.v[k], alone.v, rtol=1e-10, atol=1e-10)
    for k in np.flatnonzero(~found.met):
        with pytest.raises(eomgen.ModelError):
            model.consistent(q[k], v[k], parameters=p[k])
    part = consistent_samples(model, q[5:9], v[5:9], 0.0, p[5:9])  # whatever is beside a sample
    np.testing.assert_array_equal(part.q, found.q[5:9])
    np.testing.assert_array_equal(part.v, found.v[5:9])


def test_a_sample_without_a_state_leaves_the_others_alone() -> None:
    """Four bars of which one cannot close: its ground is longer than all others together."""
    model = model_of("four_bar")
    p = np.array([[0.4], [2.0]])
    q, v = (np.repeat(part[np.newaxis], 2, axis=0) for part in (model.initial_q, model.initial_v))
    found = consistent_samples(model, q, v, 0.0, p)
    assert found.met.tolist() == [True, False]
    np.testing.assert_allclose(found.q[0], model.initial_q, rtol=1e-12)
    with pytest.raises(eomgen.ModelError, match="cannot be met together"):
        model.consistent(q[1], v[1], parameters=p[1])
