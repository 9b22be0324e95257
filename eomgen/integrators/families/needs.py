"""Requirements of methods on systems: reasons for which they are refused otherwise, and substitutes."""

from __future__ import annotations

from eomgen.base.data import dataclass


@dataclass(frozen=True)
class SystemRequirement:
    """A fact that a system must have or must not have, with the reason and the alternative.

    ``parameter`` is the parameter of the method that brings the need about, if any.
    """

    fact: str
    value: bool
    reason: str
    alternative: str
    parameter: str = ""


#: Of methods whose steps evaluate ordinary differential equations.
UNCONSTRAINED = SystemRequirement(
    "constraints",
    False,
    "it steps ordinary differential equations and would ignore the constraint equations",
    "rk4_partitioned, which eliminates constraints, generalized_alpha, which keeps them, or a tree of joints",
)
#: Of methods that expand inputs in series of time.
UNCONSTRAINED_SERIES = SystemRequirement(
    "constraints",
    False,
    "it expands ordinary differential equations and would ignore the constraint equations",
    "generalized_alpha, which keeps constraints, rk4_partitioned, which eliminates them, or a tree of joints",
)
#: Of methods that linearise these equations about the start of a step.
UNCONSTRAINED_LINEARISED = SystemRequirement(
    "constraints",
    False,
    "its step solves ordinary differential equations, and forces of constraints are not known at its start",
    "rosenbrock or lsrt2, which keep constraints with one factorization a step, generalized_alpha, or a tree of joints",
)
#: Of Newmark's methods that are stable in small steps only.
UNCONSTRAINED_CONDITIONALLY_STABLE = SystemRequirement(
    "constraints",
    False,
    "with 2 beta < gamma the highest frequency limits its step, and constraints are infinitely stiff",
    "beta of at least gamma/2: newmark with alpha, trapezoidal, hht or generalized_alpha",
    "beta",
)

#: Of variational methods: discrete Lagrangians know positions at both ends of a step.
POSITIONS_ALONE = SystemRequirement(
    "velocity_constraints",
    False,
    "its step holds positions on the constraints, and rolling, skates and other constraints of velocities alone have"
    " no positions to hold",
    "generalized_alpha, which keeps them",
)


def needs_constraints(otherwise: str) -> SystemRequirement:
    """Return the need of a method that eliminates constraints; ``otherwise`` is the method for scenes without
    constraints."""
    reason = f"it eliminates constraint equations, and {otherwise} does the same work if there are none"
    return SystemRequirement("constraints", True, reason, otherwise)


_OTHERWISE = "rattlie, which keeps energies if inertia varies, or rk4"
#: Of compositions of drifts and kicks: the two parts of the Hamiltonian have exact motions.
CONSTANT_INERTIA = SystemRequirement(
    "constant_mass",
    True,
    "its drifts are exact at constant velocities, and constant momenta give these only if inertia does not change with"
    " the position",
    _OTHERWISE,
)
NO_VELOCITY_FORCES = SystemRequirement(
    "velocity_forces",
    False,
    "its kicks hold positions while velocities change, so forces of dampers and friction have no place in them",
    _OTHERWISE,
)
NO_INNER_STATES = SystemRequirement(
    "internal_states",
    False,
    "its drifts and kicks move positions and velocities alone",
    "rk4, or generalized_alpha for stiff ones",
)
