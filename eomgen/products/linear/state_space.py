"""State space of a linearised mechanical system with constraints and internal states.

sdot = A s + B u + E w,   y = C s + D u + F w,   s = (x, y, z): independent coordinates, velocities, internal states;
sampled: s[k+1] = A s[k] + B u[k] + E w[k], inputs and disturbances held from sample to sample
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Protocol, TypedDict

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import NamedAttributes, checked_calls
from eomgen.base.data import dataclass, field
from eomgen.base.html import page, table
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.linear.eigenvalues import eigenvalues_of_parts, verdict
from eomgen.products.linear.freedom import Freedom, Partials, times

#: Kinds of signals of a linear model.
KINDS = ("states", "inputs", "disturbances", "outputs")


@checked_calls()
@dataclass(frozen=True, repr=False)
class StateSpace(NamedAttributes):
    """A linear model of first order, in continuous time or sampled.

    Attributes
    ----------
    A : (ns, ns), B : (ns, nu), E : (ns, nw), C : (ny, ns), D : (ny, nu), F : (ny, nw)
    states : ``hinge``, ``ball[2]``: coordinates, left-trivialised; ``v.hinge``: velocities; ``z.name``: internal states
    inputs, disturbances, outputs : names of u, w, y
    units : for ``states``, ``inputs``, ``disturbances``, ``outputs`` the units of each, empty if unknown
    references : values of the same signals at the reference of the linear model; changes count from there. Not a number
        if one is not known
    sample : time between two samples, s; None in continuous time
    input_delay : of a sampled model, from a sample to when inputs take effect, s
    waiting : the states that are inputs of samples before, each with the input and how many samples
    orientations : of joints with rotation groups, q at the reference of the linear model: quaternion (w, x, y, z), and
        then a position
    """

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    references: Mapping[str, Array] = field(default_factory=dict)
    sample: float | None = None
    input_delay: float = 0.0
    waiting: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    orientations: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def __repr__(self) -> str:
        sizes = ((len(getattr(self, kind)), kind) for kind in KINDS)
        counts = ", ".join(f"{size} {kind[:-1] if size == 1 else kind}" for size, kind in sizes)
        return f"<StateSpace{self.when}: {counts}; {self.stability}>"

    def _repr_html_(self) -> str:
        rows = [
            (f"{letter}[{k}]", name, self.unit(kind, name), kind[:-1])
            for kind, letter in zip(KINDS, "suwy", strict=True)
            for k, name in enumerate(getattr(self, kind))
        ]
        return page(f"State space{self.when}, {self.stability}", table(("", "name", "unit", "is"), rows))

    @property
    def when(self) -> str:
        """``, sampled every 0.001 s``; empty in continuous time."""
        return "" if self.sample is None else f", sampled every {self.sample:.6g} s"

    def unit(self, kind: str, name: str) -> str:
        """Return the unit of one of the ``states``, ``inputs``, ``disturbances`` or ``outputs``.

        Parameters
        ----------
        kind : str
            ``states``, ``inputs``, ``disturbances`` or ``outputs``.
        name : str
            Name of the signal.

        Returns
        -------
        str
            Unit, empty if unknown.

        Raises
        ------
        UsageError
            A kind that there is not, or a name that the model does not have.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> space.unit("outputs", "body_acceleration")
        'm/s^2'
        """
        index, units = self._place("unit", kind, name), self.units.get(kind)
        return units[index] if units else ""

    def reference(self, kind: str, name: str) -> float:
        """Return a signal of a kind at the reference of the model; not a number if unknown.

        Parameters
        ----------
        kind : str
            ``states``, ``inputs``, ``disturbances`` or ``outputs``.
        name : str
            Name of the signal.

        Returns
        -------
        float
            In the signal's unit.

        Raises
        ------
        UsageError
            A kind that there is not, or a name that the model does not have.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> abs(space.reference("outputs", "suspension_travel")) < 1e-12
        True
        """
        index, references = self._place("reference", kind, name), self.references.get(kind)
        return np.nan if references is None else float(references[index])

    def _place(self, call: str, kind: str, name: str) -> int:
        if kind not in KINDS:
            raise UsageError(Problem(call, f"there is no kind {shown(kind)} of signals [E2241]", nearest(kind, KINDS)))
        return _number(kind[:-1], name, getattr(self, kind), call)

    @cached_property
    def _spectrum(self) -> tuple[Complex, Array]:
        return eigenvalues_of_parts(self.A)

    @cached_property
    def eigenvalues(self) -> Complex:
        """(ns,) eigenvalues of A, slow ones first: 1/s; sampled e^(s T), without unit."""
        values, _ = self._spectrum
        slowness = np.abs(values) if self.sample is None else -np.abs(values)
        return np.asarray(values[np.lexsort((values.imag, np.round(slowness, 12)))])

    @property
    def decay(self) -> float:
        """Rate at which the slowest motion decays, 1/s; negative if a motion grows, infinite without states."""
        if not len(self.A):
            return np.inf
        if self.sample is None:
            return -float(np.max(self.eigenvalues.real))
        with np.errstate(divide="ignore"):
            return -float(np.log(np.max(np.abs(self.eigenvalues)))) / self.sample

    @property
    def stability(self) -> str:
        """``stable`` if all motions decay, ``unstable`` if a motion grows, else ``marginal``.

        Growth within the rounding errors of the eigenvalues counts as zero, as in ``Modes``: also of a free motion,
        whose double eigenvalue is split. Gains between states that do not act back make no such errors. Of a sampled
        model growth up to 1e-9 per sample counts as zero, too. Without states ``stable``.
        """
        values, bounds = self._spectrum
        if self.sample is None:
            return verdict(values.real, bounds)
        return verdict(np.abs(values) - 1.0, np.maximum(bounds, COMPUTED))

    def frequency_response(self, omega: ArrayLike, input: str, output: str) -> Complex:
        """Return the complex response of an output to an input at angular frequencies.

        Parameters
        ----------
        omega : array_like
            Angular frequencies (...), rad/s; of a sampled model the response from sample to sample.
        input : str
            Name of an input or of a disturbance.
        output : str
            Name of an output of the scene (``name[k]`` for an output of several components), or of a state.

        Returns
        -------
        (...) complex ndarray
            The output is response e^(i omega t) for the input e^(i omega t).

        Raises
        ------
        UsageError
            An unknown input or output; the message names the known inputs and outputs.
        NumericalError
            A frequency equal to an undamped mode's, to machine precision.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> abs(space.frequency_response(2 * np.pi * np.array([1.2, 10.0]), "road", "body_acceleration")).round(1)
        array([148.8, 613.6])
        """
        return self.frequency_responses(omega, [input], [output])[..., 0, 0]

    def frequency_responses(self, omega: ArrayLike, inputs: Sequence[str], outputs: Sequence[str]) -> Complex:
        """Return the complex responses of several outputs to several inputs at angular frequencies.

        Names and errors as in ``frequency_response``.

        Parameters
        ----------
        omega : array_like
            Angular frequencies (...), rad/s; of a sampled model the response from sample to sample.
        inputs : sequence of str
            Names of inputs or disturbances.
        outputs : sequence of str
            Names of outputs or states.

        Returns
        -------
        (..., outputs, inputs) complex ndarray
            The output is response e^(i omega t) for the input e^(i omega t); unit of the output per unit of the input.

        Raises
        ------
        UsageError
            An unknown input or output, or a text as ``omega``.
        NumericalError
            A frequency equal to an undamped mode's, to machine precision; zero for a motion without stiffness.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> space.frequency_responses([1.0, 2.0, 3.0], ["road"], ["body", "wheel"]).shape
        (3, 2, 1)
        """
        if isinstance(omega, str):
            fault = f"the first argument omega is an array in rad/s, and {shown(omega)} is not [E0482]"
            hint = "frequency_response(omega, input, output)"
            raise UsageError(Problem("frequency response", fault, hint))
        entering, direct = self.input_columns(inputs, outputs)
        left = self.output_rows(outputs)
        frequencies = np.asarray(omega, dtype=float)
        points = 1j * frequencies if self.sample is None else np.exp(1j * frequencies * self.sample)
        pencils = points[..., np.newaxis, np.newaxis] * np.eye(len(self.states)) - self.A
        try:
            states = np.linalg.solve(pencils, entering.astype(complex))
        except np.linalg.LinAlgError:
            fault = "a frequency is equal to the frequency of an undamped mode, whose response has no bound [E0483]"
            raise NumericalError(Problem("frequency response", fault, "other frequencies, or damping")) from None
        return np.asarray(left @ states + direct, dtype=complex)

    def output_rows(self, outputs: Sequence[str]) -> Array:
        """Return the rows of C of outputs, and of the unit matrix for states that are not outputs by name.

        Parameters
        ----------
        outputs : sequence of str
            Names of outputs or states.

        Returns
        -------
        (outputs, ns) ndarray
            One row for each name, in the order of ``outputs``.

        Raises
        ------
        UsageError
            A name that is neither an output nor a state.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> space.output_rows(["v.body"])
        array([[0., 0., 0., 1.]])
        """
        every = np.concatenate([self.C, np.eye(len(self.states))])
        return np.asarray(every[self._output_numbers(outputs)])

    def input_columns(self, inputs: Sequence[str], outputs: Sequence[str]) -> tuple[Array, Array]:
        """Return the columns of B and E, and the direct gains to outputs, of some inputs.

        Parameters
        ----------
        inputs : sequence of str
            Names of inputs or disturbances.
        outputs : sequence of str
            Names of outputs or states.

        Returns
        -------
        columns : (ns, inputs) ndarray
            Columns of B or E.
        gains : (outputs, inputs) ndarray
            Entries of D or F; zero for states.

        Raises
        ------
        UsageError
            An unknown input or output.

        Examples
        --------
        >>> space = eomgen.build("examples/quarter_car/scene.toml").linearize(t=30.0).state_space()
        >>> columns, gains = space.input_columns(["road"], ["tyre_load"])
        >>> columns.shape, gains.round(0)                  # the load follows the road by the tyre's stiffness
        ((4, 1), array([[160000.]]))
        """
        columns = [_number("input or disturbance", name, (*self.inputs, *self.disturbances)) for name in inputs]
        rows = self._output_numbers(outputs)
        direct = np.concatenate([self.D, self.F], axis=1)
        direct = np.concatenate([direct, np.zeros((len(self.states), direct.shape[1]))])
        return np.concatenate([self.B, self.E], axis=1)[:, columns], direct[np.ix_(rows, columns)]

    def _output_numbers(self, outputs: Sequence[str]) -> list[int]:
        known = (*self.outputs, *self.states)
        return [_number("output or state", linear_model_name(name, known), known) for name in outputs]


class SignalLabels(TypedDict):
    """Units and references of signals by kind, as of a ``StateSpace``."""

    units: dict[str, tuple[str, ...]]
    references: dict[str, Array]


def labels(space: StateSpace, kind: str, names: Sequence[str] | None = None) -> list[tuple[str, float]]:
    """Return (unit, reference) by name of a signal, by default for all signals of a kind."""
    chosen = getattr(space, kind) if names is None else names
    return [(space.unit(kind, name), space.reference(kind, name)) for name in chosen]


def signal_labels(signals: Mapping[str, Sequence[tuple[str, float]]]) -> SignalLabels:
    """Return units and references by kind from the (unit, reference) pairs of signals of all kinds."""
    units = {kind: tuple(unit for unit, _ in signals[kind]) for kind in KINDS}
    references = {kind: np.array([value for _, value in signals[kind]], dtype=float) for kind in KINDS}
    return {"units": units, "references": references}


def with_more(space: StateSpace, more: Mapping[str, Sequence[tuple[str, float]]]) -> SignalLabels:
    """Return units and references of a model's signals by kind, with the (unit, reference) pairs in `more` appended."""
    return signal_labels({kind: [*labels(space, kind), *more.get(kind, ())] for kind in KINDS})


