"""Products of a sparse matrix with a vector: one loop for each stretch of terms that are equally spaced."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.iterations import READ, rule
from eomgen.codegen.scheduling.shortened import counted


def added_products(terms: Sequence[tuple[int, int, int]], gain: str = "") -> tuple[Statement, ...]:
    """Return loops that add matrix times vector to output 0; empty if tables are as short.

    They read ``right``, the initial value, ``numbers``, the matrix entries, and ``vector``.

    Parameters
    ----------
    terms : row, number and column of each nonzero, in the order in which they are added
    gain : the block of a factor with which they are subtracted instead
    """
    rows, numbers, columns = (rule([term[k] for term in terms]) for k in range(3))
    read: list[Expression] = [("row", "right", *rows), ("row", "numbers", *numbers), ("row", "vector", *columns)]
    right, number, component, factor = (("in", READ, k) for k in range(4))
    value: Expression = ("ADD", right, ("MUL", number, component))
    if gain:
        read.append(("in", gain, 0))
        value = ("SUB", right, ("MUL", ("MUL", factor, number), component))
    loops = counted(len(terms), (Statement("out", (0, 0, value)),), read, (("row", 0, *rows),))
    is_table = len(loops) == 1 and any(isinstance(item, tuple) and len(item) == 3 for item in loops[0][2][:3])
    return () if is_table else tuple(Statement("repeat", data) for data in loops)
