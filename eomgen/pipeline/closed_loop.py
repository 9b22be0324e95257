"""Messages about a closed loop: its slowest motion, and modes that miss the requested poles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.errors import ModelError
from eomgen.linear.control.modal import ModalFeedback
from eomgen.linear.control.plant import Plant
from eomgen.linear.modes import modes

#: Modal forces that miss their mode, as a share of those asked for, above which poles are elsewhere.
_MISSED = 1e-6
#: Distance of an eigenvalue from its wanted place, as a share of its size, that is reported.
_OFF = 1e-3


def slowest_motion(plant: Plant, G: Array) -> str:
    """Return the decay rate of the slowest motion under gains G of [q, v], (m, 2n), or a motion without decay."""
    n = plant.n
    A, _ = plant.state_space(G[:, :n], G[:, n:])
    result = modes(A, np.eye(n, 2 * n), plant.names, np.diag(plant.M))
    slowest = int(np.argmax(result.eigenvalues.real))
    rate, mover = -float(result.eigenvalues[slowest].real), result.dominant(slowest, 1)[0][0]
    if abs(rate) <= result.uncertainty[slowest]:
        return f"the closed loop does not decay: {mover}"
    if rate < 0.0:
        return f"the closed loop grows at {-rate:.4g} 1/s: {mover}"
    return f"the slowest motion of the closed loop decays at {rate:.4g} 1/s"


def check_reach(name: str, plant: Plant, modal: ModalFeedback) -> None:
    """Raise ModelError if the outputs cannot actuate the controlled modes independently."""
    if modal.crosstalk <= _MISSED:
        return
    numbers = ", ".join(str(k + 1) for k in modal.controlled)
    ways = int(np.linalg.matrix_rank(modal.modes.shapes[:, list(modal.controlled)].T @ plant.B, rtol=1e-9))
    only = f"{name} acts on them in {ways} independent way{'s' * (ways > 1)} only"
    fault = f"the modes {numbers} cannot be placed each by itself: {only}"
    raise ModelError(fault, f"{ways} of the modes, an output more, all poles in place of modes, or lqr")


def not_reached(modal: ModalFeedback, wanted: ArrayLike, ratios: Array) -> str:
    """Return the modes whose frequency (rad/s) or damping ratio differs from the requested one; empty if none does."""
    differences = []
    for k, w, zeta in zip(modal.controlled, np.asarray(wanted), ratios, strict=True):
        pole = w * (-zeta + np.sqrt(complex(zeta**2 - 1.0)))
        nearest_pole = modal.eigenvalues[np.argmin(np.abs(modal.eigenvalues - pole))]
        if abs(nearest_pole - pole) > _OFF * w:
            got = f"{abs(nearest_pole):.4g} rad/s with a damping ratio of {-nearest_pole.real / abs(nearest_pole):.3g}"
            differences.append(f"mode {k + 1} gets {got}, not {w:.4g} with {zeta:.3g}")
    return f"damping couples the modes: {', '.join(differences)}; " if differences else ""
