"""Second derivatives of many bodies in JAX need memory for the nonzeros of their Hessians, not for whole matrices."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import eomgen

jax = pytest.importorskip("jax")


def chain_of_sliders(count: int) -> eomgen.Model:
    """Return sliders with forces that are not linear between neighbours."""
    scene = eomgen.SceneBuilder("sliders", gravity=[0, 0, 0])
    for k in range(count):
        scene = scene.body(f"b{k}", 1.0 + k).joint(f"x{k}", "prismatic", "base", f"b{k}", axis=[1, 0, 0])
    for k in range(count):
        near = " + ".join(f"(q.x{i} - q.x{k})**3" for i in (k - 1, k + 1) if 0 <= i < count)
        scene = scene.effort(f"f{k}", f"x{k}", near)
    return eomgen.build(scene.build(), profile="quick")


def arrays(jaxpr: Any) -> Iterator[Any]:
    """Yield the intermediate arrays of a program of JAX, of its parts too."""
    for equation in jaxpr.eqns:
        yield from (variable.aval for variable in equation.outvars)
        for part in jax.tree.leaves(list(equation.params.values()), is_leaf=lambda x: hasattr(x, "eqns")):
            if hasattr(part, "eqns"):
                yield from arrays(part)
            elif hasattr(part, "jaxpr"):
                yield from arrays(part.jaxpr)


@pytest.mark.long
@pytest.mark.slow
def test_hessians_of_many_coordinates_have_no_whole_matrix_for_each_direction() -> None:
    jax.config.update("jax_enable_x64", True)
    model = chain_of_sliders(20)
    functions, q = eomgen.jax(model), np.linspace(0.0, 1.0, 20) ** 2
    hessian = jax.hessian(lambda q: functions.forward_dynamics(q, 0.0 * q).sum())
    largest = max(array.size for array in arrays(jax.make_jaxpr(hessian)(q).jaxpr))
    assert largest < 20 * 20 * 20  # for each direction a row for each acceleration and coordinate
    mass = np.arange(1.0, 21.0)  # by hand: force on k by k + 1 is (q[k+1] - q[k])**3, and the opposite on k + 1
    expected, stiffness = np.zeros((20, 20)), 6.0 * np.diff(q)
    for k in range(19):
        pair = np.ix_([k, k + 1], [k, k + 1])
        expected[pair] += stiffness[k] * (1.0 / mass[k] - 1.0 / mass[k + 1]) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    np.testing.assert_allclose(hessian(q), expected, rtol=0.0, atol=1e-12)
