"""Dependencies of the unknowns of an FMU, from the nonzeros of derivatives in all arguments."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cached_property

import numpy as np

from eomgen.codegen.program import Program
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS

#: Kind of a known, and the place in the array of the kind.
Known = tuple[str, int]
#: Terms on request whose nonzeros give dependencies and derivatives.
PATTERNS = (
    "forward_dynamics_derivatives",
    "residual_derivatives",
    "constraint_acceleration",
    "constraint_acceleration_derivatives",
    "internal_rate_derivatives",
    "outputs_derivatives",
    "input_derivatives",
)


def argument_sizes(program: Program) -> dict[str, int]:
    """Return the numbers of directions in which functions are differentiated, by argument in their order."""
    return {block: 1 if block == "t" else program.input_size({"q": "v"}.get(block, block)) for block in ARGUMENTS}


class Dependencies:
    """Knowns on which the unknowns of a Program depend.

    Parameters
    ----------
    program : with nonzeros of derivatives, of which absent ones make the dependencies unknown
    inputs : numbers of the inputs that are set from outside
    """

    def __init__(self, program: Program, inputs: Collection[int]) -> None:
        self.program, self.inputs = program, inputs
        modes = program.method["events"]["modes"] if "events" in program.method else []
        self._modes = {int(mode["parameter"]): number for number, mode in enumerate(modes)}
        rows = program.method.get("samples", {}).get("rows", ())
        self._sampled = {int(row["state"]) for row in rows}

    def of(self, kind: str, index: int) -> tuple[set[Known], set[Known]] | None:
        """Return two sets of knowns that determine an unknown: with constant derivatives, and all others; None if not
        known. ``kind`` is ``der_q``, ``der_v``, ``der_z`` or ``output``, ``index`` the place in this kind's array."""
        if kind == "der_q":
            return self._dependencies_of_rate(index)
        if kind == "der_v":
            return None if self.accelerations is None else (set(), self.accelerations[index])
        if kind == "der_z":
            return None if self.states is None else (set(), self.states[index])
        if kind == "output" and self.outputs is not None:
            return set(), self.outputs[index]
        return None

    def _dependencies_of_rate(self, index: int) -> tuple[set[Known], set[Known]]:
        directions = [v for v, components in self._components.items() if index in components]
        rates: set[Known] = {("v", v) for v in directions}
        components = self._components[directions[0]]
        if len(components) == 1:
            return rates, set()
        quaternion = components if len(components) == 4 else self._components[directions[0] - 3]
        return set(), rates | {("q", component) for component in quaternion}

    @cached_property
    def accelerations(self) -> list[set[Known]] | None:
        """Set of knowns of each component of vdot, (nv,), one set for all with constraints; None without patterns."""
        program, nv = self.program, self.program.sizes["v"]
        if not program.sizes["lam"]:
            rows = self._rows("forward_dynamics")
            return None if rows is None else [self._plain(row) for row in rows]
        known = [self._rows(name) for name in ("residual", "constraint_acceleration")]
        if any(rows is None for rows in known):
            return None
        every = set[Known]().union(*(self._plain(row) for rows in known if rows is not None for row in rows))
        return [every] * nv

    @cached_property
    def states(self) -> list[set[Known]] | None:
        """Knowns of each rate of an internal state."""
        rows = self._rows("internal_rate")
        return None if rows is None else [self._plain(row) for row in rows]

    @cached_property
    def outputs(self) -> list[set[Known]] | None:
        """Set of knowns of each output, through accelerations and multipliers, too; None without the derivatives."""
        rows = self._rows("outputs")
        if rows is None:
            return None
        result = []
        for row in rows:
            knowns = self._plain(row)
            through = [index for block, index in row if block == "a"]
            multipliers = any(block == "lam" for block, _ in row)
            if (through or multipliers) and self.accelerations is None:
                return None
            for index in through or ([0] if multipliers else []):
                knowns |= (self.accelerations or [])[index]
            result.append(knowns)
        return result

    def direct(self, kind: str, index: int) -> tuple[set[Known], set[Known]] | None:
        """Return the knowns of an unknown as ``of`` does, accelerations and multipliers as knowns ``algebraic``."""
        nv = self.program.sizes["v"]
        if kind == "der_v":
            return {("algebraic", index)}, set()
        if kind not in ("output", "residual"):
            return self.of(kind, index)
        names = ("residual", "constraint_acceleration") if self.program.sizes["lam"] else ("inverse_dynamics",)
        parts = [self._rows(name) for name in (("outputs",) if kind == "output" else names)]
        if any(rows is None for rows in parts):
            return None
        row = [row for rows in parts if rows is not None for row in rows][index]
        algebraic: set[Known] = {("algebraic", k) for block, k in row if block == "a"}
        algebraic |= {("algebraic", nv + k) for block, k in row if block == "lam"}
        return set(), self._plain(row) | algebraic

    def _rows(self, name: str) -> list[list[tuple[str, int]]] | None:
        """Return for each row of a function the arguments (block, place) with a nonzero derivative, q by directions of
        v. None if the Program lacks the function or the pattern of derivatives."""
        program = self.program
        if name not in program.function_names or f"{name}_derivatives" not in program.patterns:
            return None
        size = sum(output.size for output in program.function(name).outputs)
        arguments = [(block, index) for block, size in argument_sizes(program).items() for index in range(size)]
        rows, columns = unpacked_places(program.patterns[f"{name}_derivatives"])
        result: list[list[tuple[str, int]]] = [[] for _ in range(size)]
        for row, column in zip(np.asarray(rows).tolist(), np.asarray(columns).tolist(), strict=True):
            result[row].append(arguments[column])
        return result

    def _parameter(self, index: int) -> Known:
        return ("mode", self._modes[index]) if index in self._modes else ("parameter", index)

    @cached_property
    def _given(self) -> list[set[Known]]:
        """Parameters and time on which each input depends that the scene gives, as a set for each input.

        The sets are empty if the scene gives no input. Without patterns of derivatives of the given inputs, each input
        has all parameters and time.
        """
        program, count = self.program, len(self.program.parameters)
        every: set[Known] = {("time", 0), *(self._parameter(index) for index in range(count))}
        if "inputs" not in program.function_names:
            return [set() for _ in program.inputs]
        if "input_derivatives" not in program.patterns:
            return [set(every) for _ in program.inputs]
        result: list[set[Known]] = [set() for _ in program.inputs]
        rows, columns = unpacked_places(program.patterns["input_derivatives"]).tolist()
        for row, column in zip(rows, columns, strict=True):
            result[row].add(("time", 0) if column == count else self._parameter(column))
        return result

    @cached_property
    def _components(self) -> Mapping[int, tuple[int, ...]]:
        """Components of q for each direction."""
        result: dict[int, tuple[int, ...]] = {}
        for factor in self.program.factors:
            q, v = int(factor["q_start"]), int(factor["v_start"])
            if factor["group"] == "R":
                result.update({v + k: (q + k,) for k in range(int(factor["v_size"]))})
                continue
            quaternion = tuple(range(q, q + 4))
            result.update({v + k: quaternion for k in range(3)})
            if int(factor["v_size"]) > 3:
                result.update({v + k: (q + 4, q + 5, q + 6) for k in range(3, 6)})
        return result

    def _plain(self, row: list[tuple[str, int]]) -> set[Known]:
        """Return the knowns for the arguments (block, index) of a row; accelerations and multipliers are left out.
        Inputs that the scene gives are replaced by the parameters and the time in the formula."""
        knowns: set[Known] = set()
        for block, index in row:
            if block == "q":
                knowns |= {("q", component) for component in self._components[index]}
            elif block == "u":
                knowns |= {("input", index)} if index in self.inputs else self._given[index]
            elif block == "t":
                knowns.add(("time", 0))
            elif block == "p":
                knowns.add(self._parameter(index))
            elif block == "z" and index in self._sampled:
                knowns.add(("sampled", index))
            elif block in ("v", "z"):
                knowns.add((block, index))
        return knowns
