"""Linearization: the linear model of a mechanical system about a state, of second and first order, modal, by frequency.

    M0 x'' + C0 x' + K0 x + Z0 z = B0 u + E0 w

x are small changes of independent coordinates, left-trivialised; constraints are projected out (Lieh 1994; on groups
and about moving references see ``linear.freedom``). Explicit dependence on time is frozen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import NamedAttributes, checked_calls
from eomgen.base.data import dataclass, field
from eomgen.base.html import page, paragraph
from eomgen.base.rounding import COMPUTED
from eomgen.base.threads import one_thread_of_algebra
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.linear.freedom import Freedom, Partials
from eomgen.products.linear.modes import Modes, modes
from eomgen.products.linear.multiblade import Multiblade
from eomgen.products.linear.plots import plot_response
from eomgen.products.linear.random_response import densities, root_mean_squares, white_noise_road
from eomgen.products.linear.sampling import SampledPart, over_a_period
from eomgen.products.linear.second_order_modes import MANY, second_order_modes
from eomgen.products.linear.spectra import (
    Excitation,
    PowerSpectrum,
    RideTable,
    RoadExcitation,
    check_excitation,
    check_weighted,
)
from eomgen.products.linear.spectra.road import check_frequencies
from eomgen.products.linear.state_space import (
    KINDS,
    FirstOrderForm,
    StateSpace,
    first_order,
    has_diagonal_inertia,
    labels,
    linear_model_name,
    signal_labels,
)


@dataclass(frozen=True)
class Reference:
    """The state about which a model is linear: t in s, q (nq,), v and a (nv,), z (nz,), u (nu,), multipliers (rows,).

    ``what`` is the kind of reference: ``equilibrium``, ``steady motion``, ``initial state``, ``given state``.
    """

    t: float
    q: Array
    v: Array
    a: Array
    z: Array
    u: Array
    multipliers: Array
    what: str

    def __repr__(self) -> str:
        return f"<Reference: {self.what} at t = {self.t:.6g} s>"


@dataclass(frozen=True)
class LinearNames:
    """Names of the components of v (without the letter), and of internal states, inputs, disturbances and outputs.

    ``measured`` are the candidates of independent coordinates: the components, or coordinates of joints between
    absolute bodies. ``units_by_kind`` and ``references``, as of a ``StateSpace``, belong to ``measured``, the rates of
    ``measured`` under ``velocities``, ``states``, ``inputs``, ``disturbances`` and ``outputs``. ``orientations``: as of
    a ``StateSpace``.
    """

    components: tuple[str, ...]
    measured: tuple[str, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]
    units_by_kind: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    references: Mapping[str, Array] = field(default_factory=dict)
    orientations: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def units(self) -> dict[str, str]:
        """Units of inputs, outputs and states by name; empty if unknown."""
        states = tuple(f"z.{name}" for name in self.states)
        kinds = {"velocities": tuple(f"v.{name}" for name in self.measured), "states": states}
        kinds |= {kind: getattr(self, kind) for kind in ("measured", "inputs", "disturbances", "outputs")}
        return {
            name: unit
            for kind, names in kinds.items()
            for name, unit in zip(names, self.units_by_kind.get(kind, ()), strict=False)
        }


@checked_calls()
@dataclass(frozen=True)
class Linearization(NamedAttributes):
    """A linear model.

    Attributes
    ----------
    reference : Reference
    partials : Partials, before constraints are projected out
    free : Freedom, the motions left free by constraints
    names : LinearNames
    sampled : SampledPart of a scene with sampled states, which are inputs of the other matrices; None without sampled
        states
    multiblade : Multiblade, the coordinates of equal blades with the remaining change over azimuths; None without them
    """

    reference: Reference
    partials: Partials
    free: Freedom
    names: LinearNames
    sampled: SampledPart | None = None
    multiblade: Multiblade | None = None

    def __repr__(self) -> str:
        about = f"{self.reference.what} at t = {self.reference.t:.6g} s"
        return f"<Linearization about the {about}: {', '.join(self.coordinates)}>"

    def _repr_html_(self) -> str:
        free = f"coordinates: {', '.join(self.coordinates)}" if self.coordinates else "no coordinates are free"
        heading = f"Linear model about the {self.reference.what} at t = {self.reference.t:.6g} s"
        return page(heading, paragraph(free), self.modes()._repr_html_())

    # -- second order --------------------------------------------------------------------------------------------------

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the independent coordinates x: ``hinge``, ``ball[2]``."""
        return tuple(self.names.measured[k] for k in self.free.coordinates)

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of the independent velocities, fewer than coordinates if something rolls."""
        return tuple(f"v.{self.names.measured[k]}" for k in self.free.velocities)

    @cached_property
    def M0(self) -> Array:
        """(n, n) inertia matrix."""
        self._needs_second_order()
        result: Array = self.free.S.T @ self.partials.M @ self.free.S
        return result

    @cached_property
    def C0(self) -> Array:
        """(n, n) of x': damping, gyroscopic and Coriolis terms."""
        result: Array = self._by_velocity - self.M0 @ self.free.W
        return result

    @cached_property
    def K0(self) -> Array:
        """(n, n) of x: stiffness, with the weight, the constraint forces and the centrifugal terms of the reference."""
        p, f = self.partials, self.free
        by_coordinate = f.S.T @ (p.M @ f.V + p.C @ f.T + p.K @ f.R)
        result: Array = by_coordinate - self._by_velocity @ f.W - self.M0 @ f.W_rate
        return result

    @cached_property
    def B0(self) -> Array:
        """(n, number of inputs) forces of inputs that a controller or a caller drives."""
        return self._project(self.partials.B)

    @cached_property
    def E0(self) -> Array:
        """(n, number of disturbances) generalized forces per disturbance: inputs that the scene gives, and base
        accelerations."""
        return self._project(self.partials.E)

    @cached_property
    def Z0(self) -> Array:
        """(n, nz) forces of internal states, with the sign of the left side."""
        return self._project(self.partials.Rz)

    def _project(self, forces: Array) -> Array:
        self._needs_second_order()
        result: Array = self.free.S.T @ forces
        return result

    @cached_property
    def _by_velocity(self) -> Array:
        """(n, n) factor of the independent velocities y = x' - W x in the equations: S^T (M U + C S)."""
        p, f = self.partials, self.free
        result: Array = f.S.T @ (p.M @ f.U + p.C @ f.S)
        return result

    def _needs_second_order(self) -> None:
        if not self.free.holonomic:
            counts = f"{len(self.free.velocities)} velocities and {len(self.free.coordinates)} coordinates"
            fault = f"constraints leave {counts} free, so there is no model of second order [E0437]"
            raise ModelError(Problem("linearization", fault, ".state_space(), which has one row for each"))

    @cached_property
    def undamped_frequencies(self) -> Array:
        """(n,) angular frequencies of M0 x'' + K0 x = 0, rad/s, increasing.

        For a direction that is unstable without damping, minus the rate of growth; not a number for complex
        eigenvalues, which follower forces may cause.
        """
        if not len(self.M0):
            return np.zeros(0)
        values = np.asarray(scipy.linalg.eigvals(self.K0, self.M0))
        real = np.abs(values.imag) <= COMPUTED * np.max(np.abs(values))
        return np.sort(np.where(real, np.sign(values.real) * np.sqrt(np.abs(values.real)), np.nan))

    # -- first order ---------------------------------------------------------------------------------------------------

    @cached_property
    def _first_order(self) -> FirstOrderForm:
        return first_order(self.partials, self.free, self.velocities)

    def state_space(self) -> StateSpace:
        """Return sdot = A s + B u + E w, y = C s + D u + F w; s holds coordinates, velocities and internal states.

        All are changes from the reference, of the independent coordinates and velocities alone. Sampled states are not
        in s; the last of the inputs u are the sampled states, by name without ``z.``.

        Returns
        -------
        StateSpace
            Matrices of first order with names, units and reference values.

        Raises
        ------
        ModelError
            The inertia matrix is singular along a free direction.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> space = model.linearize(t=30.0).state_space()
        >>> space.states, space.A.shape
        (('wheel', 'body', 'v.wheel', 'v.body'), (4, 4))
        """
        m = self._first_order
        states = (*self.coordinates, *self.velocities, *(f"z.{name}" for name in self.names.states))
        names = self.names
        units = {kind: tuple(of) for kind, of in _signal_labels(names.units_by_kind, self.free).items()}
        references = {kind: np.array(of, float) for kind, of in _signal_labels(names.references, self.free).items()}
        of = (m.A, m.B, m.E, m.C, m.D, m.F, states, names.inputs, names.disturbances, names.outputs)
        return StateSpace(*of, units, references, orientations=names.orientations)

    def sampled_loop(self) -> StateSpace:
        """Return the closed loop of the sampled states, from one common sampling period to the next.

        The state of the loop is the state of ``state_space``, then the sampled states (``z.name``), just before the
        samples at the start of a period; all remaining inputs and disturbances have their values at the reference.
        ``eigenvalues`` belong to one period, and ``decay`` is the rate in 1/s of the slowest motion. Rounding by a
        quantum is left out.

        Returns
        -------
        StateSpace
            From one common sampling period to the next, with the outputs of ``state_space`` and without inputs and
            disturbances; ``sample`` is the period in s.

        Raises
        ------
        ModelError
            No state is sampled, the periods have no common multiple within 10,000 samples, or the inertia matrix is
            singular along a free direction.
        """
        if self.sampled is None:
            fault = "no states are sampled [E0438]"
            raise ModelError(Problem("sampled loop", fault, "state_space(), in continuous time"))
        of, part, free = self.state_space(), self.sampled, self.free
        n, moving = len(part.names), np.hstack([free.T, free.S])
        of_v = np.pad(moving, ((0, 0), (0, len(of.states) - moving.shape[1])))
        A = over_a_period(part, of.A, of.B[:, -n:], self._first_order.R_all, of_v)
        nothing = np.zeros((len(A), 0)), np.zeros((len(of.outputs), 0))
        C = np.hstack([of.C, of.D[:, -n:]])
        states = (*of.states, *(f"z.{name}" for name in part.names))
        held = labels(of, "inputs", of.inputs[-n:])
        known = signal_labels(
            {
                "states": [*labels(of, "states"), *held],
                "inputs": (),
                "disturbances": (),
                "outputs": labels(of, "outputs"),
            }
        )
        matrices = (A, nothing[0], nothing[0], C, nothing[1], nothing[1])
        names = (states, (), (), of.outputs)
        return StateSpace(*matrices, *names, **known, sample=part.common_period, orientations=of.orientations)

    def modes(self) -> Modes:
        """Return the modes with the shapes of all coordinates, including dependent coordinates.

        Sampled states are held at the reference; ``sampled_loop`` has the eigenvalues with sampled control.

        Returns
        -------
        Modes
            Eigenvalues in 1/s, one of each conjugate pair, undamped and damped frequencies in Hz, damping ratios and
            complex shapes, slowest first.

        Raises
        ------
        ModelError
            The inertia matrix is singular along a free direction.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> model.linearize(t=30.0).modes().frequency.round(2)
        array([ 1.25, 11.02])
        """
        with one_thread_of_algebra(len(self.partials.M)):
            if len(self.partials.M) >= MANY and not self.names.states and self.free.unconstrained:
                p = self.partials
                has_diagonal_inertia(p.M, self.velocities)
                return second_order_modes(p.M, p.C, p.K, self.names.components)
            m = self._first_order
            return modes(m.A, m.R_all, self.names.components, np.diag(self.partials.M))

    def frequency_response(self, omega: ArrayLike, input: str, output: str) -> Complex:
        """Return the complex response of an output to an input or a disturbance at angular frequencies.

        Parameters
        ----------
        omega : array_like
            Angular frequencies (...), rad/s.
        input : str
            Name of an input or of a disturbance.
        output : str
            Name of an output of the scene (``name[k]`` for an output of several components), or of a state.

        Returns
        -------
        (...) complex ndarray
            The output is response e^(i omega t) for the input e^(i omega t); unit of the output per unit of the input.

        Raises
        ------
        UsageError
            An unknown input or output; the message names the known ones.
        NumericalError
            A frequency equal to an undamped mode's, to machine precision.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> linear = model.linearize(t=30.0)
        >>> abs(linear.frequency_response([1e-3], "road", "suspension_travel")).round(6)
        array([0.])
        """
        return self.state_space().frequency_response(omega, input, output)

    def plot_response(
        self, input: str, output: str, frequencies: ArrayLike | None = None, axes: object = None
    ) -> list[Any]:
        """Draw magnitude and phase of the response of an output to an input; return matplotlib's two axes.

        Parameters
        ----------
        input, output : str
            Names of an input or a disturbance, and of an output or a state.
        frequencies : array_like, optional
            Frequencies (n,), Hz, increasing; 500 over ``modes().band`` if none are given.
        axes : sequence of matplotlib Axes, optional
            Two axes; a new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            Of the magnitude, on logarithmic scales, and of the phase in degrees, unwrapped.

        Raises
        ------
        UsageError
            An input or an output that there is not; fewer than two frequencies, or not positive numbers; other than
            two axes.
        NumericalError
            A frequency equal to an undamped mode's, to machine precision.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> magnitude, phase = model.linearize(t=30.0).plot_response("road", "body_acceleration")
        >>> phase.get_xlabel()
        'frequency, Hz'
        """
        chosen = np.geomspace(*self.modes().band, 500) if frequencies is None else frequencies
        band = np.atleast_1d(np.asarray(chosen, dtype=float))
        check_frequencies("plot_response", band, "numpy.geomspace(0.1, 100.0, 500), Hz")
        values = self.frequency_response(2.0 * np.pi * band, input, output)
        return plot_response(band, values, (input, output), axes)

    def _unit(self, name: str) -> str:
        """Return the unit of an output or a state; empty if unknown."""
        return self.names.units.get(linear_model_name(name, tuple(self.names.units)), "")

    # -- random vibration ----------------------------------------------------------------------------------------------

    def psd(self, output: str, excitation: Excitation, frequencies: ArrayLike | None = None) -> PowerSpectrum:
        """Return the power spectral density of an output under random inputs.

        Parameters
        ----------
        output : str
            Name of an output or a state.
        excitation : RoadExcitation or InputSpectrum
            Random inputs, of ``eomgen.spectra``.
        frequencies : array_like, optional
            Frequencies (n,), Hz; over the band of the excitation, close about resonances, if none are given. The
            density is zero outside this band.

        Returns
        -------
        PowerSpectrum
            One-sided density over frequency, in the output's unit squared per Hz.

        Raises
        ------
        UsageError
            An input or an output that there is not; fewer than two frequencies, or not positive and increasing.
        ModelError
            A mode grows, so that there is no stationary motion; a mode without damping is accepted.
        NumericalError
            A frequency equal to an undamped mode's, to machine precision.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> spectrum = model.linearize(t=30.0).psd("body_acceleration", model.road_excitation())
        >>> spectrum.unit
        '(m/s^2)^2/Hz'
        """
        check_excitation("psd", excitation)
        modes = self.modes()
        f = _spread(modes, excitation.band) if frequencies is None else np.asarray(frequencies, dtype=float)
        check_frequencies("psd", f, "numpy.geomspace(0.1, 100.0, 500), Hz")
        density = densities(self.state_space(), modes, excitation, [output], f)[0]
        return PowerSpectrum(output, self._unit(output), f, density, excitation.name)

    def rms(
        self,
        output: str,
        excitation: Excitation,
        band: tuple[float, float] | None = None,
        weighting: str | None = None,
    ) -> float:
        """Return the root mean square of an output about its reference under random inputs, integrated over frequency
        to a relative error of 1e-8.

        Parameters
        ----------
        output : str
            Name of an output or a state.
        excitation : RoadExcitation or InputSpectrum
            Random inputs, of ``eomgen.spectra``.
        band : tuple of float, optional
            The part that counts, Hz, cut to the excitation's band; all of this band if none is given.
        weighting : str, optional
            ``Wk`` or ``Wd`` of ISO 2631-1, for an acceleration in m/s^2: the part that people feel.

        Returns
        -------
        float
            In the unit of the output.

        Raises
        ------
        UsageError
            An input, an output or a weighting that there is not; a weighting of an output with another unit than m/s^2
            (an unknown unit passes); a band outside the excitation's.
        ModelError
            A mode grows, or one within the band has no damping.
        NumericalError
            The integral does not converge.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> linear, road = model.linearize(t=30.0), model.road_excitation()
        >>> round(linear.rms("body_acceleration", road, weighting="Wk"), 3)
        1.183
        """
        check_excitation("rms", excitation)
        if weighting is not None:
            check_weighted(output, self._unit(output))
        space, result = self.state_space(), self.modes()
        return float(root_mean_squares(space, result, excitation, [output], [weighting], band)[0])

    def rms_on_white_noise_road(self, output: str, excitation: RoadExcitation) -> float:
        """Return the root mean square of an output on a road of exponent 2 with an unbounded band.

        By Lyapunov's equation, exact with the delay between axles, without integration or sampling over frequency.

        Parameters
        ----------
        output : str
            Name of an output or a state.
        excitation : RoadExcitation
            A road of exponent 2 under wheels at a constant speed; its band is not used.

        Returns
        -------
        float
            In the unit of the output.

        Raises
        ------
        UsageError
            An input or an output that there is not; another excitation, another exponent or a measured road; several
            tracks of isotropic coherence, which depends on frequency.
        ModelError
            A mode does not decay, or the output follows the elevation of the road, which has an unbounded variance.

        Examples
        --------
        >>> from eomgen.spectra import Road, RoadExcitation
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> road = RoadExcitation(Road("C"), 20.0, {"road": 0.0})
        >>> round(model.linearize(t=30.0).rms_on_white_noise_road("suspension_travel", road), 4)
        0.0119
        """
        _check_road("rms_on_white_noise_road", excitation)
        return white_noise_road(self.state_space(), self.modes(), excitation, output)

    def ride_table(
        self,
        excitation: RoadExcitation,
        outputs: Sequence[str] | Mapping[str, str | None] = (),
        classes: Sequence[str] = ("A", "B", "C", "D"),
        speeds: Sequence[float | str] = (),
        band: tuple[float, float] | None = None,
    ) -> RideTable:
        """Return the root mean squares of outputs over road classes and speeds.

        Parameters
        ----------
        excitation : RoadExcitation
            A road under wheels, whose exponents and band all classes take.
        outputs : sequence of str or mapping, optional
            Names of outputs or states, or weightings (``Wk``, ``Wd``, None) by name; all outputs, unweighted, if none
            are given.
        classes : sequence of str, optional
            Road classes of ISO 8608, ``A`` to ``H``; an empty sequence for the road of the excitation itself, the only
            choice for a measured road.
        speeds : sequence of float or str, optional
            Speeds (n,) in m/s, or texts with a unit, ``"80 km/h"``; the speed of the excitation if none are given.
        band : tuple of float, optional
            The part that counts, Hz, cut to the excitation's band at each speed; all of this band if none is given.

        Returns
        -------
        RideTable
            Root mean squares (classes, speeds, outputs), in the units of the outputs.

        Raises
        ------
        EomgenError
            The errors of ``rms``: unknown names, unsuitable excitations, modes that grow or lack damping. UsageError
            for unknown classes, classes of a measured road, and a model without outputs if none are named.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> table = model.linearize(t=30.0).ride_table(model.road_excitation(), speeds=[10, 20])
        >>> table.values.shape
        (4, 2, 3)
        """
        _check_road("ride_table", excitation)
        chosen = dict(outputs) if isinstance(outputs, Mapping) else dict.fromkeys(outputs or self.names.outputs)
        if not chosen:
            fault = "the scene has no outputs [E0441]"
            raise UsageError(Problem("ride_table", fault, "[outputs] in the scene, or states"))
        for name, weighting in chosen.items():
            if weighting is not None:
                check_weighted(name, self._unit(name))
        names, weightings = tuple(chosen), tuple(chosen.values())
        driven = [excitation.at(speed if isinstance(speed, str) else float(speed)) for speed in speeds] or [excitation]
        space, modes = self.state_space(), self.modes()
        at_speeds = np.array([root_mean_squares(space, modes, e, names, weightings, band) for e in driven])
        road = excitation.road
        sizes = [(road.of_class(name).reference_roughness / road.reference_roughness) ** 0.5 for name in classes]
        return RideTable(
            names,
            tuple(self._unit(name) for name in names),
            tuple(classes) or (road.label,),
            np.array([e.speed for e in driven]),
            np.array(sizes or [1.0])[:, np.newaxis, np.newaxis] * at_speeds,
            tuple(name or "" for name in weightings),
        )


