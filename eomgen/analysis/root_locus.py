"""Root locus: eigenvalues of the linear model over a parameter, the reference state followed from value to value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from eomgen.analysis.linearize import linearize
from eomgen.analysis.operating_point import EquilibriumState
from eomgen.compiled.arguments import check_finite, numbers
from eomgen.compiled.terms import Inputs
from eomgen.errors import Problem, UsageError
from eomgen.linear.linearization import Linearization
from eomgen.linear.root_locus import RootLocus
from eomgen.linear.root_locus import root_locus as followed_roots

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def root_locus(
    model: CompiledModel,
    parameter: str,
    values: Sequence[float],
    *,
    parameters: Mapping[str, float] | None = None,
    at: str | EquilibriumState | None = None,
    initial: Mapping[str, Any] | None = None,
    t: float = 0.0,
    u: Inputs = None,
    base: ArrayLike | None = None,
    any_kind: bool = False,
    independent: Sequence[str] = (),
) -> RootLocus:
    """Return the eigenvalues of linear models over values of a tunable parameter, each root followed.

    Parameters
    ----------
    parameter : str
        Tunable parameter.
    values : (n,)
        Its values, SI units.
    parameters : mapping
        Values of other parameters.
    at, initial, t, u, base, any_kind, independent : as of ``linearize``
        The search for an equilibrium or a steady motion starts at the last one.

    Raises
    ------
    EomgenError
        As of ``linearize``, with the value at which it was raised.
    """
    array = numbers("values", values)
    if array.ndim != 1 or not len(array):
        raise UsageError(
            Problem("values", f"the shape is {array.shape}, (n,) is needed", "numpy.linspace(100.0, 2000.0, 40)")
        )
    check_finite("values", array)

    def linearized(value: float, before: Linearization | None) -> Linearization:
        near = None if before is None or at == "initial" else state_of(before)
        return linearize(
            model,
            t=t,
            u=u,
            parameters={**(parameters or {}), parameter: value},
            base=base,
            at=at,
            initial=near or initial,
            any_kind=any_kind,
            independent=independent,
        )

    return followed_roots(parameter, array.tolist(), linearized)


def state_of(lin: Linearization) -> dict[str, Any] | None:
    """Return a linear model's state as ``initial`` takes it, for the next one near it; None of an initial state."""
    r = lin.reference
    if r.what == "initial state":
        return None
    return {"q": r.q, "v": r.v, **({"z": r.z} if len(r.z) else {})}
