"""One step of a method with fixed steps as a chain of functions, with the patterns of its first and second derivatives.

Values are numbered: arguments of differentiation, the unknowns of implicit equations, values that are held, then the
results of nodes. A node is a function of the model or of a group, or a sum of multiples of values by powers of
the length of the step. With Y = (inputs y, unknowns U), G(Y) = 0 the equations and E(Y) the end of the step,

    dU/dy = -G_U^-1 G_y,   dE/dy = E_y + E_U dU/dy,   eta = -G_U^-T E_U^T weights,

and the Hessian of weights . E is (1, dU/dy)^T L (1, dU/dy), with L the Hessian of weights . E + eta . G in Y: the sum
over nodes of the Hessian for the node's adjoint, between the derivatives of the arguments in Y.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.codegen.program import Program
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.family import LinearStep
from eomgen.integrators.families.register import canonical_name, method_named
from eomgen.products.derivatives.steps import (
    STAGES,
    WEIGHTS,
    StepOperations,
    StepTerm,
    composition,
    runge_kutta,
    variational,
    variational_unknowns,
)
from eomgen.products.optimisers.functions import Exported, dense_pattern, exported_group_function, lower_pattern
from eomgen.products.optimisers.group_functions import GroupFunction, group_function

Nonzero = NDArray[np.bool_]
_Functions = Mapping[str, Exported]
#: Method of steps without constraints.
RUNGE_KUTTA = "rk4"
#: Functions that steps of each family take: of scenes without and with constraints.
_EXPLICIT = ("forward_dynamics", "internal_rate")
_VARIATIONAL = ("momenta", "residual", "constraint", "constraint_velocity", "internal_rate")
_IMPLICIT = (
    ("inverse_dynamics", *_EXPLICIT),
    (*("residual", "constraint_acceleration", "constraint_velocity", "internal_rate"),),
    ("residual", "constraint_acceleration", "constraint", "constraint_velocity", "internal_rate"),
)


class Slot(NamedTuple):
    """Consecutive values: the number of the first, and how many."""

    place: int
    size: int

    def part(self, start: int, size: int) -> Slot:
        """Return some of the values."""
        return Slot(self.place + start, size)


class ChainNode(NamedTuple):
    """One operation of a step: a function of the chain, by number, or with the number -1 a sum.

    Attributes
    ----------
    function : number in ``StepChain.functions``; -1 of a sum
    result : values that the node computes
    arguments : values of the function's arguments; empty of a sum
    terms : of a sum; empty of a function
    """

    function: int
    result: Slot
    arguments: tuple[Slot, ...]
    terms: tuple[StepTerm[Slot], ...]


class ChainFunction(NamedTuple):
    """A function of the model, or of a group."""

    exported: Exported
    group: GroupFunction | None

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.exported.name

    @property
    def blocks(self) -> list[int]:
        """Number of the argument of each column of the Jacobian."""
        return [number for number, size in enumerate(self.exported.sizes.values()) for _ in range(size)]

    @property
    def offsets(self) -> list[int]:
        """Place of each column in the argument."""
        return [index for size in self.exported.sizes.values() for index in range(size)]


class StepChain(StepOperations[Slot]):
    """One step of a method as a chain of nodes on an array of numbered values.

    Parameters
    ----------
    program : Program
    functions : of the model, by name, that the step may take
    title : of the method
    along : arguments of differentiation in addition to x, among u, p, t and h
    unknowns : numbers of unknowns of implicit equations, by name

    Attributes
    ----------
    values, unknowns : places of the arguments x, u, p, t, h, and of the unknowns, by name
    nodes, functions : operations in order, and the functions that they call
    equations : values that are zero in a solution
    guesses : pairs of an unknown and the values with which its iteration begins
    end : (q, v, z) at the end
    """

    def __init__(
        self,
        program: Program,
        functions: Mapping[str, Exported],
        title: str,
        along: Sequence[str],
        unknowns: Mapping[str, int],
    ) -> None:
        """Number x, the arguments of differentiation in ``along``, the unknowns and the held arguments in one array of
        values.

        Names in ``along`` that no function takes are ignored. The chain has no operations, equations, guesses and end
        yet.
        """
        self.program, self.model, self.title = program, functions, title
        self.nq, self.nv, self.nz = program.input_size("q"), program.sizes["v"], program.sizes["z"]
        self.nl, self.nx = program.sizes["lam"], program.input_size("q") + program.sizes["v"] + program.sizes["z"]
        taken = {"x", "h", *(block for function in functions.values() for block in function.sizes)}
        every = {"x": self.nx, "u": program.input_size("u"), "p": program.input_size("p"), "t": 1, "h": 1}
        inputs = {name: size for name, size in every.items() if name in taken}
        self.timed = "t" in taken
        self.sizes = {name: size for name, size in inputs.items() if name == "x" or name in along}
        self.ny, self.nu, self.count = sum(self.sizes.values()), sum(unknowns.values()), 0
        self.values = {name: self.new(size) for name, size in self.sizes.items()}
        self.unknowns = {name: self.new(size) for name, size in unknowns.items()}
        self.values |= {name: self.new(size) for name, size in inputs.items() if name not in self.sizes}
        self.one, self.zero = self.new(1), self.new(max(self.nv, self.nl, 1))
        x = self.values["x"]
        self.q, self.v = x.part(0, self.nq), x.part(self.nq, self.nv)
        self.z = x.part(self.nq + self.nv, self.nz)
        self.nodes: list[ChainNode] = []
        self.functions: list[ChainFunction] = []
        self.guesses: list[tuple[Slot, Slot]] = []
        self.equations: list[Slot] = []
        self.end = Slot(0, 0)

    def new(self, size: int) -> Slot:
        """Return values, zero unless nodes write into some."""
        slot = Slot(self.count, size)
        self.count += size
        return slot

    def call(self, name: str, **slots: Slot) -> Slot:
        """Append the call of a function of the model, and return the result's values. `slots` are the values of its
        arguments by block; inputs, parameters and time are the step's, and accelerations and multipliers zero unless
        given."""
        exported = self.model[name]
        values = {**self.values, "a": self.zero.part(0, self.nv), "lam": self.zero.part(0, self.nl), **slots}
        return self._node(ChainFunction(exported, None), [values[block] for block in exported.sizes])

    def _node(self, function: ChainFunction, arguments: Sequence[Slot], result: Slot | None = None) -> Slot:
        names = [known.name for known in self.functions]
        if function.name not in names:
            self.functions.append(function)
            names.append(function.name)
        slot = self.new(function.exported.output[1]) if result is None else result
        self.nodes.append(ChainNode(names.index(function.name), slot, tuple(arguments), ()))
        return slot

    def sum(self, *terms: StepTerm[Slot], into: Slot | None = None) -> Slot:
        """Append a sum of terms of equal size, and return the values, new ones or `into`. No node is appended for size
        0."""
        slot = self.new(terms[0].value.size) if into is None else into
        if slot.size:
            self.nodes.append(ChainNode(-1, slot, (), terms))
        return slot

    def pad(self, part: Slot, start: int, size: int) -> Slot:
        """Return `size` values that are zero but for `part` from the index `start` on, by a sum; part itself if of that
        size.
        """
        if part.size == size:
            return part
        whole = self.new(size)
        self.sum(StepTerm(1.0, part), into=whole.part(start, part.size))
        return whole

    def time(self, share: float) -> Slot:
        """Return the value t + share h, by a sum unless `share` is 0; the constant 1 if no function takes time."""
        if not (self.timed and share):
            return self.values.get("t", self.one)
        return self.sum(StepTerm(1.0, self.values["t"]), StepTerm(share, self.one, 1))

    def _by_factor(self, name: str, size: int, first: Slot, second: Slot, *, of_q: bool) -> Slot:
        """Append a function of the group for each rotation and pose of the configuration, and return the values of all
        factors. `first` has components of q, or with `of_q` false of v, `second` of v. For plain numbers the result is
        the sum, or without `of_q` the second argument. `name` is of ``group_functions``, `size` the number of results.
        """
        result = self.new(size)
        for factor in self.program.factors:
            coordinates = int(factor["q_start"]), int(factor["q_size"])
            along = int(factor["v_start"]), int(factor["v_size"])
            left, right = first.part(*(coordinates if of_q else along)), second.part(*along)
            target = result.part(*(coordinates if of_q else along))
            if factor["group"] == "R":
                self.sum(*([StepTerm(1.0, left)] if of_q else []), StepTerm(1.0, right), into=target)
            else:
                function = group_function(name, str(factor["group"]))
                self._node(ChainFunction(exported_group_function(function), function), (left, right), target)
        return result

    def update(self, q: Slot, increment: Slot) -> Slot:
        """Return q o exp(increment)."""
        return self._by_factor("update", self.nq, q, increment, of_q=True)

    def increment_rate(self, increment: Slot, v: Slot) -> Slot:
        """Return the rate of an increment at a velocity, up to two brackets."""
        return self._by_rotation("increment_rate", increment, v)

    def cotangent(self, increment: Slot, momentum: Slot) -> Slot:
        """Return a momentum, taken along an increment."""
        return self._by_rotation("cotangent", increment, momentum)

    def _by_rotation(self, name: str, increment: Slot, vector: Slot) -> Slot:
        if all(factor["group"] == "R" for factor in self.program.factors):
            return vector
        return self._by_factor(name, self.nv, increment, vector, of_q=False)

    def balance(self, state: Mapping[str, Slot], impulse: Slot, *terms: StepTerm[Slot]) -> None:
        """Add the equation that the sum of terms and the reactions of an impulse at a state is zero. Reactions are the
        difference of residuals with the impulse as multipliers, and without."""
        still = {**state, "v": self.zero.part(0, self.nv)}
        pushed, free = self.call("residual", **still, lam=impulse), self.call("residual", **still)
        self.equations.append(self.sum(*terms, StepTerm(1.0, pushed), StepTerm(-1.0, free)))

    def ends_with(self, q: Slot, v: Slot, z: Slot) -> None:
        """Set the end of the step."""
        self.end, first = self.new(self.nx), 0
        for part in (q, v, z):
            self.sum(StepTerm(1.0, part), into=self.end.part(first, part.size))
            first += part.size

    # -- patterns and data of the C ----------------------------------------------------------------------------------

    @property
    def nn(self) -> int:
        """Numbers in which the values are differentiated: of y, and unknowns."""
        return self.ny + self.nu

    @property
    def h_column(self) -> int:
        """Column of the length of the step, -1 if the length is held."""
        return int(self.values["h"].place) if "h" in self.sizes else -1

    @property
    def residuals(self) -> list[int]:
        """Values that are zero in a solution."""
        return [slot.place + k for slot in self.equations for k in range(slot.size)]

    @property
    def groups(self) -> list[GroupFunction]:
        """Functions of rotations and poses."""
        return [function.group for function in self.functions if function.group is not None]

    @property
    def numbers(self) -> int:
        """Count of numbers in the Jacobians of all nodes."""
        return sum(self.functions[node.function].exported.first for node in self.nodes if node.function >= 0)

    @property
    def most_arguments(self) -> int:
        """Largest number of arguments of a function."""
        return max(len(function.exported.sizes) for function in self.functions)

    def columns_of(self, node: ChainNode) -> NDArray[np.int64]:
        """Return the values that are the columns of a function's Jacobian."""
        return np.concatenate([np.arange(slot.place, slot.place + slot.size) for slot in node.arguments])

    @cached_property
    def first(self) -> dict[str, int]:
        """Index of the first number of each part of the memory, which follow both derivatives; ``work``: the whole
        size."""
        widest = max((sum(function.exported.sizes.values()) for function in self.functions), default=0)
        scratch = max((function.exported.work for function in self.functions), default=0)
        parts = {"end": self.nx, "W": self.count, "D": self.count * self.nn, "J": self.numbers, "scratch": scratch}
        parts |= {"adjoint": self.count, "product": widest * self.nn, "L": self.nn * self.nn}
        parts |= {"G": self.nu * self.nu, "S": self.nu * self.ny, "eta": self.nu, "LS": self.nu * self.ny}
        places = accumulate(parts.values(), initial=self.nx * self.ny + self.ny * self.ny)
        return dict(zip((*parts, "work"), places, strict=True))

    def export(self) -> Exported:
        """Return the step as a function with the patterns of the Jacobian and Hessian, by the chain rule on structural
        nonzeros; of implicit steps with the inverse of the equations' Jacobian."""
        ny, along = self.ny, np.zeros((self.count, self.nn), bool)
        along[: self.nn] = np.eye(self.nn, dtype=bool)
        second = np.zeros((self.nn, self.nn), bool)
        for node in self.nodes:
            rows = slice(node.result.place, node.result.place + node.result.size)
            if node.function < 0:
                for term in node.terms:
                    source = along[term.value.place : term.value.place + term.value.size]
                    along[rows] |= source
                    if term.power and self.h_column >= 0:
                        along[rows, self.h_column] = True
                        second[self.h_column] |= source.any(axis=0)
                        second[self.h_column, self.h_column] |= term.power > 1
                continue
            exported, columns = self.functions[node.function].exported, self.columns_of(node)
            first = np.zeros((exported.output[1], len(columns)), bool)
            first[exported.jacobian.rows, exported.jacobian.columns] = True
            bent = np.zeros((len(columns), len(columns)), bool)
            bent[exported.hessian.rows, exported.hessian.columns] = True
            along[rows] = first @ along[columns]
            second |= along[columns].T @ bent @ along[columns]
        second |= second.T
        end = along[self.end.place : self.end.place + self.nx]
        jacobian, hessian = end[:, :ny].copy(), second[:ny, :ny].copy()
        if self.nu:
            of_equations = along[self.residuals]
            solved = inverse_pattern(of_equations[:, ny:]) @ of_equations[:, :ny]
            jacobian |= end[:, ny:] @ solved
            mixed = second[:ny, ny:] @ solved
            hessian |= mixed | mixed.T | (solved.T @ second[ny:, ny:] @ solved)
        patterns = dense_pattern(jacobian, ny), lower_pattern(hessian)
        return Exported("step", self.sizes, ("x_next", self.nx), *patterns, self.nx * ny, self.first["work"])


