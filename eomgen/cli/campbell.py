"""``eomgen linearize --campbell``: frequencies over the speed of a rotor, and critical speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.base.text import counted
from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.linear.eigenvalue_loci import Campbell
    from eomgen.pipeline.model import Model


@dataclass(frozen=True)
class CampbellRequest:
    """Request of ``--campbell``, ``--orders`` and ``--whirl``."""

    speed: str
    values: list[float]
    orders: tuple[float, ...] | None
    whirl: list[tuple[str, str]]

    @classmethod
    def read(
        cls, sweep: tuple[str, list[float]] | None, orders: str | None, whirl: tuple[str, ...]
    ) -> CampbellRequest | None:
        """Return the request; None if there is none. Raises UsageError for words that cannot be read."""
        if sweep is None:
            for option, given in (("--orders", orders), ("--whirl", whirl)):
                if given:
                    raise UsageError(Problem(option, "it belongs to a Campbell diagram", "--campbell spin=0:300:31"))
            return None
        pairs = []
        for text in whirl:
            first, colon, second = text.partition(":")
            if not colon or not first.strip() or not second.strip():
                raise UsageError(Problem(f"--whirl {text}", "two deflections are needed", "--whirl x:y"))
            pairs.append((first.strip(), second.strip()))
        return cls(*sweep, _orders(orders), pairs)

    def diagram(self, model: Model, **options: Any) -> Campbell:
        """Return the diagram; options as of ``Model.campbell``."""
        return model.campbell(self.speed, self.values, orders=self.orders, whirl=self.whirl, progress=True, **options)

    def interruption(self, diagram: Campbell | None) -> str:
        """Return the line for Ctrl-C: how much of the diagram there is."""
        if diagram is None:
            return "interrupted before there was a Campbell diagram"
        values = f"{len(diagram.values)} of {len(self.values)} values of {self.speed}"
        return f"interrupted: the Campbell diagram has {values} and {counted(len(diagram.crossings), 'crossing')}"


def _orders(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        orders = tuple(float(part) for part in text.split(","))
    except ValueError:
        orders = (0.0,)
    if not all(0.0 < order < float("inf") for order in orders):
        raise UsageError(Problem(f"--orders {text}", "positive numbers are needed", "--orders 1,2"))
    return orders
