"""How a linear model shows itself in a notebook: signals, independent coordinates, the table of its modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.html import page, paragraph, table

#: Damping ratios below this are rounding.
_ROUNDING = 1e-9


class ShownModes(Protocol):
    """Display of ``Modes``: see there."""

    @property
    def eigenvalues(self) -> NDArray[np.complex128]: ...
    @property
    def frequency(self) -> Array: ...
    @property
    def damping_ratio(self) -> Array: ...
    @property
    def uncertainty(self) -> Array: ...
    @property
    def oscillating(self) -> NDArray[np.bool_]: ...
    @property
    def stability(self) -> str: ...

    def dominant(self, mode: int) -> list[tuple[str, complex]]: ...

    def __len__(self) -> int: ...


class ShownStateSpace(Protocol):
    """Display of a ``StateSpace``: see there."""

    @property
    def states(self) -> tuple[str, ...]: ...
    @property
    def inputs(self) -> tuple[str, ...]: ...
    @property
    def disturbances(self) -> tuple[str, ...]: ...
    @property
    def outputs(self) -> tuple[str, ...]: ...
    @property
    def when(self) -> str: ...
    @property
    def stability(self) -> str: ...

    def unit(self, kind: str, name: str) -> str: ...


def state_space_html(space: ShownStateSpace) -> str:
    """Return an HTML table of the signals of a linear model of first order with units, and of the stability of the
    model."""
    rows = []
    for kind, letter in (("states", "s"), ("inputs", "u"), ("disturbances", "w"), ("outputs", "y")):
        names: tuple[str, ...] = getattr(space, kind)
        rows += [(f"{letter}[{k}]", name, space.unit(kind, name), kind[:-1]) for k, name in enumerate(names)]
    return page(f"State space{space.when}, {space.stability}", table(("", "name", "unit", "is"), rows))


def linearization_html(kind: str, t: float, coordinates: Sequence[str], modes: ShownModes) -> str:
    """Return reference, time (s), independent coordinates and modes of a linear model."""
    free = f"coordinates: {', '.join(coordinates)}" if coordinates else "no coordinates are free"
    return page(f"Linear model about the {kind} at t = {t:.6g} s", paragraph(free), modes_html(modes))


def modes_html(modes: ShownModes) -> str:
    """Return undamped frequency, damping ratio, eigenvalue and the largest part of each mode, and whether all decay."""
    rows = (
        (
            k + 1,
            f"{modes.frequency[k]:.6g}" if modes.oscillating[k] else "",
            f"{_known(modes.damping_ratio[k], _ROUNDING):.4g}"
            if abs(modes.eigenvalues[k]) > modes.uncertainty[k]
            else "",
            _eigenvalue(modes.eigenvalues[k], modes.uncertainty[k]),
            ", ".join(name for name, _ in modes.dominant(k)),
        )
        for k in range(len(modes))
    )
    headings = ("mode", "undamped frequency, Hz", "damping ratio", "eigenvalue, 1/s", "mostly")
    return page(f"{len(modes)} modes, {modes.stability}", table(headings, rows))


def _eigenvalue(value: complex, uncertainty: float) -> str:
    """Return an eigenvalue without the parts that are rounding."""
    real, imaginary = _known(value.real, uncertainty), _known(value.imag, uncertainty)
    if not imaginary:
        return f"{real:.6g}"
    return f"{real:.6g} ± {imaginary:.6g}j" if real else f"± {imaginary:.6g}j"


def _known(value: float, uncertainty: float) -> float:
    return value if abs(value) > uncertainty else 0.0
