"""RideTable: root mean squares of outputs over road classes and speeds."""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.html import page, table


@checked_calls()
@dataclass(frozen=True, repr=False)
class RideTable:
    """Root mean squares over road classes and speeds.

    Attributes
    ----------
    outputs, units : names and units of the outputs; empty units are not known
    classes : (nc,) road classes
    speeds : (ns,) m/s
    values : (nc, ns, number of outputs)
    weightings : names of the outputs' frequency weightings; empty for none
    """

    outputs: tuple[str, ...]
    units: tuple[str, ...]
    classes: tuple[str, ...]
    speeds: Array
    values: Array
    weightings: tuple[str, ...]

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of the columns of ``rows``."""
        named = (
            name + (f" ({weighting})" if weighting else "") + (f" [{unit}]" if unit else "")
            for name, unit, weighting in zip(self.outputs, self.units, self.weightings, strict=True)
        )
        return ("class", "speed [m/s]", *(f"rms {name}" for name in named))

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Class, speed and root mean squares as texts."""
        return [
            (name, f"{speed:.6g}", *(f"{value:.6g}" for value in self.values[i, k]))
            for i, name in enumerate(self.classes)
            for k, speed in enumerate(self.speeds)
        ]

    def __repr__(self) -> str:
        columns = list(zip(self.headings, *self.rows, strict=True))
        widths = [max(len(cell) for cell in column) for column in columns]
        lines = [self.headings, *self.rows]
        return "\n".join(
            "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines
        )

    def _repr_html_(self) -> str:
        return page("Root mean squares on random roads", table(self.headings, self.rows))
