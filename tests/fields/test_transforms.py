"""Transforms by SciPy and by FFTW, in double and in single precision, against one another."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from eomgen.base.threads import share
from eomgen.errors import EomgenError
from eomgen.fields import FieldPosterior, Mesh, Sampler, amplitude, difference, follow, mask, white
from eomgen.integrators.compositions import composition_named
from eomgen.products.fields.posteriors.cells import CellRoutines
from tests.fields.density import counted, optimised

__all__ = ["optimised"]

KINDS = [("scipy", "single"), ("fftw", "double"), ("fftw", "single")]


def stream(seed: int = 3) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(seed))


def as_asked(posterior: FieldPosterior, transforms: str, precision: str) -> FieldPosterior:
    """Return the same posterior with other transforms."""
    return FieldPosterior(posterior.mesh, posterior.energy_of_cell, posterior.operators, posterior.data,
                          transforms=transforms, precision=precision)  # fmt: skip


def three_fields(cells: tuple[int, ...]) -> FieldPosterior:
    """Return a posterior of a field, of its difference with a mask, and of the white field itself."""
    mesh = Mesh(cells, tuple(5.0 * count for count in cells))
    s = amplitude(mesh, lambda k: 300.0 * np.exp(-((4.0 * k) ** 2)))
    seen = mask(mesh, stream().random(cells))
    fields = {"s": s, "slope": seen @ difference(mesh, 0) @ s, "noise": white(mesh)}
    return FieldPosterior(mesh, "exp(s) - d*s + slope**4 + (noise - s)**2/2", fields, {"d": stream(5).random(cells)})


@pytest.mark.slow
@pytest.mark.long_except("fftw-single-cells0", "fftw-single-cells1", "scipy-single-cells0", "fftw-single-cells2")
@pytest.mark.parametrize("cells", [(4, 6, 5), (7,), (6, 5), (8, 8, 8)])
@pytest.mark.parametrize(("transforms", "precision"), KINDS)
def test_what_a_posterior_gives_is_the_same(transforms: str, precision: str, cells: tuple[int, ...]) -> None:
    by_scipy = three_fields(cells)
    made = as_asked(by_scipy, transforms, precision)
    x, y = by_scipy.mesh.white(stream(1)), by_scipy.mesh.white(stream(2))
    assert made.energy(x) == pytest.approx(by_scipy.energy(x), rel=1e-14)
    slope = by_scipy.gradient(x)
    size = float(np.abs(slope).max())
    assert made.gradient(x) == pytest.approx(slope, abs=1e-14 * size)
    found = np.ones_like(x)
    assert made.energy_and_gradient(x, found) == made.energy(x)
    assert np.array_equal(found, made.gradient(x))
    added = y.copy()
    made.add_gradient(-0.3, x, added)
    error = float(np.abs(added - (y - 0.3 * slope)).max()) / size
    assert 1e-10 < error < 1e-6 if precision == "single" else error < 1e-14
    product, other = made.hessian(x), by_scipy.hessian(x)
    made.energy(y)  # the product keeps fields of its own
    assert product(y) == pytest.approx(other(y), abs=1e-13 * float(np.abs(other(y)).max()))
    for name, operator in by_scipy.operators.items():
        assert made.value(name, x) == pytest.approx(operator.apply(x), abs=1e-13)
    drawn = np.empty_like(x)
    made.white(stream(7), drawn)
    assert drawn == pytest.approx(by_scipy.mesh.white(stream(7)), abs=1e-13)
    assert made.mode().energy == pytest.approx(by_scipy.mode().energy, rel=1e-12)


@pytest.mark.parametrize("cells", [(4, 6, 5), (8, 8, 8)])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_columns_of_large_meshes_go_through_an_array_of_their_own(
    precision: str, cells: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("eomgen.products.fields.posteriors.mesh._LARGE", 1)
    test_what_a_posterior_gives_is_the_same("fftw", precision, cells)


@pytest.mark.parametrize(("transforms", "precision"), KINDS)
def test_trajectories_go_back_and_samples_come_again(transforms: str, precision: str) -> None:
    """The errors of energies are those of doubles, and rounding of gradients does not turn a way back aside."""
    by_scipy, truth = counted(8, 0.3)
    made = as_asked(by_scipy, transforms, precision)
    x, p = truth.copy(), made.mesh.white(stream(4))
    start = (x.copy(), p.copy())
    method = composition_named("suzuki4")
    follow(made, method, 0.5, 4, x, p)
    p *= -1.0
    follow(made, method, 0.5, 4, x, p)
    assert np.abs(x - start[0]).max() < 1e-12 and np.abs(p + start[1]).max() < 1e-12

    def samples(posterior: FieldPosterior) -> Any:
        return Sampler(posterior, step=0.7, start=[truth], seed=2).draw(12)

    one, again, other = samples(made), samples(as_asked(by_scipy, transforms, precision)), samples(by_scipy)
    assert np.array_equal(one.cells, again.cells) and np.array_equal(one.energy_errors, again.energy_errors)
    assert one.energy_errors == pytest.approx(other.energy_errors, abs=1e-4 if precision == "single" else 1e-10)
    assert one.power == pytest.approx(other.power, rel=1e-5 if precision == "single" else 1e-10, nan_ok=True)


def test_threads_get_the_same_parts_of_each_array(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 1024 numbers or a multiple, but for the last; small arrays, and those of one thread, are not cut."""
    routines = CellRoutines.__new__(CellRoutines)
    one, two = np.arange(5000.0).reshape(50, 100), np.arange(5000.0) + 0.5
    parts: list[tuple[Any, ...]] = []
    for threads, shared, lengths in ((2, 5000, [3072, 1928]), (2, 5001, [50]), (1, 1, [50]), (4, 1, [2048, 2048, 904])):
        parts.clear()
        monkeypatch.setattr("eomgen.products.fields.posteriors.cells._SHARED", shared)
        routines.threads = threads
        routines._share(lambda *arrays: parts.append(arrays), None, one, two)
        parts.sort(key=lambda arrays: float(arrays[2][0]))
        assert [len(arrays[1]) for arrays in parts] == lengths and all(arrays[0] is None for arrays in parts)
        for number, whole in ((1, one), (2, two)):
            assert np.array_equal(np.concatenate([arrays[number].ravel() for arrays in parts]), whole.ravel())