def inverse_pattern(matrix: Nonzero) -> Nonzero:
    """Return the nonzeros of the inverse of a square matrix with these nonzeros and otherwise any numbers. All are
    nonzero if the matrix is singular by structure. With rows in an order that makes the diagonal nonzero, an entry of
    the inverse is nonzero if a path of nonzeros leads from the row to the column."""
    from scipy.sparse import csgraph, csr_array  # noqa: PLC0415  # for steps of methods with unknowns

    size = len(matrix)
    owner = csgraph.maximum_bipartite_matching(csr_array(matrix), perm_type="row")  # row of each column
    if np.any(owner < 0):
        return np.ones((size, size), bool)
    paths = matrix[owner]
    for _ in range(max(size - 1, 1).bit_length()):
        paths = paths | (paths @ paths)
    result = np.zeros((size, size), bool)
    result[:, owner] = paths
    return result


def default_method(program: Program) -> str:
    """Return the method of the function ``step`` unless another is named."""
    if not program.sizes["lam"]:
        return RUNGE_KUTTA
    return "rattlie" if program.sizes["holonomic"] == program.sizes["lam"] else "trapezoidal"


def why_no_step(program: Program) -> str:
    """Return the reason why no step of a model is a function of (q, v, z) alone: sampled states, or angles counted over
    turns; empty if steps are."""
    if program.sampled:
        names = ", ".join(str(program.states[int(row["state"])].name) for row in program.sampled)
        return f"the state {names} is sampled: its value after a step depends on the time of the last sample [E0941]"
    if program.angles:
        return f"the turns of {', '.join(program.angles)} are counted, which has no derivatives [E0942]"
    return ""


