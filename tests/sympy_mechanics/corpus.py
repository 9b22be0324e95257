"""Examples of SymPy's mechanics and of PyDy, whoever wrote them: each description is caught when SymPy is asked for its
equations, which are compared with the ones of ``eomgen.from_sympy``: accelerations, and M and f on the motions that
constraints leave.

SymPy's equations are evaluated with 30 digits, node by node, each node once: no compilation, no substitution.

    python -m tests.sympy_mechanics.corpus FILE.py FILE.rst FILE.ipynb ... > rows.json
    python -m tests.sympy_mechanics.corpus sympy.physics.mechanics.tests.test_kane > rows.json

A module of tests runs test by test. Cells and doctests run in order; a cell that fails does not stop the later ones.
"""

from __future__ import annotations

import contextlib
import doctest
import importlib
import io
import json
import os
import random
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import mpmath
import numpy as np
import sympy
from sympy.core.function import AppliedUndef
from sympy.physics import mechanics as me
from sympy.physics.biomechanics import CharacteristicCurveFunction
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from eomgen.errors import EomgenError
from eomgen.symbolic.evaluate import evaluate

T = dynamicsymbols._t
#: Seconds for one example, and for one comparison.
LIMIT = 400
#: Draws of values until a state meets the constraints and no equation is singular.
_DRAWS = 12
_MATRICES = ("mass", "constraint_jacobian")
#: Calls in which examples contradict themselves; these are left out.
LEFT_OUT: dict[str, tuple[type, str]] = {
    "sympy.physics.mechanics.tests.test_kane::test_aux": (me.Point, "a2pt_theory"),
    "three-link-conical-pendulum.rst": (me.ReferenceFrame, "set_ang_vel"),
    "derive.py": (me.ReferenceFrame, "set_ang_vel"),
}
#: Values near which all are drawn, of examples with muscles.
VALUES: dict[str, dict[str, float]] = {
    "biomechanical-model-example.rst": {
        "dx": 0.31, "dy": 0.15, "dz": -0.31, "lA": 0.2, "lC": 0.3, "lD": 0.3, "mA": 1.0, "mC": 2.3, "mD": 1.7,
        "g": 9.81, "k": 5.0, "c": 0.5, "r": 0.03, "F_M_max_biceps": 500.0, "l_M_opt_biceps": 0.18,
        "l_T_slack_biceps": 0.165, "F_M_max_triceps": 500.0, "l_M_opt_triceps": 0.18, "l_T_slack_triceps": 0.195,
        "q1": 0.0873, "q2": -0.0106, "q3": 0.165, "q4": 1.548,
    },
}  # fmt: skip  # a table


class Row(NamedTuple):
    """One description: the largest relative difference of accelerations, or the refusal."""

    example: str
    number: int
    kind: str
    coordinates: int = 0
    constraints: int = 0
    bodies: int = 0
    error: float | None = None
    seconds: float = 0.0
    result: str = ""


class TooLongError(Exception):
    """An example takes longer than its limit."""


@contextlib.contextmanager
def limited(seconds: int) -> Iterator[None]:
    """Raise TooLongError after some seconds."""

    def stop(*_: object) -> None:
        raise TooLongError

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@contextlib.contextmanager
def caught(into: list[Any]) -> Iterator[None]:
    """Collect all descriptions whose equations are asked for, without the ones that SymPy makes inside of others."""
    depth = [0]
    saved: list[tuple[type, str, Any]] = []

    def watch(owner: Any, name: str) -> None:
        original = getattr(owner, name)

        def formed(self: Any, *args: Any, **options: Any) -> Any:
            if isinstance(self, me.KanesMethod) and not depth[0]:
                given = dict(zip(("bodies", "loads"), args, strict=False)) | options
                if any(isinstance(item, tuple) for item in given.get("bodies", ())):  # the order before SymPy 1.1
                    given = {"bodies": given["loads"], "loads": given["bodies"]}
                    args = (given["bodies"], given["loads"])
                self._bodylist = given.get("bodies", self._bodylist)
                self._forcelist = given.get("loads", self._forcelist)
            if not depth[0] and not any(self is item for item in into):
                into.append(self)
            depth[0] += 1
            try:
                return original(self, *args, **options)
            finally:
                depth[0] -= 1

        saved.append((owner, name, original))
        setattr(owner, name, formed)

    watch(me.KanesMethod, "kanes_equations")
    watch(me.LagrangesMethod, "form_lagranges_equations")
    watch(me.System, "form_eoms")
    try:
        yield
    finally:
        for owner, name, original in saved:
            setattr(owner, name, original)


