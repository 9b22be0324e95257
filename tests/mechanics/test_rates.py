"""Time derivatives of inverse dynamics and of the separated blocks along motions, against complex steps and printed
digits."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from eomgen.mechanics.derive import derive
from eomgen.mechanics.rates.jets import input_rates
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.rates import inverse_dynamics_rates, motion_jets
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import Tape
from tests.mechanics.test_beam_energy import loaded_chain, nearly_straight
from tests.mechanics.test_internal_states import scene as drone
from tests.oracles import robots
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.motions import along_motion, random_motions
from tests.oracles.random_scenes import random_scene, with_base, with_loads, with_mimics

TERMS = [
    "inverse_dynamics", "mass", "coupling", "force", "base_motion", "rates", "rates_1", "rates_4", "mass_rates",
    "coupling_rates", "force_rates", "base_motion_rates", "internal_rate",
]  # fmt: skip  # a table

#: tau, tau_dot and tau_ddot, a line for each.
PANDA_RATES = {
    ("centre of mass", 1.0): """
        3.780598310243 36.80468181363 -8.418587841962 -9.672100913986 -1.310497838996 1.575781394459 0.001708005214512
        -16.05295063809 82.39382039509 -0.8753839713758 -37.3137228401 -4.454685484365 -4.865959092932 0.1194247863216
        -189.4043656084 -180.8117736674 196.7450154361 -72.0367637562 22.90913154622 -42.77339274627 2.083854977088
    """,
    ("centre of mass", 2.5): """
        4.550037710675 -31.12910696705 2.41346536709 14.56063566405 -0.3863529012996 -0.217431385905 0.0343842387841
        4.332143978719 146.9680626816 37.18509871069 -25.95710932889 6.321305978972 -6.381726737966 -0.06988653893141
        -441.8219956376 576.387566532 91.48028769761 -194.4975636406 2.574543777901 2.129660911074 -2.287515331452
    """,
    ("frame origin", 1.0): """
        3.582881690252 36.50057893104 -8.45523955437 -9.61178384657 -1.306334762695 1.563660184138 0.007364582303892
        -16.2237978331 80.57235436733 -1.029313159933 -35.839799447 -4.178385273688 -4.507319908582 0.1136968664273
        -182.4033425208 -182.5799638904 193.4830024157 -67.1574011585 24.54083648496 -40.10940132449 1.728788736805
    """,
}


@pytest.mark.parametrize(("convention", "t"), PANDA_RATES)
def test_printed_digits_of_the_panda(convention: str, t: float) -> None:
    """Thirteen digits of three other routes; the tensors of the data read about the centre of mass or the frame's
    origin."""
    scene = robots.panda() if convention == "centre of mass" else robots.panda_of_origin_tensors()
    found = tape_evaluator(derive(scene, ["rates"]))("rates", robots.panda_state(t))
    digits = np.array([line.split() for line in PANDA_RATES[convention, t].split("\n")[1:-1]], float)
    for name, expected in zip(("tau", "tau_dot", "tau_ddot"), digits, strict=True):
        assert relative_error(found[name], expected) <= 1e-12, name


def scenes() -> dict[str, Scene]:
    made = {f"random {seed}": random_scene(seed, 5) for seed in range(2)}
    made |= {f"loaded {seed}": with_loads(random_scene(seed, 4), seed) for seed in (10, 11)}
    made |= {f"based {seed}": with_base(with_loads(random_scene(seed, 4), seed), seed) for seed in (20, 21)}
    made["translating"] = with_base(with_loads(random_scene(30, 3), 30), 30, turning=False)
    made["following"] = with_base(with_mimics(with_loads(random_scene(31, 6), 31), 31), 31)
    made |= {"states": drone(), "states, absolute": drone("absolute"), "elastic": loaded_chain(1)}
    return made


SCENES = scenes()


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_every_derivative_is_that_of_the_one_before(name: str, rng: np.random.Generator) -> None:
    system = derive(SCENES[name], TERMS)
    run = tape_evaluator(system)
    state = random_motions(system, run, 5, rng)
    state = nearly_straight(system, state) if name == "elastic" else state
    values = {term: run(term, state) for term in system.functions if term.split("_")[0] != "base" or "motion" in term}
    for order, term in ((2, "rates"), (1, "rates_1"), (4, "rates_4")):
        found = values[term]
        names = list(found)
        assert names == ["tau", "tau_dot", "tau_ddot", "tau_3", "tau_4"][: order + 1]
        assert relative_error(found["tau"], values["inverse_dynamics"]["tau"]) <= 1e-13
        rates = along_motion(system, run, term, state)
        for below, above in itertools.pairwise(names):
            assert relative_error(found[above], rates[below]) <= 1e-12, (term, above)
    for source, block in (("mass", "M"), ("coupling", "h"), ("force", "Q"), ("base_motion", "b")):
        if source not in system.functions:
            continue
        axes, found = 2 if block == "M" else 1, values[f"{source}_rates"]
        floor = 1e-3 if block == "M" else 0.0  # M of free bodies is constant
        first = along_motion(system, run, source, state)[block]
        second = along_motion(system, run, f"{source}_rates", state)[f"{block}_dot"]
        assert relative_error(found[f"{block}_dot"], first, axes, floor) <= 1e-12, block
        assert relative_error(found[f"{block}_ddot"], second, axes, floor) <= 1e-12, block


@pytest.mark.slow_cases("loaded 10", "based 20", "following", "states, absolute")
@pytest.mark.parametrize("name", [name for name in SCENES if name != "elastic"])
def test_recursion_against_jets_of_the_operations_of_tau(name: str, rng: np.random.Generator) -> None:
    """Both are exact; the one that needs fewer operations is kept, which without applied forces is the recursion."""
    derivation = Derivation(SCENES[name])
    (tau,) = derivation.inverse_dynamics()
    by_recursion, by_jets = inverse_dynamics_rates(derivation, 3), motion_jets(derivation).of(tau.refs, 3)
    tape, system = derivation.tape, derive(SCENES[name], ["rates_3", "internal_rate"])
    state = random_motions(system, tape_evaluator(system), 5, rng)
    for k in range(4):
        found, expected = (evaluate(tape, [path[k] for path in paths], state) for paths in (by_recursion, by_jets))
        assert relative_error(found, expected) <= 1e-13, k
    counts = [tape.counts([ref for path in paths for ref in path]).flops for paths in (by_recursion, by_jets)]
    if not any(derivation.loads.wrenches):
        assert counts[0] < 0.9 * counts[1]
    assert system.counts["rates_3"].flops == min(counts)


FREE = [name for name in SCENES if "absolute" not in name]


@pytest.mark.slow_cases("based 20", "based 21", "following", "random 1")
@pytest.mark.parametrize("name", [*FREE, "long chain"])
def test_forward_dynamics_along_its_own_motion(name: str, rng: np.random.Generator) -> None:
    """Jerk and its rate, against complex steps of vdot and of the jerk along the motion that vdot itself causes."""
    scene = SCENES[name] if name in SCENES else robots.planar_chain(40)
    system = derive(scene, ["forward_dynamics", "forward_rates", "forward_rates_1", "internal_rate"])
    run = tape_evaluator(system)
    state = random_motions(system, run, 3, rng)
    state = nearly_straight(system, state) if name == "elastic" else state
    state["a"] = run("forward_dynamics", state)["vdot"]
    found, first = run("forward_rates", state), run("forward_rates_1", state)
    assert list(found) == ["vdot", "vdot_dot", "vdot_ddot"] and list(first) == ["vdot", "vdot_dot"]
    stepped = along_motion(system, run, "forward_rates", state)
    reference = along_motion(system, run, "forward_dynamics", state)["vdot"]
    assert relative_error(found["vdot"], state["a"]) <= 1e-11
    assert relative_error(found["vdot_dot"], reference) <= 1e-10
    assert relative_error(first["vdot_dot"], reference) <= 1e-10
    assert relative_error(found["vdot_ddot"], stepped["vdot_dot"]) <= 1e-10
    assert {"a", "j", "s"}.isdisjoint(system.functions["forward_rates"].inputs)


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_rates_of_inputs_are_their_derivatives(order: int) -> None:
    """Of sin(3 t) and t^4, in as many blocks as the order has derivatives."""
    tape = Tape()
    t = Scalar(tape, tape.input("t"))
    blocks = input_rates(tape, [Scalar(tape, tape.call(Op.SIN, (t * 3.0).ref)), t * t * t * t], order)
    sizes = {"u_dot": (2,), "u_ddot": (2,), "u_higher": (order - 2, 2)}
    assert {block.name: block.shape for block in blocks} == dict([*sizes.items()][: min(order, 3)])
    values = [evaluate(tape, block.refs, {"t": np.array([0.7])}) for block in blocks]
    for k, (sine, power) in enumerate(np.concatenate(values).reshape(order, 2), 1):
        assert sine == pytest.approx(3.0**k * np.sin(2.1 + 0.5 * np.pi * k), rel=1e-13)
        assert power == pytest.approx(math.perm(4, k) * 0.7 ** (4 - k) if k <= 4 else 0.0, rel=1e-13)
