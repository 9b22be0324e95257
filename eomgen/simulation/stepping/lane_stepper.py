"""The stepper of several trajectories side by side, with its memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.integrators.stepper_layout import row_layout, state_layout
from eomgen.simulation.stepping.stepper import on_cache_lines
from eomgen.toolchain.lane_library import LaneLibrary


class LaneStepper:
    """The stepper of a library of lanes with its memory.

    Parameters
    ----------
    settings : mapping from name to number
        The same for all lanes, in the order of ``integrators.stepper_layout.default_settings``.

    Attributes
    ----------
    lanes : how many trajectories are stepped
    width : numbers of a row
    places : slices of the quantities of a flat state
    """

    def __init__(self, library: LaneLibrary, settings: Mapping[str, float]) -> None:
        method: Mapping[str, Any] = library.layout["method"]
        self.lanes = library.lanes
        self.width = sum(int(size) for _, size in method["row"])
        self.places, self.row_places = state_layout(method), row_layout(method)
        self._modes = len(method.get("events", {"modes": ()})["modes"])
        self._size = max(place.stop for place in self.places.values())
        self._lib, self._ffi = library.lib, library.ffi
        self._settings = np.array([*settings.values(), 0.0])
        self._state, self._workspace = on_cache_lines(library.state_size), on_cache_lines(library.workspace_size)
        self._statuses = np.zeros(self.lanes, dtype=np.intc)
        self._parameters = np.zeros(0)
        self._inputs: Array | None = None

    def start(self, states: Array, parameters: Array, inputs: Array | None) -> None:
        """Begin.

        Parameters
        ----------
        states : (lanes, 1 + nq + nv + nz)
            Time in s, q, v, z.
        parameters : (lanes, np)
        inputs : (lanes, nu)
            Held over the run, NaN for inputs by a formula of the scene; None: all by formulas.
        """
        self._parameters = np.concatenate([np.ascontiguousarray(parameters, dtype=float).ravel(), [0.0]])
        self._inputs = None if inputs is None else np.ascontiguousarray(inputs, dtype=float)
        self._lib.eomgen_lanes_start(
            self._doubles(self._parameters),
            self._doubles(self._settings),
            self._doubles(self._inputs),
            self._doubles(np.ascontiguousarray(states, dtype=float)),
            self._doubles(self._state),
            self._doubles(self._workspace),
            self._whole(self._statuses),
        )

    def run(self, steps: int, rows: int) -> Array:
        """Return (lanes, rows, width), a row behind each ``steps`` steps; NaN after the failure of a lane.

        ``rows`` 0: the rows of the states as they are, (lanes, 1, width).
        """
        record = np.full((self.lanes, max(rows, 1), self.width), np.nan)
        self._lib.eomgen_lanes_run(
            self._doubles(self._parameters),
            self._doubles(self._settings),
            self._doubles(self._inputs),
            self._doubles(self._state),
            self._doubles(self._workspace),
            steps,
            rows,
            self._doubles(record),
            self._whole(self._statuses),
        )
        return record

    def runs(
        self,
        states: Array,
        parameters: Array,
        inputs: Array | None,
        steps: int,
        rows: int,
        rest: int,
        shorter: float = 0.0,
        tables: Array | None = None,
    ) -> tuple[Array, Array, Array, NDArray[np.intc]]:
        """Return rows (n, 1 + rows, width), one more each with ``rest`` and ``shorter``, modes (n, ..., modes) at
        them, flat states (n, size) at the end and statuses (n,).

        A run stopped by an event has the row of the event as its last one.

        Parameters
        ----------
        states, parameters, inputs : as of ``start``, (n, ...), n a multiple of the lanes
        steps, rows : a row behind each ``steps`` steps; the first row is the start
        rest : steps before one row more, if any
        shorter : size of a last step, s, if there is one
        tables : (n, 1 + rows of inputs of all steps, nu)
            Inputs that change with time, in place of ``inputs``.
        """
        count = len(states)
        record = np.full((count, 1 + rows + (rest > 0) + (shorter > 0.0), self.width), np.nan)
        modes = np.full((*record.shape[:2], self._modes), np.nan)
        flat, statuses = np.empty((count, self._size)), np.zeros(count, dtype=np.intc)
        given = [np.ascontiguousarray(part, dtype=float) for part in (parameters, states)]
        beside = None if tables is None else self._beside(tables)
        self._lib.eomgen_lanes_groups(
            self._doubles(np.append(given[0].ravel(), 0.0)),
            self._doubles(self._settings),
            self._doubles(None if inputs is None else np.ascontiguousarray(inputs, dtype=float)),
            self._doubles(beside),
            self._doubles(given[1]),
            self._doubles(self._state),
            self._doubles(self._workspace),
            count // self.lanes,
            steps,
            rows,
            rest,
            shorter,
            self._doubles(record),
            self._doubles(modes if self._modes else None),
            self._doubles(flat),
            self._whole(statuses),
        )
        return record, modes, flat, statuses

    def _beside(self, tables: Array) -> Array:
        """Return tables (n, rows, nu) with the numbers of each group of lanes beside one another."""
        count, rows, size = tables.shape
        beside = on_cache_lines(tables.size)
        beside.reshape(-1, rows, size, self.lanes)[:] = np.moveaxis(
            tables.reshape(count // self.lanes, self.lanes, rows, size), 1, 3
        )
        return beside

    @property
    def statuses(self) -> NDArray[np.intc]:
        """Status of each lane; 0 without a failure."""
        return self._statuses.copy()

    @property
    def states(self) -> Array:
        """Flat states (lanes, size), as ``Stepper.state``; ``places`` has their quantities."""
        flat = np.empty((self.lanes, self._size))
        self._lib.eomgen_lanes_state(self._doubles(self._state), self._doubles(flat))
        return flat

    def _doubles(self, array: Array | None) -> Any:
        return self._ffi.NULL if array is None else self._ffi.from_buffer("double[]", array)

    def _whole(self, array: NDArray[np.intc]) -> Any:
        return self._ffi.from_buffer("int[]", array)
