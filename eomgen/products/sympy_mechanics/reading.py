"""``from_sympy``: SymPy's descriptions of mechanics as documents that build, run and generate C."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, System, dynamicsymbols

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.messages import counted, is_legal, shown
from eomgen.errors import DescriptionError, Problem, UsageError
from eomgen.products.sympy_mechanics.equations import SymbolicEquations
from eomgen.products.sympy_mechanics.expressions import Expressions, name_of
from eomgen.products.sympy_mechanics.kane import Kinematics, Terms, constrained, kane
from eomgen.symbolic.calculus.partials import gradient, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import ONE, Ref, Tape

#: Most corrections of an initial state, and the violation that counts as none.
_CORRECTIONS, _MET = 50, 1e-11
#: Most parameters without a value in a hint.
_LISTED = 6
#: Seed of the state at which pivots are chosen.
_SEED = 1


@checked_call("eomgen.from_sympy(system, parameters={m: 1.0})")
def from_sympy(
    system: object,
    *,
    parameters: Mapping[Any, float] | None = None,
    initial: Mapping[Any, float] | None = None,
    name: str = "sympy",
    q: Sequence[Any] = (),
) -> SymbolicEquations:
    """Take equations of motion from SymPy: a System, KanesMethod or LagrangesMethod, or plain M(q) and f(q, v, t).

    Velocities and accelerations are composed and differentiated on the tape, so neither ``form_eoms`` nor
    ``kanes_equations`` nor ``form_lagranges_equations`` is called or needed. Free symbols become tunable parameters,
    and functions of time besides coordinates become inputs. The velocities v are the rates of the coordinates;
    other speeds become outputs.

    Parameters
    ----------
    system : System, KanesMethod, LagrangesMethod, or pair of matrices
        A pair is M, (n, n), and f, (n,), of M vdot = f.
    parameters : mapping
        Values of the free symbols, by symbol or name, SI units.
    initial : mapping
        Initial values of coordinates and, by ``q.diff()``, of rates; zero if not given.
    name : str
        Prefix of the C functions.
    q : sequence of dynamicsymbols
        Coordinates of a pair of matrices.

    Returns
    -------
    SymbolicEquations
        A document for ``build``, ``derive`` and ``generate``.

    Raises
    ------
    DescriptionError
        For a part without a counterpart, with name and remedy.
    UsageError
        For symbols without a value.

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
    if not is_legal(name):
        raise UsageError(Problem("name", f"{shown(name)} is not a name", 'letters, digits and underscores, "bicycle"'))
    reading = _Reading(name, system, q)
    terms = reading.terms()
    if absent := reading.without_effect(terms):
        reading = _Reading(name, system, q, absent)
        terms = reading.terms()
    return reading.document(terms, parameters or {}, initial or {})


