"""Bodies that the functions of a Program share: loops over elements, external calls, texts of repeated operations."""

from __future__ import annotations

from eomgen.base.data import dataclass, field
from eomgen.codegen.program import Addition, ProgramShared
from eomgen.symbolic.external import Call
from eomgen.symbolic.map import Map


@dataclass(frozen=True)
class RunLoop:
    """A Map run by a function, and the additions of the elements to outputs, with numbers for these outputs."""

    loop: Map
    additions: tuple[Addition, ...] = ()

    @property
    def outputs(self) -> int:
        """Number of outputs to which the loop adds."""
        return len({item.output for item in self.additions})


@dataclass
class Bodies:
    """Bodies of one Program, completed function by function.

    Attributes
    ----------
    loops : loops over elements
    curves : number of a curve by its id
    calls : one call of each external function
    shared : texts of shared stretches; None: no stretches are shared
    """

    loops: list[RunLoop] = field(default_factory=list)
    curves: dict[int, int] = field(default_factory=dict)
    calls: list[Call] = field(default_factory=list)
    shared: list[ProgramShared] | None = None
