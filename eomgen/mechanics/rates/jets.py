"""Jets in time of q, v, a, z, u, t and the base along a motion, from inputs that hold the derivatives; time
derivatives of prescribed inputs.

The motion is given by a and its derivatives j = da/dt, s = d2a/dt2 and, beyond, the rows of ``a_higher``; likewise u.
Internal states follow their own law zdot = f; its jets give all further derivatives (Griewank and Walther 2008, section
13.2).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.mechanics.forces.internal_states import InternalStates
from eomgen.mechanics.tree.base import BaseState
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.calculus.configuration import configuration_jets, pose_jet
from eomgen.symbolic.calculus.jets import Jet, JetAlgebra, jets, taylor_coefficients, time_derivatives
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import RATE_BLOCKS, Block, base_place

Seeds = dict[Ref | InputSymbol, Jet]


def derivative_inputs(tape: Tape, block: str, index: int, size: int, order: int) -> list[Ref]:
    """Return one component of a or u and its time derivatives up to ``order``, as inputs."""
    first, second, higher = RATE_BLOCKS[block]
    names = [(block, index), (first, index), (second, index)]
    names += [(higher, row * size + index) for row in range(order - 2)]
    return [tape.input(name, component) for name, component in names[: order + 1]]


def accelerations(tape: Tape, nv: int, order: int) -> list[list[Ref]]:
    """Return a and its time derivatives up to ``order`` for each velocity component, (nv, order + 1)."""
    return [derivative_inputs(tape, "a", k, nv, order) for k in range(nv)]


def base_twist(tape: Tape, base: BaseState, order: int) -> list[list[Ref]]:
    """Return the six components of the base's twist, angular first, each with time derivatives up to ``order``.
    Derivatives are inputs, from order 2 on in the block ``base_rates``; all are 0 for an acceleration that is always
    zero."""
    starts = [base_place("omega"), base_place("velocity")]
    rates = [base_place("omega_dot"), base_place("velocity_dot")]
    components: list[list[Ref]] = []
    for part in range(2):
        for k in range(3):
            path = [base.struct[starts[part] + k].ref, base.struct[rates[part] + k].ref]
            still = path[1] == ZERO
            path += [ZERO if still else tape.input("base_rates", 6 * row + 3 * part + k) for row in range(order - 1)]
            components.append(path[: order + 1])
    return components


class MotionJets:
    """Jets (truncated Taylor series in time) of all inputs of one scene's equations along its motion. ``inputs`` is the
    number of components of u."""

    def __init__(self, tree: Tree, base: BaseState, inputs: int, internal: InternalStates) -> None:
        self.tree = tree
        self.tape = tree.algebra.tape
        self.base = base
        self.inputs = inputs
        self.internal = internal

    def of(
        self, quantities: Sequence[Ref], order: int, along: Sequence[Sequence[Ref]] | None = None
    ) -> list[list[Ref]]:
        """Return for each quantity its time derivatives of orders 0 to ``order``. ``along`` holds a and derivatives for
        each velocity component, unless these are inputs of the tape."""
        series = jets(self.tape, quantities, self.seeds(order, along), order)
        return [time_derivatives(self.tape, jet) for jet in series]

    def along_flow(self, accelerations_: Sequence[Ref], order: int) -> list[list[Ref]]:
        """Return for each velocity component vdot and the time derivatives up to ``order``. ``accelerations_`` are vdot
        as functions of the state, and the derivatives are along the motion with this vdot."""
        along: list[list[Ref]] = [[] for _ in accelerations_]
        for k in range(order + 1):
            for path, derivatives in zip(
                along, self.of(accelerations_, k, [[*path, ZERO] for path in along]), strict=True
            ):
                path.append(derivatives[k])
        return along

    def seeds(self, order: int, along: Sequence[Sequence[Ref]] | None = None) -> Seeds:
        """Return the jets of all inputs up to ``order``, by input. ``along`` holds a and derivatives for each velocity
        component; by default these are inputs of the tape."""
        paths = accelerations(self.tape, self.tree.nv, order) if along is None else along
        series = [taylor_coefficients(self.tape, path) for path in paths]
        velocities = [self._velocity(k, series[k]) for k in range(self.tree.nv)]
        seeds = self._without_states(velocities, order)
        seeds |= {InputSymbol("a", k): jet for k, jet in enumerate(series)}
        return seeds | self._states(seeds, order)

    def _velocity(self, index: int, acceleration: Jet) -> list[Ref]:
        return JetAlgebra(self.tape).integrate(self.tape.input("v", index), acceleration)

    def _without_states(self, velocities: Sequence[Jet], order: int) -> Seeds:
        """Return the jets of t, q, v, u and the base; ``velocities`` are the jets of v."""
        tape = self.tape
        factors = [(f.group, f.q_start, f.q_size, f.v_start) for f in self.tree.factors]
        seeds: Seeds = {InputSymbol("t", 0): [tape.input("t"), ONE]}
        seeds |= configuration_jets(tape, factors, velocities, order)
        seeds |= {InputSymbol("v", k): jet for k, jet in enumerate(velocities)}
        for k in range(self.inputs):
            seeds[InputSymbol("u", k)] = taylor_coefficients(tape, derivative_inputs(tape, "u", k, self.inputs, order))
        if self.base.moving:
            seeds |= base_jets(tape, self.base, order)
        return seeds

    def _states(self, seeds: Mapping[Ref | InputSymbol, Jet], order: int) -> Seeds:
        """Return the jets of the internal states up to ``order``, given the jets of all other inputs (``seeds``). Each
        coefficient follows from the previous coefficient by the rates of the states."""
        symbols = [InputSymbol("z", k) for k in range(self.internal.count)]
        paths: list[list[Ref]] = [[self.tape.input("z", k)] for k in range(len(symbols))]
        for k in range(order if symbols else 0):
            known: dict[Ref | InputSymbol, Jet] = dict(seeds)
            known |= dict(zip(symbols, paths, strict=True))
            rates = jets(self.tape, [value.ref for value in self.internal.rates], known, k)
            for path, rate in zip(paths, rates, strict=True):
                path.append(self.tape.mul(self.tape.constant(1.0 / (k + 1)), rate[k]))
        return dict(zip(symbols, paths, strict=True))


def base_jets(tape: Tape, base: BaseState, order: int) -> Seeds:
    """Return the jets up to ``order`` of all components of the base struct, by input, from derivatives of the base's
    twist."""
    twist = base_twist(tape, base, order + 1)
    jets_of_twist = [taylor_coefficients(tape, path) for path in twist]
    pose = [value.ref for value in base.struct[:7]]
    algebra = JetAlgebra(tape)
    if base.turning:
        paths = pose_jet(tape, pose, jets_of_twist, order)
    else:
        paths = [[ref] for ref in pose[:4]]
        paths += [algebra.integrate(ref, jet[:order]) for ref, jet in zip(pose[4:], jets_of_twist[3:], strict=True)]
    paths += [jet[: order + 1] for jet in jets_of_twist]
    paths += [algebra.rate(jet) for jet in jets_of_twist]
    return {InputSymbol("base", k): path for k, path in enumerate(paths)}


def base_rates(tape: Tape, law: Sequence[Scalar], order: int) -> Block:
    """Return the block ``base_rates``, (order, 6): time derivatives 2 to order + 1 of the components of the base's
    twist. ``law`` is the base struct as functions of time."""
    start = base_place("omega_dot")
    paths = _over_time(tape, law[start : start + 6], order)
    refs = tuple(path[k] for k in range(1, order + 1) for path in paths)
    description = "time derivatives of the components of omega and velocity, from the second on"
    return Block("base_rates", (order, 6), refs, description)


def input_rates(tape: Tape, values: Sequence[Scalar], order: int) -> tuple[Block, ...]:
    """Return the blocks ``u_dot``, ``u_ddot`` and ``u_higher`` with time derivatives up to ``order`` of inputs by
    formulas of time, ``values``. Blocks of higher derivatives are left out."""
    paths = _over_time(tape, values, order)
    first, second, higher = RATE_BLOCKS["u"]
    blocks = [
        Block(name, (len(values),), tuple(path[k] for path in paths), f"time derivative {k} of the inputs")
        for k, name in ((1, first), (2, second))
        if k <= order
    ]
    if order > 2:
        refs = tuple(path[k] for k in range(3, order + 1) for path in paths)
        blocks.append(
            Block(higher, (order - 2, len(values)), refs, "time derivatives of the inputs, from the third on")
        )
    return tuple(blocks)


def _over_time(tape: Tape, values: Sequence[Scalar], order: int) -> list[list[Ref]]:
    time = InputSymbol("t", 0)
    series = jets(tape, [value.ref for value in values], {time: [tape.input("t"), ONE]}, order)
    return [time_derivatives(tape, jet) for jet in series]