def _check_road(where: str, excitation: object) -> None:
    """Raise UsageError for anything but the excitation by a road."""
    check_excitation(where, excitation)
    if not isinstance(excitation, RoadExcitation):
        fault = f"the excitation by a road is needed, not {type(excitation).__name__} [E2240]"
        raise UsageError(Problem(where, fault, "RoadExcitation of eomgen.spectra, or rms"))


def _spread(modes: Modes, band: tuple[float, float]) -> Array:
    """Return increasing frequencies (n,) in Hz over a band: geometrically spaced, and close about the oscillating
    modes."""
    points = [np.geomspace(*band, 600)]
    for value in modes.eigenvalues[modes.oscillating]:
        centre, half_width = abs(value.imag) / (2.0 * np.pi), abs(value.real) / (2.0 * np.pi)
        points.append(centre + half_width * np.sinh(np.linspace(-4.0, 4.0, 81)))
    every = np.unique(np.concatenate(points))
    return np.asarray(every[(every >= band[0]) & (every <= band[1])])


def _signal_labels(by_kind: Mapping[str, Iterable[Any]], free: Freedom) -> dict[str, list[Any]]:
    """Return the labels (units or reference values) of the signals of a state space, by kind of signal. `by_kind` has
    the labels of all measured coordinates and velocities; labels of the independent ones (`free`) become labels of
    ``states``, before the internal states. Empty if `by_kind` is empty."""
    if not by_kind:
        return {}
    every = {kind: list(entries) for kind, entries in by_kind.items()}
    states = [every["measured"][k] for k in free.coordinates] + [every["velocities"][k] for k in free.velocities]
    return {kind: states + every[kind] if kind == "states" else every[kind] for kind in KINDS}
