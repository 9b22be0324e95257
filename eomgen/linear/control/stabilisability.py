"""Uncontrollable modes and modes without cost: the Popov-Belevitch-Hautus test in second-order form.

A mode with eigenvalue s is uncontrollable if [s^2 M + s C + K, B] loses rank (A. J. Laub and W. F. Arnold,
Controllability and observability criteria for multivariable linear second-order models, IEEE Transactions on Automatic
Control 29, 1984).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.errors import ModelError
from eomgen.linear.control.plant import Plant, first_order

#: Eigenvalues this close to the imaginary axis, as a share of the plant's rate, count as on it: a double one at zero is
#: known to half of the digits only.
_ON_AXIS = 1e-7
#: A singular value below this share of the largest is none.
_RANK = 1e-9


def check_stabilisable(plant: Plant) -> None:
    """Raise ModelError if a mode that does not decay is out of the actuators' reach, naming the fastest."""
    lost = [(value, shape) for value, shape, reach in _reached(plant) if reach < _RANK]
    lost = [(value, shape) for value, shape in lost if value.real > -_ON_AXIS * plant.scales.rate]
    if lost:
        value, shape = max(lost, key=lambda mode: mode[0].real)
        fault = f"{described(plant, value, shape)} cannot be stabilised: no actuator moves it"
        raise ModelError(fault, "an actuator that works on it, or a spring and a damper that hold it")


def check_controllable(plant: Plant) -> None:
    """Raise ModelError if a mode is out of the actuators' reach, whether it decays or not."""
    for value, shape, reach in _reached(plant):
        if reach < _RANK:
            fault = f"{described(plant, value, shape)} cannot be placed: no actuator moves it"
            raise ModelError(fault, "an actuator that works on it, or a method that leaves it as it is (lqr)")


def check_detectable(plant: Plant, A: Array, root: Array) -> None:
    """Raise ModelError if a mode on the imaginary axis has no cost: optimal control would leave it there.

    Parameters
    ----------
    A : (2n, 2n) state matrix in the units of ``plant.scales``, cross terms of the cost taken off.
    root : (r, 2n) with root^T root the weight of the state in these units.
    """
    n = plant.n
    norm = float(np.linalg.norm(root, 2)) if root.size else 0.0
    unit = root / norm if norm > 0.0 else np.zeros((1, 2 * n))
    for value in distinct(np.linalg.eigvals(A)):
        if abs(value.real) > _ON_AXIS:
            continue
        at = 1j * value.imag
        stacked = np.vstack([at * np.eye(2 * n) - A, unit])
        _, singular, right = np.linalg.svd(stacked)
        if singular[-1] < math.sqrt(_RANK):
            shape = right[-1].conj()[:n]
            shape = shape if np.linalg.norm(shape) > _RANK else right[-1].conj()[n:]
            physical = plant.scales.state_back[:n, :n] @ shape
            fault = f"{described(plant, plant.scales.rate * at, physical)} has zero weight"
            fault = f"{fault}, so optimal control would leave it as it is"
            raise ModelError(fault, "a weight on a coordinate or a velocity that it moves")


def _reached(plant: Plant) -> Iterator[tuple[complex, Complex, float]]:
    """Yield each eigenvalue in 1/s, the shape of its mode, and how far actuators reach it: 0 is not at all."""
    k, c, b = plant.scaled
    norm = float(np.linalg.norm(b, 2)) if b.size else 0.0
    unit = b / norm if norm > 0.0 else np.zeros((plant.n, 1))
    back = plant.scales.state_back[: plant.n, : plant.n]
    for value in distinct(np.linalg.eigvals(first_order(k, c))):
        dynamic = value**2 * np.eye(plant.n) + value * c + k
        reach = float(np.linalg.svd(np.hstack([dynamic, unit]), compute_uv=False)[-1])
        left = np.linalg.svd(np.hstack([dynamic, unit]))[0][:, -1]
        yield plant.scales.rate * value, back @ left.conj(), reach / max(1.0, abs(value) ** 2)


def distinct(values: ArrayLike) -> list[complex]:
    """Return eigenvalues with one of each pair, and one of each group of equal ones."""
    distinct: list[complex] = []
    for value in sorted(map(complex, np.asarray(values)), key=lambda value: (round(abs(value), 9), -value.imag)):
        near = math.sqrt(np.finfo(float).eps) * max(1.0, abs(value))
        if value.imag >= -near and all(abs(value - other) > near for other in distinct):
            distinct.append(value)
    return distinct


def described(plant: Plant, value: complex, shape: Complex) -> str:
    """Return a mode in words: frequency, growth, and the coordinates of largest motion."""
    size = np.abs(shape) * np.sqrt(np.diag(plant.M))
    order = np.argsort(-size)[:2]
    movers = [plant.names[k] for k in order if size[k] > 0.3 * size[order[0]]] if size.max() > 0.0 else []
    return in_words(value, movers, _ON_AXIS * plant.scales.rate)


def in_words(value: complex, movers: Sequence[str], axis: float) -> str:
    """Return a mode in words from its eigenvalue, 1/s, and its moving coordinates; below ``axis``, 1/s, is zero."""
    where = f" of {' and '.join(movers)}" if movers else ""
    if abs(value) <= axis:
        return f"the mode{where} at 0 Hz, which nothing holds,"
    if abs(value.imag) <= axis:
        trend = "grows" if value.real > 0.0 else "decays"
        return f"the mode{where} that {trend} at {abs(value.real):.4g} 1/s without oscillating"
    frequency = abs(value.imag) / (2.0 * math.pi)
    if value.real > axis:
        return f"the mode{where} at {frequency:.4g} Hz, which grows at {value.real:.4g} 1/s,"
    damping = f"decays at {-value.real:.4g} 1/s" if value.real < -axis else "is not damped"
    return f"the mode{where} at {frequency:.4g} Hz, which {damping},"