class Numbers:
    """Values of expressions with 30 digits, node by node, each node once.

    Parameters
    ----------
    known : mapping
        Values of functions of time and of their rates; other functions, and rates, are zero.
    named : mapping
        Values of symbols by name, 0.7 for others.
    """

    _FUNCTIONS: ClassVar[Mapping[Any, Callable[..., Any]]] = {
        sympy.Abs: abs,
        sympy.Min: min,
        sympy.Max: max,
        sympy.Heaviside: lambda x, at_zero: mpmath.mpf(x > 0) if x else at_zero,
    }

    def __init__(self, known: Mapping[Any, float], named: Mapping[str, float]) -> None:
        self.named = named
        self._values: dict[Any, Any] = {key: mpmath.mpf(float(value)) for key, value in known.items()}

    def __call__(self, expression: Any) -> Any:
        """Return the value of an expression."""
        with mpmath.workdps(30):
            return self._value(sympy.sympify(expression))

    def array(self, matrix: Any) -> Any:
        """Return the values of a matrix, (rows, columns)."""
        rows, columns = matrix.shape
        return np.array([[float(self(matrix[i, j])) for j in range(columns)] for i in range(rows)]).reshape(
            rows, columns
        )

    def _value(self, root: Any) -> Any:
        pending = [root]
        while pending:
            node = pending[-1]
            if node in self._values:
                pending.pop()
                continue
            if isinstance(node, sympy.Piecewise):
                self._values[node] = self._piece(node)
                continue
            if node.is_Symbol or isinstance(node, AppliedUndef | sympy.Derivative) or not node.args:
                self._values[node] = self._leaf(node)
                continue
            doit = isinstance(node, CharacteristicCurveFunction)
            operands = [node.doit(deep=False)] if doit else node.args
            if missing := [item for item in operands if item not in self._values]:
                pending += missing
                continue
            values = [self._values[item] for item in operands]
            self._values[node] = values[0] if doit else self._result(node, values)
        return self._values[root]

    def _piece(self, node: Any) -> Any:
        for value, condition in node.args:
            if condition == sympy.true:
                return self._value(value)
            left, right = (self._value(item) for item in condition.args)
            if condition.func(sympy.Float(str(left), 30), sympy.Float(str(right), 30)) == sympy.true:
                return self._value(value)
        return mpmath.nan

    def _leaf(self, node: Any) -> Any:
        if node.is_Symbol:
            return mpmath.mpf(self.named.get(_name(node), 0.7))
        if isinstance(node, AppliedUndef | sympy.Derivative):
            return mpmath.mpf(0)
        return mpmath.mpmathify(node.evalf(30))

    def _result(self, node: Any, values: Sequence[Any]) -> Any:
        if node.is_Add:
            return mpmath.fsum(values)
        if node.is_Mul:
            return mpmath.fprod(values)
        if node.is_Pow:
            return values[0] ** (int(node.exp) if node.exp.is_Integer else values[1])
        function = self._FUNCTIONS.get(type(node)) or getattr(mpmath, type(node).__name__)
        return function(*values)


