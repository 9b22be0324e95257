"""Observers of the whole state of a linear model: the Kalman-Bucy filter; sampled, the Kalman filter.

sdot = A s + B u + G w, y = C s + D u + F w + n with white noise w and n; the estimate follows e' = A e + B u + L (y -
C e - D u). Sampled, the estimate predicted from the sample before is corrected by M (y - C e - D u). (B. D. O.
Anderson and J. B. Moore, Optimal Filtering, 1979.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NoReturn

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import checked_call, checked_calls, names_of, not_unpacked
from eomgen.base.data import dataclass, replace
from eomgen.base.html import page
from eomgen.base.messages import nearest, shown
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.linear.control.controllability import Dynamics, check_detectable, check_driven, check_observable
from eomgen.products.linear.control.notebook import deviations_html, eigenvalues_html, gains_html
from eomgen.products.linear.control.pole_placement import pole_array
from eomgen.products.linear.control.regulator import only_with_sample, optimal_gains, placed_gains
from eomgen.products.linear.control.riccati_equation import sampled_solution, without_cross_terms
from eomgen.products.linear.control.weights import Weighted, Weights, controlled_by, number, row_of, weight
from eomgen.products.linear.sampling import discretized, noise_over_a_sample
from eomgen.products.linear.state_space import HasStateSpace, StateSpace, linear_model_name, state_space_of


@checked_calls()
@dataclass(frozen=True, repr=False)
class Observer:
    """An estimate of the whole state from measurements.

    Attributes
    ----------
    space : the observed model; sampled if the observer is
    measured : names of outputs, or of states
    gains : (ns, number of measured) L; of a sampled observer M
    covariance : (ns, ns) of the error of the estimate, sampled right after a measurement; None of placed eigenvalues
    """

    space: StateSpace
    measured: tuple[str, ...]
    gains: Array
    covariance: Array | None = None

    def __iter__(self) -> NoReturn:
        raise not_unpacked(self, "observer = ..., and observer.gains, observer.covariance, observer.error.eigenvalues")

    def __repr__(self) -> str:
        decay = f"the slowest error decays at {self.error.decay:.4g} 1/s"
        return f"<Observer{self.space.when}: {len(self.space.states)} states from {', '.join(self.measured)}; {decay}>"

    def _repr_html_(self) -> str:
        gains = gains_html(self.space, self.gains, self.measured)
        deviations = deviations_html(self.space, self.deviations)
        return page(f"Observer{self.space.when}", gains, deviations, eigenvalues_html("error", self.error))

    @cached_property
    def C(self) -> Array:
        """(number of measured, ns) output matrix of the measurements."""
        return np.array([row_of(self.space, name)[0] for name in self.measured])

    @cached_property
    def D(self) -> Array:
        """(number of measured, nu) feedthrough matrix of the measurements."""
        return np.array([row_of(self.space, name)[1] for name in self.measured])

    @cached_property
    def error(self) -> StateSpace:
        """How the error of the estimate moves, without noise."""
        space, nothing = self.space, np.zeros((len(self.space.states), 0))
        correction = self.gains if space.sample is None else space.A @ self.gains
        A, none = space.A - correction @ self.C, np.zeros((0, 0))
        return StateSpace(A, nothing, nothing, nothing.T, none, none, space.states, (), (), (), sample=space.sample)

    @property
    def eigenvalues(self) -> Complex:
        """(ns,) of the error; see ``StateSpace.eigenvalues``."""
        return self.error.eigenvalues

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the errors of estimated states, by name of the state, in its unit; for a sampled
        observer right after a measurement. An empty dict for placed eigenvalues."""
        if self.covariance is None:
            return {}
        return dict(zip(self.space.states, np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist(), strict=True))


