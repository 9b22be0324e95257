"""Stationary random motions of a linear model under white noise, by Lyapunov's equation; on a road with white noise as
velocity.

An ISO 8608 road of roughness G_d(n0) at the reference wavenumber n0 has, at the speed V, the one-sided spectral density
of its vertical velocity 4 pi^2 n0^2 G_d(n0) V, at all frequencies the same; half of it is the intensity in Lyapunov's
equation.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import shown
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.linear.control.plant import Plant, real_matrix
from eomgen.products.linear.control.weights import near, number
from eomgen.products.linear.state_space import HasStateSpace, StateSpace, state_space_of


def stationary_covariance(space: StateSpace | HasStateSpace, noise: Mapping[str, float]) -> Array:
    """Return the stationary covariance (ns, ns) of the state under independent white noises.

    Parameters
    ----------
    space : StateSpace or Linearization
        A stable linear model.
    noise : mapping
        Intensities by disturbance or input: two-sided spectral densities, unit^2 s, half of one-sided densities per Hz;
        of a sampled model variances of values held over a sample. Signals that are not named are zero.

    Returns
    -------
    (ns, ns) ndarray
        Covariance of the state, in the order of ``states``.

    Raises
    ------
    UsageError
        Names that there are not, or negative intensities.
    ModelError
        A motion that does not decay.

    Examples
    --------
    >>> from eomgen.control import shaping_filter, stationary_covariance
    >>> gusts = shaping_filter([1.0], [1.0, 2.0], "white", "wind")
    >>> stationary_covariance(gusts, {"white": 4.0}).round(6)
    array([[1.]])
    """
    space = state_space_of(space)
    G, _, W = _entering(space, noise)
    if space.stability != "stable":
        growth = f"beyond rounding errors ({-space.decay:.4g} 1/s)"
        fault = f"there is no stationary motion: the slowest motion does not decay {growth} [E0424]"
        raise ModelError(Problem("", fault, "a damper, or feedback"))
    if space.sample is None:
        covariance = np.asarray(solve_continuous_lyapunov(space.A, -G @ W @ G.T), dtype=float)
    else:
        covariance = np.asarray(solve_discrete_lyapunov(space.A, G @ W @ G.T), dtype=float)
    return np.asarray((covariance + covariance.T) / 2.0)


def root_mean_squares(space: StateSpace | HasStateSpace, noise: Mapping[str, float]) -> dict[str, float]:
    """Return the stationary root mean square of every output under independent white noises.

    Parameters
    ----------
    space : StateSpace or Linearization
        A stable linear model.
    noise : mapping
        Intensities by disturbance or input: two-sided spectral densities, unit^2 s; of a sampled model variances of
        values held over a sample. Signals that are not named are zero.

    Returns
    -------
    dict
        By name of the output, in its unit, about the reference; infinite if an output of a model in continuous time
        contains white noise.

    Raises
    ------
    UsageError
        Names that there are not, or negative intensities.
    ModelError
        A motion that does not decay.

    Examples
    --------
    >>> from eomgen.control import root_mean_squares, shaping_filter
    >>> gusts = shaping_filter([1.0], [1.0, 2.0], "white", "wind")
    >>> round(root_mean_squares(gusts, {"white": 4.0})["wind"], 6)     # sqrt(4 / (2 * 2))
    1.0
    """
    space = state_space_of(space)
    covariance = stationary_covariance(space, noise)
    _, F, W = _entering(space, noise)
    squares = np.einsum("ij,jk,ik->i", space.C, covariance, space.C)
    direct = np.einsum("ij,jk,ik->i", F, W, F)
    if space.sample is None:
        direct = np.where(direct > 0.0, np.inf, 0.0)
    values = np.sqrt(np.maximum(squares, 0.0) + direct)
    return dict(zip(space.outputs, values.tolist(), strict=True))


def _entering(space: StateSpace, noise: Mapping[str, float]) -> tuple[Array, Array, Array]:
    """Return the noise matrices of states (ns, noises) and outputs (ny, noises), and the diagonal matrix of
    intensities. Raises UsageError for a name that is not a disturbance or an input, and for noise without names."""
    names = (*space.disturbances, *space.inputs)
    if not isinstance(noise, Mapping):
        fault = f"a mapping is needed, not {type(noise).__name__} [E0090]"
        raise UsageError(Problem("noise", fault, f"one of {', '.join(names)}, and the intensity of each"))
    for name in noise:
        if name not in names:
            fault = f"there is no disturbance or input {shown(name)} [E0425]"
            raise UsageError(Problem("noise", fault, near(str(name), names)))
    columns = [names.index(name) for name in noise]
    W = np.diag(np.array([number("noise", name, value) for name, value in noise.items()], dtype=float))
    return np.hstack([space.E, space.B])[:, columns], np.hstack([space.F, space.D])[:, columns], W


@dataclass(frozen=True)
class Stationary:
    """A stationary random motion of x = [q - r w, v], r being the displacement that a constant road w leads to.

    Attributes
    ----------
    covariance : (2n, 2n) of x.
    following : (n, roads) r.
    A : (2n, 2n), x' = A x - [r; 0] w' + ...
    """

    covariance: Array
    following: Array
    A: Array

    def rms(self, of_state: ArrayLike) -> Array:
        """Return the root mean square (rows,) of F x under the stationary covariance of x, for F (rows, 2n)."""
        F = np.atleast_2d(np.asarray(of_state, dtype=float))
        return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", F, self.covariance, F), 0.0)))

    @property
    def acceleration(self) -> Array:
        """(n, 2n) matrix F with v' = F x."""
        return self.A[len(self.A) // 2 :]


def stationary(
    plant: Plant, road: ArrayLike, intensity: ArrayLike, G_p: ArrayLike | None = None, G_v: ArrayLike | None = None
) -> Stationary:
    """Return the stationary covariance of M v' + C v + K q = B u + E w with white noise w'.

    Parameters
    ----------
    plant : Plant
        M, C, K and B.
    road : (n, roads) E, force per displacement of the road (a tyre's stiffness).
    intensity : of w', (roads, roads), E[w'(t) w'(s)] = intensity delta(t - s); or one number for roads that are
        independent.
    G_p, G_v : (m, n), optional
        u = -G_p (q - r w) - G_v v: gains on coordinates relative to the road.

    Raises
    ------
    ModelError
        A plant that a constant road does not carry along, or a motion that does not decay.
    """
    E = np.asarray(road, dtype=float).reshape(plant.n, -1)
    roads = E.shape[1]
    matrix = np.asarray(intensity, dtype=float)
    W = real_matrix("the intensity", matrix if matrix.ndim else matrix * np.eye(roads), roads, roads)
    A, _ = plant.state_space(G_p, G_v)
    growth = float(np.linalg.eigvals(A).real.max())
    if growth >= -1e-12 * plant.scales.rate:
        fault = f"there is no stationary motion: a mode does not decay ({growth:.4g} 1/s) [E0426]"
        raise ModelError(fault, "a damper, or other gains")
    if np.linalg.matrix_rank(plant.K) < plant.n:
        fault = "a constant road does not hold the plant anywhere: its stiffness matrix is singular [E0427]"
        raise ModelError(fault, "springs that do")
    r = np.linalg.solve(plant.K, E)
    entering = np.vstack([-r, np.zeros_like(r)])
    covariance = solve_continuous_lyapunov(A, -entering @ W @ entering.T)
    return Stationary((covariance + covariance.T) / 2.0, r, A)