class Equations:
    """SymPy's equations of one description at one state.

    Attributes
    ----------
    q, u : coordinates, and speeds
    """

    def __init__(self, system: Any) -> None:
        self.system = system.eom_method if isinstance(system, me.System) else system
        self.of_lagrange = isinstance(self.system, me.LagrangesMethod)
        self.q, self.u = list(self.system.q), list(getattr(self.system, "u", ()))
        self.free: list[Any] = []
        if self.of_lagrange:
            return
        #: K qdot + U u + k = 0
        method = self.system
        self.rates = [method._k_kqdot_implicit, method._k_ku_implicit, method._f_k_implicit]
        self.rates_of_rates = [item.diff(T) for item in self.rates]
        # speeds of wheels whose angles move nothing
        self.free = [item for place, item in enumerate(self.u) if self.rates[1][:, place].is_zero_matrix]
        self.free = self.free if len(self.u) - len(self.free) == len(self.q) else []
        self.q += [dynamicsymbols(f"{_name(item)}_integral") for item in self.free]

    def kinematics(self, numbers: Numbers) -> tuple[Any, Any]:
        """Return W and w of v = W u + w."""
        if self.of_lagrange:
            return np.eye(len(self.q)), np.zeros(len(self.q))
        K, U, k = (numbers.array(item) for item in self.rates)
        W, w = -np.linalg.solve(K, U), -np.linalg.solve(K, k).ravel()
        rows = np.array([[float(item is speed) for speed in self.u] for item in self.free]).reshape(-1, len(self.u))
        return np.vstack([W, rows]), np.concatenate([w, np.zeros(len(self.free))])

    def kinematic_bias(self, numbers: Numbers, v: Any, u: Any) -> Any:
        """Return the rates of v at udot = 0."""
        K = numbers.array(self.rates[0])
        moved = [numbers.array(item) for item in self.rates_of_rates]
        known = v[: len(K)]
        return np.concatenate(
            [-np.linalg.solve(K, moved[0] @ known + moved[1] @ u + moved[2].ravel()), np.zeros(len(self.free))]
        )

    def compared(self, document: Any, state: Mapping[str, Any]) -> float:
        """Return the largest relative difference of SymPy's equations and of a document's at a state."""
        v, named = state["v"], state["named"]
        values = {
            T: state["t"][0],
            **dict(zip(self.q, state["q"], strict=True)),
            **dict(zip((item.diff(T) for item in self.q), v, strict=True)),
        }
        inputs = dict(zip(document.inputs, state["u"], strict=True))
        symbols = set[Any]().union(*(matrix.atoms(AppliedUndef) for matrix in self._matrices()))
        values |= {item: inputs[_name(item)] for item in symbols - values.keys() if _name(item) in inputs}
        if self.of_lagrange:
            numbers = Numbers(values, named)
            solution = np.linalg.solve(
                numbers.array(self.system.mass_matrix_full), numbers.array(self.system.forcing_full)
            ).ravel()
            return _apart(accelerations(document, state), solution[len(v) : 2 * len(v)])
        u = _speeds(document, state, self.u)
        values |= dict(zip(self.u, u, strict=True))
        numbers = Numbers(values, named)
        W, w = self.kinematics(numbers)
        bias = self.kinematic_bias(numbers, v, u)
        errors = [float(np.abs(W @ u + w - v).max())]
        # udot = T udot_independent + e
        independent = len(self.u) - len(self.system._udep)
        slopes, rest = np.eye(len(self.u))[:, :independent], np.zeros(len(self.u))
        if len(self.system._udep):
            B, b = (numbers.array(item) for item in (self.system._k_dnh, self.system._f_dnh))
            slopes = np.vstack([np.eye(independent), -np.linalg.solve(B[:, independent:], B[:, :independent])])
            rest[independent:] = -np.linalg.solve(B[:, independent:], b).ravel()
        if self.system.bodies:
            M, f = numbers.array(self.system._k_d), -numbers.array(self.system._f_d).ravel()
        else:
            M, f = np.zeros((independent, len(self.u))), numbers.array(self.system._fr[:independent, :]).ravel()
        own = terms_of(document, state)
        ways = W @ slopes
        mass = ways.T @ own["mass"] @ ways
        force = ways.T @ (own["force"] - own["coupling"] - own["mass"] @ (W @ rest + bias))
        errors.append(_apart(force, f - M @ rest))
        if not np.abs(M).max(initial=0.0):
            return max(*errors, float(np.abs(mass).max()))
        errors.append(_apart(mass, M @ slopes))
        whole = M @ slopes
        if np.linalg.cond(whole) < 1e12:  # elsewhere no acceleration follows
            change = slopes @ np.linalg.solve(whole, f - M @ rest) + rest
            errors.append(_apart(accelerations(document, state), W @ change + bias))
        return max(errors)

    def _matrices(self) -> list[Any]:
        if self.of_lagrange:
            return [self.system.mass_matrix_full, self.system.forcing_full]
        own = [self.system._k_d, self.system._f_d] if self.system.bodies else [self.system._fr]
        return [*own, *self.rates]


def _apart(result: Any, expected: Any) -> float:
    """Return the largest difference, relative to the largest value."""
    return float(np.abs(result - expected).max() / max(np.abs(expected).max(), 1e-3))


def _speeds(document: Any, state: Mapping[str, Any], speeds: Sequence[Any]) -> Any:
    """Return SymPy's speeds at a state."""
    system = eomgen.derive(document, ["outputs"])
    values = value(system, "outputs", state) if "outputs" in system.functions else []
    named = dict(zip(document.speeds, values, strict=True))
    rates_of = dict(zip(document.coordinates, state["v"], strict=True))
    return np.array([_speed(item, named, rates_of) for item in speeds])


