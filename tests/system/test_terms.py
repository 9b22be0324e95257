"""The register of terms: every row is recorded where it says that it exists, nowhere else, and of the inputs that it
names."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from eomgen.base.calls import meant_term
from eomgen.formula.nodes import Number, Symbol
from eomgen.mechanics.derive import derive
from eomgen.scene.builder import SceneBuilder
from eomgen.scene.events.model import Event
from eomgen.scene.scene import Scene
from eomgen.system.system import INPUT_BLOCKS
from eomgen.system.terms import PURPOSES, TERMS, Term

#: The fact that holds in a scene where another does not.
_OPPOSITE = {"unconstrained": "constraints", "rigid": "elastic", "rigid_tree": "elastic", "given_inputs": "no_inputs"}


@cache
def scene_with(fact: str) -> Scene:
    """Return a body on a hinge with an input, and what makes one fact of it hold."""
    builder = SceneBuilder(f"hinge_{fact}", coordinates="absolute" if fact == "absolute" else "joint")
    builder.input("torque", *([] if fact == "no_inputs" else ["sin(t)"]))
    builder.body("link", 2.0, center_of_mass=[0.0, 0.0, 0.5], inertia=[0.2, 0.3, 0.1])
    builder.joint("hinge", "revolute", "base", "link", axis=[0, 1, 0])
    builder.effort("motor", "hinge", "torque")
    match fact:
        case "constraints":
            tip = {"body": "link", "position": [0.0, 0.4, 0.5]}
            builder.constraint("pin", "distance", {"body": "base", "position": [0.2, 0.0, 0.0]}, tip, length=0.6)
        case "states":
            builder.state("lag", "sin(q.hinge) - lag")
        case "samples":
            builder.state("held", sample=0.01, formula="q.hinge")
        case "outputs":
            builder.output("angle", formula="sin(q.hinge)")
        case "tunable" | "tunable_outputs":
            builder.parameter("stiffness", 3.0, tunable=True)
            builder.effort("spring", "hinge", "-stiffness * q.hinge")
            if fact == "tunable_outputs":
                builder.output("moment", formula="stiffness * q.hinge")
        case "moving_base":
            builder.base([0.0, 0.0, "0.1 * sin(t)"])
        case "elastic":
            builder.beam("rod", 1.0, mass_per_length=1.0, bending_y={"modes": 1, "stiffness": 100.0})
            builder.joint("clamp", "fixed", "link", "rod")
        case "exact_beams":
            stiffness = dict.fromkeys(("stretch", "shear_y", "shear_z", "torsion", "bending_y", "bending_z"), 100.0)
            shape: dict[str, Any] = {"length": 1.0, "elements": 3, "mass_per_length": 1.0}
            builder.beam("rope", model="cosserat", stiffness=stiffness, rotary_inertia=[0.1, 0.1, 0.1], **shape)
            builder.joint("grip", "fixed", "link", "rope")
        case "events" | "event_actions" | "event_impulse":
            return with_events(builder.build())
    return builder.build()


def with_events(scene: Scene) -> Scene:
    """Return a scene with an event that is recorded, one that sets a velocity, and an impact."""
    angle, speed = Symbol("q", "hinge"), Symbol("v", "hinge")
    passage = Event("passage", angle, "both", "record")
    reset = Event("reset", angle + Number(1.0), "both", "reset", resets=((speed, Number(0.0)),))
    impact = Event("impact", angle - Number(1.0), "rising", "impact", restitution=Number(0.5))
    return replace(scene, events=(passage, reset, impact))


def facts_of(term: Term) -> tuple[str, str]:
    """Return a fact with which a term exists, and one with which it does not."""
    first = next((fact for fact in term.exists if fact != "large"), "")
    return first, _OPPOSITE.get(first, "plain")


@pytest.mark.parametrize("name", TERMS)
def test_a_term_is_recorded_where_its_row_says(name: str) -> None:
    term = TERMS[name]
    present, absent = facts_of(term)
    system = derive(scene_with(present), [name])
    function = system.functions[name]
    assert function.description == term.description
    assert function.refs
    assert set(function.inputs) <= set(term.inputs) <= set(INPUT_BLOCKS)
    assert {symbol.block for symbol in system.tape.depends_on(function.refs)} <= set(term.inputs)
    if term.exists:
        assert name not in derive(scene_with(absent), [name]).functions
    if term.source:
        assert len(function.outputs) == term.order - term.first + 1


def test_what_a_rigid_tree_on_a_base_at_rest_has_no_use_for() -> None:
    """By name, since the rows themselves decide what the other tests expect."""
    of_constraints = {name for name in TERMS if name.startswith("constraint")} | {"equations", "iteration"}
    of_constraints |= {"velocity_partials", "acceleration_partials", "jacobian_values", "joint_velocities"}
    of_constraints |= {"reaction_partials"}
    of_others = {"internal_rate", "internal_partials", "outputs", "output_partials", "elastic"}
    of_others |= {"parameter_partials", "output_parameter_partials"}
    of_others |= {
        f"{name}_{kind}"
        for name in ("residual", "momenta", "internal_rate", "outputs")
        for kind in ("derivatives", "hessian")
    } - {"momenta_derivatives"}  # steps of rattlie need them
    of_others |= {"events", "event_actions", "event_impulse", "samples", "section_loads"}
    of_base = {"base_motion", "base_motion_rates", "base_motion_rates_1"}
    recorded = derive(scene_with("plain"), list(TERMS)).functions
    assert set(TERMS) - set(recorded) == of_constraints | of_others | of_base
    of_closed_form = {"rates_closed", "mass_rates_closed"} | {
        name for name in TERMS if name.startswith(("system_jacobian", "adjoints", "joint_br", "link_br", "coriolis"))
    }
    elastic = derive(scene_with("elastic"), list(TERMS)).functions
    assert (
        set(recorded) - set(elastic) == of_closed_form | {"regressor", "regressor_parameters"} and "elastic" in elastic
    )
    constrained = derive(scene_with("constraints"), list(TERMS)).functions
    assert set(recorded) - set(constrained) == {
        "forward_dynamics",
        "forward_dynamics_derivatives",
        "forward_dynamics_hessian",
        "forward_rates",
        "forward_rates_1",
        "frame_mobilities",
    }


@pytest.mark.parametrize("fact", ["plain", "constraints", "states", "outputs", "moving_base", "absolute", "elastic"])
def test_without_a_list_all_is_recorded_but_what_is_on_request(fact: str) -> None:
    recorded = set(derive(scene_with(fact)).functions) & set(TERMS)
    assert recorded >= {"mass", "coupling", "force", "residual", "partials", "energy"}
    assert not {name for name in recorded if TERMS[name].on_request}
    facts = {
        fact,
        "elastic" if fact == "elastic" else "rigid",
        "unconstrained" if fact != "constraints" else "constraints",
    }
    if fact == "absolute":
        facts = facts - {"unconstrained"} | {"constraints"}
    assert recorded == {name for name, term in TERMS.items() if term.exists_with(facts) and not term.on_request}


def test_a_term_may_be_what_others_call_it_and_every_purpose_names_terms() -> None:
    assert all(
        meant_term(name) in TERMS for name in ("inertia", "M", "bias", "gravity", "RNEA", "ABA", "kinetic", "phi", "b")
    )
    assert all(set(terms) <= set(TERMS) and len(set(terms)) == len(terms) for terms in PURPOSES.values())
