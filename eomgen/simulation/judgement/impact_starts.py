"""Impacts that a run starts behind, or on, and their effect on the motion, in words."""

from __future__ import annotations

import numpy as np

from eomgen.compiled.initial_state import InitialState
from eomgen.lie import product
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.stepping.run import Run

#: Part of the coordinates, and of the rate within a step, by which a function on its root may be off.
_ON = 1e-12


def impacts_at_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each impact that the initial state is behind, or rests on without a side.

    An impact of a direction has its free side at values of its function above zero (falling) or below (rising); an
    impact of both directions is met from either side, so that only a start on it has no side.
    """
    model, t = run.model, run.grid.start
    rows = model.library.layout["method"].get("events", {"rows": []})["rows"]
    if not any(row["action"] == "impact" for row in rows) or "events" not in model.functions:
        return []
    u = run.signals.rows(np.array([t]))[0] if model.nu else None
    reach = reach_of(model, state.q)
    ways = np.concatenate([np.zeros((1, model.nv)), np.diag(_ON * np.where(reach > 0.0, reach, 1.0))])
    places = product.update(model.factors, np.repeat(state.q[np.newaxis], len(ways), axis=0), ways)
    with np.errstate(all="ignore"):
        functions = model.evaluate(
            "events", places, state.v, np.zeros_like(state.v), t, u, z=state.z, parameters=run.parameters
        )
    values, rates = functions["event"], functions["event_rate"][0]
    rounding = np.abs(values[1:] - values[0]).sum(axis=0)  # when coordinates move by theirs
    sentences = []
    for row, value, rate, off in zip(rows, values[0].tolist(), rates.tolist(), rounding.tolist(), strict=True):
        travel = abs(rate) * run.settings["step"]
        near = off + _ON * travel
        if row["action"] != "impact":
            continue
        name, sign = row["name"], row["sign"]
        if sign and value * sign > near:
            sentences.append(
                f"the run starts behind the impact {name}, which is met from the side where its formula is"
                f" {'below' if sign > 0 else 'above'} zero: at the start it is {value:.4g}; try: another initial state,"
                f' or direction = "{"falling" if sign > 0 else "rising"}"'
            )
        elif not sign and abs(value) <= near and travel <= off:
            sentences.append(
                f"the run starts at rest on the impact {name}, which has no side: the motion may leave it either way;"
                ' try: direction = "falling" for a free side where its formula is above zero, "rising" for below'
            )
    return sentences
