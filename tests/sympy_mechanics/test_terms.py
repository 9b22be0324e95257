"""Terms of equations from SymPy against one another by complex steps, and expressions against SymPy's own values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from sympy.physics import mechanics as me
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from eomgen.products.sympy_mechanics import expressions
from eomgen.products.sympy_mechanics.equations import _PARTIALS, _TERMS, solve_symmetric
from eomgen.products.sympy_mechanics.expressions import Expressions
from eomgen.products.sympy_mechanics.rows import _independent, is_singular
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from tests.sympy_mechanics.test_from_sympy import rocket, sleigh

T = dynamicsymbols._t
Blocks = Mapping[str, Any]


def tethered() -> Any:
    """Return a document of Lagrange with a rope that time moves, a constraint of rates, a state and an input."""
    x, y, s, f, z = dynamicsymbols("x y s f z")
    m, g, k, length, tau = sympy.symbols("m g k l tau")
    frame, point = me.ReferenceFrame("N"), me.Point("P")
    point.set_vel(frame, x.diff(T) * frame.x + y.diff(T) * frame.y)
    kinetic = x.diff(T) ** 2 + (1 + x**2) * y.diff(T) ** 2 + s.diff(T) ** 2 + x.diff(T) * s.diff(T) / 3
    system = me.LagrangesMethod(
        m * kinetic / 2 - m * g * y - k * s**2 / 2,
        [x, y, s],
        hol_coneqs=[x**2 + y - length + sympy.sin(T) / 5 - k * s / 9],
        nonhol_coneqs=[s.diff(T) - y * x.diff(T) - k * sympy.cos(T) / 4],
        forcelist=[(point, (f + z * x - k * y.diff(T)) * frame.x)],
        frame=frame,
    )
    values = {"m": 1.3, "g": 9.81, "k": 0.7, "l": 0.9, "tau": 0.4}
    return eomgen.from_sympy(system, parameters=values, states={z: (f - z * x) / tau + k * x.diff(T) ** 2})


SYSTEMS: Mapping[str, Callable[[], Any]] = {
    "tethered": tethered,
    "sleigh": lambda: eomgen.from_sympy(sleigh(), parameters={"m": 2.0, "I": 0.3, "a": 0.4, "c": 0.5}),
    "rocket": lambda: eomgen.from_sympy(rocket(), parameters={"m": 2.0, "k": 0.3, "thrust": 0.4}),
}


@cache
def derived(name: str) -> tuple[Any, Any]:
    """Return a document and its system with all terms that it can have."""
    document = SYSTEMS[name]()
    return document, eomgen.derive(document, list(_TERMS))


def state_of(document: Any) -> dict[str, Any]:
    random, n = np.random.default_rng(5), len(document.coordinates)
    sizes = {"q": n, "v": n, "a": n, "lam": len(document.rows.names), "z": len(document.states.names)}
    sizes |= {"u": len(document.inputs), "t": 1}
    return {block: random.uniform(0.3, 1.1, size) for block, size in sizes.items()} | {"p": np.array(document.values)}


def values(system: Any, term: str, state: Blocks) -> dict[str, Any]:
    """Return the blocks of a term at a state."""
    function = system.functions[term]
    found = evaluate(system.tape, function.refs, {block: state[block] for block in function.inputs})
    starts = np.cumsum([0, *(len(block.refs) for block in function.outputs)])
    return {
        block.name: found[start:end].reshape(block.shape)
        for block, start, end in zip(function.outputs, starts, starts[1:], strict=False)
    }


def along(function: Callable[[Blocks], Any], state: Blocks, directions: Blocks) -> Any:
    """Return the derivative of a function of a state in some directions, by a complex step."""
    step = 1e-30
    moved = {block: state[block] + 1j * step * np.asarray(directions[block]) for block in directions}
    return np.imag(function({**state, **moved})) / step


def partials(function: Callable[[Blocks], Any], state: Blocks, block: str) -> Any:
    size = len(state[block])
    return np.array([along(function, state, {block: row}) for row in np.eye(size)]).T


#: Terms whose values are the quantities of ``_PARTIALS``.
QUANTITIES = {"residual": "residual", "rates": "internal_rate", "positions": "constraint", "outputs": "outputs"}
QUANTITIES |= {"row_rates": "constraint_velocity", "row_accelerations": "constraint_acceleration"}


def quantity(system: Any, name: str) -> Callable[[Blocks], Any]:
    """Return the function of a state that is a quantity of the equations."""

    def only(term: str, state: Blocks) -> Any:
        (found,) = values(system, term, state).values()
        return found

    def at_rest(state: Blocks) -> dict[str, Any]:
        return {**state, "a": 0.0 * state["a"], "lam": 0.0 * state["lam"]}

    if name == "forces":
        return lambda state: -only("residual", at_rest(state))
    if name == "reactions":
        return lambda state: only("residual", state) - only("residual", {**state, "lam": 0.0 * state["lam"]})
    return lambda state: only(QUANTITIES[name], state)


@pytest.mark.parametrize("name", SYSTEMS)
def test_partials_are_the_complex_steps_of_their_quantities(name: str) -> None:
    document, system = derived(name)
    state, tried = state_of(document), 0
    for term, rows in _PARTIALS.items():
        found = values(system, term, state) if term in system.functions else {}
        for block, of, argument, _ in rows:
            key = f"{block[0]}0" if term == "linearization" and block in ("K", "C") else block
            if key in found:
                np.testing.assert_allclose(found[key], partials(quantity(system, of), state, argument), atol=1e-12)
                tried += 1
    linear = values(system, "linearization", state)
    for key, block in (("K0", "q"), ("C0", "v"), ("M0", "a")):
        np.testing.assert_allclose(linear[key], partials(quantity(system, "residual"), state, block), atol=1e-12)
    assert tried >= {"tethered": 22, "sleigh": 12, "rocket": 3}[name]


@pytest.mark.parametrize("name", SYSTEMS)
def test_terms_fit_one_another(name: str) -> None:
    document, system = derived(name)
    state, n = state_of(document), len(document.coordinates)

    def at(term: str, state: Blocks = state) -> Any:
        return np.concatenate([np.ravel(block) for block in values(system, term, state).values()])

    M, h, Q = at("mass").reshape(n, n), at("coupling"), at("force")
    tau = M @ state["a"] + h - Q
    B = np.zeros((0, n))
    if document.rows.names:
        B = at("constraint_jacobian").reshape(-1, n)
        rates, bias = at("constraint_velocity"), at("constraint_bias")
        motion = {"q": state["v"], "v": state["a"], "t": [1.0]}
        positions = along(lambda moved: at("constraint", moved), state, motion)
        np.testing.assert_allclose(rates[: len(positions)], positions, atol=1e-12)
        accelerations = along(lambda moved: at("constraint_velocity", moved), state, motion)
        np.testing.assert_allclose(at("constraint_acceleration"), accelerations, atol=1e-12)
        np.testing.assert_allclose(B @ state["a"] + bias, accelerations, atol=1e-12)
        np.testing.assert_array_equal(at("jacobian_values"), [B[place] for place in system.patterns["B"]])
    else:
        np.testing.assert_allclose(M @ at("forward_dynamics"), Q - h, atol=1e-12)
    residual = tau + B.T @ state["lam"]
    np.testing.assert_allclose(at("residual"), residual, atol=1e-12)
    if "equations" in system.functions:
        further = ("constraint", "constraint_velocity", "internal_rate")
        equations = [residual, *(at(term) for term in further if term in system.functions)]
        np.testing.assert_allclose(at("equations"), np.concatenate(equations), atol=1e-12)
    whole = {**values(system, "partials", state), "B": B}
    for term in ("velocity_partials", "internal_partials"):
        whole |= values(system, term, state) if term in system.functions else {}
    iteration = values(system, "iteration", state) if "iteration" in system.functions else {}
    for block, numbers in iteration.items():
        np.testing.assert_array_equal(numbers, [whole[block][place] for place in system.patterns[block]])
        assert np.count_nonzero(whole[block]) <= len(numbers)


def test_energies_of_a_lagrangian_are_its_parts() -> None:
    """The part that vanishes at rest, minus the other one, and the power of all forces."""
    document, system = derived("tethered")
    state = state_of(document)
    kinetic, potential, power, _ = values(system, "energy", state)["energy"]
    x, y, s = state["q"]
    (vx, vy, vs), values_of = state["v"], dict(zip(document.parameters, document.values, strict=True))
    m, g, k = (values_of[name] for name in "mgk")
    assert kinetic == pytest.approx(0.5 * m * (vx**2 + (1 + x**2) * vy**2 + vs**2 + vx * vs / 3), rel=1e-13)
    assert potential == pytest.approx(m * g * y + 0.5 * k * s**2, rel=1e-13)
    assert power == pytest.approx((state["u"][0] + state["z"][0] * x - k * vy) * vx, rel=1e-13)


def test_symmetric_equations_are_solved() -> None:
    """Also of an indefinite matrix, and with zeros that elimination fills."""
    A = np.array([[4.0, 0.0, -1.0, 2.0], [0.0, -3.0, 0.5, 0.0], [-1.0, 0.5, 5.0, 0.0], [2.0, 0.0, 0.0, 1.5]])
    b, algebra = np.array([1.0, -2.0, 0.3, 0.7]), Algebra(Tape())
    entries = algebra.block("p", 20)
    matrix = [algebra.zero if x == 0.0 else item for x, item in zip(A.ravel(), entries, strict=False)]
    solution = [item.ref for item in solve_symmetric(matrix, entries[16:])]
    found = evaluate(algebra.tape, solution, {"p": np.concatenate([A.ravel(), b])})
    np.testing.assert_allclose(found, np.linalg.solve(A, b), rtol=1e-13)


def test_rows_that_follow_from_earlier_ones_are_left_out() -> None:
    """A row stays if it is independent in any of the states."""
    one = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [3.0, -1.0, 0.0], [0.0, 0.0, 0.0]])
    assert _independent(one[np.newaxis]) == [0, 2]
    other = one.copy()
    other[3, 2] = 1e-3
    assert _independent(np.array([one, other])) == [0, 2, 3]
    assert _independent(np.array([[[1.0, 1.0], [1.0, 1.0 + 1e-7]]])) == [0]
    assert _independent(np.array([[[1.0, 1.0], [1.0, 1.0 + 1e-5]]])) == [0, 1]


def test_a_singular_inertia_is_one_at_all_states() -> None:
    flat, round_ = np.array([[1.0, 1.0], [1.0, 1.0]]), np.array([[1.0, 0.9], [0.9, 1.0]])
    unequal = np.diag([1e-14, 1e14]) @ round_ @ np.diag([1e-14, 1e14])  # only its units
    nothing = np.full((2, 2), np.nan)
    cases = (([flat], True), ([round_], False), ([unequal], False), ([flat, round_], False), ([nothing], True),
             ([np.diag([1.0, 0.0])], True), ([nothing, round_], False))  # fmt: skip  # a table
    assert [is_singular(matrices) for matrices, _ in cases] == [singular for _, singular in cases]


X, Y = dynamicsymbols("x y")
BOTH = sympy.Piecewise(
    (X, (X > 0) & (Y > 0)), (Y, sympy.Or(X < -1, sympy.Ne(Y, X))), (2 * X, sympy.Eq(X, Y)), (7, True)
)
#: Expressions of every kind that the tape has, of x and y.
KINDS = [
    *(function(X) for function in (*expressions._FUNCTIONS, *expressions._REWRITTEN)),
    *(pair(X, Y) for pair in expressions._PAIRS),
    *(sympy.Piecewise((X, comparison(X, Y)), (-Y, True)) for comparison in expressions._COMPARISONS),
    *(sympy.Piecewise((1, condition(X, Y)), (0, True)) for condition in (sympy.Eq, sympy.Ne)),
    *(BOTH, sympy.Heaviside(X), sympy.Heaviside(X, 3), sympy.Min(X, Y, 0), sympy.Max(X, Y, 0), X - Y - 2, X * Y * 3),
    *(X**power for power in (1, 3, -2, sympy.Rational(1, 2), sympy.Rational(-3, 2), sympy.Rational(5, 2))),
    *(X**sympy.Rational(1, 3), X**-2.5, X**Y, 2**X, sympy.pi * X, sympy.E**X, sympy.UnevaluatedExpr(X) * 2),
]  # fmt: skip  # a table
POINTS = ((0.3, 0.7), (1.7, 0.4), (-0.6, 0.5), (0.5, 0.5), (-2.0, -2.0), (0.0, 1.2))


@pytest.mark.parametrize("expression", KINDS, ids=str)
def test_every_kind_of_expression_has_sympy_s_value(expression: Any) -> None:
    algebra = Algebra(Tape())
    record = Expressions(algebra, "kinds", dict(zip((X, Y), algebra.block("q", 2), strict=True)))
    ref = record(expression).ref
    compared = 0
    for x, y in POINTS:
        exact = expression.doit().subs({X: sympy.Float(x, 30), Y: sympy.Float(y, 30)}, simultaneous=True).evalf(20)
        if exact.is_real and exact.is_finite:
            with np.errstate(all="ignore"):
                found = evaluate(algebra.tape, [ref], {"q": np.array([x, y])})[0]
            assert found == pytest.approx(float(exact), rel=1e-13, abs=1e-15)
            compared += 1
    assert compared >= 1
