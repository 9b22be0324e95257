"""Feedback of second-order models M q'' + C q' + K q = B u by one law for each mode (independent modal space control).

A mode xi'' + 2 zeta w xi' + w^2 xi = f has f = -g xi - h xi'. Optimal for int xi'^2 + w^2 xi^2 + R f^2 dt are (L.
Meirovitch and H. Baruh, Control of self-adjoint distributed-parameter systems, Journal of Guidance and Control 5, 1982;
there without damping)

    g = w sqrt(w^2 + 1/R) - w^2,  h = sqrt(c^2 + 2 g + 1/R) - c,  c = 2 zeta w,

and a frequency w_d with a damping ratio zeta_d are reached by g = w_d^2 - w^2, h = 2 (zeta_d w_d - zeta w).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError, UsageError


@dataclass(frozen=True)
class Plant:
    """A linear model M q'' + C q' + K q = B u with n coordinates, whose ``names`` serve messages, and m actuators.

    M (n, n) is symmetric and positive definite, C and K (n, n) need not be symmetric, B is (n, m).
    """

    M: Array
    C: Array
    K: Array
    B: Array
    names: Sequence[str]

    def state_matrix(self, G_p: ArrayLike = 0.0, G_v: ArrayLike = 0.0) -> Array:
        """Return A (2n, 2n) of x' = A x, x = [q, v], under u = -G_p q - G_v v with gains (m, n)."""
        n, m = self.B.shape
        forces = [part + self.B @ np.broadcast_to(gains, (m, n)) for part, gains in ((self.K, G_p), (self.C, G_v))]
        return np.vstack([np.eye(n, 2 * n, n), -np.linalg.solve(self.M, np.hstack(forces))])


@dataclass(frozen=True)
class PlantModes:
    """Undamped modes of a plant, by increasing frequency.

    Attributes
    ----------
    frequencies : (n,) w, rad/s.
    damping : (n,) c = 2 zeta w, 1/s: the diagonal of the modal damping matrix.
    shapes : (n, n) columns with the unit modal mass.
    """

    frequencies: Array
    damping: Array
    shapes: Array


@dataclass(frozen=True)
class ModalFeedback:
    """Gains u = -G_p q - G_v v of a feedback in modal space.

    Attributes
    ----------
    G_p, G_v : (m, n)
    modes : of the plant.
    controlled : numbers of the modes that are fed back, from 0.
    crosstalk : largest modal force that reaches another controlled mode, or is missing in the requested mode, per
        requested force; 0 with at least as many independent actuators as controlled modes.
    spillover : largest modal force that reaches a mode that is not controlled, per force that is asked for.
    eigenvalues : (2n,) of the closed loop with all modes, 1/s.
    """

    G_p: Array
    G_v: Array
    modes: PlantModes
    controlled: tuple[int, ...]
    crosstalk: float
    spillover: float
    eigenvalues: Complex


def modes_of(plant: Plant) -> PlantModes:
    """Return the undamped modes. Raises ModelError if K is not symmetric, or an equilibrium unstable."""
    if not np.allclose(plant.K, plant.K.T, rtol=0.0, atol=1e-8 * np.abs(plant.K).max()):
        fault = "the stiffness matrix is not symmetric, so there are no modes that keep their shape [E0415]"
        raise ModelError(fault, "lqr")
    squares, shapes = eigh((plant.K + plant.K.T) / 2.0, (plant.M + plant.M.T) / 2.0)
    limit = COMPUTED * float(np.abs(squares).max())
    if squares[0] < -limit:
        mover = plant.names[int(np.argmax(np.abs(shapes[:, 0])))]
        fault = f"the equilibrium is unstable: the mode of {mover} grows at {(-squares[0]) ** 0.5:.4g} 1/s"
        raise ModelError(f"{fault}, and modal control is for modes that oscillate [E0416]", "lqr")
    damping = np.einsum("ik,ij,jk->k", shapes, plant.C, shapes)
    return PlantModes(np.sqrt(np.where(np.abs(squares) <= limit, 0.0, squares)), damping, np.asarray(shapes))


def optimal_modal_gains(frequency: ArrayLike, damping: ArrayLike, effort: ArrayLike) -> tuple[Array, Array]:
    """Return the gains g (1/s^2) and h (1/s) of f = -g xi - h xi' that minimise int xi'^2 + w^2 xi^2 + R f^2 dt.

    Parameters
    ----------
    frequency : w, rad/s.
    damping : c = 2 zeta w, 1/s.
    effort : R, above zero.
    """
    w, c, R = (np.asarray(value, dtype=float) for value in (frequency, damping, effort))
    g = w / R / (np.sqrt(w**2 + 1.0 / R) + w)  # without the difference of two large numbers
    rise = 2.0 * g + 1.0 / R
    return g, rise / (np.sqrt(c**2 + rise) + c)