@pytest.mark.slow
@pytest.mark.long_except("single")
@pytest.mark.parametrize("precision", ["double", "single"])
def test_threads_that_share_arrays_give_the_same_bits(precision: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of whole registers, and a rest: 13 x 20 x 21 cells."""
    alone = as_asked(three_fields((13, 20, 21)), "scipy", precision)
    calls = []

    def counting(call: Any, pieces: list[tuple[int, int]], threads: int) -> None:
        calls.append(pieces)
        share(call, pieces, threads)

    monkeypatch.setattr("eomgen.products.fields.posteriors.cells._SHARED", 1)
    monkeypatch.setattr("eomgen.products.fields.posteriors.cells.share", counting)
    x = alone.mesh.white(stream())
    found = []
    for threads in (1, 3):
        alone._routines.threads = threads
        slope = x.copy()
        alone.add_gradient(0.3, x, slope)
        alone.drift(0.2, alone.mass(), x, slope)
        found.append((slope, alone.energy(slope), alone.gradient(slope)))
    assert all(np.array_equal(one, two) for one, two in zip(*found, strict=True))
    assert calls[0] == [(0, 1024), (1024, 2048), (2048, 2860)] and len(calls) >= 10
    assert {pieces[-1][1] for pieces in calls} == {13 * 20 * 11, 13 * 20 * 21}


def test_what_transforms_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = Mesh((4, 4), 1.0)

    def message(**options: str) -> str:
        with pytest.raises(EomgenError) as caught:
            FieldPosterior(mesh, "s**4", {"s": white(mesh)}, **options)
        return str(caught.value)

    assert "transforms: there is no library 'fftv'; try: fftw" in message(transforms="fftv")
    assert "precision: there is no precision 'half'; try: one of double, single" in message(precision="half")
    monkeypatch.setitem(sys.modules, "pyfftw", None)  # an import fails
    text = "transforms: FFTW comes with the package pyfftw, which is not installed; try: pip install 'eomgen[fast"
    assert text in message(transforms="fftw")
    assert math.isfinite(FieldPosterior(mesh, "s**4", {"s": white(mesh)}).energy(mesh.white(stream())))
