"""Feedback of the whole state of a linear model: optimal for a quadratic cost, or with eigenvalues that are asked for.

The state holds internal states, also of actuators and of shaping filters. With J = int s^T Q s +
2 s^T N u + u^T R u dt the gain of u = -G s is G = R^-1 (B^T P + N^T); P solves Riccati's equation (B. D. O.
Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1990). A sampled regulator minimises the same
integral with inputs that are held, or the sum over samples of a model that is sampled already.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import NamedAttributes, checked_call, checked_calls, names_of, not_unpacked
from eomgen.base.data import dataclass, replace
from eomgen.base.html import page
from eomgen.base.messages import nearest
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.control.controllability import (
    Dynamics,
    check_controllable,
    check_stabilisable,
    check_weighted,
)
from eomgen.products.linear.control.margins import Margins, margins_of
from eomgen.products.linear.control.notebook import (
    eigenvalues_html,
    gains_html,
    margins_html,
    plot_margins,
)
from eomgen.products.linear.control.pole_placement import (
    check_poles,
    check_reached,
    pole_array,
    pole_gains,
)
from eomgen.products.linear.control.riccati_equation import (
    sampled_solution,
    solution,
    solvable,
    whitening,
    without_cross_terms,
)
from eomgen.products.linear.control.weights import Weighted, Weights, controlled_by, quadratic_cost
from eomgen.products.linear.eigenvalues import balance
from eomgen.products.linear.sampling import discretized, sampled_with_cost
from eomgen.products.linear.state_space import HasStateSpace, StateSpace, labels, state_space_of, with_more

#: Function that raises an error for excluded motions, given the dynamics and the matrix of actuators or weights.
Check = Callable[[Dynamics, Array], None]


@checked_calls()
@dataclass(frozen=True, repr=False)
class Regulator(NamedAttributes):
    """Feedback u = -G s of the deviations s of all states from the reference of the linear model.

    Attributes
    ----------
    space : the controlled model; sampled if the regulator is. Its inputs are the controlled inputs
    gains : (nu, ns) G
    cost_left : (ns, ns) P, s^T P s is the remaining cost of a motion from s; None of placed eigenvalues
    """

    space: StateSpace
    gains: Array
    cost_left: Array | None = None

    def __iter__(self) -> NoReturn:
        raise not_unpacked(self, "law = ..., and law.gains, law.eigenvalues, law.cost_left")

    def __repr__(self) -> str:
        of = f"{', '.join(self.space.inputs)} from {len(self.space.states)} states"
        return f"<Regulator{self.space.when}: {of}; {self.closed_loop.stability}>"

    def _repr_html_(self) -> str:
        gains = gains_html(self.space, self.gains.T, self.space.inputs)
        of_loop = eigenvalues_html("closed loop", self.closed_loop)
        return page(f"Regulator{self.space.when}: u = -G s", gains, margins_html(self.margins), of_loop)

    def gain(self, input: str, state: str) -> float:
        """Return the gain of one state in one input.

        Parameters
        ----------
        input, state : str
            Names of a controlled input and of a state.

        Returns
        -------
        float
            Unit of the input per unit of the state; minus gain times deviation of the state adds to the input.

        Raises
        ------
        UsageError
            An unknown name.

        Examples
        --------
        >>> from eomgen.control import lqr
        >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
        >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
        >>> law = lqr(eomgen.build(cart.build()).linearize(at="initial"), {"rail": 16.0}, {"push": 1.0})
        >>> round(law.gain("push", "rail"), 6)
        4.0
        """
        for name, known in ((input, self.space.inputs), (state, self.space.states)):
            if name not in known:
                raise UsageError(Problem("gain", f"there is no {name!a} among the gains [E0400]", nearest(name, known)))
        return float(self.gains[self.space.inputs.index(input), self.space.states.index(state)])

    @cached_property
    def closed_loop(self) -> StateSpace:
        """The controlled model under u = -G s. Inputs add to the feedback, which is among the outputs under the inputs'
        names."""
        space = self.space
        fed_back = [name for name in space.inputs if name not in space.outputs]
        rows = [space.inputs.index(name) for name in fed_back]
        return replace(
            space,
            A=space.A - space.B @ self.gains,
            C=np.vstack([space.C - space.D @ self.gains, -self.gains[rows]]),
            D=np.vstack([space.D, np.eye(len(space.inputs))[rows]]),
            F=np.vstack([space.F, np.zeros((len(rows), len(space.disturbances)))]),
            outputs=(*space.outputs, *fed_back),
            **with_more(space, {"outputs": labels(space, "inputs", fed_back)}),
        )

    @property
    def eigenvalues(self) -> Complex:
        """(ns,) of the closed loop; see ``StateSpace.eigenvalues``."""
        return self.closed_loop.eigenvalues

    @cached_property
    def margins(self) -> dict[str, Margins]:
        """Gain, phase, delay and modulus margins at each input, with the other loops closed, by the input's name."""
        return margins_of(self.space.A, self.space.B, self.gains, self.space.inputs, self.space.sample)

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the open loop at each input in the complex plane, with margins, and return the axes of matplotlib.

        Parameters
        ----------
        axes : sequence of matplotlib Axes, optional
            One for each input; a new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One for each input.

        Raises
        ------
        UsageError
            Another number of axes than of inputs.

        Examples
        --------
        >>> from eomgen.control import lqr
        >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
        >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
        >>> law = lqr(eomgen.build(cart.build()).linearize(at="initial"), {"rail": 16.0}, {"push": 1.0})
        >>> len(law.plot())
        1
        """
        return plot_margins(self.margins, axes)


@checked_call()
def lqr(
    space: StateSpace | HasStateSpace,
    Q: Weighted,
    R: Weighted,
    N: ArrayLike | None = None,
    *,
    inputs: Sequence[str] = (),
    sample: float | str | None = None,
    delay: float | str = 0.0,
) -> Regulator:
    """Return the feedback of the whole state that minimises int s^T Q s + 2 s^T N u + u^T R u dt.

    Parameters
    ----------
    space : StateSpace or Linearization
        The linear model; of a sampled model the cost is the sum over samples in place of the integral.
    Q : mapping or array_like
        Weights of the squares of outputs and states by name, including accelerations; or a matrix (ns, ns), or a
        diagonal.
    R : mapping or array_like
        Weights of the squares of inputs by name, or (nu, nu), or a diagonal. Inputs without a name in R are not used;
        rows of the gains are in the order of the names in R.
    N : array_like, optional
        Weights (ns, nu) of products of states and inputs.
    inputs : sequence of str, optional
        The controlled inputs, in the order of rows of the gains, if R has no names; all by default.
    sample : float or str, optional
        Of a sampled regulator: the time for which inputs are held, s, or a text with a unit. The cost remains the
        integral.
    delay : float or str, optional
        Of a sampled regulator: time from a sample to when inputs take effect, s, or a text with a unit; 0 by default.
        Inputs that wait are fed back, too.

    Returns
    -------
    Regulator
        Gains, remaining cost, closed loop and margins.

    Raises
    ------
    UsageError
        Names that there are not, or ``inputs`` other than the names in R; weights that are negative, of other sizes, or
        zero for all that an input does. A model without inputs; a ``sample`` that is not above 0, or for a model that
        is sampled already; a delay that is negative, without ``sample``, or above 1000 samples.
    ModelError
        A motion that does not decay and that no input moves; one that neither grows nor decays and has no cost.
    NumericalError
        No solution of Riccati's equation with a relative residual below 1e-10.

    Examples
    --------
    >>> from eomgen.control import lqr
    >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
    >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
    >>> law = lqr(eomgen.build(cart.build()).linearize(at="initial"), {"rail": 16.0}, {"push": 1.0})
    >>> law.gains.round(6)                             # sqrt(16), and sqrt(2 mass sqrt(16))
    array([[4., 4.]])
    """
    space = state_space_of(space)
    controlled, weights = quadratic_cost(space, Q, R, N, names_of("inputs", "inputs", inputs, "force"))
    if sample is None:
        only_with_sample(delay)
        if space.sample is not None:
            return _sampled_regulator(controlled, weights)
        whitening(weights.effort)  # which has to be positive
        dynamics = Dynamics(controlled.A, controlled.states)
        check_stabilisable(dynamics, controlled.B)
        return Regulator(controlled, *optimal_gains(weights, controlled.B, dynamics, check_weighted))
    joined = np.block([[weights.state, weights.cross], [weights.cross.T, weights.effort]])
    held, spent = sampled_with_cost(controlled, sample, delay, joined)
    ns = len(held.states)
    return _sampled_regulator(held, Weights(spent[:ns, :ns], spent[ns:, ns:], spent[:ns, ns:]))


@checked_call()
def place(
    space: StateSpace | HasStateSpace,
    poles: Sequence[complex],
    *,
    inputs: Sequence[str] = (),
    sample: float | str | None = None,
    delay: float | str = 0.0,
) -> Regulator:
    """Return the feedback of the whole state for which the closed loop has given eigenvalues (SciPy's placement).

    Warns of eigenvalues that grow.

    Parameters
    ----------
    space : StateSpace or Linearization
        The linear model.
    poles : sequence of complex
        Eigenvalues (ns,), complex ones in conjugate pairs, none more often than the number of inputs: 1/s; for a
        sampled ``space`` z = e^(s T); with ``sample`` also 1/s, as many as states of the sampled model, inputs that
        wait included.
    inputs : sequence of str, optional
        The controlled inputs, in the order of rows of the gains; all by default.
    sample : float or str, optional
        Of a sampled regulator: the time for which inputs are held, s, or a text with a unit.
    delay : float or str, optional
        With ``sample``: time from a sample to when inputs take effect, s, or a text; 0 by default.

    Returns
    -------
    Regulator
        Gains, closed loop and margins; no ``cost_left``.

    Raises
    ------
    UsageError
        Poles of another number, without complex conjugates, repeated too often, or not finite. Names that there are
        not, a model without inputs; a ``sample`` that is not above 0, or for a model that is sampled already; a delay
        that is negative, without ``sample``, or above 1000 samples.
    ModelError
        A motion that no input moves, decaying or not.
    NumericalError
        Poles that are not reached to 1e-6 of their size.

    Examples
    --------
    >>> from eomgen.control import place
    >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
    >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
    >>> law = place(eomgen.build(cart.build()).linearize(at="initial"), [-2.0, -3.0])
    >>> law.gains.round(6)                             # mass times 2 * 3, and mass times 2 + 3
    array([[12., 10.]])
    """
    space = state_space_of(space)
    plant = controlled_by(space, names_of("inputs", "inputs", inputs, "force"))
    if sample is None:
        only_with_sample(delay)
    else:
        plant = discretized(plant, sample, delay)
    wanted = pole_array(poles, None if sample is None else plant.sample)
    dynamics = Dynamics(plant.A, plant.states, plant.sample)
    gains = placed_gains(plant.B, wanted, dynamics, check_controllable)
    return Regulator(plant, gains)


def placed_gains(B: Array, wanted: Complex, dynamics: Dynamics, check: Check) -> Array:
    """Return gains G (m, n) that give A - B G the wanted eigenvalues.

    Warns of unstable eigenvalues. Raises UsageError for a wrong number or repetition of eigenvalues, NumericalError if
    they are not reached to 1e-6.

    Parameters
    ----------
    B : (n, m) ndarray
        Input matrix.
    wanted : (n,) complex ndarray
        Eigenvalues in 1/s, or z = e^(s T) for a sampled model.
    dynamics : Dynamics
        A, and the time between two samples.
    check : callable
        Called with dynamics and B; raises an error for motions that B does not reach.
    """
    unstable = wanted.real > 0.0 if dynamics.sample is None else np.abs(wanted) > 1.0
    if np.any(unstable):
        poles = wanted if np.any(wanted.imag) else wanted.real
        growing = ", ".join(f"{pole:.6g}" for pole in poles[unstable])
        where = "with positive real parts" if dynamics.sample is None else "z = e^(s T) outside the unit circle"
        hint = "negative real parts" if dynamics.sample is None else "negative real parts of s"
        note = f"place: poles {where} are asked for, {growing}: such motions grow; try: {hint} [W0030]"
        warnings.warn(note, RuntimeWarning, stacklevel=4)
    A, (n, m) = dynamics.A, B.shape
    check_poles(wanted, n, m)
    check(dynamics, B)
    balanced, scales = balance(A, permute=False)
    sizes, rate = np.diag(scales), dynamics.rate
    gains = pole_gains(balanced / rate, B / sizes[:, np.newaxis] / rate, wanted / rate) / sizes
    check_reached(np.linalg.eigvals(A - B @ gains).astype(complex), wanted, rate)
    return np.asarray(gains, dtype=float)


@solvable()
def optimal_gains(weights: Weights, B: Array, dynamics: Dynamics, check: Check) -> tuple[Array, Array]:
    """Return the optimal gains (m, n) and the matrix P (n, n) of the remaining cost s^T P s, in continuous time.

    Parameters
    ----------
    weights : Weights
        Matrices of the quadratic cost.
    B : (n, m) ndarray
        Input matrix.
    dynamics : Dynamics
        A of the model in continuous time.
    check : callable
        Called with the dynamics without cross terms and a root of the cost; raises an error for motions without cost.
        ``check_stabilisable`` is left to the caller.
    """
    A = dynamics.A
    half = whitening(weights.effort)
    balanced, scales = balance(A, permute=False)
    T = np.diag(scales)
    rate = float(np.linalg.norm(balanced, 2)) or 1.0
    b = B / T[:, np.newaxis] @ half / rate
    cross = T[:, np.newaxis] * (weights.cross @ half)
    a = balanced / rate - b @ cross.T
    cost, root = without_cross_terms(T[:, np.newaxis] * weights.state * T, cross)
    check(replace(dynamics, A=A - B @ half @ (cross.T / T), scales=T), root / T)
    P = solution(a, b, cost)
    gains = half @ (b.T @ P + cross.T) / T
    return gains, P / np.outer(T, T) / rate


@solvable()
def _sampled_regulator(space: StateSpace, weights: Weights) -> Regulator:
    dynamics = Dynamics(space.A, space.states, space.sample)
    check_stabilisable(dynamics, space.B)
    joined = np.block([[weights.state, weights.cross], [weights.cross.T, weights.effort]])
    values, vectors = np.linalg.eigh((joined + joined.T) / 2.0)
    root = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    free, (root, effort) = dynamics, np.split(root, [len(space.states)], axis=1)
    if np.any(effort):  # action of optimal inputs alone
        of_state = np.linalg.lstsq(effort, root, rcond=1e-10)[0]
        scales = np.diag(balance(space.A, permute=False)[1])
        free = replace(dynamics, A=space.A - space.B @ of_state, scales=scales)
        root = root - effort @ of_state
    check_weighted(free, root)
    P, gains = sampled_solution(space.A, space.B, weights.state, weights.effort, weights.cross)
    return Regulator(space, gains, P)


def only_with_sample(delay: float | str) -> None:
    """Raise UsageError for a delay of a model without samples."""
    if delay != 0.0:
        fault = "a delay is given, and no time between two samples [E0408]"
        hint = 'sample="1 ms"; in continuous time an actuator or a filter with a lag'
        raise UsageError(Problem("delay", fault, hint))
