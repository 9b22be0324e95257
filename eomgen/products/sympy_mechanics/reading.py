"""``from_sympy``: SymPy's descriptions of mechanics as documents that build, run and generate C."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy
from sympy.core.function import AppliedUndef
from sympy.physics.biomechanics import MusculotendonBase
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    System,
    Vector,
    dynamicsymbols,
)

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.messages import is_legal, listed, shown
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.errors import DescriptionError, Message, Problem, UsageError
from eomgen.products.sympy_mechanics.equations import Observations, SymbolicEquations
from eomgen.products.sympy_mechanics.expressions import Expressions, name_of
from eomgen.products.sympy_mechanics.kane import (
    KaneKinematics,
    KaneTerms,
    augmented,
    center_of,
    is_rigid,
    joined_points,
    kane,
    reachable,
)
from eomgen.products.sympy_mechanics.observed import (
    Energies,
    Observed,
    lagrangian_energies,
    power_of_drivers,
    stored_energy,
)
from eomgen.products.sympy_mechanics.rows import SEED, Constraints, KaneRows, Samples, angles, is_singular, values_at
from eomgen.symbolic.calculus.partials import gradient, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, Ref, Tape


@checked_call("eomgen.from_sympy(system, parameters={m: 1.0})")
def from_sympy(
    system: object,
    *,
    parameters: Mapping[Any, float] | None = None,
    initial: Mapping[Any, float] | None = None,
    name: str = "sympy",
    q: Sequence[Any] = (),
    states: Mapping[Any, Any] | None = None,
) -> SymbolicEquations:
    """Take equations of motion from SymPy: a System, KanesMethod or LagrangesMethod, or plain M(q) and f(q, v, t).

    Velocities and accelerations are composed and differentiated on the tape, so neither ``form_eoms`` nor
    ``kanes_equations`` nor ``form_lagranges_equations`` is called or needed. Free symbols become tunable parameters,
    and functions of time other than coordinates become inputs. The velocities v are the rates of the coordinates;
    other speeds become outputs. A speed that no kinematic equation has gets a coordinate, ``NAME_integral``. Symbols
    and functions of time without an effect are left out. Constraints hold by multipliers, and the initial state is
    moved to meet all. Bodies have poses, and loads and springs energies, but a pair of matrices has neither; potential
    energies of bodies give no forces in Kane's equations, which is a note.

    Parameters
    ----------
    system : System, KanesMethod, LagrangesMethod, or pair of matrices
        A pair is M, (n, n), and f, (n,), of M vdot = f.
    parameters : mapping
        Values of the free symbols, by symbol or name, SI units.
    initial : mapping
        Initial values of coordinates, of rates by ``q.diff()`` (not of other speeds), and of states; zero if not given.
    name : str
        Prefix of the C functions.
    q : sequence of dynamicsymbols
        Coordinates of a pair of matrices.
    states : mapping
        Rates of further functions of time, internal states, such as activations of muscles; the muscles of a System
        need no entry.

    Returns
    -------
    SymbolicEquations
        A document for ``build``, ``derive`` and ``generate``.

    Raises
    ------
    DescriptionError
        For a part without a counterpart, with name and remedy; an M that is not symmetric; an initial state that cannot
        meet the constraints.
    UsageError
        For symbols without a value, values of unknown names or that are not finite numbers, a ``name`` that is not
        legal, entries of ``states`` that are coordinates or speeds, an object that is none of these descriptions, and a
        pair without ``q``.

    Examples
    --------
    >>> import sympy
    >>> from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols
    >>> q, (m, k) = dynamicsymbols("q"), sympy.symbols("m k")
    >>> oscillator = LagrangesMethod(m * q.diff()**2 / 2 - k * q**2 / 2, [q])
    >>> model = eomgen.build(eomgen.from_sympy(oscillator, parameters={m: 2.0, k: 8.0}))
    >>> model.forward_dynamics([1.0], [0.0])
    array([-4.])
    """
    if not isinstance(name, str) or not is_legal(name):
        fault = f"{shown(name)} is not a name [E0888]"
        raise UsageError(Problem("name", fault, 'letters, digits and underscores, "bicycle"'))
    for key, values in (("parameters", parameters), ("initial", initial), ("states", states)):
        if not isinstance(values, Mapping | None):
            fault = f"values by symbol are needed, not a {type(values).__name__} [E2176]"
            raise UsageError(Problem(key, fault, f"{key}={{m: 1.0}}"))
    reading = _Reading(name, system, q, states or {})
    terms = reading.terms()
    if absent := reading.without_effect(terms):
        reading = _Reading(name, system, q, states or {}, absent)
        terms = reading.terms()
    return reading.document(terms, parameters or {}, initial or {})


class _Reading:
    """A description of SymPy, read into lists under common names, with the tape on which the equations are recorded.
    ``q`` are coordinates, ``u`` speeds, ``kdes`` kinematic equations, ``positions`` and ``constraints`` the constraints
    of positions and velocities, ``loads`` (place, vector)."""

    def __init__(
        self,
        name: str,
        system: Any,
        q: Sequence[Any],
        states: Mapping[Any, Any],
        absent: frozenset[str] = frozenset(),
    ) -> None:
        """Read a KanesMethod, LagrangesMethod, System or pair of matrices, and prepare the tape. ``q`` are coordinates
        of matrices, ``states`` rates of internal states, ``absent`` names without an effect. Raises UsageError and
        DescriptionError for parts that cannot be taken."""
        self.name, self.system = name, system
        #: Holonomic constraints, and constraints of velocities, which have the rates of the holonomic ones among them.
        self.positions: list[Any] = []
        self.constraints: list[Any] = []
        self.q: list[Any] = []
        self.u: list[Any] = []
        self.kdes: list[Any] = []
        #: Relations of rates that the kinematic equations leave, on the tape: psi(q, v, t) = 0.
        self.relations: list[Ref] = []
        #: Auxiliary speeds, which are zero along all motions.
        self.auxiliary: list[Any] = []
        self.bodies: list[Any] = []
        self.actuators: list[Any] = []
        self.joints: list[Any] = []
        self.inertial: Any = None
        self.origin: Any = None
        self._read(q)
        self._check_parts()
        self._integrate_speeds()
        #: Rates of internal states.
        self.states = dict(states)
        for state, rate in states.items():
            if not isinstance(state, AppliedUndef) or state in {*self.q, *self.u}:
                hint = "a function of time that is neither a coordinate nor a speed"
                raise UsageError(Problem("states", f"{shown(str(state))} cannot be an internal state [E2177]", hint))
            if not isinstance(rate, sympy.Expr | int | float):
                fault = f"the rate of {state} is {shown(rate)}, not an expression [E2178]"
                raise UsageError(Problem("states", fault, f"{{{state}: -{state}}}"))
        for muscle in self.actuators:
            if isinstance(muscle, MusculotendonBase):
                self.states |= dict(zip(muscle.x, muscle.rhs(), strict=True))
        self.every_load = [*self.loads, *((load[0], load[1]) for item in self.actuators for load in item.to_loads())]
        self.algebra = Algebra(Tape())
        self.time = dynamicsymbols._t
        count = len(self.q)
        self.q_scalars, self.v_scalars = (self.algebra.block(block, count) for block in "qv")
        known = dict(zip(self.q, self.q_scalars, strict=True))
        known |= dict(zip((item.diff(self.time) for item in self.q), self.v_scalars, strict=True))
        known |= dict(zip(self.states, self.algebra.block("z", len(self.states)), strict=True))
        known |= dict.fromkeys(self.auxiliary, self.algebra.zero)
        self.expressions = Expressions(self.algebra, name, known, absent)
        self.speeds = [item for item in self.u if not isinstance(item, sympy.Derivative)]

    def _read(self, q: Sequence[Any]) -> None:
        """Fill the lists of parts from the description; ``q`` are the coordinates of a pair of matrices. Raises
        UsageError or DescriptionError for other objects, and matrices without coordinates."""
        system, loads = self.system, list[Any]()
        if isinstance(system, System) and isinstance(system.eom_method, LagrangesMethod):
            # the Lagrangian may have potential energies of bodies, and the loads are the ones of all actuators
            self.joints, self.origin = list(system.joints), system.fixed_point
            self.system = system = system.eom_method
        if isinstance(system, System):
            self.auxiliary = list(system.u_aux)
            self.positions, self.constraints = list(system.holonomic_constraints), list(system.velocity_constraints)
            self.actuators, self.joints, self.origin = list(system.actuators), list(system.joints), system.fixed_point
            self.q, self.u, self.kdes = list(system.q), list(system.u), list(system.kdes)
            self.inertial, self.bodies, loads = system.frame, list(system.bodies), list(system.loads)
        elif isinstance(system, KanesMethod):
            self.auxiliary = list(system._uaux)
            self.positions = list(system._f_h)
            self.constraints = list(system._k_nh * system.u + system._f_nh) if len(system._f_nh) else []
            if not system.bodies and not system.forcelist:
                hint = "KanesMethod(..., bodies=[...], forcelist=[...])"
                raise self._refusal("the KanesMethod has no bodies [E1151]", hint)
            self.q, self.u = list(system.q), list(system.u)
            # as given: SymPy solves these for the rates, which takes more expressions
            rates = system.q.diff(dynamicsymbols._t)
            kinematic, of_speeds, rest = system._k_kqdot_implicit, system._k_ku_implicit, system._f_k_implicit
            self.kdes = list(kinematic * rates + of_speeds * system.u + rest) if len(kinematic) else []
            self.inertial, self.bodies, loads = system._inertial, list(system.bodies), list(system.forcelist or ())
        elif isinstance(system, LagrangesMethod):
            self.positions, self.constraints = list(system._hol_coneqs), list(system.coneqs)
            self.q, self.inertial, loads = list(system.q), system.inertial, list(system.forcelist or ())
            self.bodies = list(system.bodies or ()) if system.inertial is not None else []
        elif isinstance(system, tuple | list) and len(system) == 2:
            self.q = list(q) if isinstance(q, Sequence) else []
            if not self.q:
                raise UsageError(Problem("q", "matrices alone have no coordinates [E1152]", "q=[theta, x]"))
            self.system = tuple(self._matrix(item, letter) for item, letter in zip(system, "Mf", strict=True))
        else:
            fault = f"{type(system).__name__} is none of SymPy's descriptions [E1153]"
            raise UsageError(Problem("system", fault, "System, KanesMethod, LagrangesMethod, or (M, f) with q"))
        self.loads = [(load[0], load[1]) for load in loads]

    def _matrix(self, item: object, letter: str) -> Any:
        """Return M or f as a SymPy matrix; no text is read. Raises UsageError, with ``letter``, for other entries."""
        entries = item if isinstance(item, sympy.MatrixBase) else np.array(item, dtype=object)
        known = all(isinstance(entry, sympy.Basic | int | float | np.number) for entry in np.array(entries).ravel())
        if not known or len(entries.shape) not in (1, 2):
            fault = f"a matrix of expressions is needed for {letter}, not a {type(item).__name__} [E2179]"
            raise UsageError(Problem("system", fault, "sympy.Matrix([[m, 0], [0, m]]), and f with a row for each of M"))
        return sympy.Matrix(entries.tolist())

    def _check_parts(self) -> None:
        """Raise DescriptionError for bodies, loads or coordinates of other classes, and for none or two of a name."""
        faults = [
            (item, "body", "RigidBody or Particle")
            for item in self.bodies
            if not isinstance(item, RigidBody | Particle)
        ]
        for location, load in self.loads:
            if not isinstance(location, Point | ReferenceFrame) or not isinstance(load, Vector):
                faults.append((location, "load", "a Point and a Vector, or a ReferenceFrame and a Vector"))
        names = [name_of(item) if isinstance(item, AppliedUndef) else "" for item in self.q]
        time = dynamicsymbols._t
        faults += [(item, "coordinate", "dynamicsymbols") for item in self.q if getattr(item, "args", ()) != (time,)]
        for item, noun, hint in faults:
            raise self._refusal(f"{shown(str(item))} is not a {noun} [E2180]", hint)
        if not names:
            raise self._refusal("the system has no coordinates [E2182]", "joints, or system.add_coordinates")
        if twice := [name for name in names if names.count(name) > 1]:
            raise self._refusal(f"two coordinates have the name {shown(twice[0])} [E2183]", "other names")

    def _refusal(self, fault: str, hint: str) -> DescriptionError:
        return DescriptionError(Problem(self.name, fault, hint))

    def _integrate_speeds(self) -> None:
        """Add a coordinate for each speed without one, such as of a wheel without an angle."""
        free = [item for item in self.u if not any(equation.has(item) for equation in self.kdes)]
        if self.kdes and len(self.q) == len(self.kdes) == len(self.u) - len(free):
            integrals = [dynamicsymbols(f"{name_of(item)}_integral") for item in free]
            self.kdes += [symbol.diff(dynamicsymbols._t) - speed for symbol, speed in zip(integrals, free, strict=True)]
            self.q += integrals

    def terms(self) -> KaneTerms:
        """Record the equations on the tape and return M, h and Q; sets ``kinematics``, ``rows`` and ``angular``."""
        every = self._everything()
        self.expressions.declare(every)
        self.angular = angles(self.q, every)
        self._solve_speeds()
        kinematics = KaneKinematics(self.expressions, self.inertial, self.q_scalars, self.v_scalars)
        if isinstance(self.system, LagrangesMethod):
            terms = self._lagrange()
        elif isinstance(self.system, tuple | list):
            terms = self._matrices()
        else:
            terms = kane(kinematics, self.bodies, self.every_load)
        self.kinematics = kinematics
        self.rows = Constraints(
            self.expressions,
            self.positions,
            self.constraints,
            self.q_scalars,
            self.v_scalars,
            self.angular,
            self.relations,
        )
        return terms

    def _everything(self) -> list[Any]:
        """Return all expressions of the description, by which parameters and inputs are declared."""
        self.expressions.known |= dict.fromkeys(set(self.u) - self.expressions.known.keys(), self.algebra.zero)
        result: list[Any] = [*self.kdes, *self.positions, *self.constraints, *self.states.values()]
        if isinstance(self.system, LagrangesMethod):
            result.append(self.system._L[0])
        elif isinstance(self.system, tuple | list):
            result += [entry for item in self.system for entry in item]
        result += [item for actuator in self.actuators if (item := stored_energy(actuator)) is not None]
        for body in self.bodies:
            result.append(body.mass)
            if is_rigid(body):
                result += [factor for factor, _, _ in body.central_inertia.args]
        return result + _placement_expressions(self.bodies, self.every_load, self.inertial)

    def _solve_speeds(self) -> None:
        """Record the user's speeds as functions of q and v by the kinematic equations; further equations become
        ``relations``. Raises DescriptionError if numbers of speeds, equations and coordinates do not fit."""
        if not self.speeds:
            return
        if len(self.kdes) != len(self.q) or len(self.q) < len(self.u):
            counts = len(self.q), len(self.u), len(self.kdes)
            fault = "{} coordinates have {} speeds and {} kinematic equations [E1155]".format(*counts)
            raise self._refusal(fault, "one kinematic equation for the rate of each coordinate")
        factors = sympy.Matrix(self.kdes).jacobian(self.u)
        record = self.expressions
        rows = [[record(entry) for entry in row] for row in factors.tolist()]
        without = dict.fromkeys(self.u, sympy.S.Zero)
        rest = [-record(equation.xreplace(without)) for equation in self.kdes]
        solved, relations = _solved(self.algebra, rows, rest, self.name)
        self.relations = [item.ref for item in relations]
        for key in [key for key in record.known if key not in self.q and key.has(*self.u)]:
            del record.known[key]
        for speed, value in zip(self.u, solved, strict=True):
            record.known[speed] = value

    def _lagrange(self) -> KaneTerms:
        """Return M, h and Q of d/dt dL/dv - dL/dq = Q for a Lagrangian L, differentiated on the tape."""
        tape, q, v = self.algebra.tape, [x.ref for x in self.q_scalars], [x.ref for x in self.v_scalars]
        lagrangian = self.expressions(self.system._L[0]).ref
        momenta = gradient(tape, lagrangian, v)
        mass = [Scalar(tape, ref) for row in momenta for ref in gradient(tape, row, v)]
        along: dict[Ref | InputSymbol, Ref] = dict(zip(q, v, strict=True))
        along[self.expressions.known[self.time].ref] = ONE
        moved = jacobian_vector(tape, momenta, along)
        slopes = gradient(tape, lagrangian, q)
        coupling = [Scalar(tape, rate) - Scalar(tape, slope) for rate, slope in zip(moved, slopes, strict=True)]
        terms = KaneTerms(mass, coupling, [self.algebra.zero] * len(q))
        if self.loads:
            kinematics = KaneKinematics(self.expressions, self.inertial, self.q_scalars, self.v_scalars)
            terms = terms._replace(force=kane(kinematics, (), self.loads).force)
        return terms

    def _matrices(self) -> KaneTerms:
        matrix, vector = self.system
        count = len(self.q)
        if matrix.shape != (count, count) or len(vector) != count:
            fault = f"M has the shape {matrix.shape} and f {len(vector)} entries for {count} coordinates [E1156]"
            raise self._refusal(fault, "one row for each coordinate")
        mass, force = ([self.expressions(entry) for entry in item] for item in (matrix, vector))
        return KaneTerms(mass, [self.algebra.zero] * count, force)

    def without_effect(self, terms: KaneTerms) -> frozenset[str]:
        """Return the parameters and inputs on which no term depends."""
        refs = [item.ref for part in terms for item in part]
        refs += [self.expressions.known[item].ref for item in self.speeds]
        refs += [*self.rows.positions, *self.rows.velocities]
        refs += [self.expressions(rate).ref for rate in self.states.values()]
        used = {(symbol.block, symbol.index) for symbol in self.algebra.tape.depends_on(refs)}
        return frozenset(
            name
            for block, names in (("p", self.expressions.parameters), ("u", self.expressions.inputs))
            for index, name in enumerate(names)
            if (block, index) not in used
        )

    def document(
        self, terms: KaneTerms, parameters: Mapping[Any, float], initial: Mapping[Any, float]
    ) -> SymbolicEquations:
        """Return the document with values of parameters and an initial state on the constraints. Raises UsageError for
        missing or unknown names."""
        record = self.expressions
        names = [name_of(item) for item in self.q]
        of_states = [name_of(item) for item in self.states]
        values, start = self._values(parameters), self._start([*names, *of_states], initial)
        states = {item: start.get(item, 0.0) for item in of_states}
        speeds = [item for item in self.speeds if name_of(item) not in names]
        blocks = {"p": np.array([values[item] for item in record.parameters]), "u": np.zeros(len(record.inputs))}
        blocks |= {"z": np.array([*states.values()]), "t": np.zeros(1)}
        blocks |= {"q": np.array([start.get(item, 0.0) for item in names])}
        blocks |= {"v": np.array([start.get(f"v.{item}", 0.0) for item in names])}
        begun = self.rows.met(blocks)
        samples = self.rows.near(begun)
        rows = self.rows.rows(samples)
        notes = self._inertia_notes(terms, rows, samples[0])
        terms = self._with_inertia(terms, rows, samples)
        mass, coupling, force = (tuple(item.ref for item in part) for part in terms)
        return SymbolicEquations(
            self.name,
            tuple(names),
            {item: values[item] for item in record.parameters},
            tuple(record.inputs),
            tuple(name_of(item) for item in speeds),
            tuple(begun["q"].tolist()),
            tuple(begun["v"].tolist()),
            self.algebra.tape,
            mass,
            coupling,
            force,
            tuple(record(item).ref for item in speeds),
            rows,
            self._observations(terms, rows, samples, notes),
            states,
            tuple(record(rate).ref for rate in self.states.values()),
        )

    def _with_inertia(self, terms: KaneTerms, rows: KaneRows, samples: Samples) -> KaneTerms:
        """Return the terms; augmented by the rows of constraints, if any, if M is singular at all samples."""
        if not rows.names:
            return terms
        refs, count = [item.ref for item in terms.mass], len(self.q)
        if not is_singular([values_at(self.algebra.tape, refs, item).reshape(count, count) for item in samples]):
            return terms
        rates = self.kinematics.rates([Scalar(self.algebra.tape, ref) for ref in rows.positions])
        return augmented(self.kinematics, terms, [*rates, *(Scalar(self.algebra.tape, ref) for ref in rows.velocities)])

    def _inertia_notes(self, terms: KaneTerms, rows: KaneRows, start: Mapping[str, Array]) -> list[str]:
        """Return a note in a list if M has a negative eigenvalue or is singular at the start; empty otherwise. Raises
        DescriptionError if M is not symmetric."""
        count = len(self.q)
        M = values_at(self.algebra.tape, [item.ref for item in terms.mass], start).reshape(count, count)
        if not np.all(np.isfinite(M)):
            return []
        apart = np.abs(M - M.T)
        i, j = np.unravel_index(np.argmax(apart), apart.shape)
        if apart[i, j] > COMPUTED * np.abs(M).max():
            fault = f"M is not symmetric: M[{i}, {j}] is {M[i, j]:.6g} and M[{j}, {i}] is {M[j, i]:.6g} [E2184]"
            raise self._refusal(fault, "equations of Kane or Lagrange, of which M is symmetric")
        if np.linalg.eigvalsh(M)[0] < -COMPUTED * np.abs(M).max():
            return ["the mass matrix has a negative eigenvalue at the start: a mass or an inertia is negative [W0261]"]
        if not rows.names and is_singular([M]):
            return ["the mass matrix is singular at the start, a mass or inertia is 0: no acceleration follows [W0262]"]
        return []

    def _observations(self, terms: KaneTerms, rows: KaneRows, samples: Samples, notes: Sequence[str]) -> Observations:
        """Return angles, poses, twists, energies, drawing and notes of the system, checked at the samples. Raises
        DescriptionError for an angular velocity that contradicts the orientation."""
        random = np.random.default_rng(SEED)
        # rates that satisfy the constraints, which angular velocities may rely on, and any rates without constraints
        moving = list(samples[1:]) or list(samples)
        if not rows.names:
            moving = [{**sample, "v": random.normal(size=len(self.q))} for sample in samples]
        parts: dict[str, Any] = {"angular": tuple(self.angular)}
        observed = None
        if self.inertial is not None:
            observed = Observed(self.kinematics, self.bodies, self.origin, moving)
            if faults := observed.twisted():
                fault = f"the angular velocity of the frame {faults[0]} is not the rate of the orientation [E2131]"
                hint = f"{faults[0]}.set_ang_vel with the rates of the angles, or no such call"
                raise self._refusal(fault, hint)
        if isinstance(self.system, LagrangesMethod):
            lagrangian = self.expressions(self.system._L[0]).ref
            energies = lagrangian_energies(self.algebra, lagrangian, self.v_scalars, terms.force)
            parts["energy"] = self._balance(energies, rows, moving)
        elif observed is not None:
            parts["energy"] = self._balance(observed.energies(self.loads, self.actuators), rows, moving)
        if observed is not None and observed.bodies:
            fault = "no point at rest leads to {}, which is drawn from a point with a given velocity [E2130]"
            adrift = [fault.format(name) for name in observed.adrift]
            notes = [*notes, *adrift, *self._unused_energies()]
            parts |= {"bodies": tuple(observed.names), "poses": tuple(item.ref for item in observed.poses())}
            parts["twists"] = tuple(item.ref for item in observed.twists())
            parts["drawing"] = observed.drawing(self.joints, self.actuators)
        return Observations(**parts, notes=tuple(map(Message, notes)))

    def _unused_energies(self) -> list[str]:
        """Return a note on potential energies of bodies, which Kane's equations do not take."""
        names = [
            str(body.name)
            for body in ([] if isinstance(self.system, LagrangesMethod) else self.bodies)
            if not sympy.S(body.potential_energy).is_zero
        ]
        if not names:
            return []
        fault = f"no force follows from the potential energy of {listed(names)} in Kane's equations"
        return [f"{fault}; try: a load, or system.form_eoms(LagrangesMethod) before from_sympy [W0263]"]

    def _balance(self, energies: Energies, rows: KaneRows, samples: Samples) -> tuple[Ref, ...]:
        """Return references of kinetic and potential energy, power of loads, and power of drivers. Drivers have power
        if a quantity moves while v = 0 at a sample, else 0."""
        tape, algebra = self.algebra.tape, self.algebra
        at_rest = [*self.kinematics.rates([Scalar(tape, ref) for ref in rows.positions]), *self._moved_by_time(rows)]
        refs = [item.ref for item in at_rest]
        values = [values_at(tape, refs, {**sample, "v": 0.0 * sample["v"]}) for sample in samples]
        still = not any(np.any(np.abs(item) > SUMMED) for item in values)
        a = algebra.block("a", len(self.q))
        drivers = algebra.zero if still else power_of_drivers(algebra, energies, self.q_scalars, self.v_scalars, a)
        return tuple(item.ref for item in (*energies, drivers))

    def _moved_by_time(self, rows: KaneRows) -> list[Scalar]:
        """Return quantities that vanish at rest unless time or inputs move places."""
        tape = self.algebra.tape
        result = [Scalar(tape, ref) for ref in rows.velocities]
        if isinstance(self.system, LagrangesMethod):
            lagrangian = self.expressions(self.system._L[0]).ref
            result += [Scalar(tape, ref) for ref in gradient(tape, lagrangian, [item.ref for item in self.v_scalars])]
            result += [Scalar(tape, ref) for ref in jacobian_vector(tape, [lagrangian], {InputSymbol("t", 0): ONE})]
            return result
        for body in self.bodies:
            result += self.kinematics.velocity(center_of(body))
            if is_rigid(body):
                result += self.kinematics.angular_velocity(body.frame)
        for location, _ in self.every_load:
            result += self.kinematics.motion(location)
        return result

    def _values(self, parameters: Mapping[Any, float]) -> dict[str, float]:
        """Return values of all parameters by name. Raises UsageError for missing values and unknown symbols."""
        names = self.expressions.parameters
        values = {_key(key): _number("parameters", key, value) for key, value in parameters.items()}
        if missing := [item for item in names if item not in values]:
            hint = f"parameters={{{', '.join(f'{item}: 1.0' for item in missing[:6])}}}"
            raise UsageError(Problem("parameters", f"no values for {', '.join(missing)} [E1157]", hint))
        if unknown := sorted(values.keys() - names.keys() - self.expressions.absent):
            hint = f"one of {', '.join(names)}" if names else "no parameters"
            raise UsageError(Problem("parameters", f"the system has no free symbol {unknown[0]} [E1158]", hint))
        return values

    def _start(self, names: Sequence[str], initial: Mapping[Any, float]) -> dict[str, float]:
        """Return initial values by the names of coordinates and states, ``v.NAME`` of rates. Raises UsageError."""
        start = {_key(key): _number("initial", key, value) for key, value in initial.items()}
        if unknown := sorted(start.keys() - {*names, *(f"v.{item}" for item in names)}):
            hint = f"one of {', '.join(names)}, or a rate by q.diff()"
            raise UsageError(Problem("initial", f"there is no coordinate {unknown[0]} [E1159]", hint))
        return start


