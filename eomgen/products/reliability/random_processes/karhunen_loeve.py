"""Karhunen-Loeve expansion of a stationary process on a window [0, T]: g(t) = sum sqrt(lambda_i) phi_i(t) z_i.

The z_i are independent standard normal variables, lambda_i and phi_i the eigenvalues and orthonormal eigenfunctions of
int_0^T R(t - s) phi(s) ds = lambda phi(t), the largest first. Of all expansions in as many variables the Karhunen-Loeve
expansion has the largest part of the variance: the sum of the lambda_i over R(0) T.

Nystrom's method with Gauss-Legendre nodes on equal panels gives them. If R has a kink at lag 0 the integrand has one
at s = t; there the kernel is integrated on both sides of t against Lagrange's polynomials of the panel, so the
eigenvalues converge as fast as with smooth kernels. R is the same from both ends of the window, so every phi_i is
even or odd about its middle, and the two kinds are computed separately: neighbouring eigenvalues are of different
kinds, and do not mix. Of R = s^2 exp(-abs(tau)/l) they are known in closed form (Ghanem and Spanos 1991).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import WRITTEN
from eomgen.errors import Problem, UsageError
from eomgen.products.reliability.random_processes.covariance import Constant, Covariance, DampedCosine
from eomgen.solvers.quadrature import gauss_legendre

#: Most modes: each is a table, and a variable. Loading time grows with the cube of the number of modes (9 s of
#: processor time for 659); a step grows in proportion.
MOST_MODES = 1024
#: Nodes of a panel of Gauss's rule, and of a window at most.
PANEL, _MOST_NODES = 16, 4096


@dataclass(frozen=True, eq=False)
class Expansion:
    """The first n modes of a process on a window [0, T].

    Attributes
    ----------
    duration : T, s or m
    eigenvalues : (n,), the largest first
    total : R(0) T, the sum of all eigenvalues; for joint processes, over all processes
    function : returns all phi_i (n, m) at times (m,) in the window
    shares : int phi_i^2 dt, (n,): share of each mode in one of several processes, 1 in one alone
    repaired : relative change of the norm of the covariance that made the covariance positive; 0 without repair
    """

    duration: float
    eigenvalues: Array
    total: float
    function: Callable[[Array], Array]
    shares: Array | float = 1.0
    repaired: float = 0.0

    @property
    def variance_shares(self) -> Array:
        """Part of the variance in the first mode, in the first two, ...: (n,)."""
        return np.asarray(np.cumsum(self.eigenvalues) / self.total)

    def modes(self, times: Array) -> Array:
        """Return sqrt(lambda_i) phi_i at times (m,): (n, m)."""
        return np.asarray(np.sqrt(self.eigenvalues)[:, np.newaxis] * self.function(times))


def expand(
    covariance: Covariance,
    duration: float,
    *,
    share: float | None = None,
    modes: int | None = None,
    repair: bool = False,
) -> Expansion:
    """Return the Karhunen-Loeve modes that have a share of the variance, or as many as are asked for.

    Parameters
    ----------
    covariance : Covariance
        Covariance over time or distance.
    duration : float
        Length of the window, s or m.
    share, modes : float and int, optional
        Share of the variance, or number of modes.
    repair : bool, optional
        Whether a covariance with negative eigenvalues is replaced by the nearest positive covariance on the window.

    Raises
    ------
    UsageError
        Neither a share nor a number; a covariance with a negative eigenvalue; a share that the modes cannot have; more
        modes than there are.
    """
    if isinstance(covariance, Constant):
        variance = np.array([covariance.standard_deviation**2 * duration])
        return Expansion(duration, variance, float(variance[0]), lambda times: np.full((1, len(times)), duration**-0.5))
    if isinstance(covariance, DampedCosine) and not covariance.frequency:
        return _chosen(_closed_form(covariance, duration), share, modes)
    return expand_jointly([[covariance]], duration, share=share, modes=modes, repair=repair)[0]


def expand_jointly(
    covariances: Sequence[Sequence[Covariance]],
    duration: float,
    *,
    share: float | None = None,
    modes: int | None = None,
    repair: bool = False,
) -> list[Expansion]:
    """Return one expansion for each process, given their matrix of covariances and cross covariances.

    All processes have the same variables: g_p(t) = sum sqrt(lambda_i) phi_pi(t) z_i, the phi_i orthonormal over all
    processes together, so eigenvalues, total and share belong to the whole group. Panels are doubled until no
    eigenvalue changes by more than 1e-10 of the largest, or by 1e-7 for several processes, whose tables of modes are
    not closer.

    Parameters
    ----------
    covariances : sequence of sequences of Covariance
        Matrix of covariances and cross covariances.
    duration : float
        Length of the window, s or m.
    share, modes, repair
        As for ``expand``.

    Raises
    ------
    UsageError
        As of ``expand``, and for a window too long for the largest number of nodes.
    """
    count, panels, before = len(covariances), 2, np.zeros(0)

    def split_processes(expansion: Expansion) -> list[Expansion]:
        function = expansion.function
        if count == 1:
            return [replace(expansion, function=lambda t: function(t)[:, 0])]
        edges = np.linspace(0.0, duration, panels + 1)
        nodes, weights = gauss_legendre(edges, PANEL + 1)  # none of these is one of the modes' nodes
        shares = function(nodes.ravel()) ** 2 @ weights.ravel()
        return [
            replace(expansion, function=partial(_rows_of, function, column), shares=shares[:, column])
            for column in range(count)
        ]

    while True:
        known, refused = np.zeros(0), None
        resolved = known
        try:
            expansion = _nystrom(covariances, duration, panels, repair)
            known = resolved = expansion.eigenvalues
            expansion = _chosen(expansion, share, modes)
            known = expansion.eigenvalues
        except UsageError as error:
            refused = error
        change = math.inf
        if 0 < len(known) <= len(before):
            change = float(np.max(np.abs(known - before[: len(known)]))) / known[0]
        if refused is None and change <= (1e-10 if count == 1 else 1e-7):
            return split_processes(expansion)
        if 2 * panels * PANEL * count > _MOST_NODES:
            if change > 1e-5 and len(known):
                fault = f"the window is too long for {_MOST_NODES} nodes: its modes are not found [E0968]"
                raise UsageError(Problem("", fault, "a shorter window, a longer correlation"))
            if refused is not None:
                raise refused
            return split_processes(expansion)
        panels, before = 2 * panels, resolved


def _rows_of(function: Callable[[Array], Array], column: int, times: Array) -> Array:
    return function(times)[:, column]


def _chosen(expansion: Expansion, share: float | None, modes: int | None) -> Expansion:
    """Return the first modes of an expansion: as many as ``modes`` says, else as many as have the share of the
    variance. Raises UsageError if both are None, if more than ``MOST_MODES`` are needed, or if the expansion has too
    few."""
    if modes is None:
        if share is None:
            raise UsageError(
                Problem("", "neither a share of the variance nor a number of modes is given [E0970]", "share = 0.99")
            )
        reached = np.flatnonzero(expansion.variance_shares >= share)
        count = int(reached[0]) + 1 if len(reached) else math.inf
        if count > MOST_MODES:
            most = min(MOST_MODES, len(expansion.eigenvalues))
            has = float(expansion.variance_shares[most - 1])
            fault = f"the share {share:.6g} of the variance needs more than {MOST_MODES} modes; {most} have {has:.4g}"
            least = math.floor(has * 1e4) / 1e4
            hint = f"share = {least:g}, or" if least >= 0.05 else "a longer correlation, or"
            raise UsageError(Problem("", f"{fault} [E0969]", f"{hint} a shorter window"))
        modes = int(count)
    if modes > MOST_MODES:
        raise UsageError(
            Problem("", f"{modes} modes are asked for, and {MOST_MODES} are the most [E0971]", "fewer modes")
        )
    if modes > len(expansion.eigenvalues):
        known = len(expansion.eigenvalues)
        fault = f"the process has {known} modes in this window beyond rounding, and {modes} are asked for [E0972]"
        raise UsageError(Problem("", fault, "fewer modes, or a share"))
    function = expansion.function
    return replace(expansion, eigenvalues=expansion.eigenvalues[:modes], function=lambda t: function(t)[:modes])


def _nystrom(covariances: Sequence[Sequence[Covariance]], duration: float, panels: int, repair: bool) -> Expansion:
    """Return all modes that an even number of panels resolves beyond rounding, for all processes together. The function
    of the expansion has a row for each process, (n, processes, m). Notable negative eigenvalues raise UsageError unless
    ``repair`` is true; then the positive ones alone are kept, and ``repaired`` is set."""
    width, count = duration / panels, len(covariances)
    nodes, own_weights = (rule[0] for rule in gauss_legendre(np.array([0.0, width]), PANEL))
    starts = width * np.arange(panels)
    root = np.sqrt(np.tile(own_weights, panels))
    half = panels * PANEL // 2
    near, far = (np.empty((count, half, count, half)) for _ in range(2))
    for i, row in enumerate(covariances):
        for j, covariance in enumerate(row[: i + 1]):
            kernel = _kernel(covariance, width, nodes, own_weights, panels)
            near[i, :, j] = near[j, :, i] = kernel[:, :half]
            far[i, :, j] = far[j, :, i] = kernel[:, half:][:, ::-1]
    first, second = (part.reshape(count * half, count * half) for part in (near, far))
    total = sum(float(covariances[k][k].at(np.zeros(1))[0]) for k in range(count)) * duration
    values, vectors = [], []
    for sign in (1.0, -1.0):
        value, eigenvectors = np.linalg.eigh(first + sign * second)
        ahead = eigenvectors.reshape(count, half, -1)
        values.append(value)
        vectors.append(np.concatenate([ahead, sign * ahead[:, ::-1]], axis=1) / math.sqrt(2.0))
    every, vector = np.concatenate(values), np.concatenate(vectors, axis=2)
    order = np.argsort(-every, kind="stable")
    every, vector = every[order], vector[:, :, order]
    removed = 0.0
    if every[-1] < -WRITTEN * every[0]:
        part, removed = every[-1] / every[0], float(np.linalg.norm(every[every < 0.0]) / np.linalg.norm(every))
        if not repair:
            fault = (
                f"the covariance is not positive: an eigenvalue of it in the window is {part:.3g} times the largest;"
                f" the nearest positive one differs from it by {removed:.2g} of its norm [E0973]"
            )
            hint = "a covariance that some process has: its spectrum is nowhere negative; or covariance_repair = "
            raise UsageError(Problem("", fault, f'{hint}"nearest"'))
        total = float(np.sum(every[every > 0.0]))
    kept = min(int(np.sum(every > 1e-13 * every[0])), MOST_MODES)
    shape = vector[:, :, :kept] / root[:, np.newaxis]
    shape *= np.where(shape[0, 0] < 0.0, -1.0, 1.0)

    def function(at: Array) -> Array:
        panel = np.clip((at / width).astype(int), 0, panels - 1)
        result = np.empty((kept, count, len(at)))
        for index in np.unique(panel):
            here = panel == index
            places = slice(index * PANEL, (index + 1) * PANEL)
            result[:, :, here] = (_lagrange(nodes, at[here] - starts[index]) @ shape[:, places]).transpose(2, 0, 1)
        return result

    return Expansion(duration, every[:kept], total, function, repaired=removed)


def _kernel(covariance: Covariance, width: float, nodes: Array, own_weights: Array, panels: int) -> Array:
    """Return the covariance between nodes in the first half of the window and all nodes, (half, nodes), times the roots
    of both nodes' quadrature weights. `width` is of a panel, `nodes` and `own_weights` are of Gauss's rule in one
    panel. For a covariance with a kink at lag 0, panels on the diagonal are integrated across the kink."""
    # the kernel of two panels depends on the distance of the panels
    offset = width * np.arange(1 - panels // 2, panels)[:, np.newaxis, np.newaxis]
    apart = covariance.at(nodes[:, np.newaxis] - nodes - offset)
    ratio = np.sqrt(own_weights)
    apart = apart * ratio[:, np.newaxis] * ratio
    if not covariance.smooth:
        block = _across_the_kink(covariance, width, nodes) * ratio[:, np.newaxis] / ratio
        apart[panels // 2 - 1] = 0.5 * (block + block.T)
    which = np.arange(panels) - np.arange(panels // 2)[:, np.newaxis] + panels // 2 - 1
    half = panels * len(nodes) // 2
    return np.asarray(apart[which].transpose(0, 2, 1, 3).reshape(half, 2 * half))


def _across_the_kink(covariance: Covariance, width: float, nodes: Array) -> Array:
    """Return int_0^width R(t_i - s) L_j(s) ds, (nodes, nodes), L_j Lagrange's polynomials of a panel's nodes."""
    rows = []
    for time in nodes:
        row = np.zeros(len(nodes))
        for s, weight in zip(*gauss_legendre(np.array([0.0, time, width]), 2 * PANEL), strict=True):
            row += (weight * covariance.at(time - s)) @ _lagrange(nodes, s)
        rows.append(row)
    return np.array(rows)


def _lagrange(nodes: Array, at: Array) -> Array:
    """Return Lagrange's polynomials of nodes (n,) at places (m,): (m, n), by the barycentric formula."""
    scale = nodes[-1] - nodes[0]
    apart = (nodes[:, np.newaxis] - nodes) / scale
    np.fill_diagonal(apart, 1.0)
    weights = 1.0 / apart.prod(axis=1)
    distance = (at[:, np.newaxis] - nodes) / scale
    row, column = np.nonzero(distance == 0.0)
    distance[row] = 1.0
    terms = weights / distance
    result = terms / terms.sum(axis=1, keepdims=True)
    result[row] = 0.0
    result[row, column] = 1.0
    return np.asarray(result)


