"""Transforms between spectra and fields of cells, in double or single precision, by SciPy or by FFTW.

SciPy's are always present, and allocate their results. FFTW comes with the optional package pyFFTW: its plans
write into arrays that are made once, aligned for vector registers. Plans are estimated, not measured, so that the same
numbers give the same bits on each run.
"""

from __future__ import annotations

import importlib
import math
from typing import Any, Literal, Protocol

import numpy as np

from eomgen.base.text import listed, nearest
from eomgen.errors import Problem, UsageError
from eomgen.products.fields.posteriors.mesh import Complex, Mesh, Reals, Spectrum

Library = Literal["scipy", "fftw"]
LIBRARIES: tuple[Library, ...] = ("scipy", "fftw")
Precision = Literal["double", "single"]
PRECISIONS: tuple[Precision, ...] = ("double", "single")
#: Cells from which on columns along the first of three axes go through an array of their own: they lie so far apart in
#: memory that estimated plans take four times as long for them on 256^3 cells.
_LARGE = 128**3


class Transforms(Protocol):
    """Transforms of a number of fields on a mesh.

    Attributes
    ----------
    buffer : a spectrum, which ``field`` takes; its content is undefined afterwards
    scale : by which spectra are to be multiplied in both directions for transforms to be orthonormal
    """

    buffer: Spectrum
    scale: float

    def field(self, number: int) -> Reals:
        """Return the field of the spectrum in the buffer; with FFTW, the array of the field of this number."""

    def spectrum(self, number: int, field: Reals) -> Spectrum:
        """Return the spectrum of the field of this number, as ``field`` gave it, in place of which anything may stand
        afterwards; with FFTW, it is the buffer."""

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        """Write the spectrum of independent standard normal numbers in all cells into an array that is there."""


class _SciPy:
    def __init__(self, mesh: Mesh, single: bool) -> None:
        self.mesh, self.scale = mesh, 1.0
        self.buffer: Spectrum = np.empty(mesh.half, np.complex64) if single else np.empty(mesh.half, np.complex128)

    def field(self, _: int) -> Reals:
        return self.mesh.field(self.buffer, overwrite=True)

    def spectrum(self, _: int, field: Reals) -> Spectrum:
        return self.mesh.spectrum(field, overwrite=True)

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        to[...] = self.mesh.white(generator)


class _FFTW:
    def __init__(self, mesh: Mesh, single: bool, fields: int) -> None:
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

    def spectrum(self, number: int, _: Reals) -> Spectrum:
        self._from_cells[number].execute()
        if self._slab is not None:
            self._along_first(self._forward, self._slab)
        return self.buffer

    def _along_first(self, plan: Any, slab: Spectrum) -> None:
        for place in range(self.buffer.shape[1]):
            slab[...] = self.buffer[:, place]
            plan.execute()
            self.buffer[:, place] = slab

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        generator.standard_normal(out=self._fields[0])  # of doubles
        self.spectrum(0, self._fields[0])
        np.multiply(self.buffer, self.scale, out=to)


def check_transforms(library: str, precision: str) -> None:
    """Raise UsageError for a library that there is not or that is not installed, and for an unknown precision."""
    if library not in LIBRARIES:
        fault = f"there is no library {library!r} for transforms"
        raise UsageError(Problem("transforms", fault, nearest(library, LIBRARIES) or listed(LIBRARIES)))
    if precision not in PRECISIONS:
        fault = f"there is no precision {precision!r}"
        raise UsageError(Problem("precision", fault, nearest(precision, PRECISIONS) or listed(PRECISIONS)))
    if library == "fftw":
        try:
            importlib.import_module("pyfftw")
        except ImportError:
            fault = "FFTW comes with the package pyfftw, which is not installed"
            hint = "pip install 'eomgen[fast_fourier]', or scipy"
            raise UsageError(Problem("transforms", fault, hint)) from None


def transforms(mesh: Mesh, library: str, fields: int, *, single: bool = False) -> Transforms:
    """Return the transforms of so many fields, by a library that has been checked."""
    return _SciPy(mesh, single) if library == "scipy" else _FFTW(mesh, single, fields)