def chain_of(
    program: Program, functions: Sequence[Exported], method: str | None, along: Sequence[str]
) -> StepChain | None:
    """Return one step of a method as a chain of functions.

    None, if no method is named, of a model whose functions do not suffice, or with sampled states or angles that are
    counted over turns.

    Parameters
    ----------
    functions : of the model, with derivatives
    method : name; None: ``default_method``
    along : arguments of differentiation in addition to x, among u, p, t and h

    Raises
    ------
    UsageError
        A method without such steps, or none of this model; terms that the steps need are missing.
    ModelError
        A method is named, and no step of the model is a function of the state.
    """
    reason = why_no_step(program)
    if reason and method is not None:
        raise ModelError(Problem("method", reason, "no method, for the other functions, or a scene without this"))
    name = canonical_name(default_method(program) if method is None else method)
    made: Any = method_named(name)
    needed, record = _recorder(program, name, made)
    by_name = {function.name: function for function in functions}
    terms = tuple(term for term in needed if term != "internal_rate" or program.sizes["z"])
    missing = [term for term in terms if term not in by_name]
    if missing and method is not None:
        fault = f"steps of {name} are made of other terms [E2196]"
        raise UsageError(Problem("method", fault, f"terms with {', '.join(missing)}"))
    if reason or missing:
        return None
    by_term = {term: by_name[term] for term in terms}
    return _alpha(program, by_term, made, along) if record is None else _chain(program, by_term, made, along, record)