def _closed_form(covariance: DampedCosine, duration: float) -> Expansion:
    """Return the first ``MOST_MODES`` modes of the exponential covariance: cosines and sines about the middle of the
    window, all with a positive value at its start."""
    half, rate = 0.5 * duration, covariance.decay
    k = np.arange(MOST_MODES)
    # x = w half: the even ones solve x tan x = rate half in (k pi, k pi + pi/2), the odd ones -x cot x = rate half in
    # (k pi + pi/2, k pi + pi): both are x = k pi/2 + atan(rate half / x) with the next quarter for each mode
    base = 0.5 * math.pi * k
    low, high = base, base + 0.5 * math.pi
    for _ in range(200):
        x = 0.5 * (low + high)
        above = (x - base) > np.arctan2(rate * half, x)
        low, high = np.where(above, low, x), np.where(above, x, high)
    x = 0.5 * (low + high)
    frequency = x / half
    variance = covariance.standard_deviation**2
    values = variance * 2.0 * rate / (frequency**2 + rate**2)
    even = k % 2 == 0
    norms = np.sqrt(half + np.where(even, 1.0, -1.0) * np.sin(2.0 * x) / (2.0 * frequency))

    def function(at: Array) -> Array:
        phase = np.multiply.outer(frequency, at - half)
        shape = np.where(even[:, np.newaxis], np.cos(phase), np.sin(phase)) / norms[:, np.newaxis]
        first = np.where(even, np.cos(x), -np.sin(x))
        return np.asarray(shape * np.where(first < 0.0, -1.0, 1.0)[:, np.newaxis])

    return Expansion(duration, values, variance * duration, function)