@checked_call()
def kalman(
    space: StateSpace | HasStateSpace,
    noise: Weighted,
    measurement_noise: Mapping[str, float],
    *,
    inputs: Sequence[str] = (),
    sample: float | str | None = None,
    delay: float | str = 0.0,
) -> Observer:
    """Return the observer with the least error in the mean square.

    Parameters
    ----------
    space : StateSpace or Linearization
        The linear model.
    noise : mapping or array_like
        Intensities of white noise by disturbance, input or state, zero for others: two-sided spectral densities, unit^2
        s, half of the one-sided ones per Hz. Or a matrix (nw, nw) of intensities, or its diagonal, over the
        disturbances, then the inputs that the observer does not know. If ``space`` is sampled already: variances of
        values held over a sample.
    measurement_noise : mapping
        Measurements, outputs or states by name, and the intensity of the noise of each; of a sampled observer the
        variance of the error of each sample.
    inputs : sequence of str, optional
        Inputs known to the observer; all by default. Other inputs become disturbances.
    sample : float or str, optional
        Of a sampled observer: the time between two measurements, s, or a text with a unit. By default the observer is
        continuous or sampled as ``space`` is.
    delay : float or str, optional
        With ``sample``: time from a sample to when inputs take effect, s, or a text with a unit; 0 by default. Refused
        without ``sample``.

    Returns
    -------
    Observer
        Gains, covariance of the error, the observed model as ``space``, and the motion of the error as ``error``.

    Raises
    ------
    UsageError
        Unknown names, negative intensities, or measurements without noise. For a sampled observer, measurements that
        contain white noise or follow an input at once; a ``sample`` that is not above 0 or for a model that is sampled
        already, a delay that is negative or above 1000 samples.
    ModelError
        A motion that does not decay and is unobservable; one that neither grows nor decays without noise.
    NumericalError
        No solution of Riccati's equation with a relative residual below 1e-10.

    Examples
    --------
    >>> from eomgen.control import kalman
    >>> car = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0)
    >>> seen = kalman(car, {"road": 1e-4}, {"suspension_travel": 1e-8})
    >>> seen.measured, seen.gains.shape
    (('suspension_travel',), (4, 1))
    """
    known = _with_known_inputs(state_space_of(space), inputs)
    measured, V = _measurement_noise(known, measurement_noise)
    G, F, W = _noise(known, noise, measured)
    if sample is None:
        only_with_sample(delay)
        joined, cross, V = G @ W @ G.T, G @ W @ F.T, V + F @ W @ F.T
    else:
        held = discretized(known, sample, delay)
        _refuse_white_measurements(measured, F, W)
        added = noise_over_a_sample(known.A, G @ W @ G.T, float(held.sample or 0.0))
        joined = np.pad(added, (0, len(held.states) - len(known.states)))
        known, cross = held, np.zeros((len(joined), len(measured)))
    observer = _without_gains(known, measured)
    dynamics = Dynamics(known.A, known.states, known.sample)
    check_detectable(dynamics, observer.C, measured)
    if known.sample is None:
        dual = replace(dynamics, A=known.A.T)
        gains, P = optimal_gains(Weights(joined, V, cross), observer.C.T, dual, check_driven)
        return replace(observer, gains=gains.T, covariance=P)
    if np.any(cross):
        _refuse_white_measurements(measured, F, W)
    _, root = without_cross_terms(joined, np.zeros((len(joined), 0)))
    check_driven(replace(dynamics, A=known.A.T), root)
    before, _ = sampled_solution(known.A.T, observer.C.T, joined, V, np.zeros_like(cross))
    spread = observer.C @ before @ observer.C.T + V
    M = np.asarray(np.linalg.solve(spread, observer.C @ before).T, dtype=float)
    left = np.eye(len(before)) - M @ observer.C
    return replace(observer, gains=M, covariance=left @ before @ left.T + M @ V @ M.T)


@checked_call()
def place_observer(
    space: StateSpace | HasStateSpace,
    poles: Sequence[complex],
    measured: Sequence[str],
    *,
    inputs: Sequence[str] = (),
    sample: float | str | None = None,
    delay: float | str = 0.0,
) -> Observer:
    """Return the observer with given eigenvalues of the error of the estimate.

    Warns of eigenvalues that grow.

    Parameters
    ----------
    space : StateSpace or Linearization
        The linear model.
    poles : sequence of complex
        Eigenvalues (ns,) of the error, complex ones in conjugate pairs, none more often than the number of measured
        signals: 1/s, also with ``sample``; z = e^(s T) if ``space`` is sampled already.
    measured : sequence of str
        Names of outputs or states.
    inputs : sequence of str, optional
        Inputs known to the observer; all by default.
    sample : float or str, optional
        Of a sampled observer: the time between two measurements, s, or a text with a unit. By default the observer is
        continuous or sampled as ``space`` is.
    delay : float or str, optional
        With ``sample``: time from a sample to when inputs take effect, s, or a text; above 0 a ModelError is raised.
        Refused without ``sample``.

    Returns
    -------
    Observer
        Gains, the observed model as ``space``, and the motion of the error as ``error``; no covariance.

    Raises
    ------
    UsageError
        Names that there are not; poles of another number, without complex conjugates, repeated too often, or not
        finite; a sampled measurement that follows an input at once; a ``sample`` that is not above 0 or for a model
        that is sampled already, a delay that is negative or above 1000 samples.
    ModelError
        An unobservable motion, or a sampled model with delays of inputs.
    NumericalError
        Poles that are not reached to 1e-6 of their size.

    Examples
    --------
    >>> from eomgen.control import place_observer
    >>> cart = eomgen.SceneBuilder("cart").input("push", unit="N").body("cart", 2.0)
    >>> cart = cart.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).effort("push", "rail", "push")
    >>> seen = place_observer(eomgen.build(cart.build()).linearize(at="initial"), [-2.0, -3.0], ["rail"])
    >>> seen.gains.round(6).ravel()                    # 2 + 3, and 2 * 3
    array([5., 6.])
    """
    known = _with_known_inputs(state_space_of(space), inputs)
    if sample is None:
        only_with_sample(delay)
    else:
        known = discretized(known, sample, delay)
    if known.waiting:
        fault = f"{', '.join(known.waiting)} are inputs of samples before, and errors of these cannot be placed [E2242]"
        raise ModelError(Problem("place_observer", fault, "kalman, or no delay"))
    wanted = pole_array(poles, None if sample is None else known.sample)
    names = names_of("measured", "signals", measured, "angle")
    observer = _without_gains(known, names)
    # sampled: A M corrects the prediction, so C A stands for C
    C = observer.C if known.sample is None else observer.C @ known.A
    gains = placed_gains(C.T, wanted, Dynamics(known.A.T, known.states, known.sample), check_observable).T
    return replace(observer, gains=gains)


