"""Examples of SymPy's mechanics and of PyDy, whoever wrote them: each description is caught as soon as SymPy has formed
its equations, and its accelerations are compared with the ones of ``eomgen.from_sympy``.

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
import random
import re
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sympy
from sympy.core.function import AppliedUndef
from sympy.physics import mechanics as me
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from eomgen.errors import EomgenError
from eomgen.symbolic.evaluate import evaluate

T = dynamicsymbols._t
#: Seconds for one example, and for one comparison.
LIMIT = 150
#: Draws of values until a state meets the constraints and no equation is singular.
_DRAWS = 12


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
    """Collect all descriptions whose equations SymPy forms, without the ones that SymPy makes inside of others."""
    depth = [0]
    saved: list[tuple[type, str, Any]] = []

    def watch(owner: Any, name: str) -> None:
        original = getattr(owner, name)

        def formed(self: Any, *args: Any, **options: Any) -> Any:
            depth[0] += 1
            try:
                result = original(self, *args, **options)
            finally:
                depth[0] -= 1
            if not depth[0] and not any(self is item for item in into):
                into.append(self)
            return result

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


class Reference(NamedTuple):
    """SymPy's equations in its speeds u: rates of q, M udot = f, and the change of the rates of q."""

    q: list[Any]
    u: list[Any]
    others: list[Any]
    motion: Callable[..., Any]


def equations(system: Any) -> tuple[list[Any], list[Any], list[Any], Any, Any]:
    """Return q, u, rates of q by u, and M and f of M udot = f; f holds multipliers for a LagrangesMethod."""
    system = system.eom_method if isinstance(system, me.System) else system
    if isinstance(system, me.LagrangesMethod):
        q = list(system.q)
        return (
            q,
            [item.diff(T) for item in q],
            [item.diff(T) for item in q],
            system.mass_matrix_full,
            system.forcing_full,
        )
    rates = system.kindiffdict()
    q, u = list(system.q), list(system.u)
    still = dict.fromkeys(system._uaux, 0) | dict.fromkeys((item.diff(T) for item in system._uaux), 0)
    mass, force = (item.subs(rates).xreplace(still) for item in (system.mass_matrix, system.forcing))
    turned = [rates[item.diff(T)].xreplace(still) for item in q]
    if len(u) > len(q):  # speeds of wheels whose angles move nothing
        free = [item for item in u if not any(rate.has(item) for rate in turned)]
        q, turned = [*q, *(dynamicsymbols(f"{_name(item)}_integral") for item in free)], [*turned, *free]
    return q, u, turned, mass, force


def compared(system: Any) -> tuple[float, Any]:
    """Return the largest relative difference of accelerations at random states that meet the constraints, and the
    document."""
    q, u, rates, mass, force = equations(system)
    lagrange = isinstance(system, me.LagrangesMethod)
    symbols = sorted((mass.free_symbols | force.free_symbols | sympy.Matrix(rates).free_symbols) - {T}, key=str)
    functions = set[Any]()
    for expression in (mass, force, sympy.Matrix(rates)):
        functions |= expression.atoms(AppliedUndef)
    others = sorted(functions - set(q) - set(u), key=str)
    stand_in = {item: sympy.Dummy() for item in [*u, *q, *others]}  # rates of q first: they hold q
    change = [sympy.Dummy() for _ in u]
    rates = sympy.Matrix(rates)
    moved = sympy.Matrix(change) if lagrange else rates.jacobian(u) * sympy.Matrix(change)
    if not lagrange:
        moved += rates.jacobian(q) * rates + rates.diff(T).subs({item.diff(T): 0 for item in [*q, *u]})
    arguments = [T, *([stand_in[item] for item in block] for block in (q, u, others)), symbols]
    own = [_replaced(item, stand_in) for item in (mass, force, rates)]
    of_motion = sympy.lambdify(arguments, own, cse=True)
    of_change = sympy.lambdify([*arguments, change], _replaced(moved, stand_in), cse=True)
    worst = 0.0
    document = None
    for document, state in _states(system, q, symbols):
        function = eomgen.derive(document, ["outputs"]).functions.get("outputs")
        inputs = dict(zip(document.inputs, state["u"], strict=True))
        speeds = state["v"]
        if not lagrange and function is not None:
            values = evaluate(_tape(document, "outputs"), function.refs, _given(function, state))
            named = dict(zip(document.speeds, values, strict=True))
            rates_of = dict(zip(document.coordinates, state["v"], strict=True))
            speeds = np.array([_speed(item, named, rates_of) for item in u])
        p = [state["named"].get(_name(item), 0.7) for item in symbols]
        at: Sequence[Any] = (state["t"][0], state["q"], speeds, [inputs.get(_name(item), 0.0) for item in others], p)
        M, f, v = (np.array(item, dtype=float) for item in of_motion(*at))
        solution = np.linalg.solve(M, f.ravel())
        if lagrange:
            solution = solution[len(q) : 2 * len(q)]
        expected = np.array(of_change(*at, solution), dtype=float).ravel()
        result = accelerations(document, state)
        scale = max(np.abs(expected).max(), 1e-3)
        worst = max(worst, float(np.abs(result - expected).max() / scale), float(np.abs(v.ravel() - state["v"]).max()))
    return worst, document


