"""The equations of a System as NumPy callables, for the oracle stepper: slow, and independent of all generated code."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.symbolic.evaluate import evaluate
from tests.oracles.equations import Array, Constraints, Equations, InternalStates


def equations_of(system: Any) -> Equations:
    """Return the equations of a System, evaluated on its tape: any call takes milliseconds.

    Needs ``residual`` and ``partials``; with constraints ``equations``, ``constraint_bias`` and ``iteration`` besides,
    with internal states ``internal_rate`` and ``internal_partials``. Inputs and base follow the scene's formulas,
    parameters have their defaults.
    """
    nv, nl, nz = system.nv, len(system.multipliers), system.nz

    def value(name: str, block: str, t: float, **arrays: Array) -> Array:
        known: dict[str, Any] = {
            "t": np.array([t]),
            "p": np.array([parameter.value for parameter in system.parameters]),
        }
        known |= {"u": np.zeros(system.nu), "z": np.zeros(system.nz)}
        known |= {"v": np.zeros(nv), "a": np.zeros(nv), "lam": np.zeros(nl)} | arrays
        for driver, target in (("inputs", "u"), ("base", "base")):
            if driver in system.functions:
                known[target] = evaluate(system.tape, system.functions[driver].refs, known)
        refs = next((item.refs for item in system.functions[name].outputs if item.name == block), ())
        return np.asarray(evaluate(system.tape, refs, known), float)

    def dense(block: str, shape: tuple[int, int], t: float, **arrays: Array) -> Array:
        matrix = np.zeros(shape)
        if pattern := system.patterns.get(block):
            matrix[tuple(np.array(pattern).T)] = value("iteration", block, t, **arrays)
        return matrix

    def partials(
        t: float, q: Array, v: Array, a: Array, lam: Array | None = None, **z: Array
    ) -> tuple[Array, Array, Array]:
        arrays = {"q": q, "v": v, "a": a, "lam": np.zeros(nl) if lam is None else lam, **z}
        K, C, M = (value("partials", name, t, **arrays).reshape(nv, nv) for name in "KCM")
        return K, C, M

    def residual(t: float, q: Array, v: Array, a: Array, lam: Array | None = None, **z: Array) -> Array:
        return value("residual", "r", t, q=q, v=v, a=a, lam=np.zeros(nl) if lam is None else lam, **z)

    def state_partials(t: float, q: Array, v: Array, z: Array) -> tuple[Array, Array, Array, Array]:
        shapes = {"Rz": (nv, nz), "Fq": (nz, nv), "Fv": (nz, nv), "Fz": (nz, nz)}
        by_name = {
            name: value("internal_partials", name, t, q=q, v=v, z=z).reshape(shape) for name, shape in shapes.items()
        }
        return by_name["Rz"], by_name["Fq"], by_name["Fv"], by_name["Fz"]

    internal = (
        InternalStates(lambda t, q, v, z: value("internal_rate", "zdot", t, q=q, v=v, z=z), state_partials)
        if nz
        else None
    )

    constraints = None
    if nl:
        constraints = Constraints(
            system.holonomic,
            lambda t, q: value("equations", "Phi", t, q=q),
            lambda t, q, v: value("equations", "w", t, q=q, v=v),
            lambda t, q, v: value("constraint_bias", "g", t, q=q, v=v),
            lambda t, q: dense("B", (nl, nv), t, q=q),
            lambda t, q, v: dense("Z", (nl, nv), t, q=q, v=v),
        )

    def followed(t: float, q: Array) -> Array:
        return np.concatenate([q[:nq_of_poses], value("joint_angles", "turned", t, q=q)])

    nq_of_poses = system.nq - len(system.angles)
    forward = None if nl else lambda t, q, v, **z: value("forward_dynamics", "vdot", t, q=q, v=v, **z)
    return Equations(
        system.factors, forward, residual, partials, constraints, internal, followed if system.angles else None
    )