def _recorder(program: Program, name: str, made: Any) -> tuple[tuple[str, ...], Any]:
    """Return the terms that steps of a method need, and the function that takes a step; None of generalized-alpha.
    Raises UsageError for a method without such steps, or none of this model."""
    rows, holonomic = program.sizes["lam"], program.sizes["holonomic"]
    recorders: dict[str, tuple[tuple[str, ...], bool, Any]] = {
        "composition": (_EXPLICIT, not rows, composition),
        "runge_kutta": (_EXPLICIT, not rows, runge_kutta),
        "rattlie": (_VARIATIONAL, 0 < rows == holonomic, variational),
    }
    needed, fits, record = recorders.get(made.family, ((), False, None))
    if isinstance(made.linear_step, LinearStep) and not made.chooses_steps:
        needed = _IMPLICIT[int(rows > 0) + int(holonomic > 0)]
        fits = not holonomic or getattr(made, "form", "") == "stabilised"
    if not fits:
        kind = "constraints on positions" if holonomic else "constraints" if rows else "no constraints"
        reason = ", since its length is chosen" if made.chooses_steps else f" for scenes with {kind}" if needed else ""
        fault = f"steps of {name} have no derivatives in C{reason} [E0943]"
        raise UsageError(Problem("method", fault, default_method(program)))
    return needed, record