class _Reading:
    """A description of SymPy with the parts under common names."""

    def __init__(self, name: str, system: Any, q: Sequence[Any], absent: frozenset[str] = frozenset()) -> None:
        self.name, self.system = name, system
        #: Holonomic constraints, and constraints of velocities, which have the rates of the holonomic ones among them.
        self.positions: list[Any] = []
        self.constraints: list[Any] = []
        if isinstance(system, System):
            self._refuse_auxiliary(system.u_aux)
            self.positions, self.constraints = list(system.holonomic_constraints), list(system.velocity_constraints)
            self.q, self.u, self.kdes = list(system.q), list(system.u), list(system.kdes)
            self.inertial, self.bodies = system.frame, list(system.bodies)
            self.loads = [*system.loads, *(load for item in system.actuators for load in item.to_loads())]
        elif isinstance(system, KanesMethod):
            self._refuse_auxiliary(system._uaux)
            self.positions = list(system._f_h)
            self.constraints = list(system._k_nh * system.u + system._f_nh) if len(system._f_nh) else []
            if not system.bodies:
                hint = "KanesMethod(..., bodies=[...], forcelist=[...])"
                raise DescriptionError(Problem(name, "the KanesMethod has no bodies", hint))
            self.q, self.u = list(system.q), list(system.u)
            self.kdes = [rate - value for rate, value in system.kindiffdict().items()]
            self.inertial, self.bodies, self.loads = system._inertial, list(system.bodies), list(system.forcelist or ())
        elif isinstance(system, LagrangesMethod):
            self.positions, self.constraints = list(system._hol_coneqs), list(system.coneqs)
            self.q, self.u, self.kdes = list(system.q), [], []
            self.inertial, self.bodies, self.loads = system.inertial, [], list(system.forcelist or ())
        elif isinstance(system, tuple | list) and len(system) == 2:
            self.q, self.u, self.kdes, self.loads, self.bodies, self.inertial = list(q), [], [], [], [], None
            if not self.q:
                raise UsageError(Problem("q", "matrices alone have no coordinates", "q=[theta, x]"))
        else:
            hint = "System, KanesMethod, LagrangesMethod, or (M, f) with q"
            raise UsageError(Problem("system", f"{type(system).__name__} is none of SymPy's descriptions", hint))
        self.loads = [(getattr(load, "location", load[0]), getattr(load, "vector", load[1])) for load in self.loads]
        self.algebra = Algebra(Tape())
        self.time = dynamicsymbols._t
        count = len(self.q)
        self.q_scalars, self.v_scalars = (self.algebra.block(block, count) for block in "qv")
        known = dict(zip(self.q, self.q_scalars, strict=True))
        known |= dict(zip((item.diff(self.time) for item in self.q), self.v_scalars, strict=True))
        self.expressions = Expressions(self.algebra, name, known, absent)
        self.speeds = [item for item in self.u if not isinstance(item, sympy.Derivative)]

    def _refuse_auxiliary(self, speeds: Any) -> None:
        if len(speeds):
            fault = f"{counted(len(speeds), 'auxiliary speed')} of a {type(self.system).__name__} are not supported"
            raise DescriptionError(Problem(self.name, fault, "a scene, whose reactions are outputs"))

    def terms(self) -> Terms:
        """Record the equations."""
        self.expressions.declare(self._everything())
        self._solve_speeds()
        kinematics = Kinematics(self.expressions, self.inertial, self.q_scalars, self.v_scalars)
        if isinstance(self.system, LagrangesMethod):
            terms = self._lagrange()
        elif isinstance(self.system, tuple | list):
            terms = self._matrices()
        else:
            terms = kane(kinematics, self.bodies, self.loads)
        if not self.constraints:
            return terms
        rows = [self.expressions(item) for item in self.constraints]
        return constrained(kinematics, terms, rows)

    def _everything(self) -> list[Any]:
        """Return all expressions, for the lists of parameters and inputs."""
        self.expressions.known |= dict.fromkeys(set(self.u) - self.expressions.known.keys(), self.algebra.zero)
        result: list[Any] = [*self.kdes, *self.positions, *self.constraints]
        if isinstance(self.system, LagrangesMethod):
            result.append(self.system._L[0])
        elif isinstance(self.system, tuple | list):
            result += [entry for item in self.system for entry in sympy.Matrix(item)]
        frames, points = _reached(self.bodies, self.loads, self.inertial)
        for body in self.bodies:
            result.append(body.mass)
            if hasattr(body, "central_inertia"):
                result += body.central_inertia.to_matrix(body.frame)
        vectors = [vector for _, vector in self.loads]
        for frame in frames:
            result += [entry for matrix in frame._dcm_dict.values() for entry in matrix]
            vectors += frame._ang_vel_dict.values()
        for point in points:
            vectors += [*point._pos_dict.values(), *(v for f, v in point._vel_dict.items() if f is self.inertial)]
        result += [entry for vector in vectors for entry in _components(vector)]
        return result

    def _solve_speeds(self) -> None:
        """Make the user's speeds scalars of q and v, by the kinematic differential equations."""
        if not self.speeds:
            return
        if len(self.kdes) != len(self.u) or len(self.q) != len(self.u):
            fault = f"{len(self.q)} coordinates have {len(self.u)} speeds and {len(self.kdes)} kinematic equations"
            raise DescriptionError(Problem(self.name, fault, "one speed for each coordinate"))
        factors = sympy.Matrix(self.kdes).jacobian(self.u)
        record = self.expressions
        rows = [[record(entry) for entry in row] for row in factors.tolist()]
        without = dict.fromkeys(self.u, sympy.S.Zero)
        rest = [-record(equation.xreplace(without)) for equation in self.kdes]
        solved = _solved(self.algebra, rows, rest, self.name)
        stale = [key for key in record.known if key not in self.q and key.has(*self.u)]
        for key in stale:
            del record.known[key]
        for speed, value in zip(self.u, solved, strict=True):
            record.known[speed] = value

    def _lagrange(self) -> Terms:
        """d/dt dL/dv - dL/dq = Q, differentiated on the tape."""
        tape, q, v = self.algebra.tape, [x.ref for x in self.q_scalars], [x.ref for x in self.v_scalars]
        lagrangian = self.expressions(self.system._L[0]).ref
        momenta = gradient(tape, lagrangian, v)
        mass = [Scalar(tape, ref) for row in momenta for ref in gradient(tape, row, v)]
        along: dict[Ref | InputSymbol, Ref] = dict(zip(q, v, strict=True))
        along[self.expressions.known[self.time].ref] = ONE
        moved = jacobian_vector(tape, momenta, along)
        slopes = gradient(tape, lagrangian, q)
        coupling = [Scalar(tape, one) - Scalar(tape, other) for one, other in zip(moved, slopes, strict=True)]
        terms = Terms(mass, coupling, [self.algebra.zero] * len(q))
        if self.loads:
            kinematics = Kinematics(self.expressions, self.inertial, self.q_scalars, self.v_scalars)
            terms = terms._replace(force=kane(kinematics, (), self.loads).force)
        return terms

    def _matrices(self) -> Terms:
        matrix, vector = (sympy.Matrix(item) for item in self.system)
        count = len(self.q)
        if matrix.shape != (count, count) or len(vector) != count:
            fault = (
                f"M is {matrix.shape[0]} x {matrix.shape[1]} and f has {len(vector)} entries for {count} coordinates"
            )
            raise DescriptionError(Problem(self.name, fault, "one row for each coordinate"))
        mass, force = ([self.expressions(entry) for entry in item] for item in (matrix, vector))
        return Terms(mass, [self.algebra.zero] * count, force)

    def without_effect(self, terms: Terms) -> frozenset[str]:
        """Return the parameters and inputs on which no term depends."""
        refs = [item.ref for part in terms for item in part]
        refs += [self.expressions.known[item].ref for item in self.speeds]
        used = {(symbol.block, symbol.index) for symbol in self.algebra.tape.depends_on(refs)}
        return frozenset(
            name
            for block, names in (("p", self.expressions.parameters), ("u", self.expressions.inputs))
            for place, name in enumerate(names)
            if (block, place) not in used
        )

    def document(
        self, terms: Terms, parameters: Mapping[Any, float], initial: Mapping[Any, float]
    ) -> SymbolicEquations:
        """Return the document with values of parameters and the initial state."""
        record = self.expressions
        names = [name_of(item) for item in self.q]
        given, start = self._values(parameters), self._start(names, initial)
        speeds = [item for item in self.speeds if name_of(item) not in names]
        q, v = self._consistent(
            np.array([start.get(item, 0.0) for item in names]),
            np.array([start.get(f"v.{item}", 0.0) for item in names]),
            np.array([given[item] for item in record.parameters]),
        )
        mass, coupling, force = (tuple(item.ref for item in part) for part in terms)
        return SymbolicEquations(
            self.name,
            tuple(names),
            tuple(record.parameters),
            tuple(record.inputs),
            tuple(name_of(item) for item in speeds),
            tuple(given[item] for item in record.parameters),
            tuple(q.tolist()),
            tuple(v.tolist()),
            self.algebra.tape,
            mass,
            coupling,
            force,
            tuple(record(item).ref for item in speeds),
        )

    def _consistent(self, q: Array, v: Array, p: Array) -> tuple[Array, Array]:
        """Return the nearest initial state that satisfies the constraints, at time 0 and zero inputs."""
        tape = self.algebra.tape
        blocks = {"p": p, "t": np.zeros(1), "u": np.zeros(len(self.expressions.inputs))}
        for expressions, scalars, moved in (
            (self.positions, self.q_scalars, q),
            (self.constraints, self.v_scalars, v),
        ):
            values = [self.expressions(item).ref for item in expressions]
            slopes = [ref for value in values for ref in gradient(tape, value, [item.ref for item in scalars])]
            size = np.inf if values else 0.0
            for _ in range(_CORRECTIONS):
                if not values or size < _MET:
                    break
                results = evaluate(tape, [*values, *slopes], blocks | {"q": q, "v": v})
                jacobian = results[len(values) :].reshape(len(values), -1)
                step = np.linalg.lstsq(jacobian, results[: len(values)], rcond=None)[0]
                np.subtract(moved, step, out=moved)
                size = float(np.abs(results[: len(values)]).max())
            if not size < _MET:
                fault = f"the constraints are not met near the initial state: off by {size:.3g}"
                raise DescriptionError(Problem(self.name, fault, "an initial state nearer to the constraints"))
        return q, v

    def _values(self, parameters: Mapping[Any, float]) -> dict[str, float]:
        """Return values of all parameters by name."""
        names = self.expressions.parameters
        given = {_key(key): float(value) for key, value in parameters.items()}
        if missing := [item for item in names if item not in given]:
            hint = f"parameters={{{', '.join(f'{item}: 1.0' for item in missing[:_LISTED])}}}"
            raise UsageError(Problem("parameters", f"no values for {', '.join(missing)}", hint))
        if unknown := sorted(given.keys() - names.keys() - self.expressions.absent):
            hint = f"one of {', '.join(names)}" if names else "no parameters"
            raise UsageError(Problem("parameters", f"the system has no free symbol {unknown[0]}", hint))
        return given

    def _start(self, names: Sequence[str], initial: Mapping[Any, float]) -> dict[str, float]:
        """Return initial values by the names of coordinates, ``v.NAME`` of rates."""
        start = {_key(key): float(value) for key, value in initial.items()}
        if unknown := sorted(start.keys() - {*names, *(f"v.{item}" for item in names)}):
            hint = f"one of {', '.join(names)}, or a rate by q.diff()"
            raise UsageError(Problem("initial", f"there is no coordinate {unknown[0]}", hint))
        return start


