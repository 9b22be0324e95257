"""``eomgen linearize --campbell``: frequencies over the speed of a rotor, and critical speeds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.linear.campbell import Campbell
    from eomgen.model import Model


@dataclass(frozen=True)
class CampbellRequest:
    """What ``--campbell``, ``--orders`` and ``--whirl`` ask for."""

    speed: str
    values: list[float]
    orders: tuple[float, ...] | None
    whirl: list[tuple[str, str]]

    @classmethod
    def read(
        cls, sweep: tuple[str, list[float]] | None, orders: str | None, whirl: tuple[str, ...]
    ) -> CampbellRequest | None:
        """Return the request; None where there is none. Raises UsageError for words that cannot be read."""
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
        """Return the diagram; options are those of ``Model.campbell``."""
        return model.campbell(self.speed, self.values, orders=self.orders, whirl=self.whirl, **options)


def write_campbell(diagram: Campbell, title: str, folder: Path) -> list[Path]:
    """Write ``campbell.csv`` and ``campbell.png``."""
    import numpy as np  # noqa: PLC0415

    from eomgen.files import write_table  # noqa: PLC0415
    from eomgen.linear.plots import draw_campbell  # noqa: PLC0415

    names = [diagram.parameter]
    columns = [diagram.values]
    for k in range(diagram.eigenvalues.shape[1]):
        names += [f"mode{k + 1} {part}" for part in ("frequency [Hz]", "damping_ratio", "whirl")]
        columns += [diagram.frequencies[:, k], diagram.damping_ratios[:, k], diagram.whirl[:, k].astype(float)]
    write_table(folder / "campbell.csv", names, np.stack(columns, axis=1))
    return [folder / "campbell.csv", draw_campbell(diagram, title, folder / "campbell.png")]


def described_campbell(diagram: Campbell) -> list[dict[str, Any]]:
    """Return the crossings as JSON data."""
    return [
        {
            "order": item.order,
            "speed": item.speed,
            "frequency": item.frequency,
            "mode": item.mode + 1,
            "whirl": item.whirl,
        }
        for item in diagram.crossings
    ]


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
