"""Second derivatives of the equations and outputs against complex steps of the first ones, term by term."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.mechanics.test_parameter_partials import machine, prescribed, state_of
from tests.models.cosserat import beam_scene
from tests.oracles.evaluation import Array, Evaluate, relative_error, tape_evaluator
from tests.oracles.random_scenes import point_outputs, random_scene, with_loads
from tests.oracles.states import STEP

TERMS = (
    *("partials", "internal_rate", "internal_partials", "constraint_jacobian", "velocity_partials"),
    *("acceleration_partials", "outputs"),
    *("output_partials", "parameter_partials", "output_parameter_partials", "linearization", "second_partials"),
)


def gradient(
    system: System, evaluate: Evaluate, state: dict[str, Array], weights: Array, driven: Array, given: Sequence[bool]
) -> Array:
    """Return the gradient of the weighted equations and outputs, (STATES, components), from their first partials.

    ``driven``: changes of the inputs beside those that their laws give; ``given``: which have such laws.
    """
    at = prescribed(system, evaluate, state)
    if driven.size:
        at["u"] = at["u"] + driven
    found = {
        name: array for term in TERMS[:-1] if term in system.functions for name, array in evaluate(term, at).items()
    }
    nv, nz, nh, nl = system.nv, system.nz, system.holonomic, len(system.multipliers)
    r, z, phi, w, wdot, y = np.split(weights, np.cumsum([nv, nz, nh, nl, nl]), axis=1)
    sizes = {"q": nv, "v": nv, "a": nv, "z": nz, "lam": nl, "p": len(system.parameters), "u": system.nu}
    B = found.get("B", np.zeros((len(weights), 0, nv)))
    parts: dict[str, list[tuple[Array, Array]]] = {
        "q": [(r, found["K"]), (phi, B[:, :nh])],
        "v": [(r, found["C"]), (w, B)],
        "a": [(r, found["M"]), (wdot, B)],
        "z": [],
        "lam": [(r, np.swapaxes(B, 1, 2))],
        "p": [],
        "u": [],
    }
    later = {"q": (z, "Fq"), "v": (z, "Fv"), "z": (r, "Rz")}
    for block, (weight, name) in later.items():
        parts[block] += [(weight, found[name])] if name in found else []
    parts["z"] += [(z, found["Fz"])] if "Fz" in found else []
    if nl:
        parts["q"] += [(w, found["Z"]), (wdot, found["Aq"])]
        parts["v"] += [(wdot, found["Av"])]
    of_parameters = (("Rp", r), ("Fp", z), ("Phip", phi), ("Zp", w), ("Ap", wdot), ("Yp", y))
    parts["p"] += [(weight, found[name]) for name, weight in of_parameters if name in found]
    for weight, sign, names in ((r, -1.0, ("B0", "E0")), (z, 1.0, ("Fu", "Fw")), (y, 1.0, ("Yu", "Yw"))):
        matrix = np.zeros((len(weights), weight.shape[1], system.nu), dtype=complex)
        for name, places in zip(
            names, (np.flatnonzero(~np.array(given, dtype=bool)), np.flatnonzero(given)), strict=True
        ):
            if name in found and len(places):
                matrix[:, :, places] = sign * found[name][..., : len(places)]
        parts["u"].append((weight, matrix))
    for block in set(parts) - {"u"}:
        parts[block] += [(y, found[f"Y{block}"])] if block != "p" and f"Y{block}" in found else []
    columns = []
    for block, size in sizes.items():
        total = np.zeros((len(weights), size), dtype=complex)
        for weight, matrix in parts[block]:
            total = total + np.einsum("sr,src->sc", weight, matrix)
        columns.append(total)
    return np.concatenate(columns, axis=1)


def check(scene: Scene, rng: np.random.Generator, tolerance: float = 1e-12) -> Array:
    """Hold the term to complex steps of the gradient along random directions."""
    system = derive(scene, [*TERMS])
    evaluate = tape_evaluator(system)
    state = state_of(system, evaluate, rng)
    count = len(state["q"])
    weights = rng.normal(size=(count, system.second_sizes["weights"]))
    d = rng.normal(size=(count, system.second_sizes["direction"]))
    nv, nz, nl, np_ = system.nv, system.nz, len(system.multipliers), len(system.parameters)
    names, ends = ("q", "v", "a", "z", "lam", "p", "u"), np.cumsum([nv, nv, nv, nz, nl, np_])
    parts = dict(zip(names, np.split(d, ends, axis=1), strict=True))
    moved = {name: array.astype(complex) for name, array in state.items()}
    turning = sum(factor.q_size for factor in system.factors)
    moved["q"][:, :turning] = product.update(system.factors, moved["q"][:, :turning], 1j * STEP * parts["q"])
    for name in ("v", "a", "z", "lam", "p"):
        if parts[name].size:
            moved[name] = state[name] + 1j * STEP * parts[name]
    expected = (
        gradient(system, evaluate, moved, weights, 1j * STEP * parts["u"], [item.given for item in scene.inputs]).imag
        / STEP
    )
    at = prescribed(system, evaluate, state)
    found = evaluate("second_partials", {**at, "weights": weights, "direction": d})["Hd"]
    found = np.broadcast_to(found, expected.shape)
    assert relative_error(found, expected) <= tolerance
    return np.abs(found).max(axis=0)


@pytest.mark.slow_except("tree-absolute")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("looped", [False, True], ids=["tree", "loop"])
def test_a_machine_with_a_controller_a_road_and_a_moving_base(
    coordinates: str, looped: bool, rng: np.random.Generator
) -> None:
    found = check(machine(coordinates, looped=looped), rng)
    parameters, inputs = found[-13:-3], found[-2:]
    assert np.all(parameters > 1e-5) and np.all(inputs > 1e-5)  # each curves some equation


@pytest.mark.slow_except("0")
@pytest.mark.parametrize("seed", range(4))
def test_random_trees(seed: int, rng: np.random.Generator) -> None:
    check(point_outputs(with_loads(random_scene(seed, 2 + seed % 4, tunable=0.5), seed)), rng)


@pytest.mark.slow
def test_a_geometrically_exact_beam(rng: np.random.Generator) -> None:
    """Elements are a loop, so both sweeps go through it."""
    data: dict[str, Any] = beam_scene(4, {"force": ["load", "2 * load", 0.0]}, {"stiffness_damping": "0.1 * lag"})
    data["parameters"]["lag"] = {"value": 0.02, "tunable": True}
    check(eomgen.load(data), rng)
