"""Equations of motion as heyoka's expressions: eomgen's own forward dynamics, and a chain of rods as its user would
write it.

heyoka finds common subexpressions itself when it takes the equations apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import heyoka
import numpy as np
from numpy.typing import NDArray

from eomgen.symbolic.operations import Op
from eomgen.system.system import System

Array = NDArray[np.float64]
Equations = list[tuple[Any, Any]]
_OPERATIONS: dict[Op, Callable[..., Any]] = {
    Op.ADD: lambda x, y: x + y,
    Op.SUB: lambda x, y: x - y,
    Op.MUL: lambda x, y: x * y,
    Op.DIV: lambda x, y: x / y,
    Op.SIN: heyoka.sin,
    Op.COS: heyoka.cos,
    Op.SQRT: heyoka.sqrt,
}


def of_system(system: System) -> Equations:
    """Return dq/dt and dv/dt of a system of hinges and balls without parameters: forward dynamics and the motion of
    the base, operation by operation."""
    q, v = _variables("q", system.nq), _variables("v", system.nv)
    tape, refs = system.tape, system.functions["forward_dynamics"].refs
    base = system.functions["base"].refs if "base" in system.functions else ()
    known: dict[int, Any] = {}
    for node in [*tape.live(base), *tape.live(refs)]:
        symbol, number = tape.symbol(node), tape.value(node)
        if symbol is not None and symbol.block == "base":
            ref = base[symbol.index]
            known[node] = known[ref] if ref > 0 else -known[-ref]
        elif symbol is not None:
            known[node] = {"q": q, "v": v, "t": [heyoka.time]}[symbol.block][symbol.index]
        elif number is not None:
            known[node] = heyoka.expression(number)
        else:
            operands = [known[ref] if ref > 0 else -known[-ref] for ref in tape.operands(node)]
            known[node] = _OPERATIONS[tape.op[node]](*operands)
    accelerations = [known[ref] if ref > 0 else -known[-ref] for ref in refs]
    rates: list[Any] = []
    for factor in system.factors:
        moving = v[factor.v_start : factor.v_start + factor.v_size]
        if factor.group == "R":
            rates += moving
            continue
        w, x, y, z = q[factor.q_start : factor.q_start + 4]
        a, b, c = moving
        rates += [
            -0.5 * (x * a + y * b + z * c),
            0.5 * (w * a + y * c - z * b),
            0.5 * (w * b + z * a - x * c),
            0.5 * (w * c + x * b - y * a),
        ]
    return list(zip([*q, *v], [*rates, *accelerations], strict=True))


def rods(links: int, length: float, mass: float, gravity: float) -> Equations:
    """Return a planar chain of equal rods in absolute angles from the vertical, M eliminated from the tip to the
    root."""
    angle, rate = _variables("q", links), _variables("v", links)
    beyond = [links - 1 - k for k in range(links)]

    def coupling(i: int, j: int) -> float:
        return mass * length**2 * (beyond[max(i, j)] + 0.5)

    A: list[list[Any]] = [[None] * links for _ in range(links)]
    right: list[Any] = []
    for i in range(links):
        terms = [-(mass * gravity * length * (beyond[i] + 0.5)) * heyoka.sin(angle[i])]
        for j in range(links):
            low, high = min(i, j), max(i, j)
            if i == j:
                A[i][i] = heyoka.expression(mass * length**2 * (beyond[i] + 1.0 / 3.0))
                continue
            A[i][j] = coupling(i, j) * heyoka.cos(angle[low] - angle[high])
            side = -1.0 if i < j else 1.0
            terms.append(side * coupling(i, j) * heyoka.sin(angle[low] - angle[high]) * rate[j] * rate[j])
        right.append(heyoka.sum(terms))
    factors: list[dict[int, Any]] = [{} for _ in range(links)]
    inverse = [heyoka.expression(0.0)] * links
    for k in reversed(range(links)):
        inverse[k] = 1.0 / A[k][k]
        factors[k] = {i: A[k][i] * inverse[k] for i in range(k)}
        for i in range(k):
            right[i] = right[i] - factors[k][i] * right[k]
            for j in range(i + 1):
                A[i][j] = A[j][i] = A[i][j] - factors[k][i] * A[k][j]
    found: list[Any] = []
    for k in range(links):
        known = [factors[k][i] * found[i] for i in range(k)]
        found.append(right[k] * inverse[k] - heyoka.sum(known) if known else right[k] * inverse[k])
    return list(zip([*angle, *rate], [*rate, *found], strict=True))


def shear_frame(ground_stiffness: float) -> Equations:
    """Return three storeys on shaking ground with a pendulum below the top floor, M solved for the last two
    coordinates: the equations of ``tests.models.shear_frame``."""
    (x1, x2, x3, angle), (v1, v2, v3, rate) = _variables("q", 4), _variables("v", 4)
    stiffness, damping, floor, mass, length, gravity = 2e5, 1e3, 2000.0, 200.0, 0.5, 9.81
    ground = 2.0 * heyoka.sin(7.0 * heyoka.time)
    sine, cosine = heyoka.sin(angle), heyoka.cos(angle)
    second = stiffness * (x2 - x1) + damping * (v2 - v1)
    third = stiffness * (x3 - x2) + damping * (v3 - v2)
    a1 = (second - ground_stiffness * x1 - damping * v1) * (1.0 / floor) - ground
    a2 = (third - second) * (1.0 / floor) - ground
    top = mass * length * rate * rate * sine - third
    turn = -2.0 / (mass * length) * rate - gravity * sine
    # (floor + mass) a3 + mass length cos a4 = top, cos a3 + length a4 = turn, where a3 is absolute
    a3 = (top - mass * cosine * turn) / (floor + mass - mass * cosine * cosine)
    a4 = (turn - cosine * a3) * (1.0 / length)
    q, v = (x1, x2, x3, angle), (v1, v2, v3, rate)
    return list(zip([*q, *v], [*v, a1, a2, a3 - ground, a4], strict=True))


def absolute(state: Array) -> Array:
    """Return angles and rates from the vertical, from those between neighbours."""
    half = len(state) // 2
    return np.concatenate([np.cumsum(state[:half]), np.cumsum(state[half:])])


def between_neighbours(state: Array) -> Array:
    half = len(state) // 2
    return np.concatenate([np.diff(state[:half], prepend=0.0), np.diff(state[half:], prepend=0.0)])


def _variables(letter: str, size: int) -> Sequence[Any]:
    return [heyoka.expression(f"{letter}{k}") for k in range(size)]