def _chain(program: Program, functions: _Functions, method: Any, along: Sequence[str], record: Any) -> StepChain:
    """Return the chain of an explicit or a RATTLie step; ``record`` takes the step. Raises ModelError for kicks with
    accelerations that depend on velocities."""
    rows = program.sizes["lam"]
    if record is composition:
        _check_kicks(program, functions["forward_dynamics"])
    unknowns = variational_unknowns(program.sizes["v"], rows, program.sizes["z"]) if rows else {}
    chain = StepChain(program, functions, method.title(constrained=bool(rows)), along, unknowns)
    starts = {"mean": chain.v, "v_next": chain.v, "z_next": chain.z}
    chain.guesses += [(slot, starts[name]) for name, slot in chain.unknowns.items() if name in starts]
    record(chain, *([] if rows else [method]))
    return chain


def _check_kicks(program: Program, accelerations: Exported) -> None:
    """Raise ModelError if accelerations depend on velocities."""
    velocities = accelerations.slices.get("v", slice(0, 0))
    columns = accelerations.jacobian.columns
    if np.any((velocities.start <= columns) & (columns < velocities.stop)):
        fault = f"accelerations of {program.prefix} depend on velocities, so that kicks are not symplectic [E0944]"
        raise ModelError(Problem("method", fault, RUNGE_KUTTA))