class HasStateSpace(Protocol):
    """A model that has one of first order, as a linearization does."""

    def state_space(self) -> StateSpace: ...


def state_space_of(model: StateSpace | HasStateSpace) -> StateSpace:
    """Return a StateSpace unchanged, and the state space of a linearization. Raises UsageError for anything else."""
    if isinstance(model, StateSpace):
        return model
    if not hasattr(model, "state_space"):
        fault = f"a linear model is needed, not {type(model).__name__} [E0484]"
        raise UsageError(Problem("space", fault, "model.linearize(), or its state_space()"))
    return model.state_space()


@dataclass(frozen=True)
class FirstOrderForm:
    """The matrices of a StateSpace, and the map from its state to all coordinates: dq = R_all s, (nv, ns)."""

    A: Array
    B: Array
    E: Array
    C: Array
    D: Array
    F: Array
    R_all: Array


def first_order(partials: Partials, free: Freedom, velocities: Sequence[str]) -> FirstOrderForm:
    """Return the state-space matrices of the linearised equations, with constraints projected out.

    The acceleration is found with the projected inertia matrix, and outputs that depend on accelerations and
    multipliers have these inserted.

    Parameters
    ----------
    partials : derivatives of the equations before constraints are projected out
    free : motions left free by the constraints
    velocities : names of the independent velocities, for messages

    Raises
    ------
    ModelError
        The inertia matrix is singular along a free direction, named in the message.
    """
    p = partials
    sizes = [len(free.coordinates), len(free.velocities), len(p.Fz), p.B.shape[1], p.E.shape[1]]
    ends = np.cumsum(sizes)
    parts_of_state = [slice(int(end) - size, int(end)) for end, size in zip(ends, sizes, strict=True)]
    x, y, z, u, w = parts_of_state
    every = int(ends[-1])

    def over(rows: int, *parts: tuple[slice, Array]) -> Array:
        """Return a matrix over the columns (x, y, z, u, w)."""
        result = np.zeros((rows, every))
        for columns, part in parts:
            result[:, columns] = part
        return result

    nv = len(p.M)
    dq, dv = over(nv, (x, free.R)), over(nv, (x, free.T), (y, free.S))
    drift = over(nv, (x, free.V), (y, free.U))
    forces = over(nv, (u, p.B), (w, p.E), (z, -p.Rz)) - times(p.C, dv) - times(p.K, dq)
    mass = times(free.S.T, times(p.M, free.S))
    ydot = _solve(mass, times(free.S.T, forces - times(p.M, drift)), velocities)
    da = times(free.S, ydot) + drift
    zdot = over(sizes[2], (z, p.Fz), (u, p.Fu), (w, p.Fw)) + times(p.Fq, dq) + times(p.Fv, dv)
    xdot = over(sizes[0], (x, free.W), (y, free.N))
    rates = np.concatenate([xdot, ydot, zdot])
    out = over(len(p.Yq), (z, p.Yz), (u, p.Yu), (w, p.Yw)) + times(p.Yq, dq) + times(p.Yv, dv) + times(p.Ya, da)
    if np.any(p.Ylam):
        out += p.Ylam @ np.linalg.lstsq(p.J.T, forces - times(p.M, da), rcond=None)[0]
    s = slice(0, int(ends[2]))
    return FirstOrderForm(rates[:, s], rates[:, u], rates[:, w], out[:, s], out[:, u], out[:, w], dq[:, s])


