"""Second derivatives of whole runs: Hessians against differenced adjoints and complex runs, Taylor series, products."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.pipeline.model import Model
from eomgen.products.derivatives import motion
from eomgen.products.derivatives.motion import ReplayedRun
from eomgen.products.derivatives.run_sensitivities import Sensitivities
from tests.derivatives.checks import moved, sixth_order
from tests.derivatives.test_sensitivities import (
    OF_BEAM,
    OF_CONTROL,
    OF_TREE,
    OF_TURNS,
    SPUN,
    STEP,
    SWUNG,
    TO_ROUNDING,
    bending,
    built,
    controlled,
    tree,
    turning,
)


def differenced(model: Model, found: Sensitivities, of: Sequence[str], span: tuple[float, float], method: str) -> Array:
    """Return Hessians (functionals, n, n) by differences of exact gradients, of order 6; of their halves that are
    symmetric, since on rotations left-trivialised derivatives do not commute."""
    columns = []
    for row in np.eye(len(found.by)):

        def gradients(size: float, row: Array = row) -> Array:
            changed = moved(model, found, size * row)
            options = {"by": found.by, "method": method, "settings": TO_ROUNDING}
            return model.sensitivities(*span, **options, **changed).gradients(of)

        columns.append(sixth_order(gradients, 5e-4))
    table = np.stack(columns, axis=-1)
    return 0.5 * (table + np.swapaxes(table, -1, -2))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("builder", "method", "by", "initial", "of", "step"),
    [
        (tree, "generalized_alpha", OF_TREE, SWUNG, ["final(angle)", "integral(two[1])", "mean(two[0])"], STEP),
        (tree, "trapezoidal", OF_TREE, SWUNG, ["final(angle)", "sum(angle)"], STEP),
        (controlled, "trapezoidal", OF_CONTROL, {"a": 0.6}, ["final(y[0])", "mean(y[1])"], STEP),
        (bending, "generalized_alpha", OF_BEAM, {"axle": {"velocity": 1.0}}, ["final(y[0])", "mean(y[1])"], 0.001),
        (turning, "generalized_alpha", [*OF_TURNS, "q.a[1]"], SPUN, ["final(y[0])", "mean(y[2])"], STEP),
    ],
    ids=["tree", "tree_trapezoidal", "controlled", "beam", "turning"],
)
def test_hessians_are_differences_of_gradients(
    builder: Any, method: str, by: Sequence[str], initial: Mapping[str, Any], of: Sequence[str], step: float
) -> None:
    """And products with vectors are those with Hessians."""
    _, model = built(builder())
    span = (30 * step, step)
    found = model.sensitivities(*span, by=by, method=method, initial=initial, settings=TO_ROUNDING)
    hessians = found.hessians(of)
    expected = differenced(model, found, of, span, method)
    vectors = np.concatenate([np.eye(len(by)), np.random.default_rng(1).normal(size=(len(by), 2))], axis=1)
    for functional, H, other in zip(of, hessians, expected, strict=True):
        size = np.max(np.abs(H))
        assert np.max(np.abs(H - other)) <= 1e-10 * size  # 5e-9 is asked for
        np.testing.assert_array_equal(H, H.T)
        products = found.hessian_products(functional, vectors)
        assert np.max(np.abs(products - H @ vectors)) <= 1e-13 * size * np.max(np.abs(vectors))
        column = products[:, : len(by)]
        assert np.max(np.abs(column - column.T)) <= 1e-14 * size  # before it is taken out
        np.testing.assert_allclose(found.hessian_products(functional, vectors[:, -1]), products[:, -1], rtol=1e-12)


def test_long_runs_are_stepped_again_from_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    _, model = built(tree())
    of, vectors = "integral(two[1])", np.eye(2)
    kept = model.sensitivities(5.0, STEP, by=["mass", "q.a"], initial={"a": 0.5})
    monkeypatch.setattr(ReplayedRun.__init__, "__defaults__", (0,))
    monkeypatch.setattr(motion, "LONGEST", 64)
    again = model.sensitivities(5.0, STEP, by=["mass", "q.a"], initial={"a": 0.5})
    assert (kept._run.motion.parts, again._run.motion.parts) == (1, 8)
    np.testing.assert_allclose(kept.derivatives["two"], again.derivatives["two"], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(kept.gradients(["final(angle)", of]), again.gradients(["final(angle)", of]), rtol=1e-13)
    H = kept.hessian(of)
    np.testing.assert_allclose(again.hessian(of), H, rtol=1e-12)
    np.testing.assert_allclose(again.hessian_products(of, vectors), H, rtol=1e-12)


def test_runs_and_vectors_without_second_derivatives_say_why() -> None:
    _, model = built(tree())
    found = model.sensitivities(0.1, STEP, by=["mass", "q.a"])
    for vectors, text in {
        (1.0, 2.0, 3.0): "directions: vectors have the shape (3,); try: finite numbers, (2,) or (2, n)",
        (1.0, np.nan): "directions: vectors have nan; try: finite numbers, (2,) or (2, n)",
    }.items():
        with pytest.raises(UsageError) as caught:
            found.hessian_products("final(angle)", vectors)
        assert text in str(caught.value)
    with pytest.raises(UsageError, match="the functional 'last' is none of a run"):
        found.hessian("last")
