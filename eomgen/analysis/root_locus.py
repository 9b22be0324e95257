"""Root locus: eigenvalues of the linear model over a parameter, the reference state followed from value to value."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from eomgen.compiled.arguments import check_finite, numbers
from eomgen.errors import Problem, UsageError
from eomgen.linear.linearization import Linearization
from eomgen.linear.root_locus import RootLocus, root_locus


def roots_over(
    linearize: Callable[..., Linearization],
    parameter: str,
    values: Sequence[float],
    parameters: Mapping[str, float] | None,
    **options: Any,
) -> RootLocus:
    """Return the roots over a parameter; see ``Model.root_locus``. ``linearize`` is the model's method, and takes
    ``options``."""
    array = numbers("values", values)
    if array.ndim != 1 or not len(array):
        raise UsageError(
            Problem("values", f"the shape is {array.shape}, (n,) is needed", "numpy.linspace(100.0, 2000.0, 40)")
        )
    check_finite("values", array)

    def linearized(value: float, before: Linearization | None) -> Linearization:
        given = dict(options)
        if before is not None and given.get("at") != "initial":
            given["initial"] = state_of(before) or given.get("initial")
        return linearize(parameters={**(parameters or {}), parameter: value}, **given)

    return root_locus(parameter, array.tolist(), linearized)


def state_of(lin: Linearization) -> dict[str, Any] | None:
    """Return a linear model's state as ``initial`` takes it, for the next one near it; None of an initial state."""
    r = lin.reference
    if r.what == "initial state":
        return None
    return {"q": r.q, "v": r.v, **({"z": r.z} if len(r.z) else {})}
