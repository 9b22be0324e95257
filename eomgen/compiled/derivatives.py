"""Time derivatives of accelerations, inputs and the base that a term takes: checked, or by the scene's own functions of time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.compiled.arguments import by_name, components, numbers
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.compiled.terms import Terms

Array = NDArray[np.float64]

#: Blocks of time derivatives.
DERIVATIVES = frozenset({"j", "s", "a_higher", "u_dot", "u_ddot", "u_higher", "base_rates"})

_MEANING = {"j": "the first time derivative of a", "s": "the second time derivative of a"}
_MEANING["a_higher"] = "the time derivatives of a from the third on"


def check_derivatives(names: Iterable[str]) -> None:
    """Raise UsageError for what is no block of derivatives."""
    for name in names:
        if name not in DERIVATIVES:
            raise UsageError(Problem(name, "no term takes an argument of this name", f"one of {', '.join(sorted(DERIVATIVES))}"))


def derivative_values(terms: Terms, term: str, given: Mapping[str, Any], values: Mapping[str, Array]) -> dict[str, Array]:
    """Return the blocks of derivatives that a term takes.

    Parameters
    ----------
    given : what the caller says; missing derivatives of inputs are the scene's, or zero for inputs that the caller gives
    values : the other blocks

    Raises
    ------
    UsageError
        For derivatives of a that are missing, arrays of the wrong shape, names that are not there, and a base without its rates.
    """
    blocks = terms.functions.inputs(term)
    found: dict[str, Array] = {}
    for block in ("j", "s", "a_higher"):
        if block in blocks:
            if given.get(block) is None:
                raise UsageError(Problem(block, f"the term {term} needs {_MEANING[block]}", f"{block}=..."))
            found[block] = _rows(terms, term, block, given[block]) if block == "a_higher" else terms.velocity(block, given[block])
    if any(block in blocks for block in ("u_dot", "u_ddot", "u_higher")):
        found |= _of_inputs(terms, term, blocks, given, values)
    if "base_rates" in blocks:
        found["base_rates"] = _of_base(terms, given, values)
    return found


def _of_inputs(
    terms: Terms, term: str, blocks: list[str], given: Mapping[str, Any], values: Mapping[str, Array]
) -> dict[str, Array]:
    """Return derivatives of inputs: given, the scene's own, or zero for inputs that the caller gives."""
    said: dict[str, Array] = {}
    if "input_rates" in terms.functions:
        said = dict(zip(terms.functions.output_names("input_rates"), terms.functions("input_rates", values), strict=True))
    driven = given.get("u")
    names = terms.input_names
    by_caller = np.array([driven is not None and (not isinstance(driven, Mapping) or name in driven) for name in names], bool)
    found: dict[str, Array] = {}
    for block in ("u_dot", "u_ddot"):
        if block not in blocks:
            continue
        default = np.where(by_caller, 0.0, said[block]) if block in said else np.zeros(len(names))
        rates = given.get(block)
        if rates is None:
            found[block] = default
        elif isinstance(rates, Mapping):
            found[block] = by_name("input", rates, names, default)
        else:
            found[block] = components(block, rates, len(names))
    if "u_higher" in blocks:
        if given.get("u_higher") is not None:
            found["u_higher"] = _rows(terms, term, "u_higher", given["u_higher"])
        else:
            rows = np.where(by_caller, 0.0, said["u_higher"]) if said else np.zeros((1, len(names)))
            size = terms.functions.sizes["u_higher"]
            found["u_higher"] = rows.reshape(*rows.shape[:-2], -1) if said else np.zeros(size)
    return found


def _of_base(terms: Terms, given: Mapping[str, Any], values: Mapping[str, Array]) -> Array:
    if given.get("base_rates") is not None:
        if not terms.moving_base:
            raise UsageError(Problem("base_rates", "the base of this scene is at rest", "a [base] section in the scene"))
        size = terms.functions.sizes["base_rates"]
        return _flat("base_rates", given["base_rates"], (size // 6, 6), size)
    if given.get("base") is not None:
        what = "a base that is given needs the further derivatives of its twist as well"
        raise UsageError(Problem("base_rates", what, "base_rates=..., or neither of the two for the scene's own motion"))
    (rates,) = terms.functions("base_rates", values)
    return rates.reshape(*rates.shape[:-2], -1)


def _rows(terms: Terms, term: str, block: str, value: ArrayLike) -> Array:
    """Return derivatives from the third on, (..., rows of this term, n), as (..., size), zeros beyond the rows of this term."""
    size = terms.functions.sizes[block]
    width = terms.functions.sizes["v" if block == "a_higher" else "u"]
    return _flat(block, value, (int(term.rsplit("_", 1)[1]) - 2, width), size)


def _flat(block: str, value: ArrayLike, shape: tuple[int, int], size: int) -> Array:
    array = numbers(block, value)
    if array.shape[-2:] != shape:
        hint = f"{block} row by row, one derivative each, or a batch of that along leading axes"
        raise UsageError(Problem(block, f"the shape is {array.shape}, (..., {shape[0]}, {shape[1]}) is needed", hint))
    batch = array.shape[:-2]
    flat = np.zeros((*batch, size))
    flat[..., : shape[0] * shape[1]] = array.reshape(*batch, shape[0] * shape[1])
    return flat
