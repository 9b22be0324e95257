"""Chains of steps, evaluated on the tape: ends are those of other programs of the methods, patterns of derivatives
hold the nonzeros of complex steps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.codegen.convert import to_program
from eomgen.integrators.families.register import method_named
from eomgen.lie import numeric, product
from eomgen.lie.groups import group_named
from eomgen.products.optimisers.acados_code import implicit
from eomgen.products.optimisers.casadi_code import CASADI, exported_functions
from eomgen.products.optimisers.discrete_steps import StepChain, chain_of
from eomgen.products.optimisers.functions import Equations, rates
from tests.optimisers.test_patterns import whole
from tests.optimisers.test_steps import skating
from tests.oracles.complex_runs import ComplexRun
from tests.oracles.evaluation import tape_evaluator

STEP, TINY = 0.01, 1e-30


def swung() -> Any:
    """Return a cart with a pendulum whose torque a filter follows, with a parameter and an input."""
    builder = eomgen.SceneBuilder("swung_chain").parameter("pull", 2.0, tunable=True).input("torque", "0.5")
    builder.body("cart", 1.5).body("bob", 0.5, center_of_mass=[0.2, 0, -0.4], inertia=[0.01, 0.02, 0.03])
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0])
    builder.joint("hinge", "revolute", "cart", "bob", axis=[0, 1, 0]).state("lag", "3*(torque - lag)*cos(t)")
    builder.effort("motor", "hinge", "lag - pull*sin(q.hinge)*v.hinge")
    return builder.effort("spring", "rail", "-9*q.rail**3").build()


def turned(*, held: bool = False) -> Any:
    """Return a body on a ball joint with drag; held: with a rod of fixed length from its tip."""
    builder = eomgen.SceneBuilder("turned_chain").parameter("pull", 2.0, tunable=True)
    builder.body("dish", 1.0, center_of_mass=[0.0, 0.1, -0.4], inertia=[0.02, 0.03, 0.01])
    builder.joint("ball", "spherical", "base", "dish").effort("drag", "ball", "-pull*v.ball[1]**3", index=1)
    if held:
        tip = {"body": "dish", "position": [0.3, 0.1, 0.1]}
        builder.constraint("rod", "distance", {"body": "base", "position": [0.5, 0.0, 0.3]}, tip)
        builder.state("lag", "4*(v.ball[1] - lag)").effort("late", "ball", "lag*cos(t)", index=0)
    return builder.build()


def springs() -> Any:
    """Return two masses on springs, the second with a force of time."""
    builder = eomgen.SceneBuilder("springs_chain", gravity=[0.0, 0.0, -9.81]).parameter("k", 40.0, tunable=True)
    for number, parent in enumerate(("base", "mass_0")):
        builder.body(f"mass_{number}", 1.0 + number)
        builder.joint(f"slide_{number}", "prismatic", parent, f"mass_{number}", axis=[0, 0, 1])
        builder.effort(f"spring_{number}", f"slide_{number}", f"-k*q.slide_{number} - 300*q.slide_{number}**3")
    return builder.effort("shaken", "slide_1", "sin(4*t)").build()


def plane() -> Any:
    """Return a mass on two slides and on a rod."""
    builder = eomgen.SceneBuilder("plane_chain", gravity=[0, -9.81, 0]).parameter("drag", 0.3, tunable=True)
    builder.body("cart", 0.2).body("mass", 1.3).joint("x", "prismatic", "base", "cart", axis=[1, 0, 0])
    builder.joint("y", "prismatic", "cart", "mass", axis=[0, 1, 0], initial={"position": 0.8})
    ends = {"body": "mass", "position": [0, 0, 0]}, {"body": "base", "position": [0, 0, 0]}
    return builder.constraint("rod", "distance", *ends, length=0.8).effort("air", "y", "-drag*v.y").build()


SCENES = {
    **{"swung": swung, "turned": turned, "held": lambda: turned(held=True)},
    **{"springs": springs, "sled": lambda: skating(push="0.5"), "plane": plane},
}


@cache
def parts_of(name: str) -> tuple[Any, Any, Any]:
    """Return system, program, and functions with derivatives of a scene."""
    terms = list(CASADI.terms(None) or ())
    system = eomgen.derive(SCENES[name](), [term for term in terms if not term.startswith(("outputs", "frame_poses"))])
    program = to_program(system, functions=list(system.functions))
    return system, program, exported_functions(program)


@cache
def evaluator(name: str) -> Any:
    return tape_evaluator(parts_of(name)[0])


def chain(name: str, method: str) -> StepChain:
    _, program, functions = parts_of(name)
    made = chain_of(program, functions, method, ("u", "p", "t", "h"))
    assert made is not None
    return made


def unit(factors: Any, q: Array) -> Array:
    """Return q with unit quaternions."""
    result = q.copy()
    for factor in (factor for factor in factors if factor.group != "R"):
        p = q[..., factor.q_start : factor.q_start + 4]
        result[..., factor.q_start : factor.q_start + 4] = p / np.sqrt(np.sum(p * p, axis=-1, keepdims=True))
    return result


def of_group(name: str, first: Array, second: Array) -> Array:
    """Return a function of rotations or poses."""
    kind, _, group = name.rpartition("_")
    of = group_named(group.upper())
    if kind == "update":
        factor = product.Factor(group.upper(), "x", 0, first.shape[-1], 0, second.shape[-1])
        return product.update([factor], unit([factor], first), second)
    matrix = numeric.tangent_inverse(of, first) if kind == "cotangent" else numeric.bracket_matrix(of, first)
    if kind == "cotangent":
        return (np.swapaxes(matrix, -1, -2) @ second[..., None])[..., 0]
    once = matrix @ second[..., None]
    return second + (0.5 * once + matrix @ once / 12.0)[..., 0]


def values(made: StepChain, name: str, given: Mapping[str, Array]) -> Array:
    """Return all values of a chain (n, count) for arguments and unknowns (n, size) by name."""
    (system, *_), evaluate, count = parts_of(name), evaluator(name), len(given["x"])
    W = np.zeros((count, made.count), complex)
    W[:, made.one.place] = 1.0
    for slot_name, slot in (made.values | made.unknowns).items():
        W[:, slot.place : slot.place + slot.size] = given[slot_name]
    for node in made.nodes:
        place = slice(node.result.place, node.result.place + node.result.size)
        taken = [W[:, slot.place : slot.place + slot.size] for slot in node.arguments]
        if node.function < 0:
            W[:, place] = sum(
                term.factor * given["h"] ** term.power * W[:, term.value.place : term.value.place + term.value.size]
                for term in node.terms
            )
        elif (function := made.functions[node.function]).group is not None:
            W[:, place] = of_group(function.name, *taken)
        else:
            blocks = dict(zip(function.exported.sizes, taken, strict=True))
            if "q" in blocks:
                blocks["q"] = unit(system.factors, blocks["q"])
            parts = evaluate(function.name, blocks).values()
            W[:, place] = np.concatenate([np.reshape(part, (count, -1)) for part in parts], axis=1)
    return W


def solved(made: StepChain, name: str, given: dict[str, Array]) -> Array:
    """Return the values of a chain whose equations are solved by Newton's iteration from the guesses, in complex
    numbers with the Jacobian of the real part."""
    if not made.nu:
        return values(made, name, given)
    sizes = [slot.size for slot in made.unknowns.values()]
    count, guess = len(given["x"]), np.zeros((1, made.nu), complex)
    arguments = np.zeros((count, made.count), complex)
    for slot_name, slot in made.values.items():
        arguments[:, slot.place : slot.place + slot.size] = given[slot_name]
    unknown = np.repeat(guess, count, axis=0)
    for slot, source in made.guesses:
        place = slot.place - made.ny
        unknown[:, place : place + slot.size] = arguments[:, source.place : source.place + source.size]

    def off(unknown: Array, given: Mapping[str, Array]) -> Array:
        blocks = dict(zip(made.unknowns, np.split(unknown, np.cumsum(sizes)[:-1], axis=1), strict=True))
        return values(made, name, {**given, **blocks})

    real = {block: np.repeat(part[:1].real, made.nu, axis=0).astype(complex) for block, part in given.items()}
    for _ in range(6):
        at = np.repeat(unknown[:1].real, made.nu, axis=0) + 1j * TINY * np.eye(made.nu)
        matrix = off(at, real)[:, made.residuals].imag.T / TINY
        unknown = unknown - np.linalg.solve(matrix, off(unknown, given)[:, made.residuals].T).T
    result = off(unknown, given)
    assert np.max(np.abs(result[:, made.residuals].real)) < 1e-12
    return result


def end_of(made: StepChain, W: Array) -> Array:
    return W[:, made.end.place : made.end.place + made.nx]


def start_of(name: str, rng: np.random.Generator) -> dict[str, Array]:
    """Return arguments of a step from a random state, which meets the constraints."""
    system, program, _ = parts_of(name)
    q = product.update(system.factors, np.array(system.initial_q), 0.3 * rng.normal(size=system.nv))
    v, z = rng.normal(size=system.nv), rng.normal(size=system.nz)
    p = np.array([[item.value * 1.2 for item in system.parameters]])
    if system.multipliers:
        run = oracle(name, "generalized_alpha", p)
        for _ in range(3):
            q, v = (part[0].real for part in run._on_constraints(q[None], v[None], z[None]))
    given = {"x": np.concatenate([q, v, z])[None], "u": rng.normal(size=(1, program.sizes["u"])), "p": p}
    return {**given, "t": np.zeros((1, 1)), "h": np.full((1, 1), STEP)}


def oracle(name: str, method: str, p: Array) -> ComplexRun:
    run = ComplexRun(SCENES[name](), method_named(method), STEP)
    run.p = p.astype(complex)
    return run


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("turned", "generalized_alpha"),
        ("held", "generalized_alpha"),
        ("sled", "trapezoidal"),
        ("springs", "hht"),
        ("swung", "generalized_alpha"),
    ],
)
def test_steps_of_generalized_alpha_end_as_a_run_in_complex_numbers(
    name: str, method: str, rng: np.random.Generator
) -> None:
    given = start_of(name, rng)
    given["u"][:] = 0.5  # of the scene's formula
    system, run = parts_of(name)[0], oracle(name, method, given["p"])
    rows: list[Array] = []
    run._outputs = lambda t, q, v, z, *_: rows.append(np.concatenate([q, v, z], axis=-1)) or rows[-1]  # type: ignore[method-assign,func-returns-value]
    q, v, z = np.split(given["x"], [system.nq, system.nq + system.nv], axis=1)
    run.outputs(1, q, v, z, given["p"])
    made = chain(name, method)
    np.testing.assert_allclose(end_of(made, solved(made, name, given)), rows[1], rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize(
    ("name", "method", "order"),
    [("turned", "rk4", 4), ("springs", "leapfrog", 2), ("springs", "yoshida4", 4), ("held", "rattlie", 2),
     ("swung", "trapezoidal", 2)],
)  # fmt: skip
def test_two_halves_of_a_step_differ_by_the_order(name: str, method: str, order: int, rng: np.random.Generator) -> None:
    """Errors of one step are of the order h^(order + 1), from another method at least h^3; steps of symmetric methods
    return."""
    given, made = start_of(name, rng), chain(name, method)
    beside = chain(name, "generalized_alpha" if name == "held" else "rk4" if name == "swung" else "trapezoidal")

    def step(x: Array, t: float, h: float, made: StepChain = made) -> Array:
        at = {**given, "x": x, "t": np.full((1, 1), t), "h": np.full((1, 1), h)}
        return end_of(made, solved(made, name, at)).real

    apart = [np.max(np.abs(step(given["x"], 0.3, h) - step(given["x"], 0.3, h, beside))) for h in (STEP, STEP / 2.0)]
    assert np.log2(apart[0] / apart[1]) > 2.5

    errors = []
    for h in (STEP, STEP / 2.0):
        half = step(given["x"], 0.3, h / 2.0)
        errors.append(np.max(np.abs(step(half, 0.3 + h / 2.0, h / 2.0) - step(given["x"], 0.3, h))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1.0, abs=0.5)
    if method in ("leapfrog", "yoshida4", "rattlie"):
        back = step(step(given["x"], 0.3, STEP), 0.3 + STEP, -STEP)
        np.testing.assert_allclose(back, given["x"], atol=1e-11)


@pytest.mark.parametrize(
    ("name", "method"), [("springs", "leapfrog"), ("swung", "rk4"), ("plane", "rattlie"), ("springs", "newmark")]
)
def test_patterns_of_steps_hold_all_nonzeros(name: str, method: str, rng: np.random.Generator) -> None:
    """Of complex steps, and of their differences; all entries are nonzero at some states without constraints."""
    made = chain(name, method)
    exported, places = made.export(), [(block, k) for block, size in made.sizes.items() for k in range(size)]
    first, second = np.zeros((made.nx, made.ny), bool), np.zeros((made.ny, made.ny), bool)
    for _ in range(2 if made.nu else 4):
        given, weights = start_of(name, rng), rng.normal(size=made.nx)
        given["t"][:], given["h"][:] = 0.3, 0.1

        def gradients(h: float, given: dict[str, Array] = given, made: StepChain = made) -> Array:
            rows = []
            for block, k in places:
                at = {other: np.repeat(part, made.ny, axis=0).astype(complex) for other, part in given.items()}
                at[block][:, k] += h
                for row, (moved, place) in enumerate(places):
                    at[moved][row, place] += 1j * TINY
                rows.append(end_of(made, solved(made, name, at)).imag / TINY)
            return np.stack(rows)

        jacobian = gradients(0.0)[0].T
        first |= np.abs(jacobian) > 1e-13
        hessian = (gradients(1e-3) - gradients(-1e-3)) @ weights / 2e-3
        second |= np.abs(hessian) > 1e-7 * np.max(np.abs(hessian))
    known = whole(exported.jacobian, np.ones(made.nx * made.ny)) != 0.0
    bent = whole(exported.hessian, np.ones(made.ny**2)) != 0.0
    assert not np.any(first & ~known) and not np.any(second & ~bent)
    if name == "springs":
        np.testing.assert_array_equal(first, known)
        np.testing.assert_array_equal(second, bent)
    assert exported.first == made.nx * made.ny and exported.work == made.first["work"]


def numbers_of(equations: Equations, name: str, blocks: Mapping[str, Array], ending: str) -> Array:
    """Return the numbers of the parts of equations, one after another, from the tape; of rotations by complex steps."""
    system, evaluate, result = parts_of(name)[0], evaluator(name), []
    for part in equations.parts:
        assert part.group is None  # scenes without rotations
        found = evaluate(f"{part.function.name}{ending}", blocks)
        result.append(part.sign * np.concatenate([np.ravel(x) for x in found.values()]))
    assert system.factors
    return np.concatenate(result)


@pytest.mark.parametrize("kind", ["explicit", "implicit"])
def test_equations_have_the_derivatives_of_complex_steps(kind: str, rng: np.random.Generator) -> None:
    """Of rates x = (q, v, z), and of 0 = (qdot - v, tau, zdot - rates) in (x, xdot, u)."""
    name = "swung"
    _, program, functions = parts_of(name)
    made = rates(program, functions) if kind == "explicit" else implicit(program, functions)
    assert made is not None and made.takes_time and not made.groups
    given = start_of(name, rng)
    sizes, evaluate = [5, 5, 1] if kind == "implicit" else [5, 1], evaluator(name)
    assert list(made.sizes.values()) == ([5, 5, 0, 1] if kind == "implicit" else [5, 1])
    y = np.concatenate([given["x"][0], *([rng.normal(size=5)] if kind == "implicit" else []), given["u"][0]])

    def blocks_of(y: Array) -> dict[str, Array]:
        x, *others = np.split(y, np.cumsum(sizes)[:-1], axis=1)
        q, v, z = np.split(x, [2, 4], axis=1)
        a = others[0][:, 2:4] if kind == "implicit" else np.zeros_like(v)
        many = {block: np.repeat(given[block], len(y), axis=0) for block in ("p", "t")}
        return {**many, "q": q, "v": v, "z": z, "a": a, "u": others[-1]}

    def equations(y: Array) -> Array:
        blocks = blocks_of(y)
        rate = evaluate("internal_rate", blocks)["zdot"]
        if kind == "explicit":
            return np.concatenate([blocks["v"], evaluate("forward_dynamics", blocks)["vdot"], rate], axis=1)
        xdot = y[:, 5:10]
        tau = evaluate("inverse_dynamics", blocks)["tau"]
        return np.concatenate([xdot[:, :2] - blocks["v"], tau, xdot[:, 4:] - rate], axis=1)

    size, weights = len(y), rng.normal(size=made.height)

    def jacobian(y: Array) -> Array:
        return equations(y + 1j * TINY * np.eye(size)).imag.T / TINY

    at = {block: part[0] for block, part in blocks_of(y[None]).items()}
    numbers = np.concatenate([numbers_of(made, name, at, "_derivatives"), [1.0, -1.0]])
    signs = np.concatenate([np.full(part.function.first, part.sign) for part in made.parts] + [np.ones(2)])
    assert made.count == len(numbers) - 2
    np.testing.assert_allclose(whole(made.jacobian, numbers), jacobian(y), rtol=1e-12, atol=1e-13)
    assert np.all(np.abs(signs) == 1.0)
    x_block, u_block = whole(made.block("x"), numbers), whole(made.block("u"), numbers)
    np.testing.assert_allclose(np.concatenate([x_block, u_block], 1), jacobian(y)[:, [*range(5), size - 1]], rtol=1e-12)
    parts = []
    for part in made.parts:
        of_part = weights[part.row : part.row + part.size]
        wanted = dict.fromkeys(["weights"], of_part)
        found = evaluate(f"{part.function.name}_hessian", {**at, **wanted})
        parts.append(part.sign * np.concatenate([np.ravel(x) for x in found.values()]))
    h = 1e-3
    expected = np.stack([(weights @ (jacobian(y + h * e) - jacobian(y - h * e))) / (2.0 * h) for e in np.eye(size)])
    np.testing.assert_allclose(whole(made.lower, np.concatenate(parts)), np.tril(expected), atol=3e-5)