def formed(system: Any) -> None:
    """Let SymPy form the equations, if it has not."""
    method = system.eom_method if isinstance(system, me.System) else system
    if isinstance(system, me.System) and method is None:
        system.form_eoms()
    elif isinstance(method, me.LagrangesMethod) and method.eom is None:
        method.form_lagranges_equations()
    elif isinstance(method, me.KanesMethod) and method._frstar is None:
        method.kanes_equations()


def compared(system: Any, values: Mapping[str, float] | None = None, states: int = 3) -> tuple[float, Any]:
    """Return the largest relative difference of equations at random states that meet the constraints, and the document.

    ``values``: of symbols and coordinates near which all values are drawn.
    """
    formed(system)
    equations = Equations(system)
    worst, document = 0.0, None
    for document, state in _states(system, equations.q, values or {}, states):
        worst = max(worst, equations.compared(document, state))
    return worst, document


def _name(symbol: Any) -> str:
    from eomgen.products.sympy_mechanics.expressions import name_of

    return name_of(symbol)


def _speed(item: Any, named: Mapping[str, float], rates: Mapping[str, float]) -> float:
    return rates[_name(item.expr)] if isinstance(item, sympy.Derivative) else named[_name(item)]


def value(system: Any, name: str, state: Mapping[str, Any]) -> Any:
    """Return the value of a function of derived equations at a state."""
    function = system.functions[name]
    return evaluate(system.tape, function.refs, {block: state[block] for block in function.inputs})


