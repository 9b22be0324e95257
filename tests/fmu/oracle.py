"""Rates and outputs of a model as an FMU has them, from the compiled functions in complex numbers.

Functions are evaluated at unit quaternions; the rates of quaternions are 1/2 q (0, omega) of the quaternions as given,
of positions of poses R v.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import eomgen

Array = np.ndarray
#: An imaginary step, the square of which is lost.
STEP = 1e-40
TERMS = ("forward_dynamics", "residual", "mass", "constraint_jacobian", "constraint_bias", "internal_rate", "outputs")


def product(a: Array, b: Array) -> Array:
    """Return the product of two quaternions."""
    w, x = a[0], a[1:]
    return np.concatenate([[w * b[0] - x @ b[1:]], w * b[1:] + b[0] * x + np.cross(x, b[1:])])


def rotated(q: Array, x: Array) -> Array:
    """Return R x of a unit quaternion."""
    conjugate = q * np.array([1.0, -1.0, -1.0, -1.0])
    return product(product(q, np.concatenate([[0.0], x])), conjugate)[1:]


class Rates:
    """Rates of the continuous states and outputs of a model.

    Parameters
    ----------
    chosen : numbers of the inputs that importers set; the scene gives all others
    """

    def __init__(self, model: eomgen.Model, chosen: list[int]) -> None:
        self.model, self.chosen = model, chosen
        self.functions = model.in_complex(TERMS)

    def call(self, name: str, known: Mapping[str, Any]) -> Array:
        """Return the values of a function."""
        return self.functions(name, {block: known[block] for block in self.functions.inputs(name)})[0].ravel()

    def __call__(self, state: Mapping[str, Any]) -> tuple[Array, Array]:
        """Return the rates of (q, v, z) and the outputs of a state with q, v, z, u, p and t."""
        model, nv, rows = self.model, self.model.nv, len(self.model.multipliers)
        known: dict[str, Any] = {name: np.asarray(value, complex) for name, value in state.items()}
        q, v = known["q"], known["v"]
        known["q"] = unit = q.copy()
        for factor in model.factors:
            if factor.group != "R":
                place = slice(factor.q_start, factor.q_start + 4)
                unit[place] = q[place] / np.sqrt(q[place] @ q[place])
        if "inputs" in self.functions:
            given = self.call("inputs", known)
            given[self.chosen] = known["u"][self.chosen]
            known["u"] = given
        if "base" in self.functions:
            known["base"] = self.call("base", known)
        known["a"], known["lam"] = np.zeros(nv, complex), np.zeros(rows, complex)
        if "forward_dynamics" in self.functions:
            known["a"] = self.call("forward_dynamics", known)
        else:
            known["a"], known["lam"] = self.constrained(known)
        qdot = np.zeros(sum(factor.q_size for factor in model.factors), complex)
        for factor in model.factors:
            omega = v[factor.v_start : factor.v_start + 3]
            place = slice(factor.q_start, factor.q_start + 4)
            if factor.group == "R":
                qdot[factor.q] = v[factor.v]
                continue
            qdot[place] = 0.5 * product(q[place], np.concatenate([[0.0], omega]))
            if factor.group == "SE3":
                travel = v[factor.v_start + 3 : factor.v_start + 6]
                qdot[factor.q_start + 4 : factor.q_start + 7] = rotated(unit[place], travel)
        zdot = self.call("internal_rate", known) if model.nz else np.zeros(0, complex)
        outputs = self.call("outputs", known) if "outputs" in self.functions else np.zeros(0, complex)
        return np.concatenate([qdot, known["a"], zdot]), outputs

    def constrained(self, known: dict[str, Any]) -> tuple[Array, Array]:
        """Return accelerations and multipliers."""
        nv, rows = self.model.nv, len(self.model.multipliers)
        mass = self.call("mass", known).reshape(nv, nv)
        jacobian = self.call("constraint_jacobian", known).reshape(rows, nv)
        matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((rows, rows))]])
        start = self.call("residual", known)
        right = -np.concatenate([start, self.call("constraint_bias", known)])
        solution = np.linalg.solve(matrix, right)
        return solution[:nv], solution[nv:]

    def jacobian(self, state: Mapping[str, Any], knowns: list[tuple[str, int]]) -> tuple[Array, Array]:
        """Return the derivatives of rates and outputs along components of the state, by complex steps."""
        columns = []
        for block, index in knowns:
            moved = {name: np.array(value, complex) for name, value in state.items()}
            if block == "t":
                moved["t"] = moved["t"] + 1j * STEP
            else:
                moved[block][index] += 1j * STEP
            columns.append([part.imag / STEP for part in self(moved)])
        return np.stack([c[0] for c in columns], axis=1), np.stack([c[1] for c in columns], axis=1)
