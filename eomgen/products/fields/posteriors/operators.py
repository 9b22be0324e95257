"""Linear operators from white fields to fields of cells, each with its adjoint: W F^-1 a(k) F.

a(k) is a filter, diagonal in Fourier space, and W a mask, diagonal in the cells. With orthonormal transforms the
adjoint is F^-1 conj(a) F W; it needs no derivation, and the product <A x, y> = <x, A^T y> of random fields tests it.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.fields.posteriors.mesh import Complex, Mesh

#: P(k) by wave number: a function of arrays, or the values at ``mesh.wave_numbers``.
Power = Callable[[Array], ArrayLike] | Array


@dataclass(frozen=True)
class LinearOperator:
    """A filter in Fourier space and then a mask in the cells; None stands for 1 everywhere.

    Attributes
    ----------
    symbol : a(k), real or complex, shape ``mesh.half``
    mask : W, shape ``mesh.cells``
    note : deviation of the field from the requested one; empty if none
    """

    name: str
    mesh: Mesh
    symbol: Array | Complex | None = None
    mask: Array | None = None
    note: str = ""

    def apply(self, spectrum: Complex) -> Array:
        """Return the field of cells that a spectrum gives: filter, transform to the cells, and mask, in this order.

        Parameters
        ----------
        spectrum : complex ndarray
            Half spectrum, shape ``mesh.half``; of a white field for a field with the prior of the operator.

        Returns
        -------
        ndarray
            Shape ``mesh.cells``.
        """
        field = self.mesh.field(self.filtered(spectrum))
        return field if self.mask is None else self.mask * field

    def filtered(self, spectrum: Complex) -> Complex:
        """Return a spectrum after the filter.

        Parameters
        ----------
        spectrum : complex ndarray
            Half spectrum, shape ``mesh.half``.

        Returns
        -------
        complex ndarray
            Half spectrum, shape ``mesh.half``.
        """
        return spectrum if self.symbol is None else self.symbol * spectrum

    def adjoint(self, field: Array) -> Complex:
        """Return the spectrum that the adjoint makes of a field of cells: mask, transform, and conjugate filter.

        Inner products are the sum over cells for fields, and ``Mesh.product`` for spectra.

        Parameters
        ----------
        field : ndarray
            Field of cells, shape ``mesh.cells``.

        Returns
        -------
        complex ndarray
            Half spectrum, shape ``mesh.half``.
        """
        spectrum = self.mesh.spectrum(field if self.mask is None else self.mask * field)
        return spectrum if self.symbol is None else np.conj(self.symbol) * spectrum

    def __matmul__(self, other: LinearOperator) -> LinearOperator:
        """Return the operator that applies ``other`` first and then this one.

        Raises
        ------
        UsageError
            A filter is to follow a mask, or the meshes differ.
        """
        name = f"{self.name} @ {other.name}"
        if self.mesh != other.mesh:
            raise UsageError(Problem(name, "the operators have different meshes [E0803]", "one mesh for all of them"))
        if self.symbol is not None and other.mask is not None:
            fault = "a filter after a mask is diagonal neither in Fourier space nor in the cells [E0804]"
            raise UsageError(Problem(name, fault, "the mask as the last operator: mask @ filter"))
        symbol, mask = _times(self.symbol, other.symbol), _times(self.mask, other.mask)
        return LinearOperator(name, self.mesh, symbol, mask, self.note or other.note)

    @property
    def variance(self) -> float:
        """Expected variance, as a mean over cells, of the field that the operator makes of white noise of variance 1;
        infinite on overflow."""
        if self.symbol is None:
            spread = 1.0
        else:
            with np.errstate(over="ignore"):
                spread = float(np.sum(np.abs(self.symbol) ** 2 * self.mesh.weights)) / self.mesh.size
        return spread if self.mask is None else spread * float(np.mean(self.mask**2))

    def dot_test(self, generator: np.random.Generator) -> float:
        """Return |<A x, y> - <x, A^T y>| of random x and y, in parts of |A x| |y|.

        Parameters
        ----------
        generator : numpy.random.Generator
            Source of x and y.

        Returns
        -------
        float
            Zero up to rounding for an adjoint that fits, also for a filter whose a(-k) is not the conjugate of a(k),
            which the test does not find. Not divided if A x is 0 in all cells.

        Examples
        --------
        >>> from eomgen.fields import Mesh, smoothing
        >>> operator = smoothing(Mesh((8, 8), 1.0), 0.2)
        >>> operator.dot_test(np.random.default_rng(1)) < 1e-12
        True
        """
        x, y = self.mesh.white(generator), generator.standard_normal(self.mesh.cells)
        made = self.apply(x)
        error = abs(float(np.sum(made * y)) - self.mesh.product(x, self.adjoint(y)))
        return error / (math.sqrt(float(np.sum(made**2)) * float(np.sum(y**2))) or 1.0)  # 0 for an operator of zeros


def white(mesh: Mesh) -> LinearOperator:
    """Return the operator without filter and mask, which maps the spectrum of a white field to its cells.

    Parameters
    ----------
    mesh : Mesh
        The mesh.

    Returns
    -------
    LinearOperator
        The identity.

    Examples
    --------
    >>> from eomgen.fields import Mesh, white
    >>> mesh = Mesh((8, 8), 1.0)
    >>> noise = mesh.white(np.random.default_rng(1))
    >>> white(mesh).apply(noise).shape
    (8, 8)
    """
    return LinearOperator("white", mesh)


def amplitude(mesh: Mesh, power: Power) -> LinearOperator:
    """Return the filter sqrt(P(k)/V) by which white noise gets the power spectrum P, V the volume of a cell.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    power : callable or array_like
        P of |k| in radians per length, or its values, shape ``mesh.half``.

    Returns
    -------
    LinearOperator
        A filter.

    Raises
    ------
    ModelError
        P is negative or not finite at a wave number of the mesh.
    """
    return LinearOperator("amplitude", mesh, np.sqrt(_values(mesh, power) / mesh.cell_volume))


def lognormal_amplitude(mesh: Mesh, power: Power, *, warn: bool = True) -> LinearOperator:
    """Return the filter of the Gaussian field s for which exp(s - variance/2) - 1 has the power spectrum P.

    The covariance of s is ln(1 + C) with the covariance C that P has on the mesh (Coles and Jones, MNRAS 248 (1991) 1).
    Modes whose variance would be below 1e-12 of the largest have 1e-12 of the largest: no lognormal field has a power
    spectrum that makes variances negative. If the variance of s thereby grows by more than 0.1 %, ``note`` of the
    filter states the share of such modes, the growth, and the share of the power that is off by more than a tenth.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    power : callable or array_like
        P of |k| in radians per length, or its values, shape ``mesh.half``; in the unit of a cell's volume.
    warn : bool
        Whether the note, if there is one, is a RuntimeWarning, too.

    Returns
    -------
    LinearOperator
        A filter; its ``note`` is empty for a smaller growth.

    Raises
    ------
    ModelError
        P is negative or not finite at a wave number of the mesh, 0 included, or C is -1 or less somewhere.
    """
    wanted = _values(mesh, power) / mesh.cell_volume
    covariance = mesh.field(wanted.astype(complex)) / math.sqrt(mesh.size)
    if float(covariance.min()) <= -1.0:
        fault = f"a density contrast whose covariance is {float(covariance.min()):.3g} somewhere is not lognormal"
        raise ModelError(Problem("lognormal_amplitude: power", f"{fault} [E0805]", "a covariance above -1 everywhere"))
    modes = mesh.spectrum(np.log1p(covariance)).real * math.sqrt(mesh.size)
    floored = np.maximum(modes, SUMMED * float(modes.max()))  # no variance may be 0 or below
    note = _note_on_floored(mesh, wanted, modes, floored)
    if note and warn:
        warnings.warn(f"lognormal_amplitude: {note}", RuntimeWarning, stacklevel=2)
    return LinearOperator("lognormal_amplitude", mesh, np.sqrt(floored), note=note)


def _note_on_floored(mesh: Mesh, wanted: Array, modes: Array, floored: Array) -> str:
    """Return a sentence with the shares of floored modes and of the power of the density changed by them; empty if
    small.

    Parameters
    ----------
    wanted : variances of the modes of the density, shape ``mesh.half``
    modes, floored : variances of the modes of the Gaussian field, before and after negative ones are replaced
    """
    weights = np.broadcast_to(mesh.weights, mesh.half)
    added, whole = float(np.sum((floored - modes) * weights)), float(np.sum(modes * weights))
    if not added > 1e-3 * whole:
        return ""
    covariance = mesh.field(floored.astype(complex)) / math.sqrt(mesh.size)
    made = mesh.spectrum(np.expm1(covariance)).real * math.sqrt(mesh.size)
    off = (np.abs(made - wanted) > 0.1 * wanted) & (mesh.wave_numbers > 0.0)
    share = float(np.sum((floored > modes) * weights)) / mesh.size
    of_power = float(np.sum(wanted[off] * weights[off]) / np.sum(wanted * weights))
    first = float(mesh.wave_numbers[off].min()) if off.any() else math.inf
    message = f"no lognormal field has this power spectrum: {share:.2%} of the modes of its Gaussian field would have a"
    message += f" negative variance, and have next to none; the variance is {added / whole:.2%} larger, and the power"
    message += f" of the density off by more than a tenth in modes from k = {first:.3g} on, with {of_power:.2%} of it"
    return message


def smoothing(mesh: Mesh, radius: float) -> LinearOperator:
    """Return the Gaussian filter exp(-(k radius)^2/2).

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    radius : float
        In the length of the mesh.

    Returns
    -------
    LinearOperator
        A filter.

    Examples
    --------
    >>> from eomgen.fields import Mesh, smoothing
    >>> mesh = Mesh((8, 8), 1.0)
    >>> operator = smoothing(mesh, 0.2)
    >>> bool(np.allclose(operator.apply(mesh.spectrum(np.ones(mesh.cells))), 1.0))     # a mean stays
    True
    """
    return LinearOperator("smoothing", mesh, np.exp(-0.5 * (mesh.wave_numbers * radius) ** 2))


def difference(mesh: Mesh, axis: int) -> LinearOperator:
    """Return the central difference of both neighbours of a cell along an axis, divided by two widths of a cell.

    The mesh is periodic. The adjoint of this operator is the negative operator. Raises UsageError for an axis that the
    mesh lacks.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    axis : int
        Number of the axis, from 0; negative numbers are refused.

    Returns
    -------
    LinearOperator
        A filter, whose result is per unit of length.
    """
    if not 0 <= axis < len(mesh.cells):
        fault = f"there is no axis {axis} in {len(mesh.cells)} dimensions [E0806]"
        raise UsageError(Problem("difference: axis", fault, f"0 to {len(mesh.cells) - 1}"))
    width = mesh.lengths[axis] / mesh.cells[axis]
    turned = 1j * np.sin(mesh.wave_vectors[axis] * width) / width
    if mesh.cells[axis] % 2 == 0:  # sin(pi) is not quite 0, and an amplitude without a partner has to be real
        turned[np.abs(mesh.wave_vectors[axis]) * width > math.pi * (1.0 - SUMMED)] = 0.0
    return LinearOperator("difference", mesh, np.broadcast_to(turned, mesh.half).copy())


def mask(mesh: Mesh, values: ArrayLike) -> LinearOperator:
    """Return the operator that multiplies a field of cells by factors. Raises UsageError for another shape, even if it
    broadcasts, and for factors that are not finite.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    values : array_like
        Factors of the cells, shape ``mesh.cells``; an array of doubles is kept without a copy.

    Returns
    -------
    LinearOperator
        A mask.

    Examples
    --------
    >>> from eomgen.fields import Mesh, mask
    >>> mesh = Mesh((4, 4), 1.0)
    >>> bool(mask(mesh, np.zeros((4, 4))).apply(mesh.white(np.random.default_rng(1))).any())
    False
    """
    made = np.asarray(values, dtype=float)
    if made.shape != mesh.cells or not np.all(np.isfinite(made)):
        fault = f"an array of the shape {made.shape} is not a mask of finite numbers for {mesh.cells} cells [E0807]"
        raise UsageError(Problem("mask: values", fault, f"finite numbers of the shape {mesh.cells}"))
    return LinearOperator("mask", mesh, mask=made)


#: The operators by name.
OPERATORS: Mapping[str, Callable[..., LinearOperator]] = {
    made.__name__: made for made in (white, amplitude, lognormal_amplitude, smoothing, difference, mask)
}


def _values(mesh: Mesh, power: Power) -> Array:
    with np.errstate(all="ignore"):
        values = np.array(np.broadcast_to(power(mesh.wave_numbers) if callable(power) else power, mesh.half), float)
    if not np.all(np.isfinite(values)) or values.min() < 0.0:
        cell = np.unravel_index(int(np.argmin(np.where(np.isfinite(values), values, -np.inf))), mesh.half)
        fault = f"the power is {values[cell]:.6g} at k = {mesh.wave_numbers[cell]:.6g} [E0808]"
        raise ModelError(Problem("power", fault, "finite values from 0 on, at k = 0 too"))
    return values


def _times(first: Any, second: Any) -> Any:
    """Return the product of two arrays, each None for 1."""
    return second if first is None else first if second is None else first * second
