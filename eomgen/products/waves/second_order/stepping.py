"""Second order stepped in time on a periodic grid of labels, wave number by wave number.

The velocity potential of second order is an oscillator at each wave number, forced by products of the first order:

    Phi_tt + g k tanh(k h) Phi = F = -2 u . u_t - zeta (w_tt + g w_c),   x2_t = (xi . grad) u_h + grad Phi   at c = 0,

and g z2 = -|u|^2/2 - xi . u_t - Phi_t + K. Without forcing every oscillator turns by a known angle, so a step is a
composition of such turns, in which time goes on (drifts), and of impulses of the forcing (kicks): the compositions of
``eomgen.integrators.compositions``. A step costs transforms of a dozen fields for each kick, however many pairs there
are. Dommermuth, Wave Motion 32 (2000) 307: a forcing that is switched on at once makes free waves, so motions start
from the sums over pairs, or with a ramp.
"""

from __future__ import annotations

import functools
import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.codegen.targets.c.printer import wrap_text
from eomgen.codegen.targets.c.templates import environment
from eomgen.errors import Problem, UsageError
from eomgen.integrators.compositions import Composition, composition_named
from eomgen.products.waves.sea_states.spectra import check_number
from eomgen.products.waves.second_order.pairs import COLUMNS
from eomgen.products.waves.second_order.routines import routine, statements
from eomgen.products.waves.second_order.sea import Sea
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from eomgen.toolchain.builder import Builder

Complex = NDArray[np.complex128]


@checked_calls()
@dataclass(frozen=True)
class Ramp:
    """A forcing that comes in as 1 - exp(-(t/time)^power), of Dommermuth."""

    time: float
    power: float = 4.0

    def __post_init__(self) -> None:
        for name in ("time", "power"):
            check_number(f"Ramp: {name}", getattr(self, name), above_zero=True)

    def __call__(self, elapsed: float) -> float:
        return -math.expm1(-((max(elapsed, 0.0) / self.time) ** self.power))


def fields_of(plane: bool) -> tuple[str, ...]:
    """Return the names of the fields of first order that the forcing reads; ``plane`` for two horizontal directions."""
    if not plane:
        return ("x", "z", "u", "w", "ut", "wt", "lift", "ua", "wa")
    return ("x", "y", "z", "u", "v", "w", "ut", "vt", "wt", "lift", "ua", "va", "vb", "wa", "wb")


def given_of(plane: bool) -> tuple[str, ...]:
    """Return derived quantities: the forcing, (xi . grad) u_h, and g z2 without Phi_t."""
    return ("force", "carried_x", "carried_y", "raised") if plane else ("force", "carried_x", "raised")


def source(plane: bool) -> str:
    """Return the C of the products of ``given_of`` at each point, from the fields of ``fields_of``."""
    tape = Tape()
    algebra = Algebra(tape)
    names = fields_of(plane)
    field = dict(zip(names, algebra.block("f", len(names)), strict=True))
    zero = algebra.zero
    x, y, z = field["x"], field.get("y", zero), field["z"]
    u, v, w = field["u"], field.get("v", zero), field["w"]
    ut, vt, wt = field["ut"], field.get("vt", zero), field["wt"]
    speed = u * ut + v * vt + w * wt
    # the field u is a gradient: du/dc = dw/da, du/db = dv/da
    tape.blocks.append((len(tape.op), "-2 u . u_t - zeta (w_tt + g w_c)"))
    force = speed * -2.0 - z * field["lift"]
    tape.blocks.append((len(tape.op), "(xi . grad) u along the plane"))
    carried = [x * field["ua"] + y * field.get("va", zero) + z * field["wa"]]
    if plane:
        carried.append(x * field["va"] + y * field["vb"] + z * field["wb"])
    tape.blocks.append((len(tape.op), "-|u|^2/2 - xi . u_t"))
    raised = (u * u + v * v + w * w) * -0.5 - (x * ut + y * vt + z * wt)
    refs = [item.ref for item in (force, *carried, raised)]
    inputs = {"f": [f"fields[{k} * points + n]" for k in range(len(names))]}
    targets = [f"given[{k} * points + n]" for k in range(len(refs))]
    text = environment().get_template("waves/forcing.c.jinja")
    case = "two horizontal directions" if plane else "one horizontal direction"
    body = statements(tape, refs, inputs, targets, 2)
    return wrap_text(text.render(case=case, fields=names, given=given_of(plane), body=body))


@functools.cache
def _routine(plane: bool) -> tuple[Any, Any]:
    return routine(Builder(), source(plane))


