"""Random states, functions of models as callables on the tape over NumPy, and derivatives along left-trivialised
directions by complex step (Squire and Trapp 1998).

``evaluate(function, inputs)`` takes a mapping from input block to array (..., size) and gives a mapping from output
block to array (..., *shape). Oracles are written against this signature only: other tests pass functions of compiled
code. ``eomgen.testing`` has functions of the same names for authors of other distributions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.lie.product import Factor
from eomgen.symbolic.evaluate import Evaluation
from eomgen.system.system import System

Array = NDArray[Any]
Evaluate = Callable[[str, Mapping[str, Array]], dict[str, Array]]


def tape_evaluator(system: System) -> Evaluate:
    """Return the functions of a system, run operation by operation over NumPy arrays of any type and batch shape."""
    evaluations: dict[str, Evaluation] = {}

    def run(function: str, inputs: Mapping[str, Array]) -> dict[str, Array]:
        blocks = system.functions[function].outputs
        if function not in evaluations:
            evaluations[function] = Evaluation(system.tape, system.functions[function].refs)
        values = evaluations[function].on_arrays(inputs)
        outputs, start = {}, 0
        for block in blocks:
            part = values[..., start : start + len(block.refs)]
            outputs[block.name] = part.reshape(*part.shape[:-1], *block.shape)
            start += len(block.refs)
        return outputs

    return run


def relative_error(computed: Array, expected: Array, axes: int = 1, floor: float = 0.0) -> float:
    """Return the largest norm-wise relative error over a batch.

    Parameters
    ----------
    axes : how many of the last axes belong to one state
    floor : smallest size to compare with, for expected values that may vanish by structure
    """
    computed, expected = np.broadcast_arrays(computed, expected)
    over = tuple(range(-axes, 0))
    difference = np.sqrt(np.sum(np.abs(computed - expected) ** 2, axis=over))
    size = np.maximum(np.sqrt(np.sum(np.abs(expected) ** 2, axis=over)), floor)
    return float(np.max(difference / np.maximum(size, 1e-300)))


STEP = 1e-40


def random_unit_quaternions(rng: np.random.Generator, count: int) -> Array:
    quaternions = rng.normal(size=(count, 4))
    return np.asarray(quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True))


def random_states(system: System, count: int, rng: np.random.Generator) -> dict[str, Array]:
    """Return ``count`` states: q, v, a, u, t, and the default parameters; the base is left to ``on_base``."""
    q = rng.uniform(-2.5, 2.5, size=(count, system.nq))
    for factor in system.factors:
        if factor.group != "R":
            q[:, factor.q_start : factor.q_start + 4] = random_unit_quaternions(rng, count)
    state = {
        "q": q,
        "v": rng.uniform(-2.0, 2.0, size=(count, system.nv)),
        "a": rng.uniform(-3.0, 3.0, size=(count, system.nv)),
        "t": rng.uniform(0.0, 3.0, size=(count, 1)),
        "u": rng.uniform(-1.0, 1.0, size=(count, system.nu)),
        "p": np.broadcast_to([parameter.value for parameter in system.parameters], (count, len(system.parameters))),
    }
    return {name: block for name, block in state.items() if block.shape[-1]}


def on_base(evaluate: Evaluate, state: Mapping[str, Array]) -> dict[str, Array]:
    """Return the state with the base struct by the scene's law at the times of the state."""
    return {**state, "base": evaluate("base", state)["base"]}


def quaternion_product(p: Array, r: Array) -> Array:
    w = p[..., 0] * r[..., 0] - np.sum(p[..., 1:] * r[..., 1:], axis=-1)
    vector = p[..., :1] * r[..., 1:] + r[..., :1] * p[..., 1:] + np.cross(p[..., 1:], r[..., 1:])
    return np.concatenate([w[..., np.newaxis], vector], axis=-1)


def angular_velocity(quaternion: Array, rate: Array, axis: int = -1) -> Array:
    """Return the angular velocities, in axes of the body, of unit quaternions along ``axis`` with their rates."""
    w, n = np.split(quaternion, [1], axis)
    w_dot, n_dot = np.split(rate, [1], axis)
    return np.asarray(2.0 * (w * n_dot - w_dot * n - np.cross(n, n_dot, axis=axis)))


def rotation_of(quaternion: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions, from R x = x + 2 w (n x x) + 2 n x (n x x)."""
    n = quaternion[..., 1:]
    zero = np.zeros_like(n[..., 0])
    cross = np.stack([zero, -n[..., 2], n[..., 1], n[..., 2], zero, -n[..., 0], -n[..., 1], n[..., 0], zero], axis=-1)
    cross = cross.reshape(*n.shape[:-1], 3, 3)
    return np.asarray(np.eye(3) + 2.0 * quaternion[..., :1, np.newaxis] * cross + 2.0 * cross @ cross)


def displaced(factors: Sequence[Factor], q: Array, direction: Array) -> Array:
    """Return q exp(direction) to first order in the direction, the part that an infinitesimal step keeps."""
    shape = np.broadcast_shapes(q.shape[:-1], direction.shape[:-1])
    q, direction = np.broadcast_to(q, (*shape, q.shape[-1])), np.broadcast_to(direction, (*shape, direction.shape[-1]))
    moved = q.astype(np.result_type(q, direction))
    for factor in factors:
        here = slice(factor.q_start, factor.q_start + factor.q_size)
        along = direction[..., factor.v_start : factor.v_start + factor.v_size]
        if factor.group == "R":
            moved[..., here] += along
            continue
        quaternion = q[..., factor.q_start : factor.q_start + 4]
        half = np.concatenate([np.zeros_like(along[..., :1]), 0.5 * along[..., :3]], axis=-1)
        moved[..., factor.q_start : factor.q_start + 4] += quaternion_product(quaternion, half)
        if factor.group == "SE3":
            shift = np.einsum("...ij,...j->...i", rotation_of(quaternion), along[..., 3:])
            moved[..., factor.q_start + 4 : factor.q_start + 7] += shift
    return moved


def derivative(
    evaluate: Evaluate, factors: Sequence[Factor], function: str, state: Mapping[str, Array], rates: Mapping[str, Array]
) -> dict[str, Array]:
    """Return the derivative of a function's outputs along rates of the input blocks.

    Parameters
    ----------
    rates : mapping from block to array, broadcast against the state's; the rate of q is left-trivialised. A rate of t
        moves the base.
    """
    moved: dict[str, Array] = dict(state)
    for block, rate in rates.items():
        moved[block] = (
            displaced(factors, state[block], 1j * STEP * rate) if block == "q" else state[block] + 1j * STEP * rate
        )
    if "t" in rates and "base" in state:
        moved["base"] = evaluate("base", moved)["base"]
    return {name: values.imag / STEP for name, values in evaluate(function, moved).items()}


def jacobian(
    evaluate: Evaluate, factors: Sequence[Factor], function: str, output: str, state: Mapping[str, Array], block: str
) -> Array:
    """Return d output / d block (left-trivialised for q), with the directions as last axis."""
    size = sum(factor.v_size for factor in factors) if block in ("q", "v", "a") else state[block].shape[-1]
    spread = {name: values[..., np.newaxis, :] for name, values in state.items()}
    by_direction = derivative(evaluate, factors, function, spread, {block: np.eye(size)})[output]
    return np.moveaxis(by_direction, state["q"].ndim - 1, -1)
