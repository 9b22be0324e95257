"""Quadratic costs of linear models of first and second order, from weights of named quantities or from matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.arguments import check_finite, number_of, numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.state_space import KINDS, StateSpace, labels, linear_model_name, signal_labels


def real_matrix(name: str, value: ArrayLike, rows: int, columns: int) -> Array:
    """Return a matrix as finite floats.

    Parameters
    ----------
    name : str
        Name in messages.
    value : array_like
        The matrix.
    rows, columns : int
        Shape that is needed.

    Raises
    ------
    UsageError
        Another shape, or an entry that is not a finite number.
    """
    matrix = numbers(name, value)
    if matrix.shape != (rows, columns):
        raise UsageError(f"{name} has the shape {matrix.shape} [E0393]", f"({rows}, {columns})")
    check_finite(name, matrix)
    return matrix


@dataclass(frozen=True)
class Weights:
    """Weights of the quadratic cost s^T Q s + 2 s^T S u + u^T R u, s being the state, such as [q, v].

    Attributes
    ----------
    state : (2n, 2n) Q, positive semi-definite.
    effort : (m, m) R, positive definite if a gain is wanted.
    cross : (2n, m) S.
    """

    state: Array
    effort: Array
    cross: Array

    def plus_output(self, of_state: ArrayLike, of_effort: ArrayLike, cost: ArrayLike) -> Weights:
        """Return the cost plus the cost int y^T W y dt of an output y = F [q, v] + D u. `of_state` is F (ny, 2n),
        `of_effort` D (ny, m), `cost` the matrix W (ny, ny) or its diagonal. Accelerations are such outputs: v' = -M^-1
        K q - M^-1 C v + M^-1 B u."""
        weights = np.atleast_2d(np.asarray(of_state)), np.atleast_2d(np.asarray(of_effort))
        rows = len(weights[0])
        F = real_matrix("the output's part of the state", weights[0], rows, len(self.state))
        D = real_matrix("the output's part of the efforts", weights[1], rows, len(self.effort))
        W = weight("the weight of an output", cost, rows)
        return Weights(self.state + F.T @ W @ F, self.effort + D.T @ W @ D, self.cross + F.T @ W @ D)


def weight(name: str, value: ArrayLike, size: int) -> Array:
    """Return a weight as a symmetric matrix (size, size), from a matrix, a diagonal or one number for the diagonal.
    Raises UsageError unless the value is a positive semidefinite matrix of this size; `name` serves the message."""
    array = numbers(name, value)
    if array.ndim < 2 and array.shape in ((), (size,)):
        array = np.diag(np.broadcast_to(array, (size,)))
    matrix = real_matrix(name, array, size, size)
    largest = float(np.abs(matrix).max(initial=0.0))
    if not np.allclose(matrix, matrix.T, rtol=0.0, atol=COMPUTED * largest):
        raise UsageError(f"{name} is not symmetric [E0428]", "W and its transpose, halved")
    matrix = matrix / 2.0 + matrix.T / 2.0
    least = float(np.linalg.eigvalsh(matrix)[0]) if size else 0.0
    if least < -COMPUTED * largest:
        fault = f"{name} is negative in some direction (eigenvalue {least:.4g}) [E0429]"
        raise UsageError(fault, "weights of zero and above")
    return matrix


#: Weights by name, or a matrix, or the diagonal of a matrix, or one number.
Weighted = Mapping[str, float] | ArrayLike


def quadratic_cost(
    space: StateSpace, Q: Weighted, R: Weighted, N: ArrayLike | None, inputs: Sequence[str]
) -> tuple[StateSpace, Weights]:
    """Return the model with the controlled inputs, and the cost s^T Q s + 2 s^T N u + u^T R u as matrices; see ``lqr``.

    Parameters
    ----------
    space : StateSpace
        Model with named states and inputs.
    Q : mapping or (n, n) array_like
        Weights of states or outputs by name, or the matrix of states.
    R : mapping or (m, m) array_like
        Weights of inputs by name, or their matrix.
    N : (n, m) array_like or None
        Cross weights.
    inputs : sequence of str
        Names of the controlled inputs.

    Raises
    ------
    UsageError
        Names that there are not, weights that are negative, matrices of other sizes.
    """
    if inputs and isinstance(R, Mapping) and set(inputs) != set(R):
        raise UsageError(Problem("R", "the inputs that it names differ from `inputs` [E0430]", "one of both"))
    controlled = controlled_by(space, tuple(R) if isinstance(R, Mapping) else tuple(inputs))
    m, ns = len(controlled.inputs), len(controlled.states)
    effort: ArrayLike = [number("R", name, R.get(name)) for name in controlled.inputs] if isinstance(R, Mapping) else R
    state = np.zeros((ns, ns)) if isinstance(Q, Mapping) else weight("Q", Q, ns)
    cross = np.zeros((ns, m)) if N is None else real_matrix("N", N, ns, m)
    weights = Weights(state, weight("R", effort, m), cross)
    if isinstance(Q, Mapping):
        rows = [row_of(controlled, name) for name in Q]
        costs = np.array([number("Q", name, value) for name, value in Q.items()])
        if rows:
            of_state, of_effort = (np.array(parts) for parts in zip(*rows, strict=True))
            weights = weights.plus_output(of_state, of_effort, costs)
    return controlled, weights


def controlled_by(space: StateSpace, inputs: Sequence[str]) -> StateSpace:
    """Return a model with these inputs, all inputs if none is named; remaining inputs are disturbances.

    Raises
    ------
    UsageError
        Inputs that there are not, or none at all.
    """
    if not space.inputs:
        hint = "an input in the scene without a formula, [inputs] force = {}"
        raise UsageError(Problem("inputs", "the model has no input that a controller could drive [E0431]", hint))
    for name in inputs:
        if name not in space.inputs:
            hint = nearest(str(name), space.inputs)
            if name in (*space.states, *space.outputs):
                hint = "the weights of states and outputs first, then of inputs"
            raise UsageError(Problem("inputs", f"there is no input {shown(name)} [E0432]", hint))
    wanted = tuple(dict.fromkeys(inputs)) or space.inputs
    if wanted == space.inputs:
        return space
    kept = [space.inputs.index(name) for name in wanted]
    rest = [k for k in range(len(space.inputs)) if k not in kept]
    left = tuple(space.inputs[k] for k in rest)
    of = {kind: labels(space, kind) for kind in KINDS}
    of |= {
        "inputs": labels(space, "inputs", wanted),
        "disturbances": [*of["disturbances"], *labels(space, "inputs", left)],
    }
    return replace(
        space,
        B=space.B[:, kept],
        D=space.D[:, kept],
        E=np.hstack([space.E, space.B[:, rest]]),
        F=np.hstack([space.F, space.D[:, rest]]),
        inputs=wanted,
        disturbances=(*space.disturbances, *left),
        **signal_labels(of),
    )


def row_of(space: StateSpace, name: str) -> tuple[Array, Array]:
    """Return the rows (ns,) and (nu,) of C and D for an output; a unit vector and zeros for the name of a state. Raises
    UsageError with the nearest names if there is neither."""
    known = (*space.outputs, *space.states)
    name = linear_model_name(name, known)
    if name in space.outputs:
        k = space.outputs.index(name)
        return space.C[k], space.D[k]
    if name in space.states:
        return np.eye(len(space.states))[space.states.index(name)], np.zeros(len(space.inputs))
    fault = f"there is no output or state {shown(name)} [E0433]"
    raise UsageError(Problem("weights", fault, nearest(str(name), known)))


def number(matrix: str, name: str, value: object) -> float:
    """Return the weight `value` of a name as a float. Raises UsageError unless it is a finite number from zero on.
    `matrix` is the name of the cost's matrix for the message."""
    result = number_of(matrix, value, f"weight of {name}")
    if result < 0.0:
        fault = f"the weight of {name} is {result:.6g} [E0435]"
        raise UsageError(Problem(matrix, fault, "a number of zero or above"))
    return result
