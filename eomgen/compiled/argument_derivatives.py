"""First and second derivatives of terms in all of their arguments, exact to rounding, with their sparsity.

The Hessian is the second derivative of weights . values: one symmetric matrix, as optimisers ask for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import names_of
from eomgen.base.messages import nearest, shown
from eomgen.compiled.arguments import components
from eomgen.compiled.functions import Functions
from eomgen.compiled.terms import ExtensibleModel, Inputs, Parameters, States
from eomgen.errors import Problem, UsageError
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS, DIFFERENTIATED, TERMS

Indices = NDArray[np.int64]


class Sparsity(NamedTuple):
    """Positions of the nonzeros of a matrix by compressed columns.

    Attributes
    ----------
    shape : tuple of int
        Rows and columns.
    starts : (columns + 1,) ndarray
        First nonzero of each column, and the number of nonzeros.
    rows : (nonzeros,) ndarray
        Rows of the nonzeros, ascending in each column.
    arguments : mapping
        Name of an argument -> slice of its columns; of a Hessian of its rows, too.
    """

    shape: tuple[int, int]
    starts: Indices
    rows: Indices
    arguments: Mapping[str, slice]

    @property
    def columns(self) -> Indices:
        """Columns of the nonzeros, (nonzeros,)."""
        return np.repeat(np.arange(self.shape[1]), np.diff(self.starts))


class _Layout(NamedTuple):
    """Sparsity, and for each nonzero its place among the numbers that the compiled function gives."""

    sparsity: Sparsity
    places: Indices


def sparsity(model: ExtensibleModel, term: str, order: int = 1, *, of: Sequence[str] | None = None) -> Sparsity:
    """Return the positions of the structural nonzeros of ``derivatives`` (order 1) or ``hessian`` (order 2).

    Parameters
    ----------
    term : str
        ``inverse_dynamics``, ``forward_dynamics``, ``internal_rate``, ``outputs`` or ``frame_poses``; with constraints
        ``residual``, ``constraint``, ``constraint_velocity`` or ``constraint_acceleration``.
    order : int, optional
        1: Jacobian; 2: Hessian, with both triangles.
    of : sequence of str, optional
        Arguments among q, v, a, z, lam, u, p and t; all that the term takes if not given.

    Returns
    -------
    Sparsity
        ``shape``, ``starts``, ``rows`` by compressed columns, and ``arguments``, the slices of the columns.

    Raises
    ------
    UsageError
        A term without such derivatives, an argument that it does not take, or another order.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> pattern = model.sparsity("inverse_dynamics", of=["q", "v"])
    >>> pattern.shape, pattern.starts.tolist()
    ((2, 4), [0, 2, 4, 6, 7])
    """
    if order not in (1, 2):
        raise UsageError(Problem("order", f"there are derivatives of order 1 and 2, not {order} [E0228]", "1 or 2"))
    name = _name(model, term, order)
    return _layout(model.having((name,)).evaluator.functions, name, of).sparsity


def derivatives(
    model: ExtensibleModel,
    term: str,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    of: Sequence[str] | None = None,
    sparse: bool = False,
) -> Array:
    """Return the Jacobian of a term in all of its arguments.

    Parameters
    ----------
    term : str
        ``inverse_dynamics``, ``forward_dynamics``, ``internal_rate``, ``outputs`` or ``frame_poses``; with constraints
        ``residual``, ``constraint``, ``constraint_velocity`` or ``constraint_acceleration``.
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv); a by forward dynamics
        if the term takes it and it is not given.
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); zero if not given.
    of : sequence of str, optional
        Arguments of the columns, in this order, among q (left-trivialised), v, a, z, lam, u, p and t; all that the term
        takes if not given. All inputs u are independent; a moving base follows its law in t and p.
    sparse : bool, optional
        Return the nonzeros in the order of ``sparsity``.

    Returns
    -------
    (..., rows, columns) ndarray, or (..., nonzeros) ndarray
        SI units.

    Raises
    ------
    UsageError
        As of ``sparsity``.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.derivatives("inverse_dynamics", [0.8, -0.3], [1.0, 0.5], [0.2, 0.1], of=["q"]).round(4)
    array([[6.5509, 1.671 ],
           [1.7966, 1.9183]])
    """
    name = _name(model, term, 1)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "multipliers": multipliers}
    return _values(model, name, of, {**arguments, "parameters": parameters}, sparse=sparse)


def hessian(
    model: ExtensibleModel,
    term: str,
    weights: ArrayLike,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    of: Sequence[str] | None = None,
    sparse: bool = False,
) -> Array:
    """Return the symmetric Hessian of weights . term in all of its arguments, as of a Lagrangian.

    In q the coordinates are increments of q exp(dq), joint by joint, at dq = 0: for rotations and poses the symmetric
    part of second left-trivialised derivatives, which do not commute.

    Parameters
    ----------
    term : str
        ``inverse_dynamics``, ``forward_dynamics``, ``internal_rate``, ``outputs`` or ``frame_poses``; with constraints
        ``residual``, ``constraint``, ``constraint_velocity`` or ``constraint_acceleration``.
    weights : array_like
        One weight for each number of the term, (..., rows): multipliers of an optimisation.
    q, v, a : array_like
        Configuration (..., nq), left-trivialised velocity and acceleration (..., nv); a by forward dynamics
        if the term takes it and it is not given.
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    multipliers : array_like, optional
        Multipliers of the constraints (..., rows); zero if not given.
    of : sequence of str, optional
        Arguments of rows and columns, as of ``derivatives``.
    sparse : bool, optional
        Return the nonzeros of both triangles in the order of ``sparsity``.

    Returns
    -------
    (..., n, n) ndarray, or (..., nonzeros) ndarray
        SI units.

    Raises
    ------
    UsageError
        As of ``sparsity``; weights of another number.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> q, v, a = [0.8, -0.3], [1.0, 0.5], [0.2, 0.1]
    >>> model.hessian("inverse_dynamics", [1.0, 0.0], q, v, a, of=["q"]).round(4)
    array([[-5.8767, -0.9815],
           [-0.9815, -1.0831]])
    """
    name = _name(model, term, 2)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "multipliers": multipliers}
    arguments["weights"] = components("weights", weights, _rows(model.evaluator.functions, term))
    return _values(model, name, of, {**arguments, "parameters": parameters}, sparse=sparse)


#: Blocks with as many numbers as terms.
_ROWS = {"constraint": "holonomic", "internal_rate": "z"}
_ROWS |= {"constraint_velocity": "lam", "constraint_acceleration": "lam"}


def _rows(functions: Functions, term: str) -> int:
    """Return the number of components of a differentiated term: rows of the Jacobian."""
    if term == "outputs":
        return sum(int(item["size"]) for item in functions.library.layout["outputs"])
    if term == "frame_poses":
        return 7 * len(functions.library.layout["frames"])  # of each a quaternion and a position
    if term == "momenta":
        return 2 * functions.sizes["v"]
    return functions.sizes[_ROWS.get(term, "v")]


def _name(model: ExtensibleModel, term: str, order: int) -> str:
    """Return the name of the compiled term with the derivatives of ``term``: ``<term>_derivatives``, or ``_hessian``
    for order 2. Raises UsageError if the scene has no such derivatives, or the term has no components."""
    evaluator = model.evaluator
    if str(term) not in DIFFERENTIATED:
        fault = f"there are no derivatives of {shown(str(term))} in all arguments [E0229]"
        raise UsageError(Problem("term", fault, nearest(str(term), DIFFERENTIATED)))
    if term == "forward_dynamics" and evaluator.multipliers:
        fault = "forward_dynamics of a scene with constraints has two results, vdot and multipliers [E0230]"
        raise UsageError(Problem("term", fault, "residual and constraint, with the multipliers as arguments"))
    name = f"{term}_{'hessian' if order == 2 else 'derivatives'}"
    if TERMS[name].exists == ("constraints",) and not evaluator.multipliers:
        which = "second derivatives" if TERMS[f"{term}_derivatives"].exists != TERMS[name].exists else "derivatives"
        raise UsageError(Problem("term", f"{term} has {which} in scenes with constraints [E0231]", "inverse_dynamics"))
    if not _rows(evaluator.functions, term):
        raise UsageError(Problem("term", f"{term} of this scene has no numbers [E0232]", "inverse_dynamics"))
    return name


def _values(
    model: ExtensibleModel, name: str, of: Sequence[str] | None, arguments: dict[str, Any], *, sparse: bool
) -> Array:
    """Return the matrix (..., rows, columns) of a term of derivatives, or with ``sparse`` its nonzeros (..., nonzeros).
    ``of`` selects the arguments of the columns; ``arguments`` has the state and, for a Hessian, the weights."""
    evaluator = model.having((name,)).evaluator
    layout = _layout(evaluator.functions, name, of)
    if "weights" in arguments:
        missing = evaluator.functions.sizes["weights"] - arguments["weights"].shape[-1]
        arguments["weights"] = np.concatenate(
            [arguments["weights"], np.zeros((*arguments["weights"].shape[:-1], missing))], axis=-1
        )
    results = evaluator.call(name, **arguments)
    batch = results[0].shape[:-1] if results else evaluator.configuration(arguments["q"]).shape[:-1]
    nonzeros = results[0][..., layout.places] if results else np.zeros((*batch, 0))
    if sparse:
        return nonzeros
    matrix = np.zeros((*batch, *layout.sparsity.shape))
    matrix[..., layout.sparsity.rows, layout.sparsity.columns] = nonzeros
    return matrix


def _layout(functions: Functions, name: str, of: Sequence[str] | None) -> _Layout:
    """Return the sparsity of a term of derivatives, kept with the library."""
    of = None if of is None else names_of("of", "arguments", of, "q")
    key = f"sparsity of {name} {of}"
    if key not in functions.library.kept:
        functions.library.kept[key] = _made_layout(functions, name, of)
    return cast("_Layout", functions.library.kept[key])


def _made_layout(functions: Functions, name: str, of: Sequence[str] | None) -> _Layout:
    """Return the sparsity of derivatives in the arguments ``of``, in this order (None: all), and the places of the
    nonzeros. Raises UsageError for an argument that the term does not take, or one named twice."""
    sizes = {block: size_of(functions, block) for block in ARGUMENTS}
    firsts = dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
    rows, columns = unpacked_places(functions.library.layout["patterns"][name])
    read = {
        block for block in ARGUMENTS if np.any((firsts[block] <= columns) & (columns < firsts[block] + sizes[block]))
    }
    taken = [block for block in ARGUMENTS if block in functions.inputs(name) or block in read]
    chosen = taken if of is None else list(of)
    for block in chosen:
        if block not in taken:
            fault = f"{TERMS[name].differentiated} of this scene does not take {shown(str(block))} [E0233]"
            raise UsageError(Problem("of", fault, f"some of {', '.join(taken)}"))
    if len(set(chosen)) < len(chosen):
        raise UsageError(Problem("of", f"{', '.join(chosen)} has an argument twice [E0234]", "each once"))
    slices, size = dict[str, slice](), 0
    new_columns = np.full(sum(sizes.values()), -1)
    for block in chosen:
        slices[block] = slice(size, size + sizes[block])
        new_columns[firsts[block] : firsts[block] + sizes[block]] = np.arange(size, size + sizes[block])
        size += sizes[block]
    numbers = np.arange(len(rows))
    second = name.endswith("_hessian")
    if second:
        off = rows != columns
        rows, columns = np.concatenate([rows, columns[off]]), np.concatenate([columns, rows[off]])
        numbers, rows = np.concatenate([numbers, numbers[off]]), new_columns[rows]
    columns = new_columns[columns]
    selection = np.flatnonzero((rows >= 0) & (columns >= 0))
    order = selection[np.lexsort((rows[selection], columns[selection]))]
    starts = np.concatenate([[0], np.cumsum(np.bincount(columns[order], minlength=size))])
    height = size if second else _rows(functions, TERMS[name].differentiated)
    return _Layout(Sparsity((height, size), starts, rows[order], slices), numbers[order])


def size_of(functions: Functions, block: str) -> int:
    """Return the number of directions of an argument."""
    return 1 if block == "t" else functions.sizes[{"q": "v", "a": "v"}.get(block, block)]
