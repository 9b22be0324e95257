"""The events of a run: a table of states before and after each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.base.files import write_text
from eomgen.base.messages import nearest
from eomgen.errors import Problem, UsageError
from eomgen.system.description import component_names

#: Names of arrays of a state, before an event and after the event.
BLOCKS = ("q_before", "v_before", "z_before", "q", "v", "z", "modes")


class EventRecord(NamedTuple):
    """One event: name, time in s, states before and after, and modes after; ``number`` counts events of its name from
    1."""

    name: str
    number: int
    t: float
    q_before: Array
    v_before: Array
    z_before: Array
    q: Array
    v: Array
    z: Array
    modes: Array


@dataclass(frozen=True, repr=False)
class Events:
    """Events in the order of time; iterating gives an ``EventRecord`` each, ``events["bounce"]`` all of one name.

    Attributes
    ----------
    names : of each event
    t : (n,) s
    q_before, v_before, z_before : (n, nq), (n, nv), (n, nz); state before each event
    q, v, z : state after each event
    modes : (n, number of modes); after each event
    counts : by name, also of events that are only counted; empty if the scene has no events
    mode_names : of the columns of ``modes``
    first_modes : modes before all events
    """

    names: tuple[str, ...]
    t: Array
    q_before: Array
    v_before: Array
    z_before: Array
    q: Array
    v: Array
    z: Array
    modes: Array
    counts: Mapping[str, int] = field(default_factory=dict)
    mode_names: tuple[str, ...] = ()
    first_modes: Array = field(default_factory=lambda: np.empty(0))

    def __repr__(self) -> str:
        counted = ", ".join(f"{count} {name}" for name, count in self.counts.items())
        span = f" from t = {self.t[0]:.6g} to {self.t[-1]:.6g} s" if len(self) else ""
        return f"<Events: {counted or 'none'}{span}>"

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[EventRecord]:
        met: dict[str, int] = {}
        for k, name in enumerate(self.names):
            met[name] = met.get(name, 0) + 1
            yield EventRecord(name, met[name], float(self.t[k]), *(getattr(self, block)[k] for block in BLOCKS))

    def __getitem__(self, name: str) -> Events:
        """Return the events of a name. Raises UsageError for a name that the scene has no event of."""
        if name not in self.counts:
            hint = nearest(str(name), self.counts) or "a scene with [events]"
            raise UsageError(Problem("events", f"there is no event {name!r} [E1268]", hint))
        return self._chosen([k for k, event in enumerate(self.names) if event == name], {name: self.counts[name]})

    def _chosen(self, places: list[int], counts: Mapping[str, int]) -> Events:
        names = tuple(self.names[k] for k in places)
        blocks: dict[str, Any] = {name: getattr(self, name)[places] for name in ("t", *BLOCKS)}
        return replace(self, names=names, counts=counts, **blocks)

    def columns(self, names: Mapping[str, list[str]]) -> dict[str, Array]:
        """Return the table of events as columns (n,) by name: ``t``, states ``before`` and ``after`` each event, and
        modes. `names` has the names of the components by letter: q, v and z."""
        columns: dict[str, Array] = {"t": self.t}
        for block in BLOCKS[:-1]:
            letter, _, before = block.partition("_")
            array = getattr(self, block)
            labels = names.get(letter) or component_names("", letter, array.shape[1])
            columns |= {f"{label} {before or 'after'}": array[:, k] for k, label in enumerate(labels)}
        return columns | {f"mode.{name}": self.modes[:, k] for k, name in enumerate(self.mode_names)}

    def write(self, path: Path, names: Mapping[str, list[str]]) -> Path:
        """Write the table as ``.csv``; ``names`` as of ``columns``. Raises FileError."""
        columns = self.columns(names)
        rows = zip(self.names, *(column.tolist() for column in columns.values()), strict=True)
        lines = [",".join(["event", *columns]), *(",".join([row[0], *map(repr, row[1:])]) for row in rows)]
        write_text(path, "\n".join(lines) + "\n")
        return path

    def arrays(self) -> dict[str, Array]:
        """Return the arrays by name."""
        return {name: getattr(self, name) for name in ("t", *BLOCKS)}

    def to_dict(self) -> dict[str, Any]:
        """Return names, times and counts as JSON types."""
        return {
            "counts": dict(self.counts),
            "modes": dict(zip(self.mode_names, self.first_modes.tolist(), strict=True)),
            "list": [{"name": name, "t": time} for name, time in zip(self.names, self.t.tolist(), strict=True)],
        }

    def followed_by(self, later: Events, start: float) -> Events:
        """Return these events up to ``start``, included, then ``later``, whose counts must include these already."""
        kept = self._chosen([k for k, time in enumerate(self.t) if time <= start], self.counts)
        joined: dict[str, Any] = {
            name: np.concatenate([getattr(kept, name), getattr(later, name)]) for name in ("t", *BLOCKS)
        }
        return replace(later, names=kept.names + later.names, first_modes=self.first_modes, **joined)


_NOTHING: Array = np.empty((0, 0))
#: Of a scene that has none.
NO_EVENTS = Events((), np.empty(0), _NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING)


def events_from(described: Mapping[str, Any], arrays: Mapping[str, Array]) -> Events:
    """Return the events of a stored solution from ``to_dict`` data and ``arrays``. Raises KeyError if an array is
    missing."""
    names = tuple(str(item["name"]) for item in described["list"])
    blocks = {name: arrays[name] for name in ("t", *BLOCKS)}
    modes = described["modes"]
    return Events(
        names, **blocks, counts=described["counts"], mode_names=tuple(modes), first_modes=np.array([*modes.values()])
    )