def _replaced(expression: Any, stand_in: Mapping[Any, Any]) -> Any:
    rates = {item: new for item, new in stand_in.items() if isinstance(item, sympy.Derivative)}
    return expression.xreplace(rates).xreplace(dict(stand_in))


def _name(symbol: Any) -> str:
    from eomgen.products.sympy_mechanics.expressions import name_of

    return name_of(symbol)


def _speed(item: Any, named: Mapping[str, float], rates: Mapping[str, float]) -> float:
    return rates[_name(item.expr)] if isinstance(item, sympy.Derivative) else named[_name(item)]


def _tape(document: Any, term: str) -> Any:
    return eomgen.derive(document, [term]).tape


def _given(function: Any, state: Mapping[str, Any]) -> dict[str, Any]:
    return {block: state[block] for block in function.inputs}


def _states(
    system: Any, q: Sequence[Any], symbols: Sequence[Any], count: int = 3
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield documents with states that satisfy the constraints, at drawn values of symbols."""
    draw, made = random.Random(3), 0
    refusal: Exception | None = None
    for _ in range(_DRAWS):
        named: dict[str, float] = {}
        start = {item: draw.uniform(0.15, 0.9) for item in q}
        start |= {item.diff(T): draw.uniform(-1.0, 1.0) for item in q}
        document = None
        for _ in range(8):  # names of all free symbols come from the message
            try:
                document = eomgen.from_sympy(system, parameters=named, initial=start)
                break
            except EomgenError as error:
                refusal = error
                if found := re.search(r"no values for (.*?); try", str(error)):
                    named |= {item: draw.uniform(0.5, 1.5) for item in found[1].split(", ")}
                elif "no free symbol" in str(error):
                    named.pop(str(error).split("no free symbol ")[1].split(";")[0], None)
                else:
                    break
        if document is None:
            continue
        refusal = ValueError("no drawn state has finite accelerations")
        inputs = np.array([draw.uniform(-1.0, 1.0) for _ in document.inputs])
        # constraints that inputs move were met at zero inputs
        inputs = 0.0 * inputs if document.rows.names else inputs
        state = {
            **{"q": np.array(document.initial_q), "v": np.array(document.initial_v), "u": inputs},
            **{"t": np.zeros(1), "p": np.array(document.values), "named": named},
        }
        if np.all(np.isfinite(accelerations(document, state))):
            yield document, state
            made += 1
        if made == count:
            return
    if not made and refusal is not None:
        raise refusal


def accelerations(document: Any, blocks: Mapping[str, Any]) -> Any:
    """Return vdot of a document, with multipliers if it has constraints."""
    terms = ["mass", "coupling", "force", "constraint_jacobian", "constraint_bias"]
    system = eomgen.derive(document, terms)
    results = {}
    for name, function in system.functions.items():
        results[name] = evaluate(system.tape, function.refs, _given(function, blocks))
    n, rows = len(document.coordinates), len(document.rows.names)
    right = results["force"] - results["coupling"]
    whole = results["mass"].reshape(n, n)
    if rows:
        B = results["constraint_jacobian"].reshape(rows, n)
        whole = np.block([[whole, B.T], [B, np.zeros((rows, rows))]])
        right = np.concatenate([right, -results["constraint_bias"]])
    return np.linalg.solve(whole, right)[:n]


def rows_of(example: str, systems: Sequence[Any], note: str = "") -> list[Row]:
    """Return the rows of the descriptions of an example."""
    result = []
    for number, system in enumerate(systems, 1):
        kind, begun = type(system).__name__, time.process_time()
        row = Row(example, number, kind)
        try:
            with limited(LIMIT), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                error, document = compared(system)
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
                yield re.sub(r"(?m)^\s*[%!].*$", "", "".join(cell.get("source", cell.get("input"))))
    elif path.suffix == ".rst":
        yield from (item.source for item in doctest.DocTestParser().get_examples(text))
        for block in re.findall(r"\.\. jupyter-execute::\n(?:\s+:.*\n)*\n((?:[ \t]+.*\n|\n)+)", text):
            lines = block.splitlines()
            indent = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
            yield "\n".join(line[indent:] for line in lines)
    else:
        yield text


def ran(example: str) -> list[Row]:
    """Run an example, a file or a module of tests, and return its rows."""
    if not Path(example).exists():
        module = importlib.import_module(example)
        rows = []
        for name in [item for item in vars(module) if item.startswith("test_")]:
            systems: list[Any] = []
            note = _run(getattr(module, name), systems)
            if systems:
                rows += rows_of(f"{example}::{name}", systems, note)
        return rows
    systems, notes = [], []
    scope: dict[str, Any] = {"__name__": "__main__", "__file__": example, "display": lambda *_: None}
    for piece in _pieces(Path(example)):
        if note := _run(lambda piece=piece: exec(compile(piece, example, "exec"), scope), systems):
            notes.append(note)
    return rows_of(example, systems, "; ".join(dict.fromkeys(notes)))


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
    print(json.dumps(found, indent=1))
