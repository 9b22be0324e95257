"""Terms of equations from SymPy against one another by complex steps, and expressions against SymPy's own values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy
from sympy.physics import mechanics as me
from sympy.physics.biomechanics import MusculotendonFormulation, TendonForceLengthDeGroote2016
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from eomgen.products.sympy_mechanics import expressions
from eomgen.products.sympy_mechanics.equations import _PARTIALS, _TERMS, solve_symmetric
from eomgen.products.sympy_mechanics.expressions import Expressions
from eomgen.products.sympy_mechanics.reading import _solved
from eomgen.products.sympy_mechanics.rows import _independent, is_singular
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from tests.sympy_mechanics.test_from_sympy import muscle, rocket, sleigh

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
    sizes = {"q": n, "v": n, "a": n, "lam": len(document.rows.names), "z": len(document.states)}
    sizes |= {"u": len(document.inputs), "t": 1}
    return {block: random.uniform(0.3, 1.1, size) for block, size in sizes.items()} | {
        "p": np.array([*document.parameters.values()])
    }


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

    assert system.dof_parent == tuple(k - 1 for k in range(n))  # all of M may be filled
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
    (vx, vy, vs), values_of = state["v"], document.parameters
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
    TendonForceLengthDeGroote2016.with_defaults(X),
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


def test_unknowns_are_solved_from_equations_in_any_order() -> None:
    """With pivots that are zero in the order of the rows, and a row more than unknowns, whose residual is left."""
    A = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 3.0], [0.5, 1.0, 1.0], [0.7, 3.0, 4.0]])
    algebra, x = Algebra(Tape()), np.array([0.3, -0.8, 1.1])
    entries = algebra.block("p", 16)
    rows = [[algebra.zero if A[i, j] == 0.0 else entries[3 * i + j] for j in range(3)] for i in range(4)]
    solution, residuals = _solved(algebra, rows, entries[12:], "rows")
    refs = [item.ref for item in (*solution, *residuals)]
    for wrong in (0.0, 0.25):
        b = A @ x + [0.0, 0.0, 0.0, wrong]
        found = evaluate(algebra.tape, refs, {"p": np.concatenate([A.ravel(), b])})
        # the residual is zero if all rows agree; elimination chooses which of the rows it is of
        if wrong:
            assert abs(found[3]) > 0.01
        else:
            np.testing.assert_allclose(found, [*x, 0.0], atol=1e-13)
    with pytest.raises(eomgen.DescriptionError, match="do not determine the speeds"):
        _solved(algebra, [[entries[0], algebra.zero], [entries[1], algebra.zero]], entries[:2], "rows")


def test_contents_tell_equations_apart() -> None:
    """By values and by the tape; two readings of one system are alike."""
    contents = [SYSTEMS["sleigh"]().content for _ in range(2)]
    assert contents[0] == contents[1] != derived("rocket")[0].content
    assert eomgen.from_sympy(sleigh(), parameters={"m": 2.0, "I": 0.3, "a": 0.4, "c": 0.6}).content != contents[0]


def test_rows_have_the_sizes_of_their_summands_and_their_change_per_radian() -> None:
    """Of a row without angles the change is 1; of rates it is the sum of slopes in angles."""
    q, x = dynamicsymbols("q x")
    m, k, L = sympy.symbols("m k L")
    lagrangian = m * (q.diff(T) ** 2 + x.diff(T) ** 2) / 2
    place, rate = x - L * sympy.sin(q) - k, x.diff(T) - 3 * sympy.cos(q) * q.diff(T)
    method = me.LagrangesMethod(lagrangian, [q, x], hol_coneqs=[place], nonhol_coneqs=[rate])
    document = eomgen.from_sympy(method, parameters={m: 1.0, k: 0.2, L: 0.5}, initial={q: 0.1})
    system = eomgen.derive(document, ["constraint_size"])
    found = values(
        system,
        "constraint_size",
        {"q": np.array([-0.4, 0.7]), "p": np.array([*document.parameters.values()]), "t": [0.0]},
    )
    slope = 0.5 * np.cos(0.4)
    size = 0.7 + 0.5 * np.sin(0.4) + 0.2 + slope * 0.4 + 0.7
    np.testing.assert_allclose(found["size"], [size, 3.0 * np.cos(0.4)], rtol=1e-14)
    np.testing.assert_allclose(found["extent"], [slope, 3.0 * np.cos(0.4)], rtol=1e-14)


def test_energies_powers_and_drawings_of_joints_and_springs() -> None:
    """A block on a rail with a hanging bob: by hand."""
    ground, block, bob = me.RigidBody("ground"), me.RigidBody("block", mass=2), me.RigidBody("bob", mass=0.5)
    system = me.System.from_newtonian(ground)
    length, d, r, k, j, c, b, g = sympy.symbols("l d r k j c b g")
    slide = me.PrismaticJoint("slide", ground, block, joint_axis=ground.x)
    pin = me.PinJoint("pin", block, bob, joint_axis=block.z, child_point=length * bob.y)
    system.add_joints(slide, pin)
    system.apply_uniform_gravity(-g * ground.y)
    hook = ground.masscenter.locatenew("hook", -d * ground.x)
    path = me.LinearPathway(hook, block.masscenter)
    idle = me.LinearPathway(hook, block.masscenter.locatenew("eye", d * block.y))
    system.add_actuators(
        me.LinearSpring(k, path, r), me.DuffingSpring(k, j, path, r), me.LinearDamper(c, path),
        me.TorqueActuator(-b * pin.speeds[0], block.z, bob, block), me.LinearSpring(0, idle, r),
    )  # fmt: skip  # one call
    numbers = {length: 0.4, d: 0.3, r: 0.25, k: 30.0, j: 7.0, c: 0.6, b: 0.2, g: 9.81, "bob_izz": 0.02}
    document = eomgen.from_sympy(system, parameters=numbers, name="block")
    derived = eomgen.derive(document, ["energy", "poses", "twists"])
    (x, q), (vx, w) = (0.35, 0.7), (0.8, -1.3)
    state = {
        "q": np.array([x, q]),
        "v": np.array([vx, w]),
        "a": np.zeros(2),
        "t": [0.0],
        "p": np.array([*document.parameters.values()]),
    }
    found = {block: value for term in derived.functions for block, value in values(derived, term, state).items()}
    speed = np.array([vx + 0.4 * np.cos(q) * w, 0.4 * np.sin(q) * w])
    stretch = x + 0.3 - 0.25
    kinetic = 0.5 * (2.0 * vx**2 + 0.5 * speed @ speed + 0.02 * w**2)
    potential = -0.5 * 9.81 * 0.4 * np.cos(q) + 30.0 * stretch**2 + 7.0 * stretch**4 / 4
    np.testing.assert_allclose(found["energy"], [kinetic, potential, -0.6 * vx**2 - 0.2 * w**2, 0.0], rtol=1e-13)
    pose = [np.cos(q / 2), 0.0, 0.0, np.sin(q / 2), x + 0.4 * np.sin(q), -0.4 * np.cos(q), 0.0]
    np.testing.assert_allclose(found["pose"][1], pose, atol=1e-15)
    turned = np.array([[np.cos(q), np.sin(q)], [-np.sin(q), np.cos(q)]]) @ speed
    np.testing.assert_allclose(found["twist"][1], [0.0, 0.0, w, *turned, 0.0], atol=1e-15)
    assert not derived.facts.conservative
    drawing = document.observed.drawing
    hinges = [
        (hinge.name, hinge.type, hinge.parent, hinge.child, hinge.turns, hinge.slides) for hinge in drawing.hinges
    ]
    assert hinges == [
        ("slide", "prismatic", "base", "block", False, True),
        ("pin", "revolute", "block", "bob", True, False),
    ]
    assert [line.elastic for line in drawing.lines] == [True, True, False, True]
    ends = [(line.first, line.second) for line in drawing.lines]
    assert ends == [*[("hook", "block_masscenter")] * 3, ("hook", "eye")]
    places = {point.name: (point.body, [part.value for part in point.position]) for point in drawing.points}
    assert places == {
        "hook": ("base", [-0.3, 0.0, 0.0]),
        "block_masscenter": ("block", [0.0, 0.0, 0.0]),
        "eye": ("block", [0.0, 0.3, 0.0]),
    }
    assert [(solid.name, solid.mass.value) for solid in drawing.solids] == [("block", 2.0), ("bob", 0.5)]


def test_activations_of_muscles_have_sympy_s_rates() -> None:
    system, biceps, numbers, start = muscle(MusculotendonFormulation.RIGID_TENDON)
    document = eomgen.from_sympy(system, parameters=numbers, initial=start, name="arm")
    assert document.states == {"a_biceps": 0.6}
    state = {"q": [0.3], "v": [0.2], "z": [0.6], "u": [0.4], "t": [0.0], "p": np.array([*document.parameters.values()])}
    (found,) = values(eomgen.derive(document, ["internal_rate"]), "internal_rate", state).values()
    known = {biceps.x[0]: 0.6, biceps.r[0]: 0.4}
    assert found == pytest.approx([float(biceps.rhs()[0].subs(known))], rel=1e-13)
