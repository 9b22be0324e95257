"""Linearization: the linear model of a mechanical system about a state, of second and first order, modal, by frequency.

    M0 x'' + C0 x' + K0 x + Z0 z = B0 u + E0 w

x are small changes of independent coordinates, left-trivialised; constraints are projected out (Lieh 1994; on groups
and about moving references see ``linear.freedom``). What depends on time is frozen.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

from eomgen.arrays import Array
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.linear.display import linearization_html
from eomgen.linear.freedom import Freedom
from eomgen.linear.modes import Modes, modes
from eomgen.linear.partials import Partials
from eomgen.linear.plots import plot_response
from eomgen.linear.state_space import FirstOrder, StateSpace, first_order

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Reference:
    """The state about which a model is linear: t in s, q (nq,), v and a (nv,), z (nz,), u (nu,), multipliers (rows,).

    ``what`` says in words what it is: ``equilibrium``, ``steady motion``, ``initial state``, ``given state``.
    """

    t: float
    q: Array
    v: Array
    a: Array
    z: Array
    u: Array
    multipliers: Array
    what: str


@dataclass(frozen=True)
class Names:
    """Names of the components of v (without their letter), and of internal states, inputs, disturbances and outputs.

    ``measured`` are the coordinates of which the independent ones are chosen: the components, or those of joints
    between absolute bodies.
    """

    components: tuple[str, ...]
    measured: tuple[str, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    disturbances: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(frozen=True)
class Linearization:
    """A linear model.

    Attributes
    ----------
    reference : Reference
    partials : Partials, before constraints are projected out
    free : Freedom, what constraints leave free
    names : Names
    """

    reference: Reference
    partials: Partials
    free: Freedom
    names: Names

    def __repr__(self) -> str:
        return (
            f"<Linearization about the {self.reference.what} at t = {self.reference.t:.6g} s:"
            f" {', '.join(self.coordinates)}>"
        )

    def _repr_html_(self) -> str:
        return linearization_html(self.reference.what, self.reference.t, self.coordinates, self.modes())

    # -- second order --------------------------------------------------------------------------------------------------

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the independent coordinates x: ``hinge``, ``ball[2]``."""
        return tuple(self.names.measured[k] for k in self.free.coordinates)

    @property
    def velocities(self) -> tuple[str, ...]:
        """Names of the independent velocities, fewer than coordinates where something rolls."""
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
        return self._projected(self.partials.B)

    @cached_property
    def E0(self) -> Array:
        """(n, number of disturbances) forces of the inputs that the scene gives, and of accelerations of the base."""
        return self._projected(self.partials.E)

    @cached_property
    def Z0(self) -> Array:
        """(n, nz) forces of internal states, with the sign of the left side."""
        return self._projected(self.partials.Rz)

    def _projected(self, forces: Array) -> Array:
        self._needs_second_order()
        result: Array = self.free.S.T @ forces
        return result

    @cached_property
    def _by_velocity(self) -> Array:
        """(n, n) of the independent velocities y = x' - W x."""
        p, f = self.partials, self.free
        result: Array = f.S.T @ (p.M @ f.U + p.C @ f.S)
        return result

    def _needs_second_order(self) -> None:
        if not self.free.holonomic:
            what = f"constraints at velocity level leave {len(self.free.velocities)} velocities free but "
            what += f"{len(self.free.coordinates)} coordinates, so there is no model of second order"
            raise ModelError(Problem("linearization", what, ".state_space(), which has one row for each"))

    @cached_property
    def undamped_frequencies(self) -> Array:
        """(n,) angular frequencies of M0 x'' + K0 x = 0, rad/s, increasing.

        Of a direction that is unstable without damping minus the rate at which it grows; not a number where eigenvalues
        are complex, as forces that follow the motion can make them.
        """
        values = np.asarray(scipy.linalg.eigvals(self.K0, self.M0)) if len(self.M0) else np.zeros(0, complex)
        scale = float(np.max(np.abs(values), initial=0.0))
        real = np.abs(values.imag) <= 1e-9 * scale
        return np.sort(np.where(real, np.sign(values.real) * np.sqrt(np.abs(values.real)), np.nan))

    # -- first order ---------------------------------------------------------------------------------------------------

    @cached_property
    def _first_order(self) -> FirstOrder:
        return first_order(self.partials, self.free, self.velocities)

    def state_space(self) -> StateSpace:
        """Return sdot = A s + B u + E w, y = C s + D u + F w; s holds coordinates, velocities and internal states.

        Raises
        ------
        ModelError
            The inertia matrix is singular along a free direction.
        """
        m = self._first_order
        states = (*self.coordinates, *self.velocities, *(f"z.{name}" for name in self.names.states))
        names = self.names
        return StateSpace(m.A, m.B, m.E, m.C, m.D, m.F, states, names.inputs, names.disturbances, names.outputs)

    def modes(self) -> Modes:
        """Return the modes with the shapes of all coordinates, dependent ones too."""
        m = self._first_order
        return modes(m.A, m.R_all, self.names.components, np.diag(self.partials.M))

    def frequency_response(self, omega: ArrayLike, input: str, output: str) -> Complex:
        """Return the complex response of an output to an input; see ``StateSpace.frequency_response``."""
        return self.state_space().frequency_response(omega, input, output)

    def plot_response(
        self, input: str, output: str, frequencies: ArrayLike | None = None, axes: object = None
    ) -> list[Any]:
        """Draw magnitude and phase of the response of an output to an input; return matplotlib's two axes.

        Parameters
        ----------
        input, output : str
            As of ``frequency_response``.
        frequencies : (n,) Hz
            From a tenth of the lowest frequency of a mode to ten times the highest where none are given.
        axes : two of matplotlib's Axes
            A new figure of pyplot where none are given.

        Raises
        ------
        UsageError
            An input or an output that there is not; frequencies that are not positive numbers; other than two axes.
        """
        band = (
            np.geomspace(*self.modes().band, 500)
            if frequencies is None
            else np.atleast_1d(np.asarray(frequencies, dtype=float))
        )
        if band.ndim != 1 or len(band) < 2 or not np.all(np.isfinite(band)) or np.any(band <= 0.0):
            what = "frequencies have to be two or more positive numbers, Hz"
            raise UsageError(Problem("plot_response", what, "numpy.geomspace(0.1, 100.0, 500)"))
        values = self.frequency_response(2.0 * np.pi * band, input, output)
        return plot_response(band, values, (input, output), axes)
