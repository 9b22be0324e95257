"""Stationary random motions of a linear model under white noise, by Lyapunov's equation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from eomgen.base.arrays import Array
from eomgen.base.text import shown
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.linear.control.cost import near, number
from eomgen.linear.state_space import HasStateSpace, StateSpace, state_space_of


def stationary_covariance(space: StateSpace | HasStateSpace, noise: Mapping[str, float]) -> Array:
    """Return the stationary covariance (ns, ns) of the state under independent white noises.

    Parameters
    ----------
    noise : by disturbance or input, intensities (two-sided spectral densities, unit^2 s: half of one-sided ones per
        Hz); of a sampled model variances of values held over a sample

    Raises
    ------
    UsageError
        Names that there are not, or negative intensities.
    ModelError
        A motion that does not decay.
    """
    space = state_space_of(space)
    G, _, W = _entering(space, noise)
    if space.stability != "stable":
        fault = f"there is no stationary motion: the slowest motion does not decay ({-space.decay:.4g} 1/s)"
        raise ModelError(Problem("", fault, "a damper, or feedback"))
    solve = solve_continuous_lyapunov if space.sample is None else _sampled
    covariance: Array = np.asarray(solve(space.A, -G @ W @ G.T), dtype=float)
    return np.asarray((covariance + covariance.T) / 2.0)


def root_mean_squares(space: StateSpace | HasStateSpace, noise: Mapping[str, float]) -> dict[str, float]:
    """Return the stationary root mean square of every output by name; infinite if white noise is part of it.

    Raises as ``stationary_covariance``.
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


def _sampled(A: Array, negative: Array) -> Array:
    return np.asarray(solve_discrete_lyapunov(A, -negative), dtype=float)


def _entering(space: StateSpace, noise: Mapping[str, float]) -> tuple[Array, Array, Array]:
    """Return the noise matrices of states and outputs, and the intensity."""
    names = (*space.disturbances, *space.inputs)
    for name in noise:
        if name not in names:
            fault = f"there is no disturbance or input {shown(name)}"
            raise UsageError(Problem("noise", fault, near(str(name), names)))
    columns = [names.index(name) for name in noise]
    W = np.diag(np.array([number("noise", name, value) for name, value in noise.items()], dtype=float))
    return np.hstack([space.E, space.B])[:, columns], np.hstack([space.F, space.D])[:, columns], W
