"""Which lanes come to which statements of a function: regions, loops, and the variables that belong to them."""

from __future__ import annotations

from dataclasses import dataclass

from eomgen.products.ensembles.lane_code.types import Type


@dataclass
class Region:
    """Statements that the same lanes come to, and the variable that says which; ``outer`` holds it."""

    mask: str
    outer: Region | None = None
    #: The loop with this region as its body.
    loop: Loop | None = None
    #: Some lanes left from within a block of it.
    left: bool = False


@dataclass
class Loop:
    """A loop of the source; ``run`` names the lanes that take another iteration, if lanes diverge."""

    region: Region
    run: str = ""
    parted: bool = False


@dataclass
class Variable:
    """A variable of the function, and the region in which it is declared."""

    type: Type
    region: Region
    null: bool = False
