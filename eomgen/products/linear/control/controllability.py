"""Controllability and observability of a linear model of first order: the test of Popov, Belevitch and Hautus.

A mode with the eigenvalue s is uncontrollable if [A - s 1, B] loses rank, and unobservable if [A - s 1; C] does.
The states that dominate a mode follow from participation factors, which are invariant under units (I. J.
Perez-Arriaga, G. C. Verghese and F. C. Schweppe, Selective modal analysis with applications to electric power systems,
IEEE Transactions on Power Apparatus and Systems 101, 1982).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy.linalg

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError
from eomgen.products.linear.eigenvalues import balance

#: Distance from the border of stability, as a share of the largest eigenvalue, up to which an eigenvalue counts as on
#: the border; and length of a column of a square root, as a share of the longest, that is rounding.
_ON_BORDER = 1e-7


@dataclass(frozen=True)
class Dynamics:
    """The free motion of a linear model: sdot = A s, or s[k+1] = A s[k] for a sampled model.

    Attributes
    ----------
    A : (ns, ns)
    states : names
    sample : s between two samples; None in continuous time
    scales : (ns,) units of the states in which A is balanced; found from A if None, which parts of A that are not
        coupled leave open
    """

    A: Array
    states: tuple[str, ...]
    sample: float | None = None
    scales: Array | None = None

    @property
    def rate(self) -> float:
        """Scale of eigenvalues: the largest; 1 if the model is sampled."""
        if self.sample is not None or not len(self.A):
            return 1.0
        return float(np.max(np.abs(np.linalg.eigvals(self.A)))) or 1.0

    @property
    def dual(self) -> Dynamics:
        """The dual model with A^T: modes unobservable in outputs are uncontrollable there."""
        return Dynamics(self.A.T, self.states, self.sample, None if self.scales is None else 1.0 / self.scales)

    def growth(self, value: complex) -> float:
        """Return the distance of an eigenvalue beyond the border of stability, as a share of ``rate``."""
        return value.real / self.rate if self.sample is None else abs(value) - 1.0


def check_stabilisable(dynamics: Dynamics, B: Array) -> None:
    """Raise ModelError, with the name of the motion, if a motion that does not decay is out of the actuators' reach."""
    if worst := _worst(dynamics, _uncontrollable_modes(dynamics, B)):
        fault = f"{worst} cannot be stabilised: no actuator moves it [E0378]"
        raise ModelError(fault, "an actuator that works on it, or a spring, a damper or a filter that makes it decay")


def check_controllable(dynamics: Dynamics, B: Array) -> None:
    """Raise ModelError if a motion is out of the actuators' reach, decaying or not."""
    lost = _uncontrollable_modes(dynamics, B)
    if lost:
        fault = f"{describe_mode(dynamics, *next(iter(lost.items())))} cannot be placed: no actuator moves it [E0379]"
        raise ModelError(fault, "an actuator that works on it, or lqr, which leaves it as it is")


def check_detectable(dynamics: Dynamics, C: Array, measured: Sequence[str]) -> None:
    """Raise ModelError, with the name of the motion, if a motion that does not decay is unobservable in the
    measurements."""
    if worst := _worst(dynamics, _uncontrollable_modes(dynamics.dual, C.T)):
        fault = f"{worst} is not seen in {', '.join(measured)}, so no observer can follow it [E0380]"
        raise ModelError(fault, "a measured signal that it moves")


def check_weighted(dynamics: Dynamics, root: Array) -> None:
    """Raise ModelError if a motion on the border of stability has no cost: optimal control would leave the motion
    there.

    Parameters
    ----------
    dynamics : cross terms of the cost taken off
    root : (r, ns) with root^T root the weight of the state
    """
    if mode := _unseen_on_border(dynamics, root):
        fault = f"{mode} has zero weight, so optimal control would leave it as it is [E0381]"
        raise ModelError(fault, "a weight on a state or an output that it moves")


def check_driven(dynamics: Dynamics, root: Array) -> None:
    """Raise ModelError if noise does not drive a motion on the border of stability: the gain of this motion would be
    zero.

    Parameters
    ----------
    dynamics : of the dual model, with the transpose of A; the part correlated with measurement noise subtracted
    root : (r, ns) with root^T root the intensity of the noise
    """
    if mode := _unseen_on_border(dynamics, root):
        fault = f"no noise moves {mode} so the best observer would not correct it [E0382]"
        raise ModelError(fault, "noise on a disturbance, an input or a state that moves it")