def _with_known_inputs(space: StateSpace, names: Sequence[str]) -> StateSpace:
    """Return the model whose inputs of these names are known, all without names. Raises UsageError for other names."""
    if not (space.inputs or np.size(names)):
        return space
    return controlled_by(space, names_of("inputs", "inputs", names, "force"))


def _without_gains(space: StateSpace, measured: tuple[str, ...]) -> Observer:
    """Return an observer of a model from the measured signals, with gains of zero that are still to be computed. Raises
    UsageError if a sample depends on the input of the same sample: an input with direct feedthrough."""
    observer = Observer(space, measured, np.zeros((len(space.states), len(measured))))
    if space.sample is not None and np.any(observer.D):
        name = measured[int(np.argwhere(np.any(observer.D, axis=1))[0, 0])]
        fault = f"{name} depends on an input at the same instant, and the input follows from measured signals [E0384]"
        raise UsageError(Problem("measured", fault, "a delay of the inputs, or another signal"))
    return observer


def _measurement_noise(space: StateSpace, noise: Mapping[str, float]) -> tuple[tuple[str, ...], Array]:
    """Return the names of the measurements, and the diagonal matrix (ny, ny) of the intensities of their noise. `noise`
    maps names of outputs or states to intensities. Raises UsageError if it is empty, or for an unknown name or an
    intensity that is not positive."""
    if not isinstance(noise, Mapping) or not noise:
        fault = "no measured signal is named [E0385]"
        raise UsageError(Problem("measurement_noise", fault, '{"angle": 1e-6}, an output or a state each'))
    for name, value in noise.items():
        row_of(space, name)
        if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating) or not value > 0.0:
            fault = f"the noise of {name} is {shown(value)}, so its signal would be taken for exact [E0386]"
            raise UsageError(Problem("measurement_noise", fault, "a number above zero"))
    names = tuple(linear_model_name(name, (*space.outputs, *space.states)) for name in noise)
    return names, np.diag(np.array(list(noise.values()), dtype=float))


def _noise(space: StateSpace, noise: Weighted, measured: Sequence[str]) -> tuple[Array, Array, Array]:
    """Return the noise matrices of the states (ns, nw) and measurements (ny, nw), and the intensity (nw, nw). `noise`
    maps disturbances, inputs or states to intensities, or is a matrix over all disturbances. Raises UsageError for an
    unknown name or an unsuitable intensity."""
    ns, outputs = len(space.states), [name for name in measured if name in space.outputs]
    into = {name: (space.E[:, k], space.F[:, k]) for k, name in enumerate(space.disturbances)}
    if not isinstance(noise, Mapping):
        names: Sequence[str] = space.disturbances
        W = weight("the noise", noise, len(names))
    else:
        into |= {name: (space.B[:, k], space.D[:, k]) for k, name in enumerate(space.inputs)}
        units = zip(space.states, np.eye(ns), strict=True)
        into = {name: (unit, np.zeros(len(space.outputs))) for name, unit in units} | into
        noise = {linear_model_name(name, tuple(into)): value for name, value in noise.items()}
        names = tuple(noise)
        for name in names:
            if name not in into:
                fault = f"there is no disturbance, input or state {shown(name)} [E0387]"
                raise UsageError(Problem("noise", fault, nearest(str(name), tuple(into))))
        W = np.diag([number("noise", name, noise[name]) for name in names])
    G, F = np.zeros((ns, len(names))), np.zeros((len(measured), len(names)))
    for column, name in enumerate(names):
        G[:, column], of_outputs = into[name]
        for row, output in enumerate(measured):
            if output in outputs:
                F[row, column] = of_outputs[space.outputs.index(output)]
    return G, F, W


def _refuse_white_measurements(measured: Sequence[str], F: Array, W: Array) -> None:
    """Raise UsageError if a measured signal contains white noise that drives the model."""
    for name, row in zip(measured, F @ W, strict=True):
        if np.any(row):
            fault = f"{name} contains white noise itself, and its value at a sample would be infinite [E0388]"
            hint = "a shaping filter between the noise and the model, or another signal"
            raise UsageError(Problem("kalman", fault, hint))