def _alpha(program: Program, functions: _Functions, method: Any, along: Sequence[str]) -> StepChain:
    """Return the chain of a step of generalized-alpha from (q, v, z), with accelerations that are consistent at the
    start. Constraints on positions have the stabilised form: positions and velocities at the end meet the constraints.
    Unknowns are consistent accelerations at a few times, then vdot, multipliers and internal states at the end."""
    step: LinearStep = method.linear_step
    nv, nz, rows = program.sizes["v"], program.sizes["z"], program.sizes["lam"]
    holonomic = program.sizes["holonomic"]
    share, rate_share = step.alpha_m - step.alpha_f, (step.rate_alpha_m - step.alpha_f) if nz else 0.0
    stages = STAGES if share or rate_share else STAGES[:1]
    unknowns = {f"{name}_{k}": size for k in range(len(stages)) for name, size in (("a", nv), ("lam", rows)) if rows}
    unknowns |= {f"z_{k}": nz for k in range(1, len(stages))}
    weighed = _weighed_components(functions["residual"], holonomic) if holonomic else []
    unknowns |= {"vdot": nv, "lam": rows, "z": nz, "eta": holonomic, "shift": len(weighed)}
    chain = StepChain(program, functions, method.title(constrained=bool(rows)), along, unknowns)
    chain.guesses.append((chain.unknowns["z"], chain.z))
    accelerations: list[Slot] = []
    rates: list[Slot] = []
    first: dict[str, Slot] = {}
    for k, part in enumerate(stages):
        state = {"q": chain.q, "v": chain.v, "z": chain.z, "t": chain.time(part)}
        if part:
            state |= _predict(chain, first, k, part)
        if rows:
            state |= {"a": chain.unknowns[f"a_{k}"], "lam": chain.unknowns[f"lam_{k}"]}
            chain.equations += [chain.call("residual", **state), chain.call("constraint_acceleration", **state)]
            accelerations.append(state["a"])
        else:
            accelerations.append(chain.call("forward_dynamics", **state))
        state["a"] = accelerations[k]
        first = state if k == 0 else first
        rates.append(chain.rate_of_states(**state))
    before = accelerations[0]
    a = before
    if share:
        slope = zip(WEIGHTS, accelerations, strict=True)
        a = chain.sum(StepTerm(1.0, before), *(StepTerm(share * weight, slot) for weight, slot in slope))
    vdot, m, f = chain.unknowns["vdot"], step.alpha_m, step.alpha_f
    after = chain.sum(
        StepTerm((1.0 - f) / (1.0 - m), vdot), StepTerm(f / (1.0 - m), before), StepTerm(-m / (1.0 - m), a)
    )
    theta = chain.sum(StepTerm(1.0, chain.v, 1), StepTerm(0.5 - step.beta, a, 2), StepTerm(step.beta, after, 2))
    v = chain.sum(StepTerm(1.0, chain.v), StepTerm(1.0 - step.gamma, a, 1), StepTerm(step.gamma, after, 1))
    if holonomic:
        theta = chain.sum(StepTerm(1.0, theta), StepTerm(-1.0, _stabilise(chain, weighed), 1))
    state = {"q": chain.update(chain.q, theta), "v": v, "a": vdot, "z": chain.unknowns["z"]}
    state |= {"lam": chain.unknowns["lam"], "t": chain.time(1.0)}
    chain.equations.append(chain.call("residual" if rows else "inverse_dynamics", **state))
    if rows:
        chain.equations += [chain.call("constraint", **state)] if holonomic else []
        chain.equations.append(chain.call("constraint_velocity", **state))
    if nz:
        _move_states(chain, step, rates, state)
    chain.ends_with(state["q"], v, state["z"])
    return chain


def _weighed_components(residual: Exported, holonomic: int) -> list[int]:
    """Return the components of v that constraints on positions take, from the nonzeros of B."""
    first_row, pattern = residual.slices["lam"].start, residual.jacobian
    of_rows = (first_row <= pattern.columns) & (pattern.columns < first_row + holonomic)
    return sorted({int(row) for row in pattern.rows[of_rows]})