def linear_model_name(name: str, known: Sequence[str]) -> str:
    """Return the spelling of a name in linear models: positions without the ``q.`` of solutions and formulas, internal
    states with ``z.``, other names unchanged."""
    if name in known or not isinstance(name, str):
        return name
    return next((spelling for spelling in (name.removeprefix("q."), f"z.{name}") if spelling in known), name)


def _number(kind: str, name: str, known: Sequence[str], call: str = "frequency response") -> int:
    """Return the index of a name among the known names. Raises UsageError with the nearest names; `kind` names the
    signal and `call` the method."""
    if name in known:
        return known.index(name)
    missing = "" if known else f": the linear model has no {kind}"
    fault = f"there is no {kind} {ascii(name)[:64]}{missing} [E0433]"
    raise UsageError(Problem(call, fault, nearest(str(name)[:64], known)))


def _solve(M: Array, right: Array, names: Sequence[str]) -> Array:
    """Return M^-1 right. Raises ModelError naming the directions without inertia."""
    if not len(M):
        return right
    if has_diagonal_inertia(M, names):
        return right / np.diagonal(M)[:, np.newaxis]
    return np.asarray(scipy.linalg.solve(M, right, assume_a="pos"))


def has_diagonal_inertia(M: Array, names: Sequence[str]) -> bool:
    """Return whether an inertia matrix is diagonal, as of free bodies. Raises ModelError naming the directions without
    inertia."""
    diagonal = np.diagonal(M)
    alone = np.count_nonzero(M) == np.count_nonzero(diagonal)
    if alone and np.min(diagonal) > 1e-14 * np.max(diagonal):
        return True
    values, vectors = np.linalg.eigh(0.5 * (M + M.T))
    if values[0] <= 1e-14 * values[-1]:
        direction = np.abs(vectors[:, 0])
        along = ", ".join(name for name, size in zip(names, direction, strict=True) if size > 0.1 * np.max(direction))
        fault = f"the inertia matrix is singular along {along}, so there is no linear model of second order [E0486]"
        raise ModelError(Problem("linearization", fault, "mass or inertia for motion along it"))
    return False