@checked_calls()
class SteppedSea:
    """The second order of a sea on a periodic grid of labels, stepped in time.

    Parameters
    ----------
    sea : Sea
        Sea whose first-order components are all on the grid's wave numbers.
    lengths : tuple of float
        Lengths along x and y after which the sea repeats itself, m. Along y any length for waves along x, with one
        label.
    counts : tuple of int
        Labels along x and y. More than four times the highest multiple of 2 pi/length among the components, so that no
        product of two is taken for another wave number.
    method : str
        A composition: ``suzuki4`` (4th order, five evaluations a step), ``omf4``, ``leapfrog`` and others.
    first : str, optional
        First part of a step, ``drift`` or ``kick``.
    time : float, optional
        Time of the start, s.
    ramp : Ramp
        Start from rest with a forcing that comes in; without one from the sums over pairs, if the sea is of order
        2.

    Attributes
    ----------
    time : float, s
    """

    def __init__(
        self,
        sea: Sea,
        lengths: tuple[float, float],
        counts: tuple[int, int],
        *,
        method: str = "suzuki4",
        first: Literal["drift", "kick"] = "drift",
        time: float = 0.0,
        ramp: Ramp | None = None,
    ) -> None:
        """Prepare the Fourier modes of a sea on a grid of labels, with the sums over pairs at the start, or zeros with
        a ramp. Raises UsageError for impossible arguments, and components that are not on the grid."""
        if min(lengths) <= 0.0 or min(counts) < 1:
            fault = f"lengths {lengths} m and {counts} labels are not above 0 [E1225]"
            raise UsageError(Problem("SteppedSea", fault, "along x and y; any length with one label along y"))
        if sea.vorticity != "none":
            fault = f"particles of a sea with vorticity = {sea.vorticity!r} do not drift, and stepped ones do [E1226]"
            raise UsageError(Problem("SteppedSea: sea", fault, 'vorticity = "none"'))
        self.composition: Composition = composition_named(method, first=first)
        self._sea, self.time, self._start, self._ramp = sea, float(time), float(time), ramp
        self._counts, self._lengths = counts, lengths
        self._plane = counts[1] > 1
        self._index = self._on_grid()
        unit = [2.0 * math.pi / length for length in lengths]
        self._kx = unit[0] * np.fft.fftfreq(counts[0], 1.0 / counts[0])[:, None]
        self._ky = unit[1] * np.fft.rfftfreq(counts[1], 1.0 / counts[1])[None, :]
        k = np.hypot(self._kx, self._ky)
        self._turning = np.sqrt(sea.restoring * k * (np.tanh(k * sea.depth) if math.isfinite(sea.depth) else 1.0))
        self._factors = self._factors_of_fields()
        empty = np.zeros(k.shape, dtype=complex)
        self._phi, self._rate, self._x, self._y = (empty.copy() for _ in range(4))
        if ramp is None:
            self._phi, self._rate, self._x, self._y = self._pair_sums(self.time)

    def step(self, size: float, steps: int = 1) -> None:
        """Step the second order of the sea in time, which changes the object and its ``time``.

        Oscillators are rotated exactly, so every step is stable; the error still grows with the step.

        Parameters
        ----------
        size : float
            Size of a step, s; negative: backwards.
        steps : int, optional
            Number of steps.
        """
        for part, fraction in self.composition.parts(steps):
            if part == "drift":
                self._drift(fraction * size)
                continue
            weight = fraction * size * (1.0 if self._ramp is None else self._ramp(self.time - self._start))
            moved = weight * np.fft.rfft2(self._products()[:-1])
            self._rate += moved[0]
            self._x += moved[1]
            if self._plane:
                self._y += moved[2]

    def potential(self) -> Array:
        """Return the velocity potential of second order at the labels.

        Returns
        -------
        (counts) ndarray
            In m^2/s.
        """
        return self._labels(self._phi)

    def displacement(self) -> Array:
        """Return displacements of second order at the labels, at the present ``time``.

        Displacements of first order are not included. After a start with a ramp x and y begin at 0, and z does not.

        Returns
        -------
        (counts[0], counts[1], 3) ndarray
            Along x, y and z, m.
        """
        products = self._products()
        up = (products[-1] - self._labels(self._rate) + self._sea.raised) / self._sea.restoring
        return np.stack((self._labels(self._x), self._labels(self._y), up), axis=-1)

    # -- parts of a step --------------------------------------------------------------------------------------------

    def _drift(self, size: float) -> None:
        """Turn every oscillator by the angle of the time ``size``, s, integrate the displacements by grad Phi, and
        advance time."""
        angle = self._turning * size
        half = 0.5 * size * np.sinc(0.5 * angle / math.pi)
        whole = size * np.sinc(angle / math.pi)  # integral of the cosine
        moved = whole * self._phi + 2.0 * half * half * self._rate  # integral of Phi
        self._x += 1j * self._kx * moved
        self._y += 1j * self._ky * moved
        cosine = np.cos(angle)
        self._phi, self._rate = (
            cosine * self._phi + whole * self._rate,
            cosine * self._rate - self._turning**2 * whole * self._phi,
        )
        self.time += size

    def _products(self) -> Array:
        """Return the quantities of ``given_of`` on the grid at the present time, (quantities, nx, ny)."""
        sea = self._sea
        crest = self._factors * (sea.amplitude * np.exp(1j * (sea.phase - sea.frequency * self.time)))
        nx, ny = self._counts
        whole = np.zeros((len(crest), nx * ny), dtype=complex)
        for sign, values in ((1, crest), (-1, np.conj(crest))):  # no two components are at one place
            at = np.ravel_multi_index((sign * self._index).T, (nx, ny), mode="wrap")
            whole[:, at] += 0.5 * nx * ny * values
        fields = np.ascontiguousarray(np.fft.irfft2(whole.reshape(-1, nx, ny)[:, :, : ny // 2 + 1], s=self._counts))
        ffi, lib = _routine(self._plane)
        products = np.empty((len(given_of(self._plane)), nx, ny))
        arrays = (ffi.from_buffer("double[]", array) for array in (fields, products))
        lib.eomgen_wave_forcing(nx * ny, sea.restoring, *arrays)
        return products

    def _factors_of_fields(self) -> Complex:
        """Return the factors of A exp(i theta) of each component in the fields of first order, (fields, n)."""
        row, sea = dict(zip(COLUMNS, self._sea.columns, strict=True)), self._sea
        w, Ch, Sh, k = row["w"], row["Ch"], row["Sh"], row["k"]
        ex, ey = row["ex"], row["ey"]
        slope = {"a": 1j * row["kx"], "b": 1j * row["ky"]}
        amplitudes = {"x": 1j * ex * Ch, "y": 1j * ey * Ch, "z": Sh + 0j}
        for name, of in (("u", "x"), ("v", "y"), ("w", "z")):
            amplitudes[name] = -1j * w * amplitudes[of]
            amplitudes[f"{name}t"] = -1j * w * amplitudes[name]
            for by in "ab":
                amplitudes[f"{name}{by}"] = slope[by] * amplitudes[name]
        # w_tt + g w_c, with dSh/dc = k Ch
        amplitudes["lift"] = -1j * w * amplitudes["wt"] + sea.restoring * (-1j * w) * k * Ch
        return np.stack([amplitudes[name] for name in fields_of(self._plane)])

    # -- wave numbers and labels ------------------------------------------------------------------------------------

    def _on_grid(self) -> NDArray[np.int64]:
        """Return the integer multiples (n, 2) of 2 pi/length that the components' wave vectors are. Raises UsageError
        for a component off the grid, and for too few labels."""
        multiples = self._sea.vectors * np.array(self._lengths) / (2.0 * math.pi)
        if not self._plane:
            multiples[:, 1] = np.where(self._sea.vectors[:, 1] == 0.0, 0.0, np.nan)
        index = np.rint(np.nan_to_num(multiples, nan=0.5))
        off = np.abs(multiples - index) > COMPUTED * np.hypot(*multiples.T)[:, None] + SUMMED
        if np.any(off | np.isnan(multiples)):
            number = int(np.argmax(np.any(off | np.isnan(multiples), axis=1)))
            along, across = multiples[number]
            fault = f"component {number} is ({along:.6g}, {across:.6g}) times 2 pi/length [E1227]"
            raise UsageError(Problem("SteppedSea: lengths", fault, "lengths that all components divide"))
        for name, count, most in zip("xy", self._counts, 4 * np.abs(index).max(axis=0), strict=True):
            if count <= most:
                fault = f"{count} labels along {name} take sums of waves for others [E1228]"
                raise UsageError(Problem("SteppedSea: counts", fault, f"{int(most) + 1} or more"))
        return np.asarray(index, np.int64)

    def _spectrum(self, amplitudes: Complex, index: NDArray[np.int64]) -> Complex:
        """Return the half spectrum on the grid of the sum of Re(amplitude exp(i k a)) over waves; ``index`` (m, 2) has
        their wave vectors as multiples."""
        nx, ny = self._counts
        whole = np.zeros(nx * ny, dtype=complex)
        for sign, values in ((1, amplitudes), (-1, np.conj(amplitudes))):
            at = np.ravel_multi_index((sign * index).T, (nx, ny), mode="wrap")
            whole.real += np.bincount(at, values.real, nx * ny)
            whole.imag += np.bincount(at, values.imag, nx * ny)
        return np.asarray(0.5 * nx * ny * whole.reshape(nx, ny)[:, : ny // 2 + 1])

    def _labels(self, spectrum: Complex) -> Array:
        return np.asarray(np.fft.irfft2(spectrum, s=self._counts))

    def _pair_sums(self, time: float) -> tuple[Complex, Complex, Complex, Complex]:
        """Return half spectra of Phi, its rate, and the displacements x and y along the plane, by sums over pairs at a
        time."""
        amplitudes = self._sea.bound_waves(time)
        places = np.concatenate(
            [sign_i * self._index[i] + sign_j * self._index[j] for i, sign_i, j, sign_j in amplitudes.members]
        )
        waves = (amplitudes.potential, amplitudes.rate, amplitudes.x, amplitudes.y)
        phi, rate, x, y = (self._spectrum(values, places) for values in waves)
        points = self._counts[0] * self._counts[1]
        x[0, 0] += points * amplitudes.drift[0]
        y[0, 0] += points * amplitudes.drift[1]
        return phi, rate, x, y
