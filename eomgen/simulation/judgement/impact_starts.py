"""Impacts that a run starts behind, or on: what they are for the motion, in words."""

from __future__ import annotations

import numpy as np

from eomgen.compiled.initial_state import InitialState
from eomgen.simulation.stepping.run import Run

#: Part of 1, or of the rate within a step, below which a function is on its root, or does not leave it.
_ON = 1e-12


def impacts_at_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each impact that the initial state is behind, or rests on without a side.

    An impact of a direction has its free side where the function is above zero (falling) or below (rising); one of
    both directions is met from either side, so that only what rests on it has none.
    """
    model, t = run.model, run.grid.start
    rows = model.library.layout["method"].get("events", {"rows": []})["rows"]
    if not any(row["action"] == "impact" for row in rows) or "events" not in model.functions:
        return []
    u = run.signals.rows(np.array([t]))[0] if model.nu else None
    with np.errstate(all="ignore"):
        found = model.evaluate(
            "events", state.q, state.v, np.zeros_like(state.v), t, u, z=state.z, parameters=run.parameters
        )
    sentences = []
    for row, value, rate in zip(rows, found["event"].tolist(), found["event_rate"].tolist(), strict=True):
        near = _ON * max(1.0, abs(rate) * run.settings["step"])
        if row["action"] != "impact":
            continue
        name, sign = row["name"], row["sign"]
        if sign and value * sign > near:
            sentences.append(
                f"the run starts behind the impact {name}, which is met from where its formula is"
                f" {'below' if sign > 0 else 'above'} zero: at the start it is {value:.4g}; try: another initial state,"
                f' or direction = "{"falling" if sign > 0 else "rising"}"'
            )
        elif not sign and abs(value) <= near and abs(rate) <= near:
            sentences.append(
                f"the run starts at rest on the impact {name}, which has no side: the motion may leave it either way;"
                ' try: direction = "falling" for what lies where its formula is above zero, "rising" for below'
            )
    return sentences
