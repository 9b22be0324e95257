"""A sea of Lagrangian waves: motion of labelled particles, the surface they make, and the motion at fixed points."""

from __future__ import annotations

import copy
import math
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.rounding import COMPUTED
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.products.waves.sea_states.components import Components
from eomgen.products.waves.sea_states.spectra import STANDARD_GRAVITY, check_number, check_whole
from eomgen.products.waves.second_order.limits import check_points, check_sea, warn_of_doubtful_waves
from eomgen.products.waves.second_order.motion import BoundWaves, Complex, Motion, Surface
from eomgen.products.waves.second_order.pairs import COLUMNS, OWN, Case, Dispersion, gravity_waves
from eomgen.products.waves.second_order.profiles import Profile, harmonics, multiples
from eomgen.products.waves.second_order.routines import LabelledWaves, Routines, routines

Vorticity = Literal["none", "gerstner"]


@checked_calls("Sea(Components(vectors, amplitude, phase), depth)")
class Sea:
    """A sea of components with all sums and differences of second order, in Lagrangian description: each water particle
    is followed.

    Parameters
    ----------
    components : Components
        Wave vectors, amplitudes and phases of first order.
    depth : float
        Of the water in m; infinite by default.
    order : int, optional
        1 or 2.
    vorticity : ``none`` or ``gerstner``
        Of second order: water that has been at rest has none, and its particles drift (Stokes). In Gerstner's waves
        particles move in closed orbits. The surface at fixed points is the same to second order, and so are first-order
        waves.
    gravity : float, optional
        In m/s^2.
    dispersion : callable
        Angular frequency of a ``WaveNumber``. The part of the frequency that changes sign with the wave vector has to
        be U . k, with the velocity U of a uniform current; the rest has to be sqrt(G k tanh k h) with one G, gravity or
        a substitute, because the pressure at the surface is constant for no other form.

    Raises
    ------
    UsageError
        Components, a depth, an order or a dispersion relation that cannot be.
    """

    def __init__(
        self,
        components: Components,
        depth: float = math.inf,
        *,
        order: int = 2,
        vorticity: Vorticity = "none",
        gravity: float = STANDARD_GRAVITY,
        dispersion: Dispersion = gravity_waves,
    ) -> None:
        """Check and order the components, and find the current and the restoring acceleration. Raises UsageError."""
        check_sea(components, depth, order, gravity)
        if vorticity not in ("none", "gerstner"):
            raise UsageError(Problem("Sea: vorticity", f"there is no {vorticity!r} [E1168]", "none, or gerstner"))
        self.depth, self.order, self.gravity = float(depth), order, float(gravity)
        self.vorticity: Vorticity = vorticity
        self.dispersion = dispersion
        vectors = np.asarray(components.vectors, dtype=float)
        heading = vectors[0] / np.hypot(*vectors[0])
        across = vectors @ np.array([-heading[1], heading[0]])
        along = vectors @ heading
        self.spread = bool(np.any(np.abs(across) > 1e-14 * np.abs(along)) or np.any(along <= 0.0))
        #: columns: the direction of the waves and the orthogonal direction, for waves of one direction
        self._axes = np.eye(2) if self.spread else np.array([heading, [-heading[1], heading[0]]]).T
        columns = self._of(surface=True).table("components", vectors, self._numbers(0.0))
        self._order = np.argsort(columns[COLUMNS.index("w")], kind="stable")
        self.vectors = np.ascontiguousarray(vectors[self._order])
        self.amplitude, self.phase = self._in_order(components)
        columns = columns[:, self._order]
        self.frequency = columns[COLUMNS.index("w")]
        self.current, self.restoring = self._current_and_restoring(columns)
        warn_of_doubtful_waves(self.vectors, self.amplitude, self.depth, order)

    @classmethod
    def of_one_wave(
        cls,
        wave_number: float,
        amplitude: float,
        depth: float = math.inf,
        *,
        order: int = 2,
        vorticity: Vorticity = "none",
        gravity: float = STANDARD_GRAVITY,
    ) -> Sea:
        """Return the sea of one regular wave along x, with a crest at the label 0 at t = 0.

        At first order in deep water this is Gerstner's wave, which is exact. RuntimeWarning for water too shallow for
        order 2.

        Parameters
        ----------
        wave_number : float
            In rad/m; negative for a wave along -x.
        amplitude : float
            Of first order, m, not negative.
        depth : float, optional
            Of the water, m; infinite by default.
        order : int, optional
            1 or 2.
        vorticity : str, optional
            ``none``: particles drift at order 2; ``gerstner``: closed orbits.
        gravity : float, optional
            In m/s^2.

        Raises
        ------
        UsageError
            Numbers that cannot be, a wave that crosses itself, or at order 2 a wave that breaks.

        Examples
        --------
        >>> from eomgen.waves import Sea
        >>> swell = Sea.of_one_wave(0.1, 1.0, order=1)
        >>> swell.elevation([0.0], [0.0], 0.0).round(6)
        array([1.])
        """
        single = Components(np.array([[wave_number, 0.0]]), np.array([amplitude]), np.zeros(1))
        return cls(single, depth, order=order, vorticity=vorticity, gravity=gravity)

    @property
    def mean_square_slope(self) -> float:
        """Sum of (k A)^2 / 2 coth^2 k h: the variance of the derivatives by labels of the horizontal displacement."""
        row = dict(zip(COLUMNS, self._surface_tables[0], strict=True))
        return float(0.5 * np.sum((row["k"] * self.amplitude * row["C"]) ** 2))

    @property
    def fold_probability(self) -> float:
        """The part of labels at which waves of first order and of one direction fold over: erfc(1/sqrt(2 mss)) / 2."""
        return 0.5 * math.erfc(1.0 / math.sqrt(2.0 * self.mean_square_slope)) if np.any(self.amplitude) else 0.0

    # -- components, self-interactions and pairs ---------------------------------------------------------------------

    def _numbers(self, c: float) -> Array:
        restoring = getattr(self, "restoring", self.gravity)  # which the components' own table has yet to give
        return np.array([restoring, self.depth if math.isfinite(self.depth) else 0.0, c])

    def _of(self, *, surface: bool) -> Routines:
        return routines(Case(math.isfinite(self.depth), self.spread, surface), self.dispersion)

    def _in_order(self, components: Components) -> tuple[Array, Array]:
        """Return amplitudes and phases in the order of frequencies."""
        amplitude, phase = (np.asarray(x, dtype=float)[self._order] for x in (components.amplitude, components.phase))
        return np.ascontiguousarray(amplitude), np.ascontiguousarray(phase)

    def _current_and_restoring(self, columns: Array) -> tuple[Array, float]:
        """Return the uniform current (2,), m/s, and the restoring acceleration, m/s^2, of the dispersion relation.
        Raises UsageError if the odd part is not linear in the wave vector, or waves have different restoring
        accelerations."""
        row = dict(zip(COLUMNS, columns, strict=True))
        vectors, doppler = self.vectors, row["doppler"]
        current = np.zeros(2)
        if np.any(doppler):
            current = np.linalg.lstsq(vectors, doppler, rcond=None)[0]
            if np.abs(vectors @ current - doppler).max() > COMPUTED * np.abs(doppler).max():
                fault = "the part that is odd in the wave vector is not linear in it, so no uniform current gives"
                raise UsageError(Problem("Sea: dispersion", f"{fault} it [E1217]", "w.gravity_waves + U * w.kx"))
        restoring = row["w"] ** 2 * row["C"] / row["k"]
        if np.ptp(restoring) > COMPUTED * restoring.max():
            fault = f"w^2 coth(k h) / k is {restoring.min():.6g} to {restoring.max():.6g} m/s^2; the pressure at the"
            fault += " surface is the same everywhere only if it is the same for all waves [E1216]"
            hint = "w.gravity_waves, with terms that are linear in kx and ky"
            raise UsageError(Problem("Sea: dispersion", fault, hint))
        return current, float(np.mean(restoring))

    @cached_property
    def _surface_tables(self) -> tuple[Array, Array, Array | None, Array]:
        return self._tables(0.0)

    def _tables(self, c: float) -> tuple[Array, Array, Array | None, Array]:
        """Return tables of components, self-interactions and pairs (None at order 1), and the levels of ``_level``, for
        labels at height c, m. Raises UsageError for c outside of the water."""
        # a tenth of 1/k above the surface is for differences by c there
        if not -self.depth <= c <= 0.1 / float(np.hypot(*self.vectors.T).max()):
            fault = f"labels at c = {c:.6g} m are outside of the water, which is from {-self.depth:.6g} m to 0 [E1218]"
            raise UsageError(Problem("Sea: c", fault, "0 for the surface, negative below"))
        routines, p = self._of(surface=c == 0.0), self._numbers(c)
        columns = routines.table("components", self.vectors, np.array([self.gravity, p[1], p[2]]))
        self_table = routines.table("own", columns, p)
        table = routines.table("pairs", columns, p) if self.order == 2 else None
        if self.vorticity == "gerstner":
            # a steady shear flow against the drift: free of divergence, without effect on second order
            for names, rows in ((OWN, self_table), (self._entries, table)):
                if rows is not None:
                    rows[[number for number, name in enumerate(names) if name in ("Dx", "Dy")]] = 0.0
        return columns, self_table, table, self._level(columns, self_table)

    def _level(self, columns: Array, self_table: Array) -> Array:
        """Return (4,): the lift, m, the rise of the pressure, m^2/s^2, and the drift along and across, m/s, summed over
        components."""
        row, square = dict(zip(OWN, self_table, strict=True)), self.amplitude**2
        raised = 0.25 * np.sum(square * columns[COLUMNS.index("w")] ** 2 * columns[COLUMNS.index("s")])
        return np.array([row["lift"] @ square, raised, row["Dx"] @ square, row["Dy"] @ square])

    def _waves(self, time: float) -> LabelledWaves:
        check_number("Sea: time", time, "s")
        return LabelledWaves(self.amplitude, np.remainder(self.phase - self.frequency * time, 2.0 * math.pi), time)

    # -- labels -----------------------------------------------------------------------------------------------------

    def motion(self, labels: ArrayLike, time: float, c: float = 0.0) -> Motion:
        """Return positions, motion and pressure of the particles with labels.

        Parameters
        ----------
        labels : (points, 2) array, m
            Positions of the particles in water at rest, from above.
        time : float
            Time, s.
        c : float, m
            Height of the particles in water at rest: 0 at the surface, negative below, at least -``depth``.

        Returns
        -------
        Motion
            Of these particles, with arrays by point. Positions and velocities include a current, and the mean drift at
            order 2 unless ``vorticity`` is ``gerstner``. Pressure is divided by the density, relative to the air's, in
            m^2/s^2.

        Raises
        ------
        UsageError
            Labels of another shape, numbers that are not finite, or a height outside of the water; up to 0.1/k above
            the surface is accepted, with the largest wave number k.
        """
        local_labels = self._own_labels(labels)
        columns, twice, table, level = self._surface_tables if c == 0.0 else self._tables(c)
        sums = self._of(surface=c == 0.0).sums
        row = sums("kinematics", columns, self._waves(time), twice, table, local_labels, level, self._numbers(c))
        row = {**dict.fromkeys(("dy", "vy", "ay"), np.zeros_like(row["dx"])), **row}  # zero for one direction
        vectors = (np.stack([row[f"{kind}{axis}"] for axis in "xyz"], axis=1) for kind in "dva")
        moved, velocity, acceleration = (np.hstack((part[:, :2] @ self._axes.T, part[:, 2:])) for part in vectors)
        moved[:, :2] += np.asarray(labels, dtype=float) + self.current * time
        moved[:, 2] += c
        velocity[:, :2] += self.current
        pressure = row["p"] - self.restoring * c
        if self.order == 1 and not math.isfinite(self.depth):
            # which first order in deep water lacks: with it a single wave is Gerstner's in pressure too
            k = np.hypot(*self.vectors.T)
            pressure += 0.5 * self.restoring * float(np.sum(k * self.amplitude**2 * np.expm1(2.0 * k * c)))
        return Motion(moved, velocity, acceleration, pressure)

    def profile(self, count: int, time: float) -> Profile:
        """Return the surface of a sea of one direction at equally spaced labels, by FFT.

        Parameters
        ----------
        count : int
            Number of labels over the length after which the sea repeats itself; more than twice the highest multiple of
            the lowest common wave number, and more than four times at order 2 in water of finite depth.
        time : float
            Time, s.

        Returns
        -------
        Profile
            Places, velocities and derivatives by the label, at ``count`` labels from 0 on, along the waves' direction;
            current and drift as in ``motion``.

        Raises
        ------
        UsageError
            Waves of several directions, wave numbers that are not multiples of one, or a ``count`` that is too small
            or not whole.
        """
        if self.spread:
            fault = "the waves have several directions [E1219]"
            raise UsageError(Problem("Sea.profile", fault, "surface(labels, time), or waves of one direction"))
        check_number("Sea: time", time, "s")
        columns, self_table, table, level = self._surface_tables
        unit, number = multiples(np.hypot(*self.vectors.T))
        least = 2 * int(number.max()) * (self.order if table is not None and "Xp" in self._entries else 1)
        check_whole("Sea.profile: count", count, 1, 10**16, f"{least + 1}")
        if count <= least:
            fault = f"{count} labels are too few [E1220]"
            raise UsageError(Problem("Sea.profile: count", fault, f"{least + 1} or more"))
        crest = self.amplitude * np.exp(1j * (self.phase - self.frequency * time))
        named = None if table is None else dict(zip(self._entries, table, strict=True))
        by_name, (drift, lift) = harmonics(number, columns, crest, self_table, named, level)
        k = unit * np.arange(len(by_name["x"]))
        labels = 2.0 * math.pi / unit * np.arange(count) / count

        def over_labels(amplitudes: NDArray[np.complex128]) -> Array:
            spectrum = np.zeros(count // 2 + 1, dtype=complex)
            length = min(len(spectrum), len(amplitudes))
            spectrum[:length] = 0.5 * count * amplitudes[:length]
            spectrum[0] = count * amplitudes[0].real
            return np.fft.irfft(spectrum, count)

        x, z, u, w = (over_labels(by_name[name]) for name in "xzuw")
        xa, za, xaa, zaa = (over_labels(by_name[name] * (1j * k) ** n) for n in (1, 2) for name in "xz")
        drift += float(self.current @ self._axes[:, 0])
        return Profile(labels, labels + x + drift * time, z + lift, u + drift, w, 1.0 + xa, za, xaa, zaa)

    @property
    def _entries(self) -> tuple[str, ...]:
        return self._of(surface=True).case.entries

    @property
    def drift(self) -> Array:
        """(2,) mean velocity of the particles of the surface that second order adds, along x and y, m/s."""
        _, _, table, level = self._surface_tables
        return self._axes @ level[2:] if table is not None else np.zeros(2)

    @property
    def columns(self) -> Array:
        """The table of components at the surface, rows as ``pairs.COLUMNS``."""
        return self._surface_tables[0]

    @property
    def raised(self) -> float:
        """The constant K of the pressure of second order, which keeps the mean level at 0, in m^2/s^2."""
        return float(self._surface_tables[3][1])

    def bound_waves(self, time: float) -> BoundWaves:
        """Return the contributions of pairs of components at the surface.

        Parameters
        ----------
        time : float
            Time, s.

        Returns
        -------
        BoundWaves
            Complex amplitudes at the label 0 of the second-order velocity potential, its rate, and displacements x and
            y, by groups of pairs: differences, and, in water of finite depth or with several directions, sums and
            doubles; ``drift``, the displacement (2,) of all particles by the mean drift since t = 0, m. Components are
            numbered as ``vectors`` of the sea, by frequency.

        Raises
        ------
        UsageError
            A sea of first order.
        """
        columns, self_table, table, level = self._surface_tables
        if table is None:
            raise UsageError(Problem("Sea.bound_waves", "a sea of order 1 has no pairs [E1221]", "order = 2"))
        crest = self.amplitude * np.exp(1j * (self.phase - self.frequency * time))
        named, alone = dict(zip(self._entries, table, strict=True)), dict(zip(OWN, self_table, strict=True))
        w, all_of = columns[COLUMNS.index("w")], np.arange(len(crest))
        i, j = np.tril_indices(len(crest), -1)
        zero = np.zeros(len(i))
        differences = {x: named.get(f"{x}m", zero) for x in "BXY"}
        groups = [((i, 1, j, -1), crest[i] * np.conj(crest[j]), named["w"], differences)]
        if "Xp" in named:
            sums = {x: named.get(f"{x}p", zero) for x in "BXY"}
            groups.append(((i, 1, j, 1), crest[i] * crest[j], w[i] + w[j], sums))
            groups.append(((all_of, 1, all_of, 1), crest * crest, 2.0 * w, {x: alone[f"{x}p"] for x in "BXY"}))
        parts: list[tuple[Complex, ...]] = []
        for number, (_, product, speed, of) in enumerate(groups):
            drifts = number == 0 and self.spread
            potential = -1j * of["B"] * product
            x, y = (
                (-1j * of[axis] + (time * named[drift] if drifts else 0.0)) * product
                for axis, drift in (("X", "Dx"), ("Y", "Dy"))
            )
            parts.append((potential, -1j * speed * potential, x, y))
        potential, rate, *along = (np.concatenate(part) for part in zip(*parts, strict=True))
        x, y = self._axes @ np.stack(along)
        members = tuple(group[0] for group in groups)
        return BoundWaves(members, potential, rate, x, y, self._axes @ level[2:] * time)

    def with_waves(self, components: Components) -> Sea:
        """Return the sea of other amplitudes and phases of the same wave vectors, with the tables of this sea.

        Parameters
        ----------
        components : Components
            Other amplitudes and phases of the same wave vectors, in the order that this sea was made with.

        Returns
        -------
        Sea
            A new sea with the tables of this sea, which does not change; without the warnings of ``Sea``.

        Raises
        ------
        UsageError
            Wave vectors that differ or are in another order, or amplitudes that ``Sea`` refuses.
        """
        check_sea(components, self.depth, self.order, self.gravity)
        vectors = np.asarray(components.vectors, dtype=float)
        if vectors.shape != self.vectors.shape or np.any(vectors[self._order] != self.vectors):
            raise UsageError(Problem("Sea.with_waves", "the wave vectors are others [E1222]", "a Sea of its own"))
        sea = copy.copy(self)
        sea.amplitude, sea.phase = self._in_order(components)
        columns, self_table, table, _ = self._surface_tables
        sea._surface_tables = columns, self_table, table, sea._level(columns, self_table)
        return sea

    def derivatives(self, labels: ArrayLike, time: float, c: float = 0.0) -> tuple[Array, Array]:
        """Return derivatives of positions by labels a and b. Raises UsageError as ``motion``.

        Parameters
        ----------
        labels : array_like
            Labels (points, 2), m, a along x and b along y.
        time : float
            Time, s.
        c : float, optional
            Height of the particles in water at rest, m: 0 at the surface, negative below, at least -``depth``.

        Returns
        -------
        first : (points, 3, 2) array
            Of x, y, z by a and b.
        second : (points, 3, 3) array, 1/m
            Of x, y, z by aa, ab, bb.
        """
        local_labels = self._own_labels(labels)
        columns, twice, table, _ = self._surface_tables if c == 0.0 else self._tables(c)
        row = self._of(surface=c == 0.0).sums("geometry", columns, self._waves(time), twice, table, local_labels)
        zero = np.zeros(local_labels.shape[1])
        cells = [[row.get(f"x{axis}{by}", zero) for by in ("a", "b", "aa", "ab", "bb")] for axis in "xyz"]
        all_of = np.moveaxis(np.array(cells), 2, 0)
        first, second = all_of[:, :, :2] + np.eye(3)[:, :2], all_of[:, :, [[2, 3], [3, 4]]]
        turn = np.eye(3)
        turn[:2, :2] = self._axes
        first = np.einsum("xy,nyi,ai->nxa", turn, first, self._axes)
        second = np.einsum("xy,nyij,ai,bj->nxab", turn, second, self._axes, self._axes)
        return first, np.stack((second[:, :, 0, 0], second[:, :, 0, 1], second[:, :, 1, 1]), axis=2)

    def surface(self, labels: ArrayLike, time: float) -> Surface:
        """Return the surface at labels. Raises UsageError as ``motion``.

        Parameters
        ----------
        labels : array_like
            Labels (points, 2), m.
        time : float
            Time, s.

        Returns
        -------
        Surface
            Places, slopes along x and y, mean curvatures (1/m, negative at crests), and Jacobians of x and y by labels
            (negative if folded over, which turns the sign of the curvature), with arrays by point. A slope is infinite,
            of either sign, if the surface is upright; at a cusp the curvature is NaN.
        """
        first, second = self.derivatives(labels, time)
        along, across = first[:, :, 0], first[:, :, 1]
        normal = np.cross(along, across)
        length = np.linalg.norm(normal, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = -normal[:, :2] / normal[:, 2:]
            E, F, G = (np.einsum("nx,nx->n", x, y) for x, y in ((along, along), (along, across), (across, across)))
            L, M, N = (np.einsum("nx,nx->n", second[:, :, k], normal) / length for k in range(3))
            curvature = 0.5 * (E * N - 2.0 * F * M + G * L) / (E * G - F * F)
        # a cusp has no tangent: an upright one is met from both sides
        slope = np.where(np.isnan(slope), np.inf, slope)
        return Surface(self.motion(labels, time).position, slope, curvature, normal[:, 2])

    # -- fixed points -----------------------------------------------------------------------------------------------

    def labels_at(self, points: ArrayLike, time: float) -> Array:
        """Return the labels of the particles of the surface that are above points in the plane.

        Newton's method from the point less current and drift over ``time``, to 1e-10 of the shortest wave length, with
        steps that are halved unless they reduce the distance.

        Parameters
        ----------
        points : array_like
            Points (points, 2), m.
        time : float
            Time, s.

        Returns
        -------
        (points, 2) ndarray
            Labels, m; of a folded surface, with several particles above a point, any of them.

        Raises
        ------
        UsageError
            Points of another shape, or numbers that are not finite.
        NumericalError
            The search finds no particle above a point, for instance near a fold.
        """
        targets = np.asarray(points, dtype=float)
        check_points("Sea: points", targets)
        check_number("Sea: time", time, "s")
        labels = targets - (self.current + self.drift) * time
        scale = 2.0 * math.pi / np.hypot(*self.vectors.T).max()
        off = self.motion(labels, time).position[:, :2] - targets
        for _ in range(60):
            distance = np.hypot(*off.T)
            open_ = distance > 1e-10 * scale
            if not np.any(open_):
                return labels
            first, _ = self.derivatives(labels[open_], time)
            try:
                step = np.linalg.solve(first[:, :2, :], off[open_][:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:  # on an edge of a fold
                break
            step *= np.minimum(1.0, 0.25 * scale / np.maximum(np.hypot(*step.T), 1e-300))[:, None]
            factor = np.ones(len(step))
            at, best = labels[open_], distance[open_]
            for _ in range(8):
                tried = at - factor[:, None] * step
                distance = self.motion(tried, time).position[:, :2] - targets[open_]
                worse = np.hypot(*distance.T) > best
                if not np.any(worse):
                    break
                factor[worse] *= 0.5
            labels[open_], off[open_] = tried, distance
        bad = targets[np.argmax(np.hypot(*off.T))]
        location = f"x = {bad[0]:.6g} m, y = {bad[1]:.6g} m at t = {time:.6g} s"
        fault = f"no single particle of the surface is above {location} [E1223]"
        hint = "waves that are less steep: water folds over with a negative Jacobian of surface(labels, t)"
        raise NumericalError(Problem("Sea.labels_at", fault, hint))

    def at(self, points: ArrayLike, time: float) -> Motion:
        """Return the particles of the surface that are above points in the plane; see ``labels_at``.

        Parameters
        ----------
        points : array_like
            Points (points, 2), m.
        time : float
            Time, s.

        Returns
        -------
        Motion
            Of these particles.
        """
        return self.motion(self.labels_at(points, time), time)

    def elevation(self, x: ArrayLike, y: ArrayLike, time: float) -> Array:
        """Return the height of the surface above points of the plane.

        Parameters
        ----------
        x, y : array_like
            Coordinates (...), m.
        time : float
            Time, s.

        Returns
        -------
        (...) ndarray
            In m, of the shape of x and y together.

        Examples
        --------
        >>> from eomgen.waves import Sea
        >>> Sea.of_one_wave(0.1, 1.0, order=1).elevation([0.0], [0.0], 0.0).round(6)     # the crest
        array([1.])
        """
        return self._above(x, y, time, "position")[..., 2]

    def velocity(self, x: ArrayLike, y: ArrayLike, time: float) -> Array:
        """Return velocities of the water's surface above points of the plane.

        Parameters
        ----------
        x, y : array_like
            Coordinates (...), m.
        time : float
            Time, s.

        Returns
        -------
        (..., 3) ndarray
            In m/s, z upwards.
        """
        return self._above(x, y, time, "velocity")

    def acceleration(self, x: ArrayLike, y: ArrayLike, time: float) -> Array:
        """Return accelerations of the water's surface above points of the plane.

        Parameters
        ----------
        x, y : array_like
            Coordinates (...), m.
        time : float
            Time, s.

        Returns
        -------
        (..., 3) ndarray
            In m/s^2, z upwards.
        """
        return self._above(x, y, time, "acceleration")

    def _above(self, x: ArrayLike, y: ArrayLike, time: float, quantity: str) -> Array:
        try:
            x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        except ValueError:
            fault = f"shapes {np.shape(x)} and {np.shape(y)} do not go together [E1224]"
            raise UsageError(Problem("Sea: x and y", fault, "as many y as x, or one for all")) from None
        result = getattr(self.at(np.column_stack((x.ravel(), y.ravel())), time), quantity)
        return np.asarray(result).reshape(*x.shape, 3)

    def _own_labels(self, labels: ArrayLike) -> Array:
        """Return labels along and across the waves' direction, (2, points)."""
        check_points("Sea: labels", labels)
        return np.ascontiguousarray((np.asarray(labels, dtype=float) @ self._axes).T)
