"""Pole placement by feedback of positions and velocities (SciPy's robust placement, in scaled units)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.errors import NumericalError, UsageError
from eomgen.linear.control.plant import Plant, first_order
from eomgen.linear.control.stabilisability import check_controllable

_REACHED = 1e-6


@dataclass(frozen=True)
class Placement:
    """Gains u = -G_p q - G_v v, (m, n) each, and the eigenvalues of the closed loop, (2n,), 1/s."""

    G_p: Array
    G_v: Array
    eigenvalues: Complex


def place(plant: Plant, poles: Sequence[complex]) -> Placement:
    """Return gains for which the closed loop has the given eigenvalues.

    Parameters
    ----------
    poles : 2n eigenvalues, 1/s; complex ones in conjugate pairs; none more often than there are actuators.

    Raises
    ------
    UsageError
        Poles of another number, without their conjugates, too often the same, or not finite.
    ModelError
        A mode that no actuator moves.
    NumericalError
        Poles that are not reached to 1e-6.
    """
    wanted = np.asarray(poles, dtype=complex)
    n, rate = plant.n, plant.scales.rate
    if wanted.shape != (2 * n,):
        raise UsageError(f"{wanted.size} poles are given, and the model has {2 * n} eigenvalues", f"{2 * n} poles")
    if not np.all(np.isfinite(wanted)):
        raise UsageError("a pole is not finite", "finite numbers")
    left = list(map(complex, wanted))
    for pole in map(complex, wanted):
        if pole.imag and pole.conjugate() not in left:
            fault = f"the pole {pole.real:g}{pole.imag:+g}i is there without its conjugate"
            raise UsageError(fault, f"{pole.real:g}{-pole.imag:+g}i too")
        if pole.imag:
            left.remove(pole.conjugate())
    for pole in dict.fromkeys(map(complex, wanted)):
        count = int(np.sum(wanted == pole))
        if count > plant.m:
            fault = f"the pole {pole.real:g}{pole.imag:+g}i is there {count} times"
            raise UsageError(f"{fault}, and {plant.m} actuators place {plant.m} at most", "poles a little apart")
    check_controllable(plant)
    from scipy.signal import place_poles  # noqa: PLC0415  # it takes a second to import

    k, c, b = plant.scaled
    A, B = first_order(k, c), np.vstack([np.zeros_like(b), b])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # SciPy's doubts about convergence: the result is checked below
            gain = np.real(place_poles(A, B, wanted / rate).gain_matrix)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise NumericalError(f"the poles could not be placed: {error}", "other poles") from None
    G = gain @ plant.scales.state
    reached = plant.eigenvalues(G[:, :n], G[:, n:])
    missed = max(float(np.abs(reached - pole).min()) / max(abs(pole), 1e-3 * rate) for pole in map(complex, wanted))
    if not missed <= _REACHED:
        raise NumericalError(f"the poles are reached to {missed:.1e} of their size only", "poles nearer to the model's")
    return Placement(G[:, :n], G[:, n:], reached)
