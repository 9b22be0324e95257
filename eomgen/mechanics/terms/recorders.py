"""Functions that record each term without time derivatives, and that return its blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.events import event_actions, event_impulse, events, samples
from eomgen.mechanics.terms.forward_dynamics import forward_blocks
from eomgen.mechanics.terms.frames import FRAME_RECORDERS
from eomgen.system.system import Block

Recorder = Callable[[Derivation], list[Block]]

_RECORDERS: Mapping[str, Recorder] = {
    "forward_dynamics": partial(forward_blocks, ordered=True),
    **FRAME_RECORDERS,
    "events": events,
    "event_actions": event_actions,
    "event_impulse": event_impulse,
    "samples": samples,
}


def recorder(name: str) -> Recorder:
    """Return the function that records a term: in the table, else the method of ``Derivation`` of this name."""
    known: Recorder | None = _RECORDERS.get(name) or getattr(Derivation, name, None)
    if known is not None:
        return known
    from eomgen.mechanics.terms.further_recorders import FURTHER_RECORDERS  # noqa: PLC0415  # terms of few models

    return FURTHER_RECORDERS[name]


def differentiand_recorder(name: str) -> Recorder:
    """Return the function that records a term whose derivatives are recorded."""
    return forward_blocks if name == "forward_dynamics" else recorder(name)