def _key(key: Any) -> str:
    """Return the name of a parameter or coordinate, ``v.q`` for the rate of q."""
    if isinstance(key, sympy.Derivative) and key.derivative_count == 1 and isinstance(key.expr, AppliedUndef):
        return f"v.{name_of(key.expr)}"
    if isinstance(key, str):
        rate = "v." if key.startswith("v.") else ""
        return rate + name_of(sympy.Symbol(key.removeprefix(rate)))
    return name_of(key) if isinstance(key, sympy.Symbol | AppliedUndef) else str(key)


def _number(argument: str, key: object, value: Any) -> float:
    """Return a finite number, also of SymPy."""
    try:
        number = math.nan if isinstance(value, str | bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        fault = f"the value of {key} is {shown(value)}, not a finite number [E2185]"
        raise UsageError(Problem(argument, fault, f"{argument}={{{key}: 1.0}}"))
    return number


def _placement_expressions(bodies: Sequence[Any], loads: Sequence[tuple[Any, Any]], inertial: Any) -> list[Any]:
    """Return the expressions of loads, and of all frames and points that bodies, loads and the inertial frame are
    connected with, directly or not."""
    frames, points = set() if inertial is None else {inertial}, set()
    for body in bodies:
        points.add(center_of(body))
        if is_rigid(body):
            frames |= {body.frame, *(vector.args[0][1] for _, vector, _ in body.central_inertia.args)}
    for location, _ in loads:
        (points if hasattr(location, "_pos_dict") else frames).add(location)
    every = joined_points(*points)
    vectors = [vector for point in every for vector in (*point._pos_dict.values(), *point._vel_dict.values())]
    vectors += [vector for _, vector in loads]
    frames |= {frame for vector in vectors for _, frame in getattr(vector, "args", ())}
    vectors = [vector for _, vector in loads]
    for point in every:
        vectors += [*point._pos_dict.values(), *(v for f, v in point._vel_dict.items() if f is inertial)]
    result = []
    for frame in reachable(frames, lambda frame: (*frame._dcm_dict, *frame._ang_vel_dict)):
        result += [entry for matrix in frame._dcm_dict.values() for entry in matrix]
        vectors += frame._ang_vel_dict.values()
    return result + _components(vectors)


def _components(vectors: Sequence[Any]) -> list[Any]:
    """Return the components of vectors of SymPy in all frames."""
    return [entry for vector in vectors for part, _ in getattr(vector, "args", ()) for entry in part]


def _solved(
    algebra: Algebra, rows: list[list[Scalar]], rest: list[Scalar], name: str
) -> tuple[list[Scalar], list[Scalar]]:
    """Return x of A x = b on the tape, by elimination, and the residuals of the rows beyond the number of unknowns.
    ``rows`` are the rows of A, ``rest`` is b. Pivots are the largest entries at a random state. Raises DescriptionError
    if the rows do not determine x; ``name`` is for the message."""
    tape, count = algebra.tape, len(rows[0])
    rows, rest = [list(row) for row in rows], list(rest)
    random = np.random.default_rng(SEED)
    sizes: dict[str, int] = {}
    for symbol in tape.depends_on([item.ref for row in rows for item in row]):
        sizes[symbol.block] = max(sizes.get(symbol.block, 0), symbol.index + 1)
    sample = {block: random.uniform(0.3, 1.2, size) for block, size in sizes.items()}
    order = list(range(len(rows)))
    for column in range(count):
        values = np.abs(evaluate(tape, [rows[row][column].ref for row in order[column:]], sample))
        best = column + int(np.argmax(values))
        if not values.max() > 0.0:
            fault = "the kinematic differential equations do not determine the speeds [E1160]"
            raise DescriptionError(Problem(name, fault, "one independent equation for each speed"))
        order[column], order[best] = order[best], order[column]
        pivot = order[column]
        for row in order[column + 1 :]:
            if rows[row][column].is_zero:
                continue
            factor = rows[row][column] / rows[pivot][column]
            rows[row] = [x - factor * y for x, y in zip(rows[row], rows[pivot], strict=True)]
            rest[row] = rest[row] - factor * rest[pivot]
    solution = [algebra.zero] * count
    for column in reversed(range(count)):
        total = rest[order[column]]
        for later in range(column + 1, count):
            total = total - rows[order[column]][later] * solution[later]
        solution[column] = total / rows[order[column]][column]
    return solution, [rest[row] for row in order[count:]]
