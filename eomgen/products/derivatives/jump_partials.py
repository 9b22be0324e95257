"""Partials of the jumps of a run by complex steps, for samples, events and impacts; and partials of the equations in
time (Squire and Trapp, SIAM Review 40 (1998) 110).

Saltation: Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), chapter 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.functions import Functions
from eomgen.lie import product
from eomgen.products.derivatives.equations import StepEquations, bordered_matrix
from eomgen.simulation.stepping.inputs import InputSignals

#: An imaginary increment with a square below rounding.
_TINY = 1e-100
_TERMS = ("residual", "internal_rate", "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian")
_OF_JUMPS = ("samples", "events", "event_actions", "event_impulse")


@dataclass(frozen=True)
class EventPartials:
    """Partials of one event in q (left-trivialised), v, vdot, z, multipliers, parameters of the directions, and time.

    Attributes
    ----------
    guard : (columns,) of the function whose root is the event
    state : (2 nv + nz, columns) of q, v and z after the event
    mode : (columns,) of a new value of a mode; zeros if the event switches none
    """

    guard: Array
    state: Array
    mode: Array


class JumpPartials:
    """Partials of samples, events and impacts at states of a run, by complex steps of the compiled functions.

    Parameters
    ----------
    equations : of a step
    signals : of the run's inputs
    method : layout of the stepper's method
    """

    def __init__(self, equations: StepEquations, signals: InputSignals, method: Mapping[str, Any]) -> None:
        self._equations, self._signals = equations, signals
        self._samples: Sequence[Mapping[str, Any]] = method.get("samples", {}).get("rows", [])
        self._events: Sequence[Mapping[str, Any]] = method.get("events", {}).get("rows", [])
        e = equations
        sizes = {"q": e.nv, "v": e.nv, "a": e.nv, "z": e.nz, "lam": e.nl, "p": len(e.chosen), "du": e.driven, "t": 1}
        ends = np.cumsum(list(sizes.values())).tolist()
        self.places = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        self.columns = int(ends[-1])
        self._functions: Functions = equations.model.in_complex((*_TERMS, *_OF_JUMPS))

    # -- partials in time ------------------------------------------------------------------------------------------

    def by_time(self, values: Mapping[str, Array], rates: Array) -> tuple[Array, Array]:
        """Return the partials of e and of the constraints' accelerations in time, (n, rows) and (n, rows of B).

        Parameters
        ----------
        rates : (n, nu), of inputs that the caller gives
        """
        e, count = self._equations, len(values["t"])
        moved = {name: array.astype(complex) for name, array in values.items() if name not in ("t", "du")}
        moved["t"] = values["t"] + 1j * _TINY
        self._prescribe(moved, 1j * _TINY * rates)
        parts = [self._functions("residual", moved)[0]]
        if e.nz:
            parts.append(-self._functions("internal_rate", moved)[0])
        accelerations = np.zeros((count, 0), complex)
        if e.nl:
            B = self._functions("constraint_jacobian", moved)[0]
            if e.holonomic:
                parts.append(self._functions("constraint", moved)[0][..., : e.holonomic])
            parts.append(self._functions("constraint_velocity", moved)[0])
            bias = self._functions("constraint_bias", moved)[0]
            accelerations = (B @ moved["a"][..., np.newaxis])[..., 0] + bias
        shapes = [np.broadcast_to(part, (count, part.shape[-1])).imag for part in parts]
        of_accelerations = np.broadcast_to(accelerations, (count, accelerations.shape[-1])).imag
        return np.concatenate(shapes, axis=1) / _TINY, of_accelerations / _TINY

    # -- jumps -----------------------------------------------------------------------------------------------------

    def sample_partials(self, values: Mapping[str, Array], due: NDArray[np.bool_], rates: Array) -> Array:
        """Return the partials of q, v and z after samples at n states, (n, 2 nv + nz, columns).

        Columns are q, v, vdot, z, multipliers, parameters, inputs and time.

        Parameters
        ----------
        values : input blocks before the samples
        due : (n, sampled states) of bool, states that take new values
        rates : (n, nu) of given inputs
        """
        e, count = self._equations, len(due)
        moved = self._with_increments(values, rates)
        z = np.broadcast_to(moved["z"], (count, self.columns, e.nz)).copy()
        for level in range(1 + max((int(row["level"]) for row in self._samples), default=-1)):
            if not any(int(row["level"]) == level for row in self._samples):
                continue
            new = self._functions("samples", {**moved, "z": z.copy()})[0]
            new = np.broadcast_to(new, (count, self.columns, len(self._samples)))
            for number, row in enumerate(self._samples):
                if int(row["level"]) == level:
                    state = int(row["state"])
                    z[..., state] = np.where(due[:, np.newaxis, number], new[..., number], z[..., state])
        result = self._identity(count)
        result[:, 2 * e.nv :] = np.swapaxes(z.imag, 1, 2) / _TINY
        return result

    def event_partials(self, values: Mapping[str, Array], event: int, rates: Array) -> EventPartials:
        """Return the partials of event number `event` and of its action, at the state before the event. `values` are
        input blocks (1, ...), `rates` (1, nu) the rates of given inputs."""
        e, row = self._equations, self._events[event]
        nv, moved = e.nv, self._with_increments(values, rates)
        guards, of_rates = (
            np.broadcast_to(x, (1, self.columns, x.shape[-1])) for x in self._functions("events", moved)
        )
        guard = guards[0, :, event].imag / _TINY
        result, mode = self._identity(1)[0], np.zeros(self.columns)
        if row["action"] == "stop":
            return EventPartials(guard, result, mode)
        (actions,) = self._functions("event_actions", moved)
        actions = np.broadcast_to(actions, (1, self.columns, actions.shape[-1]))[0]
        if row["action"] == "switch":
            return EventPartials(guard, result, actions[:, row["value"]].imag / _TINY)
        rows, steps = [], []
        v = np.broadcast_to(moved["v"], (1, self.columns, nv))[0]
        by_factor = {factor.q_start: factor.v_start for factor in e.model.factors if factor.group == "R"}
        for item in row["assignments"]:
            new, index = actions[:, item["place"]], int(item["index"])
            if item["block"] == "v" and e.nl:
                rows.append(np.broadcast_to(np.eye(nv)[index], (self.columns, nv)))
                steps.append(new - v[:, index])
            elif item["block"] == "q":
                result[by_factor[index]] = new.imag / _TINY
            else:
                result[{"v": nv, "z": 2 * nv}[item["block"]] + index] = new.imag / _TINY
        if row["action"] == "impact":
            rows.append(self._impulse(moved)["gradient"][:, row["gradient"]])
            steps.append(-(1.0 + actions[:, row["restitution"]]) * of_rates[0, :, event])
        if rows:  # the least impulses with C dv = d (Gauss), constraints included
            blocks, C = self._impulse(moved), np.stack(rows, axis=1)
            C = np.concatenate([blocks["B"], C], axis=1) if e.nl else C
            right = np.concatenate([np.zeros((self.columns, nv + e.nl)), np.stack(steps, axis=1)], axis=1)
            pushed = np.linalg.solve(bordered_matrix(blocks["M"], C), right[..., np.newaxis])[:, :nv, 0]
            result[nv : 2 * nv] = (v + pushed).T.imag / _TINY
        return EventPartials(guard, result, mode)

    def _impulse(self, moved: Mapping[str, Array]) -> dict[str, Array]:
        """Return M, B and gradients of impacts, (columns, ...) each."""
        names = self._functions.output_names("event_impulse")
        parts = zip(names, self._functions("event_impulse", moved), strict=True)
        return {name: np.broadcast_to(x, (1, self.columns, *x.shape[-2:]))[0] for name, x in parts}

    def _identity(self, count: int) -> Array:
        """Return the partials of q, v and z in themselves, (count, 2 nv + nz, columns): ones and zeros."""
        e = self._equations
        result = np.zeros((count, 2 * e.nv + e.nz, self.columns))
        for first, name in ((0, "q"), (e.nv, "v"), (2 * e.nv, "z")):
            columns = self.places[name]
            result[:, first + np.arange(columns.stop - columns.start), np.arange(columns.start, columns.stop)] = 1.0
        return result

    def _with_increments(self, values: Mapping[str, Array], rates: Array) -> dict[str, Array]:
        """Return input blocks with an imaginary increment of one variable in each column, (n, columns, ...). `rates`
        (n, nu) of given inputs move the inputs in the column of time."""
        e, places, count = self._equations, self.places, len(values["t"])
        steps = {}
        for name, columns in places.items():
            step = np.zeros((self.columns, columns.stop - columns.start), complex)
            step[columns] = 1j * _TINY * np.eye(columns.stop - columns.start)
            steps[name] = step
        moved = {name: values[name][:, np.newaxis] + steps[name] for name in ("v", "a", "z", "lam")}
        q = values["q"][:, np.newaxis].astype(complex).repeat(self.columns, 1)
        moved["q"] = product.update(e.model.factors, q, steps["q"])
        p = np.broadcast_to(values["p"], (count, len(e.p)))[:, np.newaxis].astype(complex).repeat(self.columns, 1)
        p[:, :, e.chosen] += steps["p"]
        moved["p"], moved["t"] = p, values["t"][:, np.newaxis] + steps["t"][:, 0]
        for name in ("u", "base"):
            if name in values:
                moved[name] = values[name][:, np.newaxis].astype(complex).repeat(self.columns, 1)
        driven = steps["t"] * rates[:, np.newaxis] if rates.size else rates
        if e.driven:
            driven = driven + steps["du"] @ np.swapaxes(values["du"], 1, 2)
        self._prescribe(moved, driven)
        return moved

    def _prescribe(self, moved: dict[str, Any], driven: Any) -> None:
        """Set inputs and base of `moved` in place at its times and parameters; ``driven`` are imaginary increments of
        inputs."""
        arguments = {"t": moved["t"], "p": moved["p"]}
        if "u" in moved:
            prescribed = [name in self._signals.given for name in self._signals.names]
            if "inputs" in self._functions:
                followed = self._functions("inputs", arguments)[0].imag * 1j
                driven = driven + np.where(prescribed, 0.0, followed)
            moved["u"] = moved["u"].real + driven
        if "base" in moved and "base" in self._functions:
            moved["base"] = self._functions("base", arguments)[0]
