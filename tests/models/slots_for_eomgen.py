"""Another distribution: the joint type ``slot``, a pin that slides along a slot and turns in it."""

from __future__ import annotations

from eomgen.extending import Connection, ElementaryMotion

SLOT = Connection(
    "slot", (ElementaryMotion("travel", (1,), (1,)), ElementaryMotion("turn", (0,), (0,))), meanings=("angle", "travel")
)
