"""Stationary random motions of a linear model under white noise, by Lyapunov's equation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from eomgen.base.arrays import Array
from eomgen.base.messages import nearest, shown
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.linear.control.weights import number
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
            raise UsageError(Problem("noise", fault, nearest(str(name), names)))
    columns = [names.index(name) for name in noise]
    W = np.diag(np.array([number("noise", name, value) for name, value in noise.items()], dtype=float))
    return np.hstack([space.E, space.B])[:, columns], np.hstack([space.F, space.D])[:, columns], W