def _key(key: Any) -> str:
    """Return the name of a parameter or coordinate, ``v.q`` for the rate of q."""
    if isinstance(key, sympy.Derivative):
        return f"v.{name_of(key.expr)}"
    return name_of(key) if isinstance(key, sympy.Symbol | AppliedUndef) else str(key)


def _components(vector: Any) -> list[Any]:
    """Return the components of a vector of SymPy in all frames."""
    return [entry for components, _ in getattr(vector, "args", ()) for entry in components]


def _reached(bodies: Sequence[Any], loads: Sequence[tuple[Any, Any]], inertial: Any) -> tuple[set[Any], set[Any]]:
    """Return the frames and points that bodies and loads are connected with."""
    frames, points = set() if inertial is None else {inertial}, set()
    for body in bodies:
        points.add(getattr(body, "masscenter", None) or body.point)
        frames |= {body.frame} if hasattr(body, "frame") else set()
    for place, _ in loads:
        (points if hasattr(place, "_pos_dict") else frames).add(place)
    waiting = list(points)
    while waiting:
        point = waiting.pop()
        for other in point._pos_dict:
            if other not in points:
                points.add(other)
                waiting.append(other)
        for vector in (*point._pos_dict.values(), *point._vel_dict.values()):
            frames |= {frame for _, frame in getattr(vector, "args", ())}
    frames |= {frame for _, vector in loads for _, frame in getattr(vector, "args", ())}
    pending = list(frames)
    while pending:
        frame = pending.pop()
        for other in (*frame._dcm_dict, *frame._ang_vel_dict):
            if other not in frames:
                frames.add(other)
                pending.append(other)
    return frames, points


def _solved(algebra: Algebra, rows: list[list[Scalar]], rest: list[Scalar], name: str) -> list[Scalar]:
    """Return x of A x = b on the tape, by elimination; pivots are the largest entries at a random state."""
    tape, count = algebra.tape, len(rest)
    rows, rest = [list(row) for row in rows], list(rest)
    random = np.random.default_rng(_SEED)
    sizes: dict[str, int] = {}
    for symbol in tape.depends_on([item.ref for row in rows for item in row]):
        sizes[symbol.block] = max(sizes.get(symbol.block, 0), symbol.index + 1)
    sample = {block: random.uniform(0.3, 1.2, size) for block, size in sizes.items()}
    order = list(range(count))
    for column in range(count):
        values = np.abs(evaluate(tape, [rows[row][column].ref for row in order[column:]], sample))
        best = column + int(np.argmax(values))
        if not values.max() > 0.0:
            fault = "the kinematic differential equations do not determine the speeds"
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
    return solution