def placed_modal_gains(
    frequency: ArrayLike, damping: ArrayLike, wanted: ArrayLike, ratio: ArrayLike
) -> tuple[Array, Array]:
    """Return modal gains g (1/s^2) and h (1/s) that give modes new frequencies and damping ratios.

    Raises UsageError for a new frequency that is not positive, such as of a mode without stiffness.

    Parameters
    ----------
    frequency : array_like
        Undamped angular frequencies without control, rad/s.
    damping : array_like
        Modal damping c of xi'' + c xi' + w^2 xi = 0, 1/s.
    wanted : array_like
        New angular frequencies, rad/s.
    ratio : array_like
        New damping ratios.
    """
    w, c, w_d, zeta_d = (np.asarray(value, dtype=float) for value in (frequency, damping, wanted, ratio))
    if not np.all(w_d > 0.0):
        raise UsageError(f"a frequency of {float(np.min(w_d)):.6g} rad/s is asked for [E0418]", "a number above zero")
    return w_d**2 - w**2, 2.0 * zeta_d * w_d - c


def modal_feedback(
    plant: Plant, modes: PlantModes, controlled: Sequence[int], g: ArrayLike, h: ArrayLike
) -> ModalFeedback:
    """Return gains that give the controlled modes the modal forces -g xi - h xi', as far as the actuators can.

    With fewer independent actuators than controlled modes the forces follow from the pseudo-inverse, and modes talk to
    each other (``crosstalk``); forces also act on modes that are not controlled (``spillover``).

    Parameters
    ----------
    plant : Plant
        The second-order model with actuators.
    modes : PlantModes
        Undamped modes of the plant.
    controlled : sequence of int
        Indices of the modes to control, from 0.
    g, h : array_like
        Modal gains (1/s^2 and 1/s), one for each controlled mode or one for all.

    Raises
    ------
    UsageError
        Mode indices out of range, or a number of gains that differs from the number of modes.
    ModelError
        Actuators that do not reach the controlled modes, or a closed loop that spillover makes unstable.
    """
    chosen, (n, m) = [int(k) for k in controlled], plant.B.shape
    for k in chosen:
        if not 0 <= k < n:
            fault = f"there is no mode {k + 1}: the model has {n} [E0420]"
            raise UsageError(fault, f"1 to {n}" if n > 1 else "1")
    if not chosen or len(set(chosen)) < len(chosen):
        raise UsageError("the modes to control are none, or one of them is named twice [E0421]", "[1, 2]")
    gains = [np.broadcast_to(np.asarray(values, dtype=float), (len(chosen),)) for values in (g, h)]
    reach = modes.shapes[:, chosen].T @ plant.B
    sizes = np.linalg.norm(reach, axis=1)
    largest = float(np.linalg.norm(modes.shapes.T @ plant.B, 2))
    for column, k in enumerate(chosen):
        if not sizes[column] > COMPUTED * largest:
            frequency = modes.frequencies[k] / (2.0 * np.pi)
            fault = f"no actuator reaches mode {k + 1} at {frequency:.4g} Hz [E0422]"
            raise ModelError(fault, "another place for one, or other modes")
    efforts = np.linalg.pinv(reach, rcond=COMPUTED)
    of_coordinates = modes.shapes[:, chosen].T @ plant.M
    G_p, G_v = (efforts @ (values[:, np.newaxis] * of_coordinates) for values in gains)
    rest = [k for k in range(n) if k not in chosen]
    crosstalk = float(np.abs(reach @ efforts - np.eye(len(chosen))).max())
    spillover = float(np.abs(modes.shapes[:, rest].T @ plant.B @ efforts).max(initial=0.0))
    without, eigenvalues = (np.linalg.eigvals(plant.state_matrix(*G)) for G in ((), (G_p, G_v)))
    worst = eigenvalues[np.argmax(eigenvalues.real)]
    if worst.real > COMPUTED * np.abs(eigenvalues).max() and worst.real > without.real.max():
        fault = f"modal control with {m} actuators makes a mode at {abs(worst.imag) / (2 * np.pi):.4g} Hz grow"
        detail = f"(crosstalk {crosstalk:.2g}, spillover {spillover:.2g} of the forces asked for)"
        raise ModelError(f"{fault} {detail} [E0423]", "as many actuators as modes, or fewer controlled modes")
    if crosstalk < COMPUTED:
        crosstalk = 0.0
    return ModalFeedback(G_p, G_v, modes, tuple(chosen), crosstalk, spillover, eigenvalues.astype(complex))
