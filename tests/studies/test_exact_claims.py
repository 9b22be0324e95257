"""The claims of ``eomgen check`` by complex steps and second derivations, on the tape of scenes of few coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import eomgen
from eomgen.mechanics import scene_tape
from eomgen.mechanics.tree import links
from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification.claims.claim import Array, Claim, Space
from eomgen.products.studies.verification.differences import ClaimAtStates, complex_steps
from tests.studies.claims_of_scenes import space_of, states_of

STATES = 2


def top() -> eomgen.Scene:
    """Return a top on a ball joint with a slider on it, on a moving base, with a state, inputs and outputs."""
    builder = eomgen.SceneBuilder("top").parameter("lag", 0.4, tunable=True).parameter("heave", 0.1, tunable=True)
    builder.input("command", "heave + sin(t)").input("twist")
    builder.base(position=["heave * sin(3 * t)", 0, "0.2 * t"], rotation=[([0, 0, 1], "0.3 * t")])
    builder.body("rod", 0.4, center_of_mass=[0.1, 0, -0.3], inertia=[0.02, 0.02, 0.005])
    builder.joint("ball", "spherical", "base", "rod", position=[0, 0, 0.5])
    builder.body("bob", 0.7, center_of_mass=[0, 0.1, 0], inertia=[0.01, 0.01, 0.02])
    builder.joint("rail", "prismatic", "rod", "bob", axis=[0, 0, 1], damping=0.2, stiffness=30.0)
    builder.point("tip", "bob", [0, 0, -0.6])
    builder.state("wound", "(command - wound) / lag - v.rail + 0.1 * twist * q.rail")
    builder.effort("trim", "rail", "wound * q.rail + twist * q.rail ** 2 + command")
    return builder.output("load", formula=["wound * v.rail + a.rail", "twist * q.rail + command"]).build()


def loop() -> eomgen.Scene:
    """Return two pendulums whose tips a rod holds apart, on a base that shakes."""
    builder = eomgen.SceneBuilder("loop").parameter("width", 1.0, tunable=True).input("push")
    builder.base(position=["0.1 * width * sin(2 * t)", 0, 0])
    for name, place in (("left", 0.0), ("right", 1.0)):
        builder.body(name, 1.0 + place, center_of_mass=[0, 0, -0.4], inertia=[0.02, 0.03, 0.01])
        builder.joint(name, "revolute", "base", name, axis=[0, 1, 0], position=[place, 0, 0])
    ends = ({"body": name, "position": ["0.1 * width", 0, -1.0]} for name in ("left", "right"))
    builder.constraint("rod", "distance", *ends, length="width * (1.4 + 0.1 * sin(t))")
    builder.effort("motor", "left", "push - 0.2 * v.left")
    return builder.output("angle", formula="q.left * push * width + v.right * a.left").build()


def door() -> eomgen.Scene:
    """Return an absolute body on a hinge of a turning base."""
    builder = eomgen.SceneBuilder("door", coordinates="absolute").base(rotation=[([0, 0, 1], "0.1 * sin(2 * t)")])
    builder.body("leaf", 1.3, center_of_mass=[0.5, 0, 0], inertia=[0.02, 0.1, 0.1])
    return builder.joint("hinge", "revolute", "base", "leaf", axis=[0, 0, 1]).build()


def mast() -> eomgen.Scene:
    """Return a beam that bends in one shape, on a spring hinge, pulled along."""
    builder = eomgen.SceneBuilder("mast", gravity=[0, 0, 0])
    bending = {"modes": 1, "shapes": "polynomial", "stiffness": 70.0, "stiffness_damping": 1e-3}
    builder.beam("mast", 2.0, mass_per_length=0.5, bending_z=bending)
    builder.joint("clamp", "revolute", "base", "mast", axis=[0, 1, 0], stiffness=100)
    return builder.force("pull", "mast", force=[4, 0, 0], point=[2, 0, 0], axes="body").build()


def striker() -> eomgen.Scene:
    """Return a pendulum with an impact and an event of its rate."""
    builder = eomgen.SceneBuilder("striker").body("a", 2.0, center_of_mass=[0.1, 0, -0.5], inertia=[0.1, 0.2, 0.15])
    builder.joint("x", "revolute", "base", "a", axis=[0, 1, 0], damping=0.3).state("lag", "q.x - lag")
    builder.event("floor", "sin(q.x) + 0.5 * t", direction="falling", action="impact", restitution=0.6)
    return builder.event("swing", "v.x * lag + cos(t)", action="reset", reset={"lag": "0.5*lag"}).build()


def reed() -> eomgen.Scene:
    """Return a curved beam of two elements that bends, twists and stretches in the wind, on a shaft."""
    builder = eomgen.SceneBuilder("reed")
    builder.beam(
        "reed", model="kirchhoff", length=1.2, elements=2, curvature=[0.3, -0.4, 0.2], mass_per_length=0.6,
        rotary_inertia=[2e-3, 1e-3, 1e-3], stiffness={"stretch": 900, "torsion": 15, "bending_y": 20, "bending_z": 30},
        damping={"stretch": 0.3, "bending_y": 0.1},
    )  # fmt: skip  # the section on a line
    builder.joint("flight", "free", "base", "reed").distributed_load("wind", "reed", [0, 0, -3])
    return builder.build()


def bird() -> eomgen.Scene:
    """Return a free body with a point off its centre."""
    builder = eomgen.SceneBuilder("bird").body("a", 2.0, center_of_mass=[0.1, 0, -0.5], inertia=[0.6, 0.7, 0.15])
    return builder.joint("flight", "free", "base", "a").point("tip", "a", [0.3, 0.1, 0.2]).build()


def chain() -> eomgen.Scene:
    """Return three links in a row on a shaking base, which are many and in no flat tree here."""
    builder, parent = eomgen.SceneBuilder("chain").base(position=["0.1 * sin(5 * t)", 0, 0]), "base"
    for k in range(3):
        builder.body(f"link_{k}", 0.5, center_of_mass=[0, 0, -0.1], inertia=[0.01, 0.01, 0.005])
        place = {"axis": [k % 2, (k + 1) % 2, 0], "position": [0, 0, -0.2 if k else 0]}
        builder.joint(f"joint_{k}", "revolute", parent, f"link_{k}", **place, damping=0.01)
        parent = f"link_{k}"
    return builder.build()


_RATES = ("rates", "mass_rates", "coupling_rates", "force_rates", "base_motion_rates", "forward_rates")
#: Scenes, and the terms that each is derived with.
SCENES: dict[str, tuple[Callable[[], eomgen.Scene], tuple[str, ...]]] = {
    "top": (top, (
        "mass", "coupling", "force", "base_motion", "inverse_dynamics", "forward_dynamics", "residual", "partials",
        "internal_rate", "internal_partials", "equations", "iteration", "poses", "twists", "accelerations", "jacobians",
        "energy", "momenta", "outputs", "output_partials", "parameter_partials", "output_parameter_partials",
        "linearization", "input_derivatives", "regressor", "regressor_parameters", "coriolis",
        "coriolis_skew", *_RATES,
        "frame_poses", *(f"frame_{kind}{ending}" for kind in ("jacobians", "jacobian_rates", "drifts")
                         for ending in ("", "_world", "_aligned")), "frame_mobilities",
        "center_of_mass", "center_of_mass_jacobian", "center_of_mass_jacobian_rate", "center_of_mass_drift",
        "centroidal_momentum", "centroidal_momentum_rate", "centroidal_drift", "second_partials",
        "frame_poses_derivatives", "frame_poses_hessian", "outputs_derivatives", "outputs_hessian",
    )),
    "loop": (loop, (
        "mass", "coupling", "force", "inverse_dynamics", "residual", "partials", "energy", "constraint",
        "constraint_velocity", "constraint_jacobian", "constraint_bias", "constraint_acceleration", "velocity_partials",
        "acceleration_partials", "equations", "iteration", "jacobian_values", "mass_values", "reaction_partials",
        "parameter_partials", "second_partials", "outputs", "output_partials", "output_parameter_partials",
        "linearization", "base_motion", "poses", "momenta",
        *(f"{term}_{kind}" for term in ("constraint_velocity", "residual", "momenta")
          for kind in ("derivatives", "hessian")),
    )),
    "door": (door, ("joint_velocities",)),
    "mast": (mast, ("elastic", "inverse_dynamics", "mass", "residual", "energy", "force", "coupling")),
    "striker": (striker, (
        "events", "event_impulse", "internal_rate", "residual", "inverse_dynamics", "regressor", "regressor_parameters",
        "mass", "rates", "rates_closed", "mass_rates", "mass_rates_closed", "system_jacobian", "system_jacobian_rates",
    )),
    "bird": (bird, ("frame_poses", "frame_poses_derivatives", "frame_poses_hessian")),
    "chain": (chain, (
        "iteration", "residual", "inverse_dynamics", "coupling", "force", "energy", "forward_dynamics", "base_motion",
    )),
    "reed": (reed, ("section_loads", "residual", "poses", "jacobians", "force", "equations", "constraint")),
}  # fmt: skip  # a table


#: Outputs without a form of their name: what others are derivatives of, or the one output of a term that a form is
#: named after.
UNCLAIMED = {
    *("force.Q", "outputs.y", "internal_rate.zdot", "constraint.Phi", "frame_poses.frame_pose", "poses.pose"),
    *("center_of_mass.c", "center_of_mass.m", "regressor.tau0", "regressor_parameters.pi", "joint_velocities.joint_v"),
    *("event_impulse.M", "events.event", "system_jacobian.J"),
    *("energy.energy", "twists.twist", "accelerations.acceleration", "jacobians.J"),
}
#: Forms that have not the names of an output, and, after a minus, forms whose companions the scene has no term of.
OTHERS = {
    "top": {
        *("mass.M, definite", "energy", "base", "base_rates", "input_rates.u_dot", "input_rates.u_ddot", "twists"),
        *("accelerations", "jacobians", "centroidal_momentum.A, linear", "coriolis_skew.C, skew"),
    },
    "loop": {"mass.M, definite", "energy", "base", "constraint_jacobian.B by w"},
    "door": {"base"},
    "bird": set(),
    "chain": {"base", "energy", "-base_motion.b", "-iteration.X"},
    "mast": {"mass.M, definite", "energy"},
    "reed": {"section_loads.load_at_ends, at nodes", "-equations.w", "-residual.r", "-section_loads.x"},
    "striker": {"mass.M, definite", "regressor.Y, power", "-inverse_dynamics.tau", "-mass.M", "-residual.r"},
}
#: Forms that are zero in these scenes: deviations from symmetry, planar couplings, outputs without multipliers.
ZERO = {
    "mass.M, definite", "coupling.h", "forward_dynamics.vdot", "output_partials.Ylam", "output_partials.Yw",
    "joint_velocities.Pav",
    *(f"{term}.{name}" for term in ("mass_rates", "mass_rates_closed") for name in ("M_dot", "M_ddot")),
    "system_jacobian_rates.J_dot", "system_jacobian_rates.J_ddot",
}  # fmt: skip  # a table


def claims_of(scene: str, patch: pytest.MonkeyPatch) -> tuple[Space, dict[str, Claim], ClaimAtStates]:
    """Return the space and the claims of a scene by name, and random states."""
    if scene == "chain":  # three links are many, and no flat tree
        patch.setattr(links, "MANY", 2)
        patch.setattr(scene_tape, "FLAT", 0)
    make, terms = SCENES[scene]
    space = space_of(make(), terms, scale=3.0)
    claims = checking._claims(space)
    state, names = states_of(space.system, space.engine, STATES, 0.5), tuple(f"state {k}" for k in range(STATES))
    return (
        space,
        {claim.name: claim for claim in claims},
        ClaimAtStates(claims[0], space.engine, space.engine, state, names),
    )


def expected_of(claim: Claim, at: ClaimAtStates) -> list[Array]:
    """Return the closed form by complex steps, and by its second derivation, as far as there are these."""
    found = [] if claim.source is None else [complex_steps(at)]
    return found if claim.second is None else [*found, claim.second(at.engine, at.state)]


@pytest.mark.parametrize("scene", SCENES)
def test_closed_forms_are_what_they_claim_to_be(scene: str, monkeypatch: pytest.MonkeyPatch) -> None:
    space, claims, states = claims_of(scene, monkeypatch)
    outputs = {f"{name}.{output.name}" for name in SCENES[scene][1] for output in space.system.functions[name].outputs}
    absent = {name[1:] for name in OTHERS[scene] if name.startswith("-")}
    assert set(claims) == (outputs - UNCLAIMED - absent) | {name for name in OTHERS[scene] if name[0] != "-"}
    for claim in claims.values():
        at = replace(states, claim=claim, state=claim.at(states.engine, states.state))
        value = claim.value(at.engine, at.state)
        expected = expected_of(claim, at)
        assert expected, claim.name
        size = np.max(np.abs(value))
        assert size > 1e-9 or claim.name in ZERO
        if claim.size is not None:
            sizes = claim.size(at.engine, at.state)
            assert sizes.shape == value.shape[:-2] and np.all(sizes > 0.0), claim.name
            size = max(size, float(np.max(sizes)))
        for other in expected:
            np.testing.assert_allclose(value, np.broadcast_to(other, value.shape), rtol=0.0, atol=1e-9 * size,
                                       err_msg=claim.name)  # fmt: skip
        assert not claim.rows or len(claim.rows) == value.shape[-2] == len(set(claim.rows)), claim.name
        assert not claim.columns or len(claim.columns) == value.shape[-1] == len(set(claim.columns)), claim.name
        assert claim.meaning and claim.family
        assert claim.source is None or claim.smooth_functions, claim.name
