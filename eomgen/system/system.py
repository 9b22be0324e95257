"""System: the contract between front ends and back ends.

    M(q) vdot + h(q, v) + b(q, v, t) + B(q, t)^T lam = Q(q, v, t, u)
    qdot = q * tilde(v),   Phi(q, t) = 0,   zdot = Z(q, v, z, t, u)

A front end fills a System; back ends (C, integrators, linearisation, rates, studies) read only the System. The residual
comes first; M, h, b, Q, B, Phi and Z are projections of it, present only on request.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

from eomgen.base.calls import NamedAttributes, checked_calls
from eomgen.base.data import dataclass, field
from eomgen.errors import Problem, UsageError
from eomgen.lie.product import Factor
from eomgen.symbolic.latency import critical_path
from eomgen.symbolic.operations import Counts, InputSymbol
from eomgen.symbolic.periodic import Columns, harmonics_in, periodic_inputs
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.events import EventRow, Mode
from eomgen.system.notebook import equation, line, system_page
from eomgen.system.signals import SampledController, SampleRow
from eomgen.system.terms import ARGUMENTS, TERMS, nearest_term

if TYPE_CHECKING:
    import sympy

#: Input blocks in the order of the arguments of every function.
INPUT_BLOCKS = (
    "p", "t", "q", "v", "a", "j", "s", "a_higher", "z", "lam", "u", "u_dot", "u_ddot", "u_higher", "base", "base_rates",
    "weights", "direction",
)  # fmt: skip  # a table

#: Blocks with the first, the second, and row by row the higher time derivatives of a and u.
RATE_BLOCKS = {"a": ("j", "s", "a_higher"), "u": ("u_dot", "u_ddot", "u_higher")}

#: Fields of the base struct: name, number of components, meaning. Twists are in base axes, angular first.
BASE_LAYOUT: tuple[tuple[str, int, str], ...] = (
    ("quaternion", 4, "orientation of the base (w, x, y, z), base axes to world axes"),
    ("position", 3, "origin of the base in world axes, m"),
    ("omega", 3, "angular velocity in base axes, rad/s"),
    ("velocity", 3, "velocity of the origin in base axes, m/s"),
    ("omega_dot", 3, "time derivative of omega, rad/s^2"),
    ("velocity_dot", 3, "time derivative of the components of velocity, m/s^2"),
)

#: Numbers in the base struct.
BASE_SIZE = sum(size for _, size, _ in BASE_LAYOUT)

#: Functions of a known motion: no stepper calls these functions at each step.
OBSERVED = frozenset({"joint_angles", *(name for name, term in TERMS.items() if term.observed)})

#: Terms of the separated form, with symbols.
_SYMBOLS = {"mass": "M", "coupling": "h", "base_motion": "b", "force": "Q"}
#: Names in SymPy of inputs without a name in the scene, of time and of intermediates: no name of a scene may have this
#: form.
_TAKEN = r"t|[qvazu][0-9]+|(p|lam|base|w)_[0-9]+"


def base_place(field_name: str) -> int:
    """Return the offset of a field of the base struct."""
    names = [name for name, _, _ in BASE_LAYOUT]
    return sum(size for _, size, _ in BASE_LAYOUT[: names.index(field_name)])


def base_component(position: int) -> str:
    """Return the name of a component of the base struct by index, ``omega[2]``. Raises ValueError beyond the last."""
    for name, size, _ in BASE_LAYOUT:
        if position < size:
            return f"{name}[{position}]"
        position -= size
    raise ValueError("the base struct has no such component")


class SecondBlocks(NamedTuple):
    """Numbers of components by name, for the blocks of ``second_partials``.

    Attributes
    ----------
    weights : of the residual ``r``, ``zdot``, holonomic constraints ``Phi``, rates ``w`` and accelerations ``wdot`` of
        all constraints, outputs ``y``
    direction : of ``q`` (left-trivialised), ``v``, ``a``, ``z``, ``lam``, ``p``, ``u``
    """

    weights: Mapping[str, int]
    direction: Mapping[str, int]

    def places(self, block: str) -> dict[str, slice]:
        """Return the slices of the parts of ``weights`` or ``direction`` (named by ``block``), by name of the part."""
        result, first = {}, 0
        for name, size in getattr(self, block).items():
            result[name], first = slice(first, first + size), first + size
        return result


def second_blocks(
    *, nv: int, nz: int, nu: int, holonomic: int, rows: int, outputs: int, parameters: int
) -> SecondBlocks:
    """Return the parts of the blocks of ``second_partials`` for given numbers of components. ``rows`` is the number of
    all constraint rows, ``holonomic`` of the holonomic rows among these."""
    weights = {"r": nv, "zdot": nz, "Phi": holonomic, "w": rows, "wdot": rows, "y": outputs}
    return SecondBlocks(weights, {"q": nv, "v": nv, "a": nv, "z": nz, "lam": rows, "p": parameters, "u": nu})


@dataclass(frozen=True)
class Block:
    """One named output of a function, with references row by row."""

    name: str
    shape: tuple[int, ...]
    refs: tuple[Ref, ...]
    description: str = ""


@dataclass(frozen=True)
class Function:
    """A named function of the System: input blocks (ordered as INPUT_BLOCKS) and outputs."""

    name: str
    description: str
    inputs: tuple[str, ...]
    outputs: tuple[Block, ...]

    @cached_property
    def refs(self) -> tuple[Ref, ...]:
        return tuple(chain.from_iterable(block.refs for block in self.outputs))


@dataclass(frozen=True)
class Quantity:
    """A named number of the interface: a parameter or a state (``value`` is its default), an input, an output.

    ``size`` counts the components of an output; ``member`` is the name that code may use, which a target gives.
    """

    name: str
    value: float = 0.0
    size: int = 1
    unit: str = ""
    description: str = ""
    member: str = ""


@dataclass(frozen=True)
class Facts:
    """Facts that methods may rely on; checked before any C exists.

    ``conservative``: the term ``energy`` is there, and shows no power in any state, so that the total energy is
    constant. ``velocity_constraints``: of the constraints some restrict velocities alone. ``ill_scaled``: the
    elimination of M loses digits, so accelerations come from articulated bodies.
    """

    constant_mass: bool
    velocity_forces: bool
    smooth: bool
    moving_base: bool
    constraints: bool = False
    internal_states: bool = False
    conservative: bool = False
    velocity_constraints: bool = False
    ill_scaled: bool = False


@dataclass(frozen=True)
class Discontinuity:
    """A time at which forces are not smooth, repeated after every ``period`` unless that is 0.

    ``order``: the lowest derivative of forces that jumps, 0 for forces. ``blur``: the time is known to this many times
    the precision of the numbers in use. ``constraint``: whether the time belongs to a law that a constraint follows.
    """

    time: float
    period: float
    order: int
    blur: float
    constraint: bool = False


@dataclass(frozen=True)
class Validity:
    """The times with prescribed data: the domain of the curve ``name``, for ``input`` if given."""

    name: str
    input: str
    start: float
    end: float


@dataclass(frozen=True)
class BeamSlopes:
    """Integrals of squared slopes of a beam, int f_k' f_l' dx over its ``length``, m, between bending coordinates in
    one plane, else 0; in the order of its elastic coordinates, the factor ``name``."""

    name: str
    length: float
    squares: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class BeamAxis:
    """Frames along a beam, as functions of its elastic coordinates e, (n,), the factor ``name``.

    In the beam's frame, the section at x[i] is at (x[i], 0, 0) + deflections[i] e - (d, 0, 0), with d the sum of
    shortening[i][m] e_k e_j over all pairs[m] = (k, j), and is turned by exp of the rotation vector rotations[i] e.

    Attributes
    ----------
    x : (p,) m, in order
    deflections, rotations : (p, 3, n)
    pairs : numbers of coordinates
    shortening : (p, pairs)
    """

    name: str
    x: tuple[float, ...]
    deflections: tuple[tuple[tuple[float, ...], ...], ...]
    rotations: tuple[tuple[tuple[float, ...], ...], ...]
    pairs: tuple[tuple[int, int], ...]
    shortening: tuple[tuple[float, ...], ...]


class Sample(NamedTuple):
    """A scene derived in place of a longer scene with more equal parts.

    Choices that depend on lengths, of loops and of eliminations, are made for the longer scene.

    Attributes
    ----------
    parts : equal groups in the shortest run that grows, of which ratios alone are used; 0 for a scene that stands for
        itself
    missing : further groups of this run in the longer scene
    orders : orders of pivots of equal stages, which scenes derived in place of one longer scene share: values by which
        pivots are chosen differ from scene to scene
    """

    parts: int = 0
    missing: int = 0
    orders: dict[object, Any] | None = None

    @property
    def growth(self) -> float:
        """Ratio of the numbers of groups, longer scene to this one."""
        return (self.parts + self.missing) / self.parts if self.parts else 1.0

    def orders_of(self, kind: object) -> dict[Any, Any]:
        """Return the stored pivot orders of equal stages for one kind of matrix, a mapping that eliminations complete.
        A new empty mapping, which is not stored, for a scene without common orders."""
        return {} if self.orders is None else self.orders.setdefault(kind, {})

    def iterations(self, count: int) -> int:
        """Return the iterations in the longer scene of a loop with ``count`` iterations here: a loop over nearly all
        parts, or over pairs of parts, grows with them."""
        return count + count * self.missing // self.parts if 5 * count > 2 * self.parts > 0 else count


#: Of a scene that stands for itself.
WHOLE = Sample()


@checked_calls("eomgen.derive(scene)")
@dataclass(frozen=True)
class System(NamedAttributes):
    """Symbolic equations of motion on one tape.

    Attributes
    ----------
    name : str
        A legal C identifier; prefix of every exported symbol.
    factors : tuple of Factor
        The configuration, a product of groups.
    angles : tuple of str
        Numbers of q after the factors, by name: references of angles that the factors determine up to whole turns only.
        Each reference is within half a turn of its angle, which the function ``joint_angles`` gives; callers that
        change q adapt the reference.
    functions : mapping from name to Function
        ``residual`` is always there: r(q, v, a, z, lam, t, u, p), zero along motions.
    dof_parent : (nv,) tuple
        For each velocity component the nearest coupled component towards the root, -1 at the root: the block sparsity
        of M.
    multipliers : tuple of str
        Name of each constraint row: first the ``holonomic`` rows Phi(q, t) = 0, then rows at velocity level.
    row_units : tuple of str
        Unit of each constraint row: ``m``, ``1`` or, at velocity level, ``m/s``.
    angular : (nv,) tuple
        For each velocity component whether it is an angular velocity, rad/s; else a travel or a deflection.
    states : tuple of Quantity
        Internal states, with initial values.
    patterns : mapping from K, C, M, B, Z, Rz, Fq, Fv, Fz to (row, column) pairs
        Positions of the nonzeros given by ``iteration`` and ``jacobian_values``, in order.
    inner_owners : tuple of int
        For each unknown that ``iteration`` of a long tree has in addition to velocities, the first velocity component
        of the unknown's link.
    frames : tuple of str
        Bodies and named frames that the terms of frames give, in order.
    extent : tuple of Ref
        Size of the machine, m, and of gravity, m/s^2: functions of the parameters.
    events : tuple of EventRow
        Actions at the roots of the functions of the term ``events``, in the order of the term.
    modes : tuple of Mode
        Numbers that only events change.
    sampled : tuple of SampleRow
        Which internal states take new values, given by the term ``samples``, at which times.
    controllers : tuple of SampledController
        Controllers that return values of sampled states.
    discontinuities : tuple of Discontinuity
        Known times at which the right-hand side is not smooth.
    validity : tuple of Validity
        Times beyond which curves have no value.
    constants : tuple of Quantity
        Numbers that have a name in the C.
    beams : tuple of str
        Integrals kept by the equations of each beam.
    slopes : tuple of BeamSlopes
        How far each beam bends.
    axes : tuple of BeamAxis
        Drawing of each beam, if there are poses.
    warnings : tuple of str
        Warnings repeated by every run.
    left_out : tuple of str
        Constraint rows that follow from other rows at the default parameters, and may not at other parameters.
    asked_q, asked_v : tuples of float
        The requested initial state before a correction onto the constraints; empty without a correction.
    kept, dropped : tuples of str
        Terms that the scene made necessary, and terms that the scene did not.
    base_zeros : tuple of int
        Components of the base struct that are zero at all times by the base's law, so that no function reads them.
    relative : tuple of tuples of int
        Velocity components joined by relative springs and dampers, group by group, if a method needs these groups; the
        function ``row_sums`` gives nonzero row sums of K and C over the groups, ``patterns`` the positions.
    links : tuple of pairs of ints
        Pairs of these components with mutual forces that ``relative_forces`` gives apart from the residual.
    sample : Sample
        The longer scene that this one is derived for, if any.
    order : int
        Highest time derivative given by a function, which determines the number of derivatives of inputs and of the
        base's acceleration in its arguments.
    """

    name: str
    tape: Tape
    factors: tuple[Factor, ...]
    functions: Mapping[str, Function]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    bodies: tuple[str, ...]
    initial_q: tuple[float, ...]
    initial_v: tuple[float, ...]
    dof_parent: tuple[int, ...]
    facts: Facts
    asked_q: tuple[float, ...] = ()
    asked_v: tuple[float, ...] = ()
    states: tuple[Quantity, ...] = ()
    multipliers: tuple[str, ...] = ()
    row_units: tuple[str, ...] = ()
    angular: tuple[bool, ...] = ()
    holonomic: int = 0
    patterns: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    inner_owners: tuple[int, ...] = ()
    extent: tuple[Ref, ...] = ()
    events: tuple[EventRow, ...] = ()
    modes: tuple[Mode, ...] = ()
    sampled: tuple[SampleRow, ...] = ()
    controllers: tuple[SampledController, ...] = ()
    discontinuities: tuple[Discontinuity, ...] = ()
    validity: tuple[Validity, ...] = ()
    constants: tuple[Quantity, ...] = ()
    beams: tuple[str, ...] = ()
    slopes: tuple[BeamSlopes, ...] = ()
    axes: tuple[BeamAxis, ...] = ()
    kept: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    description: str = ""
    defaults: Mapping[str, Any] = field(default_factory=dict)
    order: int = 0
    angles: tuple[str, ...] = ()
    base_zeros: tuple[int, ...] = ()
    frames: tuple[str, ...] = ()
    relative: tuple[tuple[int, ...], ...] = ()
    links: tuple[tuple[int, int], ...] = ()
    sample: Sample = WHOLE

    def __repr__(self) -> str:
        return line(self.name, self._sizes, {name: count.flops for name, count in self.counts.items()})

    def _repr_html_(self) -> str:
        functions = (
            (name, ", ".join(function.inputs), self.counts[name].flops, function.description)
            for name, function in self.functions.items()
        )
        return system_page(self.name, self.description, self._sizes, self._formulas, functions)

    def _repr_latex_(self) -> str:
        return "\n".join(f"$$\\displaystyle {text}$$" for text in self._formulas)

    @property
    def _sizes(self) -> dict[str, int]:
        """Numbers of coordinates, inputs, states and constraints, by name."""
        sizes = {name: getattr(self, name) for name in ("nq", "nv", "nu", "nz")}
        return {**sizes, "constraints": len(self.multipliers)}

    @property
    def _formulas(self) -> list[str]:
        """The equations of motion as LaTeX, then the terms of the separated form with at most 120 operations."""
        facts = self.facts
        whole = equation(
            base=facts.moving_base, constraints=bool(self.multipliers), states=bool(self.nz), inputs=bool(self.nu)
        )
        symbols = {term: symbol for term, symbol in _SYMBOLS.items() if term in self.functions}
        short = [term for term in symbols if self.counts[term].flops <= 120]
        return [whole, *(self.latex(term, symbols[term], shortest=True) for term in short)]

    @property
    def nq(self) -> int:
        return sum(factor.q_size for factor in self.factors) + len(self.angles)

    @property
    def nv(self) -> int:
        return sum(factor.v_size for factor in self.factors)

    @property
    def nu(self) -> int:
        return len(self.inputs)

    @property
    def nz(self) -> int:
        return len(self.states)

    @property
    def rate_sizes(self) -> dict[str, int]:
        """Numbers of components of the blocks ``a_higher``, ``u_higher`` and ``base_rates``, by name; 0 without the
        block. They hold time derivatives of ``a`` and ``u`` above the second, and of the base's twist above the
        first."""
        higher = max(self.order - 2, 0)
        base = 6 * self.order if self.facts.moving_base else 0
        return {"a_higher": higher * self.nv, "u_higher": higher * self.nu, "base_rates": base}

    @property
    def second_sizes(self) -> dict[str, int]:
        """Sizes of the blocks ``weights`` and ``direction`` by name: both if there is the function
        ``second_partials``, else ``weights`` alone if there is a ``NAME_hessian``, and empty without these functions. A
        size is the sum of ``second_blocks``; ``weights`` has at least 7 components for each frame with
        ``frame_poses_hessian``, and 2 nv with ``momenta_hessian``."""
        sizes = {name: sum(parts.values()) for name, parts in self.second_blocks._asdict().items()}
        least = {"frame_poses_hessian": 7 * len(self.frames), "momenta_hessian": 2 * self.nv}
        sizes["weights"] = max([sizes["weights"], *(size for name, size in least.items() if name in self.functions)])
        taken = {block for function in self.functions.values() for block in function.inputs}
        return {name: size for name, size in sizes.items() if name in taken}

    @property
    def argument_sizes(self) -> dict[str, int]:
        """Number of directions in each argument of derivatives, in the order of rows and columns."""
        sizes = {**self.second_blocks.direction, "t": 1}
        return {name: sizes[name] for name in ARGUMENTS}

    @property
    def second_blocks(self) -> SecondBlocks:
        """The numbers of components of the blocks ``weights`` and ``direction`` of ``second_partials``, part by part,
        also if there is no such function: two mappings, with ``r`` (residual), ``zdot``, ``Phi`` (holonomic rows),
        ``w`` and ``wdot`` (all rows, rates and accelerations) and ``y`` (outputs), and with ``q`` (nv,
        left-trivialised), ``v``, ``a``, ``z``, ``lam`` (multipliers), ``p`` (parameters) and ``u``."""
        return second_blocks(
            nv=self.nv,
            nz=self.nz,
            nu=self.nu,
            holonomic=self.holonomic,
            rows=len(self.multipliers),
            outputs=sum(output.size for output in self.outputs),
            parameters=len(self.parameters),
        )

    @property
    def initial_z(self) -> tuple[float, ...]:
        return tuple(state.value for state in self.states)

    @cached_property
    def counts(self) -> dict[str, Counts]:
        """Exact operation counts, function by function."""
        return {name: self.tape.counts(function.refs) for name, function in self.functions.items()}

    @cached_property
    def critical_paths(self) -> dict[str, int]:
        """Cycles of the longest chain of operations that wait for one another, function by function."""
        return {name: critical_path(self.tape, function.refs) for name, function in self.functions.items()}

    @cached_property
    def turning(self) -> tuple[int, ...]:
        """Indices of angles in q on which holonomic constraints depend, and which all equations count up to whole turns
        only. A dependence that is only evaluated at the present angle is left out: a quaternion has a period of two
        turns."""
        if not self.holonomic:
            return ()
        equations = [f for name, f in self.functions.items() if name not in OBSERVED]
        held = self.tape.depends_on(
            ref for f in equations for block in f.outputs if block.name == "Phi" for ref in block.refs
        )
        angles = {factor.q_start + k for factor in self.factors if factor.group == "R" for k in range(factor.q_size)}
        held = {symbol for symbol in held if symbol.block == "q" and symbol.index in angles}
        if not held:  # as in absolute coordinates, which are not angles
            return ()
        of_period = periodic_inputs(self.tape, [ref for f in equations for ref in f.refs])
        return tuple(sorted(symbol.index for symbol in of_period & held))

    @cached_property
    def positions(self) -> int:
        """Number of leading components of q on which the holonomic constraints depend. It is nq, or nq without the
        references of angles, which come last, if no constraint depends on these."""
        first = self.nq - len(self.angles)
        rows = (block for f in self.functions.values() for block in f.outputs if block.name == "Phi")
        held = self.tape.depends_on(ref for block in rows for ref in block.refs)
        return self.nq if any(symbol.block == "q" and symbol.index >= first for symbol in held) else first

    @cached_property
    def harmonics(self) -> tuple[Columns | float, ...]:
        """Inputs that the scene gives as sums of a cos(w t) + b sin(w t): a, w and b of each, or a constant.

        Empty if some input is not such a component.
        """
        result: list[Columns | float] = []
        for ref in self.functions["inputs"].refs if "inputs" in self.functions else ():
            value = self.tape.value(ref)
            component = harmonics_in(self.tape, ref, InputSymbol("t", 0)) if value is None else value
            if component is None:
                return ()
            result.append(component)
        return tuple(result)

    @cached_property
    def symbol_names(self) -> dict[InputSymbol, str]:
        """Names from the scene of components of p, u, z, q, v and a, as ``sympy`` uses them.

        Parameters, inputs and states have the names in the scene; coordinates are ``q_hinge``, ``v_hinge``,
        ``a_hinge``, or ``q_ball_0`` and so on for joints with several components. A name shared by two components, or
        in the form of an index in an array (``q0``, ``p_1``), is left out: such a component is named by its index.
        """
        names = {InputSymbol("p", index): item.name for index, item in enumerate(self.parameters)}
        names |= {InputSymbol("u", index): item.name for index, item in enumerate(self.inputs)}
        names |= {InputSymbol("z", index): item.name for index, item in enumerate(self.states)}
        for factor in self.factors:
            blocks = (("q", factor.q_start, factor.q_size), *((b, factor.v_start, factor.v_size) for b in ("v", "a")))
            for block, start, size in blocks:
                for index in range(size):
                    part = f"_{index}" if size > 1 else ""
                    names[InputSymbol(block, start + index)] = f"{block}_{factor.name}{part}"
        for index, label in enumerate(self.angles, self.nq - len(self.angles)):
            names[InputSymbol("q", index)] = "q_" + re.sub(r"\W+", "_", label).strip("_")
        uses = Counter(names.values())
        return {symbol: name for symbol, name in names.items() if uses[name] == 1 and not re.fullmatch(_TAKEN, name)}

    def sympy(
        self, term: str, *, named: bool | None = None
    ) -> sympy.Matrix | tuple[list[tuple[sympy.Symbol, sympy.Expr]], sympy.Matrix]:
        """Return the first block of a term as SymPy expressions; further blocks are left out.

        Symbols are real, and named by ``symbol_names``: ``length``, ``q_hinge``, ``v_ball_2``; or by the index, ``q0``,
        ``p_1``.

        Parameters
        ----------
        term : str
            One of ``functions``.
        named : bool, optional
            Whether intermediate results are named; by default if the block has more than 200 operations.

        Returns
        -------
        sympy.Matrix, or (list of (symbol, expression), sympy.Matrix)
            With names of intermediate results the assignments in order, and the matrix in these names. A vector is a
            column, a number a 1 x 1 matrix.

        Raises
        ------
        UsageError
            The term was not derived, or there is none of that name.
        ValueError
            The block has more than two axes, as ``frame_jacobians``.

        Examples
        --------
        >>> system = eomgen.derive("examples/pendulum_on_shaking_base/scene.toml")
        >>> system.sympy("mass")
        Matrix([[0.01875]])
        """
        # SymPy is imported at first use only
        from eomgen.symbolic.reading import block_to_sympy  # noqa: PLC0415

        block = self._block("sympy", term)
        return block_to_sympy(self.tape, block.refs, block.shape, named=named, names=self.symbol_names)

    def latex(self, term: str, name: str = "", *, shortest: bool = False) -> str:
        r"""Return the first block of a term as LaTeX.

        The expression has the operations of the computation; with ``shortest`` products are multiplied out if an entry
        gets shorter, for example since terms of the coupling vector cancel.

        Parameters
        ----------
        term : str
            One of ``functions``.
        name : str, optional
            Left-hand side of the equation; by default the expression alone.
        shortest : bool, optional
            Whether products are multiplied out if an entry gets shorter, for example since terms of the coupling vector
            cancel; not in a long block.

        Returns
        -------
        str
            ``name = matrix``, or ``name = expression`` for a number; of a block with more than 200 operations the
            assignments of intermediate results first, as of ``sympy``, in the environment ``aligned``.

        Raises
        ------
        UsageError, ValueError
            As of ``sympy``.

        Examples
        --------
        >>> system = eomgen.derive("examples/pendulum_on_shaking_base/scene.toml")
        >>> print(system.latex("mass", "M"))
        M = \left[\begin{matrix}0.01875\end{matrix}\right]
        """
        # SymPy is imported at first use only
        from eomgen.symbolic.reading import to_latex  # noqa: PLC0415

        block = self._block("latex", term)
        return to_latex(self.tape, block.refs, block.shape, name=name, names=self.symbol_names, shortest=shortest)

    def _block(self, call: str, term: str) -> Block:
        if (term := str(term)) not in self.functions:
            hint = f'eomgen.derive(scene, terms=[..., "{term}"])' if term in TERMS else nearest_term(term)
            fault = f"the term {term} is not in this System, which was derived with {', '.join(self.functions)} [E2097]"
            raise UsageError(Problem(call, fault, hint))
        return self.functions[term].outputs[0]
