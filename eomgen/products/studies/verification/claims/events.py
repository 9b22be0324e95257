"""Claims of events: rates of their functions along the motion, and gradients of impacts."""

from __future__ import annotations

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim, Space, column
from eomgen.products.studies.verification.engines import Array, Blocks, Engine
from eomgen.system.system import System

FAMILY = "events"


def event_claims(space: Space, engine: Engine, system: System) -> list[Claim]:
    """Return the claims of the terms ``events`` and ``event_impulse``."""
    if "events" not in engine:
        return []
    known = [number for number, row in enumerate(system.events) if row.has_rate]
    impacts = [number for number, row in enumerate(system.events) if row.action == "impact"]
    names, along_q = [row.name for row in system.events], space.along["q"]

    def along_motion(state: Blocks) -> dict[str, Array]:
        rates = {"q": state["v"], "v": state["a"]}
        if "z" in state:
            rates["z"] = engine("internal_rate", state)["zdot"]
        result = {block: rate[..., np.newaxis, :] for block, rate in rates.items()}
        return result | ({"t": np.ones((1, 1))} if "t" in state else {})

    claims = []
    if known:
        claims.append(
            Claim(
                "events.event_rate",
                "d event / dt",
                FAMILY,
                lambda engine, state: column(engine("events", state)["event_rate"][..., known]),
                source=lambda engine, state: engine("events", state)["event"][..., known],
                directions=along_motion,
                rows=tuple(names[number] for number in known),
                functions=("events",),
            )
        )
    if impacts:
        claims.append(
            Claim(
                "event_impulse.gradient",
                "d event / dq of impacts",
                FAMILY,
                lambda engine, state: np.asarray(engine("event_impulse", state)["gradient"] @ along_q.matrix),
                source=lambda engine, state: engine("events", state)["event"][..., impacts],
                directions=lambda _: {"q": along_q.matrix.T},
                rows=tuple(names[number] for number in impacts),
                columns=along_q.names,
                functions=("events",),
            )
        )
    return claims
