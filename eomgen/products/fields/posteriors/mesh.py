"""A periodic mesh of cells in 1 to 3 dimensions with its wave numbers, and transforms between its spectra and fields of
cells, in double or single precision, by SciPy or by FFTW.

With orthonormal transforms F, F^-1 is the adjoint of F. A real field has conjugate amplitudes at k and -k, and only
amplitudes with k >= 0 along the last axis are kept. In products of two fields an amplitude of this half stands for two
if its partner is not kept, and for itself if k along the last axis is 0 or, for an even number of cells, the
highest.

SciPy's are always present, and allocate their results. FFTW comes with the optional package pyFFTW: its plans
write into arrays that are made once, aligned for vector registers. Plans are estimated, not measured, so that the same
numbers give the same bits on each run.
"""

from __future__ import annotations

import functools
import importlib
import math
import os
from collections.abc import Sequence
from typing import Any, overload

import numpy as np
import scipy.fft
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.base.messages import counted, nearest
from eomgen.base.products import optional_package
from eomgen.base.rounding import SUMMED
from eomgen.base.threads import thread_count
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.products.fields.documents.document import LENGTHS

Complex = NDArray[np.complex128]
#: A filter by wave number; None for 1.
Symbol = Array | Complex | None
#: Spectra and fields of cells in double or single precision.
Spectrum = NDArray[np.complex128] | NDArray[np.complex64]
Reals = NDArray[np.float64] | NDArray[np.float32]


