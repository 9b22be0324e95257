"""Shape functions of uniform beams against sines and cosines, and their scales against the definition on a grid."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson

from eomgen.mechanics.shape_functions.fixed_point import ONE, from_fixed
from eomgen.mechanics.shape_functions.integrals import shapes
from eomgen.scene.bodies.model import Beam
from tests.mechanics.test_shape_integrals import deformation

S = np.linspace(0.0, 1.0, 101)


def table(kind: Any, modes: int, family: Any, **more: Any) -> Any:
    """Return values, slopes and curvatures of functions at S, (3, modes, 101)."""
    item = deformation(kind, modes, family, **more)
    functions = shapes(item, Beam(0.0, 1.0, item.stiffness, (item,)))
    positions = np.array([(k * ONE) // 100 for k in range(101)], dtype=object)
    return np.vectorize(lambda x: float(from_fixed(x)), otypes=[float])(np.array(functions.values(positions)))


@pytest.mark.parametrize(
    ("kind", "family", "wave", "function"),
    [
        ("bending_y", "pinned_pinned", lambda k: k + 1.0, np.sin),
        ("stretch", "pinned_pinned", lambda k: k + 1.0, np.sin),
        ("torsion", "free_free", lambda k: k + 1.0, np.cos),
        ("stretch", "clamped_free", lambda k: k + 0.5, np.sin),
    ],
)
def test_uniform_beams_move_in_harmonic_waves(kind: Any, family: Any, wave: Any, function: Any) -> None:
    values, slopes, curvatures = table(kind, 3, family)
    other = np.cos if function is np.sin else lambda x: -np.sin(x)
    for k in range(3):
        w = wave(k) * np.pi
        np.testing.assert_allclose(values[k], function(w * S), rtol=0, atol=1e-14)
        np.testing.assert_allclose(slopes[k], w * other(w * S), rtol=0, atol=1e-13)
        np.testing.assert_allclose(curvatures[k], -w * w * function(w * S), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("family", "more"),
    [
        ("polynomial", {"ends": "pinned_pinned"}),
        ("finite_elements", {"ends": "pinned_pinned", "elements": 6}),
        ("pinned_pinned", {}),
        ("polynomial", {}),
        ("clamped_free", {}),
    ],
)
def test_scales_are_those_of_their_names(family: Any, more: dict[str, Any]) -> None:
    natural, unit, mean = (
        table("bending_z", 3, family, normalisation=name, **more)[0] for name in ("natural", "unit", "mean_square")
    )
    for k in range(3):
        for scaled in (unit[k], mean[k]):
            np.testing.assert_allclose(scaled * natural[k][45], natural[k] * scaled[45], rtol=0, atol=1e-12)
        assert simpson(mean[k] ** 2, x=S) == pytest.approx(1.0, abs=1e-4)
        if "pinned" in (more.get("ends") or family):
            assert 0.995 < np.max(np.abs(unit[k])) <= 1.0 + 1e-12 and unit[k][1] > 0.0
        else:
            assert unit[k][-1] == 1.0