def _states(
    system: Any, q: Sequence[Any], values: Mapping[str, float], count: int
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield documents with states that satisfy the constraints, at drawn values of symbols, near the given ones."""
    draw, made = random.Random(3), 0

    def drawn(name: str, low: float, high: float) -> float:
        return values[name] * draw.uniform(0.98, 1.02) if name in values else draw.uniform(low, high)

    refusal: Exception | None = None
    for _ in range(_DRAWS):
        named: dict[str, float] = {}
        start = {item: drawn(_name(item), 0.15, 0.9) for item in q}
        start |= {item.diff(T): draw.uniform(-1.0, 1.0) for item in q}
        document = None
        for _ in range(8):  # names of all free symbols come from the message
            try:
                document = eomgen.from_sympy(system, parameters=named, initial=start)
                break
            except EomgenError as error:
                refusal = error
                if found := re.search(r"no values for (.*?); try", str(error)):
                    named |= {item: drawn(item, 0.5, 1.5) for item in found[1].split(", ")}
                elif "no free symbol" in str(error):
                    named.pop(str(error).split("no free symbol ")[1].split(";")[0], None)
                else:
                    break
        if document is None:
            continue
        refusal = ValueError("no drawn state has finite terms")
        inputs = np.array([draw.uniform(-1.0, 1.0) for _ in document.inputs])
        rows = [*document.rows.positions, *document.rows.velocities]
        if any(symbol.block == "u" for symbol in document.tape.depends_on(rows)):
            inputs = 0.0 * inputs  # at which the constraints were met
        state = {
            **{"q": np.array(document.initial_q), "v": np.array(document.initial_v), "u": inputs},
            **{"t": np.zeros(1), "p": np.array([*document.parameters.values()]), "named": named},
        }
        if all(np.all(np.isfinite(item)) for item in terms_of(document, state).values()):
            yield document, state
            made += 1
        if made == count:
            return
    if not made and refusal is not None:
        raise refusal


def terms_of(document: Any, blocks: Mapping[str, Any]) -> dict[str, Any]:
    """Return M, h, Q and, of constraints, B and the bias of a document."""
    system = eomgen.derive(document, ["mass", "coupling", "force", "constraint_jacobian", "constraint_bias"])
    n, result = len(document.coordinates), {name: value(system, name, blocks) for name in system.functions}
    return {name: each.reshape(-1, n) if name in _MATRICES else each for name, each in result.items()}


def accelerations(document: Any, blocks: Mapping[str, Any]) -> Any:
    """Return vdot of a document, with multipliers if it has constraints."""
    terms = terms_of(document, blocks)
    whole, right = terms["mass"], terms["force"] - terms["coupling"]
    if document.rows.names:
        B = terms["constraint_jacobian"]
        whole = np.block([[whole, B.T], [B, np.zeros((len(B), len(B)))]])
        right = np.concatenate([right, -terms["constraint_bias"]])
    return np.linalg.solve(whole, right)[: len(document.coordinates)]


def rows_of(example: str, systems: Sequence[Any], note: str = "") -> list[Row]:
    """Return the rows of the descriptions of an example."""
    result = []
    for number, system in enumerate(systems, 1):
        kind, begun = type(system).__name__, time.process_time()
        row = Row(example, number, kind)
        try:
            with limited(LIMIT), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                error, document = compared(system, VALUES.get(Path(example).name))
            sizes = (len(document.coordinates), len(document.rows.names), len(document.observed.bodies))
            row = row._replace(coordinates=sizes[0], constraints=sizes[1], bodies=sizes[2], error=error, result="equal")
            if not error < 1e-12:
                row = row._replace(result="differs")
        except TooLongError:
            row = row._replace(result=f"more than {LIMIT} s")
        except Exception as error:  # of any kind: examples are not ours
            row = row._replace(result=f"{type(error).__name__}: {error}"[:300])
        result.append(row._replace(seconds=round(time.process_time() - begun, 2)))
        print(result[-1], file=sys.stderr, flush=True)
    if not systems:
        result.append(Row(example, 0, "", result=f"no equations: {note}" if note else "no equations"))
        print(result[-1], file=sys.stderr, flush=True)
    return result


def _pieces(path: Path) -> Iterator[str]:
    """Yield the pieces of code of a file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        notebook = json.loads(text)
        for cell in notebook.get("cells") or [cell for sheet in notebook["worksheets"] for cell in sheet["cells"]]:
            if cell["cell_type"] == "code":
                yield _plain("".join(cell.get("source", cell.get("input"))))
    elif path.suffix == ".rst":
        yield from (item.source for item in doctest.DocTestParser().get_examples(text))
        for block in re.findall(r"\.\. jupyter-execute::\n(?:\s+:.*\n)*\n((?:[ \t]+.*\n|\n)+)", text):
            lines = block.splitlines()
            indent = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
            yield _plain("\n".join(line[indent:] for line in lines))
    else:
        yield text


def _plain(text: str) -> str:
    """Return a cell without commands of the notebook."""
    return re.sub(r"(?m)^\s*[%!].*$", "", text)


def ran(example: str) -> list[Row]:
    """Run an example, a file or a module of tests, and return its rows."""
    if not Path(example).exists():
        module = importlib.import_module(example)
        rows = []
        calls = {name: item for name, item in vars(module).items() if name.startswith("test_")}
        for owner in [item for name, item in vars(module).items() if name.startswith("Test")]:
            names = [name for name in vars(owner) if name.startswith("test_")]
            calls |= {
                f"{owner.__name__}.{name}": lambda owner=owner, name=name: getattr(owner(), name)() for name in names
            }
        for name, call in calls.items():
            systems: list[Any] = []
            with _consistent(f"{example}::{name}"):
                note = _run(call, systems)
                rows += rows_of(f"{example}::{name}", systems, note) if systems else []
        return rows
    systems, notes = [], []
    scope: dict[str, Any] = {"__name__": "__main__", "__file__": example, "display": lambda *_: None}
    with _consistent(Path(example).name):
        for piece in _pieces(Path(example)):
            if note := _run(lambda piece=piece: exec(compile(piece, example, "exec"), scope), systems):
                notes.append(note)
        return rows_of(example, systems, "; ".join(dict.fromkeys(notes)))


@contextlib.contextmanager
def _consistent(example: str) -> Iterator[None]:
    """Leave out the calls in which an example contradicts itself."""
    owner, name = LEFT_OUT.get(example, (object, "__str__"))
    original = getattr(owner, name)
    if example in LEFT_OUT:
        setattr(owner, name, lambda *_: None)
    try:
        yield
    finally:
        if example in LEFT_OUT:
            setattr(owner, name, original)


def _run(call: Callable[[], object], into: list[Any]) -> str:
    try:
        with caught(into), limited(LIMIT), warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            call()
    except TooLongError:
        return f"more than {LIMIT} s"
    except BaseException as error:  # of any kind: examples are not ours
        return f"{type(error).__name__}: {error}"[:160]
    return ""


if __name__ == "__main__":
    sys.setrecursionlimit(10000)
    found = [row._asdict() for example in sys.argv[1:] for row in ran(example)]
    print(json.dumps(found, indent=1), flush=True)
    os._exit(0)  # examples start servers