@checked_calls()
@dataclass(frozen=True)
class Mesh:
    """A periodic box that is cut into equal cells.

    Attributes
    ----------
    cells : (nx,), (nx, ny) or (nx, ny, nz)
        Numbers of cells along each axis, from 2 on.
    lengths : of the box along each axis, in any unit of length; one number stands for all axes

    Raises
    ------
    UsageError
        For other numbers of axes, cells or lengths.
    """

    cells: tuple[int, ...]
    lengths: tuple[float, ...]

    def __init__(self, cells: Sequence[int], lengths: Sequence[float] | float) -> None:
        made = tuple(int(count) for count in cells)
        sides = (lengths,) * len(made) if isinstance(lengths, int | float) else tuple(lengths)
        if not 1 <= len(made) <= 3 or min(made) < 2:
            fault = f"{tuple(cells)} is not a mesh [E0797]"
            raise UsageError(Problem("Mesh: cells", fault, "1 to 3 numbers above 1: (64, 64)"))
        low, high = LENGTHS
        if len(sides) != len(made) or not all(low <= side <= high for side in sides):
            fault = f"{sides} are not {len(made)} lengths from {low:g} to {high:g} [E0798]"
            raise UsageError(Problem("Mesh: lengths", fault, "one number, or one for each axis"))
        object.__setattr__(self, "cells", made)
        object.__setattr__(self, "lengths", tuple(float(side) for side in sides))

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.cells)

    @property
    def half(self) -> tuple[int, ...]:
        """Shape of the half of a spectrum that is kept."""
        return (*self.cells[:-1], self.cells[-1] // 2 + 1)

    @property
    def cell_volume(self) -> float:
        """Volume of a cell, in the unit of length to the number of axes."""
        return math.prod(self.lengths) / self.size

    @functools.cached_property
    def wave_vectors(self) -> tuple[Array, ...]:
        """Components of k along each axis, with shapes that broadcast to ``half``; radians per length."""
        parts = []
        for axis, (count, length) in enumerate(zip(self.cells, self.lengths, strict=True)):
            frequencies = np.fft.rfftfreq if axis == len(self.cells) - 1 else np.fft.fftfreq
            shape = [1] * len(self.cells)
            shape[axis] = -1
            parts.append(np.asarray(2.0 * math.pi * frequencies(count, length / count).reshape(shape), float))
        return tuple(parts)

    @functools.cached_property
    def wave_numbers(self) -> Array:
        """|k|, shape ``half``; radians per length."""
        return np.sqrt(sum(part**2 for part in self.wave_vectors) + np.zeros(self.half))

    @functools.cached_property
    def weights(self) -> Array:
        """Number of amplitudes of the whole spectrum, 1 or 2, for which a kept amplitude stands, by index along the
        last axis."""
        weights = np.full(self.half[-1], 2.0)
        weights[0] = 1.0
        if self.cells[-1] % 2 == 0:
            weights[-1] = 1.0
        return weights

    @property
    def threads(self) -> int:
        """Threads of a transform."""
        return thread_count() if self.size >= 32**3 else 1  # more cost more than they save below

    @overload
    def spectrum(self, field: Array, *, overwrite: bool = False) -> Complex: ...
    @overload
    def spectrum(self, field: Reals, *, overwrite: bool = False) -> Spectrum: ...
    def spectrum(self, field: Reals, *, overwrite: bool = False) -> Spectrum:
        """Return the half spectrum of a real field by an orthonormal transform, in the precision of the field.

        Parameters
        ----------
        field : ndarray
            One field of cells, shape ``cells``, which is not checked: all axes of an array are transformed.
        overwrite : bool, optional
            Whether the memory of the argument may be used, so that the argument has no meaning afterwards.

        Returns
        -------
        complex ndarray
            Shape ``half``.

        Examples
        --------
        >>> from eomgen.fields import Mesh
        >>> mesh = Mesh((8, 8), 1.0)
        >>> field = np.random.default_rng(1).standard_normal(mesh.cells)
        >>> bool(np.allclose(mesh.field(mesh.spectrum(field)), field))
        True
        """
        made: Spectrum = scipy.fft.rfftn(field, norm="ortho", workers=self.threads, overwrite_x=overwrite)
        return made

    @overload
    def field(self, spectrum: Complex, *, overwrite: bool = False) -> Array: ...
    @overload
    def field(self, spectrum: Spectrum, *, overwrite: bool = False) -> Reals: ...
    def field(self, spectrum: Spectrum, *, overwrite: bool = False) -> Reals:
        """Return the real field of half a spectrum, the inverse of ``spectrum``, in the precision of the spectrum.

        SciPy allocates the result and, in more than one dimension, a spectrum for the transforms along the other axes.

        Parameters
        ----------
        spectrum : complex ndarray
            Half spectrum, shape ``half``, which is not checked: other shapes are cut or filled with zeros.
        overwrite : bool, optional
            Whether the memory of the argument may be used, so that the argument has no meaning afterwards.

        Returns
        -------
        ndarray
            Shape ``cells``.
        """
        made: Reals = scipy.fft.irfftn(
            spectrum, s=self.cells, norm="ortho", workers=self.threads, overwrite_x=overwrite
        )
        return made

    def product(self, one: Complex, two: Complex) -> float:
        """Return the sum over cells of the product of two real fields, given by spectra.

        Parameters
        ----------
        one, two : complex ndarray
            Half spectra, shape ``half``.

        Returns
        -------
        float
            The sum over cells.
        """
        return float(np.sum((one.real * two.real + one.imag * two.imag) * self.weights))

    def white(self, generator: np.random.Generator) -> Complex:
        """Return the spectrum of independent standard normal numbers in all cells.

        Parameters
        ----------
        generator : numpy.random.Generator
            Source of the numbers.

        Returns
        -------
        complex ndarray
            Half spectrum, shape ``half``.
        """
        return self.spectrum(generator.standard_normal(self.cells))

    def power(self, spectrum: Complex, bins: int) -> tuple[Array, Array]:
        """Return the mean of |amplitude|^2 in equal bins of |k| from above 0 to the least Nyquist wave number.

        The Nyquist wave number of an axis is pi divided by the width of a cell. Amplitudes at k = 0 and above the bins
        are left out; means are over the whole spectrum, of which the argument is the kept half.

        Parameters
        ----------
        spectrum : complex ndarray
            Half spectrum of the orthonormal transform, shape ``half``.
        bins : int
            Number of bins.

        Returns
        -------
        (k, power) : (bins,) each
            Means of |k|, in radians per length, and of |amplitude|^2 in each bin, which times ``cell_volume`` is the
            power spectrum; NaN in empty bins.
        """
        number, inside, count, mean = _bins(self, bins)
        weights = np.broadcast_to(self.weights, self.half)
        result = np.bincount(number, (weights * np.abs(spectrum) ** 2).ravel()[inside], bins)
        with np.errstate(invalid="ignore"):
            return mean.copy(), result / count

    def require_memory(self, spectra: int, fields: int, purpose: str, numbers: int = 0) -> int:
        """Return the bytes of half spectra of complex numbers, fields of doubles, and further numbers.

        Parameters
        ----------
        spectra : int
            Number of half spectra of complex numbers.
        fields : int
            Number of fields of doubles.
        purpose : str
            Use of the memory, for the message.
        numbers : int, optional
            Number of further doubles.

        Returns
        -------
        int
            Bytes; no memory is allocated.

        Raises
        ------
        ModelError
            The machine has less physical memory than that, free or in use. Not raised if the system
            does not report its memory.
        """
        needed = 16 * spectra * math.prod(self.half) + 8 * fields * self.size + 8 * numbers
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else needed
        if needed > there:
            shape = " x ".join(map(str, self.cells))
            fault = f"{purpose} on {shape} cells takes {needed / 2**30:.3g} GiB, and this machine has"
            raise ModelError(Problem("memory", f"{fault} {there / 2**30:.3g} [E0799]", "fewer cells, or chains"))
        return needed


def numbers_of_cells(mesh: Mesh, values: ArrayLike, least: float, key: str) -> Array:
    """Return an array of the shape ``mesh.cells``, broadcast from ``values``. Raises ModelError at ``key`` if a number
    is not finite or below ``least``."""
    made = np.array(np.broadcast_to(values, mesh.cells), dtype=float, order="C")
    wrong = ~np.isfinite(made) | (made < least)
    if np.any(wrong):
        cell = tuple(int(axis[0]) for axis in np.nonzero(wrong))
        bound = "finite numbers" if least == -math.inf else f"finite numbers from {least:.6g} on"
        fault = f"{counted(int(wrong.sum()), 'cell')} out of range: {made[cell]:.6g} at {cell} [E0811]"
        raise ModelError(Problem(key, fault, bound))
    return made


@functools.lru_cache(maxsize=4)
def _bins(mesh: Mesh, bins: int) -> tuple[NDArray[np.int64], NDArray[np.bool_], Array, Array]:
    """Return the bin of each amplitude within the bins, the mask (flat, over the half spectrum) of these amplitudes,
    and the number and the mean |k| of the amplitudes in each bin, (bins,) each. Bins are equal parts of |k| up to the
    Nyquist wave number."""
    nyquist = min(math.pi * count / length for count, length in zip(mesh.cells, mesh.lengths, strict=True))
    weights = np.broadcast_to(mesh.weights, mesh.half)
    number = np.ceil(mesh.wave_numbers / nyquist * bins - SUMMED).astype(int).ravel() - 1
    inside = (number >= 0) & (number < bins)
    number = number[inside]
    count, of_k = (
        np.bincount(number, (weights * values).ravel()[inside], bins)
        for values in (np.ones(mesh.half), mesh.wave_numbers)
    )
    with np.errstate(invalid="ignore"):
        return number, inside, np.asarray(count, float), of_k / count


LIBRARIES, PRECISIONS = ("scipy", "fftw"), ("double", "single")


#: Number of cells from which on columns along the first of three axes are copied to a buffer: the distances of columns
#: in memory are so large that estimated plans take four times as long on 256^3 cells.
_LARGE = 128**3


class Transforms:
    """Transforms between spectra and cells by SciPy, with memory for a number of fields on a mesh.

    Attributes
    ----------
    buffer : half spectrum, the input of ``field``, undefined afterwards
    scale : factor of spectra in both directions that makes transforms orthonormal
    """

    def __init__(self, mesh: Mesh, single: bool) -> None:
        self.mesh, self.scale = mesh, 1.0
        self.buffer: Spectrum = np.empty(mesh.half, np.complex64) if single else np.empty(mesh.half, np.complex128)

    def field(self, number: int) -> Reals:
        """Return the field of the spectrum in the buffer; with FFTW, the array of the field of this number."""
        return self.mesh.field(self.buffer, overwrite=True)

    def spectrum(self, number: int, field: Reals) -> Spectrum:
        """Return the spectrum of the field with this number, the result of ``field``, whose memory is undefined
        afterwards; with FFTW, the spectrum is the buffer."""
        return self.mesh.spectrum(field, overwrite=True)

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        """Write the orthonormal spectrum of independent standard normal numbers in all cells into a given array,
        ``to``."""
        to[...] = self.mesh.white(generator)


class _FFTW(Transforms):
    def __init__(self, mesh: Mesh, single: bool, fields: int) -> None:
        """Plan the transforms with FFTW, in slabs for large meshes of three dimensions."""
        fftw: Any = importlib.import_module("pyfftw")
        large = len(mesh.cells) == 3 and mesh.size >= _LARGE
        axes = (1, 2) if large else tuple(range(len(mesh.cells)))
        self.scale = 1.0 / math.sqrt(mesh.size)
        self.buffer: Spectrum = fftw.zeros_aligned(mesh.half, "complex64" if single else "complex128")
        self._fields: list[Reals] = []
        self._to_cells, self._from_cells = [], []
        options = {"axes": axes, "flags": ("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"), "threads": mesh.threads}
        for _ in range(max(fields, 1)):
            field = fftw.zeros_aligned(mesh.cells, "float32" if single else "float64")
            self._fields.append(field)
            self._to_cells.append(fftw.FFTW(self.buffer, field, direction="FFTW_BACKWARD", **options))
            self._from_cells.append(fftw.FFTW(field, self.buffer, **options))
        self._slab: Spectrum | None = None
        if large:
            self._slab = fftw.zeros_aligned((mesh.cells[0], mesh.half[2]), self.buffer.dtype)
            options |= {"axes": (0,)}
            self._forward = fftw.FFTW(self._slab, self._slab, **options)
            self._backward = fftw.FFTW(self._slab, self._slab, direction="FFTW_BACKWARD", **options)

    def field(self, number: int) -> Reals:
        if self._slab is not None:
            self._along_first(self._backward, self._slab)
        self._to_cells[number].execute()
        return self._fields[number]

    def spectrum(self, number: int, field: Reals) -> Spectrum:
        self._from_cells[number].execute()
        if self._slab is not None:
            self._along_first(self._forward, self._slab)
        return self.buffer

    def _along_first(self, plan: Any, slab: Spectrum) -> None:
        for number in range(self.buffer.shape[1]):
            slab[...] = self.buffer[:, number]
            plan.execute()
            self.buffer[:, number] = slab

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        generator.standard_normal(out=self._fields[0])  # of doubles
        self.spectrum(0, self._fields[0])
        np.multiply(self.buffer, self.scale, out=to)


def check_transforms(library: str, precision: str) -> None:
    """Raise an error for a library of transforms that is not there or not installed, and for an unknown precision.

    Parameters
    ----------
    library : str
        ``scipy`` or ``fftw``.
    precision : str
        ``double`` or ``single``.

    Raises
    ------
    UsageError
        An unknown library or precision, or ``fftw`` without the package pyfftw.
    """
    wanted = ("transforms", "library", library, LIBRARIES), ("precision", "precision", precision, PRECISIONS)
    for key, noun, choice, known in wanted:
        if choice not in known:
            raise UsageError(Problem(key, f"there is no {noun} {choice!r} [E0800]", nearest(choice, known)))
    if library == "fftw":
        fault = "FFTW comes with the package pyfftw, which is not installed [E0802]"
        optional_package("pyfftw", Problem("transforms", fault, "pip install 'eomgen[fast_fourier]', or scipy"))


def transforms(mesh: Mesh, library: str, fields: int, *, single: bool = False) -> Transforms:
    """Return transforms with memory for ``fields`` fields, by the library ``scipy`` or ``fftw``, which has been
    checked; ``single`` for single precision."""
    return Transforms(mesh, single) if library == "scipy" else _FFTW(mesh, single, fields)
