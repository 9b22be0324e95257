"""State space of a linearised mechanical system with constraints and internal states.

sdot = A s + B u + E w,   y = C s + D u + F w,   s = (x, y, z): independent coordinates, velocities, internal states
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from eomgen.arrays import Array
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.linear.freedom import Freedom
from eomgen.linear.partials import Partials

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class StateSpace:
    """A linear model of first order.

    Attributes
    ----------
    A : (ns, ns), B : (ns, nu), E : (ns, nw), C : (ny, ns), D : (ny, nu), F : (ny, nw)
    states : ``hinge``, ``ball[2]``: coordinates, left-trivialised; ``v.hinge``: velocities; ``z.name``: internal states
    inputs, disturbances, outputs : names of u, w, y
    """

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]

    def frequency_response(self, omega: ArrayLike, input: str, output: str) -> Complex:
        """Return the complex response of an output to an input at angular frequencies.

        Parameters
        ----------
        omega : (...), rad/s
        input : name of an input or of a disturbance
        output : name of an output of the scene (``name[k]`` where it has several components), or of a state

        Returns
        -------
        (...) complex: output = response e^(i omega t) where input = e^(i omega t)

        Raises
        ------
        UsageError
            There is no input or output of that name; names those that there are.
        NumericalError
            A frequency is that of a mode without damping, to machine precision.
        """
        return self.frequency_responses(omega, [input], [output])[..., 0, 0]

    def frequency_responses(self, omega: ArrayLike, inputs: Sequence[str], outputs: Sequence[str]) -> Complex:
        """Return the complex responses (..., outputs, inputs) at angular frequencies (...) in rad/s.

        Names and errors are those of ``frequency_response``.
        """
        entering, direct = self.input_columns(inputs, outputs)
        left = self.output_rows(outputs)
        frequencies = np.asarray(omega, dtype=float)
        pencils = 1j * frequencies[..., np.newaxis, np.newaxis] * np.eye(len(self.states)) - self.A
        try:
            states = np.linalg.solve(pencils, entering.astype(complex))
        except np.linalg.LinAlgError:
            what = "a frequency is that of a mode without damping, whose response has no bound"
            raise NumericalError(Problem("frequency response", what, "other frequencies, or damping")) from None
        return np.asarray(left @ states + direct, dtype=complex)

    def output_rows(self, outputs: Sequence[str]) -> Array:
        """Return the rows (outputs, ns) of C, and of the unit matrix where states are named."""
        every = np.concatenate([self.C, np.eye(len(self.states))])
        rows = [_number("output or state", name, (*self.outputs, *self.states)) for name in outputs]
        return np.asarray(every[rows])

    def input_columns(self, inputs: Sequence[str], outputs: Sequence[str]) -> tuple[Array, Array]:
        """Return the columns (ns, inputs) of B and E, and what passes directly to outputs (outputs, inputs)."""
        columns = [_number("input or disturbance", name, (*self.inputs, *self.disturbances)) for name in inputs]
        rows = [_number("output or state", name, (*self.outputs, *self.states)) for name in outputs]
        direct = np.concatenate([self.D, self.F], axis=1)
        direct = np.concatenate([direct, np.zeros((len(self.states), direct.shape[1]))])
        return np.concatenate([self.B, self.E], axis=1)[:, columns], direct[np.ix_(rows, columns)]


@dataclass(frozen=True)
class FirstOrder:
    """The matrices of a StateSpace, and how all coordinates follow from its state: dq = R_all s, (nv, ns)."""

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    R_all: Array


def first_order(partials: Partials, free: Freedom, velocities: Sequence[str]) -> FirstOrder:
    """Return the state-space matrices.

    Parameters
    ----------
    velocities : names of the independent velocities, for messages

    Raises
    ------
    ModelError
        The inertia matrix is singular along a free direction; names it.
    """
    p = partials
    sizes = [len(free.coordinates), len(free.velocities), len(p.Fz), p.B.shape[1], p.E.shape[1]]
    ends = np.cumsum(sizes)
    parts_of_state = [slice(int(end) - size, int(end)) for end, size in zip(ends, sizes, strict=True)]
    x, y, z, u, w = parts_of_state
    every = int(ends[-1])

    def over(rows: int, *parts: tuple[slice, Array]) -> Array:
        """Return a matrix over the columns (x, y, z, u, w)."""
        result = np.zeros((rows, every))
        for place, part in parts:
            result[:, place] = part
        return result

    nv = len(p.M)
    unit = np.eye(every)
    dq, dv = over(nv, (x, free.R)), over(nv, (x, free.T), (y, free.S))
    drift = over(nv, (x, free.V), (y, free.U))
    forces = p.B @ unit[u] + p.E @ unit[w] - p.C @ dv - p.K @ dq - p.Rz @ unit[z]
    ydot = _solved(free.S.T @ p.M @ free.S, free.S.T @ (forces - p.M @ drift), velocities)
    da = free.S @ ydot + drift
    zdot = p.Fq @ dq + p.Fv @ dv + p.Fz @ unit[z] + p.Fu @ unit[u] + p.Fw @ unit[w]
    xdot = over(sizes[0], (x, free.W), (y, free.N))
    rates = np.concatenate([xdot, ydot, zdot])
    out = p.Yq @ dq + p.Yv @ dv + p.Ya @ da + p.Yz @ unit[z] + p.Yu @ unit[u] + p.Yw @ unit[w]
    if np.any(p.Ylam):
        out += p.Ylam @ np.linalg.lstsq(p.J.T, forces - p.M @ da, rcond=None)[0]
    s = slice(0, int(ends[2]))
    return FirstOrder(rates[:, s], rates[:, u], rates[:, w], out[:, s], out[:, u], out[:, w], dq[:, s])


def _number(kind: str, name: str, known: Sequence[str]) -> int:
    """Return the number of a name. Raises UsageError with the nearest names."""
    if name in known:
        return known.index(name)
    close = difflib.get_close_matches(str(name)[:64], known, n=3)
    hint = " or ".join(close) or ("one of " + ", ".join(known[:12]) if known else "")
    missing = "" if known else f": the linear model has no {kind}"
    raise UsageError(Problem("frequency response", f"there is no {kind} {ascii(name)[:64]}{missing}", hint))


def _solved(M: Array, right: Array, names: Sequence[str]) -> Array:
    """Return M^-1 right. Raises ModelError naming the directions without inertia."""
    values, vectors = np.linalg.eigh(0.5 * (M + M.T)) if len(M) else (np.zeros(0), np.zeros((0, 0)))
    if len(M) and values[0] <= 1e-14 * values[-1]:
        direction = np.abs(vectors[:, 0])
        along = ", ".join(name for name, size in zip(names, direction, strict=True) if size > 0.1 * np.max(direction))
        what = f"the inertia matrix is singular along {along}, so there is no linear model of second order"
        raise ModelError(Problem("linearization", what, "mass or inertia for what moves along it"))
    return np.asarray(scipy.linalg.solve(M, right, assume_a="pos")) if len(M) else right