def _move_states(chain: StepChain, step: LinearStep, rates: Sequence[Slot], state: Mapping[str, Slot]) -> None:
    """Add the equation of internal states at the end of a step, with the rates at the times of the start; `state` has
    the values at the end."""
    m, f, gamma = step.rate_alpha_m, step.alpha_f, step.rate_gamma
    of_start = 1.0 - gamma - gamma * m / (1.0 - m)  # of the algorithmic rate at the start
    rate = StepTerm(gamma * (1.0 - f) / (1.0 - m), chain.rate_of_states(**state), 1)
    terms = [StepTerm(of_start + gamma * f / (1.0 - m), rates[0], 1), rate]
    if share := m - f:
        slope = zip(WEIGHTS, rates, strict=True)
        terms += [StepTerm(of_start * share * weight, slot, 1) for weight, slot in slope]
    chain.equations.append(chain.sum(StepTerm(1.0, chain.z), StepTerm(-1.0, state["z"]), *terms))


def _predict(chain: StepChain, start: Mapping[str, Slot], k: int, part: float) -> dict[str, Slot]:
    """Return q, v and z at the share `part` of a step after the start, by the accelerations of the start, as values by
    block. `start` has the values at the start, `k` is the number of the time, for the unknown of z.

    The stepper takes the linearly implicit step z - z_n = part h (Z_n + dZ/dz (z - z_n)). Here the rates Z are taken at
    z, which is the same for rates linear in z, and differs by the third power of h for others.
    """
    moved = chain.sum(StepTerm(part, chain.v, 1), StepTerm(0.5 * part * part, start["a"], 2))
    state = {"q": chain.update(chain.q, moved), "v": chain.sum(StepTerm(1.0, chain.v), StepTerm(part, start["a"], 1))}
    if chain.nz:
        state["z"] = z = chain.unknowns[f"z_{k}"]
        chain.guesses.append((z, chain.z))
        rate = chain.rate_of_states(**{**start, "z": z})
        chain.equations.append(chain.sum(StepTerm(1.0, chain.z), StepTerm(-1.0, z), StepTerm(part, rate, 1)))
    return state


def _stabilise(chain: StepChain, weighed: Sequence[int]) -> Slot:
    """Return W B^T eta at the start of a step, (nv,), W = diag(1/M_ii), zero for components without such constraints.
    The residual is linear in accelerations and multipliers, so M e_i x_i and B^T eta are differences of residuals, and
    M_ii x_i = (B^T eta)_i are equations of unknowns x, which are added. A component without inertia has the weight 1,
    as in the stepper. `weighed` are the components with constraints."""
    eta, shift, nv = chain.unknowns["eta"], chain.unknowns["shift"], chain.nv
    exported = chain.model["residual"]
    first = exported.slices["a"].start if "a" in exported.slices else exported.jacobian.shape[1]
    nonzeros = set(zip(exported.jacobian.rows.tolist(), exported.jacobian.columns.tolist(), strict=True))
    still = {"q": chain.q, "v": chain.zero.part(0, nv), "z": chain.z}
    multipliers, result = chain.pad(eta, 0, chain.nl), chain.new(nv)
    pushed, free = chain.call("residual", **still, lam=multipliers), chain.call("residual", **still)
    for number, i in enumerate(weighed):
        component = shift.part(number, 1)
        chain.sum(StepTerm(1.0, component), into=result.part(i, 1))
        balance = [StepTerm(-1.0, pushed.part(i, 1)), StepTerm(1.0, free.part(i, 1))]
        if (i, first + i) in nonzeros:
            moved = chain.call("residual", **still, a=chain.pad(component, i, nv))
            balance += [StepTerm(1.0, moved.part(i, 1)), StepTerm(-1.0, free.part(i, 1))]
        else:
            balance.append(StepTerm(1.0, component))
        chain.equations.append(chain.sum(*balance))
    return result