def check_observable(dynamics: Dynamics, C: Array) -> None:
    """Raise ModelError if a motion is unobservable in the measurements, decaying or not. `dynamics` is the dual model
    with A^T, and `C` the transposed output matrix, (ns, ny)."""
    lost = _uncontrollable_modes(dynamics, C)
    if lost:
        of = describe_mode(dynamics, *next(iter(lost.items())))
        fault = f"the error of the estimate of {of} cannot be placed: nothing measured shows it [E0383]"
        raise ModelError(fault, "a measured signal that it moves, or kalman, which leaves it as it is")


def _worst(dynamics: Dynamics, lost: Mapping[complex, Array]) -> str:
    """Return the fastest growing motion of the ones that do not decay; empty for none."""
    value = max(lost, key=dynamics.growth, default=0.0)
    lasts = value in lost and dynamics.growth(value) > -_ON_BORDER
    return describe_mode(dynamics, value, lost[value]) if lasts else ""


def _unseen_on_border(dynamics: Dynamics, root: Array) -> str:
    """Return the first motion on the border of stability that a square root (r, ns) does not see; empty for none."""
    for value, shares in _uncontrollable_modes(dynamics.dual, root.T, math.sqrt(COMPUTED), _ON_BORDER).items():
        if abs(dynamics.growth(value)) <= _ON_BORDER:
            return describe_mode(dynamics, value, shares)
    return ""


def _uncontrollable_modes(
    dynamics: Dynamics, B: Array, tolerance: float = COMPUTED, negligible: float = 0.0
) -> dict[complex, Array]:
    """Return the modes that the columns of B (ns, m) do not reach, one of each pair: the eigenvalue s, and each state's
    share (ns,) in the left null vector of [A - s 1, B] in balanced units. `tolerance` bounds the least singular value.
    Columns shorter than a ``negligible`` share of the longest count as zero."""
    if not len(dynamics.A):
        return {}
    T = np.diag(balance(dynamics.A, permute=False)[1]) if dynamics.scales is None else dynamics.scales
    A, b = dynamics.A * T / T[:, np.newaxis], B / T[:, np.newaxis]
    sizes = np.linalg.norm(b, axis=0)
    kept = sizes > negligible * np.max(sizes, initial=0.0)
    b = b[:, kept] / sizes[kept]
    norm = float(np.linalg.norm(A, 2)) or 1.0
    lost = {}
    for value in _distinct(np.linalg.eigvals(A / norm).astype(complex)):
        pencil = np.hstack([A / norm - value * np.eye(len(A)), b])
        directions, stretches, _ = np.linalg.svd(pencil)
        if stretches[-1] < tolerance:
            lost[norm * value] = np.abs(directions[:, -1])
    return lost


def describe_mode(dynamics: Dynamics, value: complex, shares: Array) -> str:
    """Return the mode with the eigenvalue `value` in words: frequency, growth, and the two states that dominate; among
    several modes with this eigenvalue, by ``shares`` (ns,)."""
    decomposed: Any = scipy.linalg.eig(dynamics.A, left=True, right=True)  # the stubs know of one kind of vectors only
    values, left, right = decomposed
    k, *others = np.argsort(np.abs(values - value), kind="stable")
    if not others or abs(values[others[0]] - value) > _ON_BORDER * dynamics.rate:
        shares = np.abs(left[:, k] * right[:, k])
    order = np.argsort(-shares, kind="stable")[:2]
    movers = [dynamics.states[j] for j in order if shares[j] > 0.3 * shares[order[0]]]
    if dynamics.sample is not None:
        value = complex(np.log(complex(value))) / dynamics.sample
    axis = _ON_BORDER * dynamics.rate if dynamics.sample is None else _ON_BORDER / dynamics.sample
    return _in_words(value, movers, axis)


def _distinct(values: Complex) -> list[complex]:
    """Return eigenvalues without repetitions, by increasing magnitude. Kept are one of each conjugate pair, with a
    positive imaginary part, and one of each group of equal eigenvalues."""
    distinct: list[complex] = []
    for value in sorted(map(complex, values), key=lambda value: (round(abs(value), 9), -value.imag)):
        near = math.sqrt(np.finfo(float).eps) * max(1.0, abs(value))
        if value.imag >= -near and all(abs(value - known) > near for known in distinct):
            distinct.append(value)
    return distinct


def _in_words(value: complex, movers: Sequence[str], axis: float) -> str:
    """Return a description of a mode by its eigenvalue, 1/s, and the names of the moving coordinates (empty if
    unknown). Real and imaginary parts below ``axis``, 1/s, count as zero."""
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
