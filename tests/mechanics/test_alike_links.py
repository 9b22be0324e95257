"""Long chains whose axes and inertias differ in zeros and signs: one text for all links, with the numbers of
Pinocchio and of the text that is written link by link."""

from __future__ import annotations

import functools
import random

import numpy as np
import pytest

import eomgen
from eomgen.codegen.convert import to_program
from eomgen.mechanics import scene_tape
from eomgen.mechanics.derive import derive
from eomgen.mechanics.tree import alike, links
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import GENERIC, ONE, ZERO, Tape
from eomgen.system.system import System
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import oracle_of_tree
from tests.oracles.states import random_states

AXES = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1])


def chain(kind: str, links: int) -> eomgen.Scene:
    """Return a chain of rods on hinges about axes in no order: coordinate axes of both senses, or any."""
    source = random.Random(3)
    builder = eomgen.SceneBuilder("chain")
    for k in range(links):
        axis = source.choice(AXES) if kind == "mixed" else [source.uniform(-1, 1) for _ in range(3)]
        builder.body(f"rod{k}", 1.0 + k % 2, center_of_mass=[0.25, 0, 0.01 * k], inertia=[0.0005, 0.02, 0.02])
        position = [0.5 if k else 0.0, 0, 0]
        builder.joint(f"joint{k}", "revolute", f"rod{k - 1}" if k else "base", f"rod{k}", axis=axis, position=position)
    return builder.simulation(step=1e-3, duration=0.5).build()


@functools.cache
def system_of(kind: str, links: int, *terms: str) -> System:
    return derive(chain(kind, links), terms)


def generics(tape: Tape) -> int:
    """Return the number of generic constants."""
    return sum(tape.op[node] is Op.CONST and tape.b[node] == GENERIC for node in range(1, len(tape.op)))


def statements(kind: str, links: int, name: str) -> int:
    parts = to_program(system_of(kind, links, name), functions=[name]).function(name).parts
    return sum(
        len(part.statements) + sum(len(s.data[1]) for s in part.statements if s.kind == "repeat") for part in parts
    )


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), [("mixed", "inverse_dynamics"), ("any", "iteration")])
def test_the_text_does_not_grow_with_links_of_any_axes(kind: str, name: str) -> None:
    short, long = statements(kind, 70, name), statements(kind, 100, name)
    assert long <= short + 3 * 30  # some outputs are still stored one by one
    assert long <= 2000


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["mixed", "any"])
def test_inverse_and_forward_dynamics_are_those_of_pinocchio(kind: str, rng: np.random.Generator) -> None:
    scene, system = chain(kind, 70), system_of(kind, 70, "inverse_dynamics", "forward_dynamics")
    assert generics(system.tape) > 500
    oracle, evaluate = oracle_of_tree(scene), tape_evaluator(system)
    state = random_states(system, 2, rng)
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], oracle.inverse_dynamics(state)) <= 1e-12
    vdot = evaluate("forward_dynamics", state)["vdot"]
    assert relative_error(evaluate("inverse_dynamics", {**state, "a": vdot})["tau"], np.zeros(70), floor=1e3) <= 1e-9


@pytest.mark.parametrize("kind", ["mixed", "any"])
def test_all_functions_are_those_of_links_written_one_by_one(
    kind: str, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(links, "MANY", 6)
    of_links = [
        "inverse_dynamics",
        "forward_dynamics",
        "mass",
        "coupling",
        "force",
        "poses",
        "twists",
        "energy",
        "jacobians",
    ]
    made = derive(chain(kind, 12), of_links)
    monkeypatch.setattr(alike, "is_irregular", lambda *_: False)
    monkeypatch.setattr(scene_tape, "is_irregular", lambda *_: False)
    alone = derive(chain(kind, 12), of_links)
    assert generics(made.tape) > 50
    state = random_states(made, 3, rng)
    for name in of_links:
        for block, values in tape_evaluator(made)(name, state).items():
            wanted = tape_evaluator(alone)(name, state)[block]
            assert relative_error(values, wanted, values.ndim - 1 or 1) <= 1e-12, (name, block)


def test_generic_constants_prune_nothing_and_fold_to_generic_constants() -> None:
    tape = Tape()
    x = tape.input("q", 0)
    zero, one, minus = (tape.generic(value, "link", number) for number, value in enumerate((0.0, 1.0, -2.0)))
    assert len({zero, one, minus, ZERO, ONE}) == 5 and minus > 0
    for number in (zero, one, minus):
        assert tape.op[tape.mul(number, x)] is Op.MUL and tape.op[tape.add(x, number)] is Op.ADD
    product = tape.mul(zero, minus)
    assert (
        tape.op[product] in LEAVES and product != ZERO and tape.number(product) == 0.0 and tape.value(product) is None
    )
    assert tape.number(tape.add(one, minus)) == -1.0 and tape.number(tape.div(one, minus)) == -0.5
    assert tape.generic(1.0, "link", 1) == one and tape.generic(1.0, "link", 7) != one
    assert tape.generic(1.0) != tape.generic(1.0)
