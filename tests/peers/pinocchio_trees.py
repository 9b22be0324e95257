"""Random trees in Pinocchio."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.scene.joints.model import Constraint, Frame
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.formulas import value_of, vector
from tests.oracles.random_scenes import random_scene
from tests.peers.trees import TERMS, Differences, Values, differences, first_scene, kinds, states

#: Joints whose motion subspace changes with their coordinates; planar ones are composites in Pinocchio.
VARYING = {"universal", "planar"}
#: Terms of a loop: function and output.
OWN = {"M": ("mass", "M"), "Q": ("force", "Q"), "h": ("coupling", "h"), "g": ("constraint_bias", "g")}
STATES = 2


def terms(seed: int) -> Differences:
    """Compare terms, inverse and forward dynamics of a tree of any joint types."""
    from tests.oracles.pinocchio_oracle import oracle_of_tree

    scene = random_scene(seed)
    system = derive(scene, [*TERMS, "coupling", "force"])
    oracle, state = oracle_of_tree(scene), states(system, seed)
    expected: Values = {
        ("mass matrix", "mass", "M"): oracle.mass(state),
        ("velocity terms", "coupling", "h"): oracle.coupling(state),
        ("gravity", "force", "Q"): oracle.weight(state),
        ("inverse dynamics", "inverse_dynamics", "tau"): oracle.inverse_dynamics(state),
        ("accelerations", "forward_dynamics", "vdot"): oracle.forward_dynamics(state, np.zeros_like(state["v"])),
    }
    return differences(system, state, expected)


def partials(seed: int) -> Differences:
    """Compare partials of inverse dynamics of a tree whose joints have constant motion subspaces."""
    return _partials(seed, varying=False)


def varying_partials(seed: int) -> Differences:
    """Compare partials of inverse dynamics of other trees, and differences of Pinocchio's own inverse dynamics."""
    return _partials(seed, varying=True)


def _partials(seed: int, varying: bool) -> Differences:
    from tests.oracles.pinocchio_oracle import oracle_of_tree

    scene = first_scene(seed, lambda scene: bool(kinds(scene) & VARYING) == varying)
    system = derive(scene, ["partials"])
    oracle, state = oracle_of_tree(scene), states(system, seed)
    by_q, by_v = oracle.partials(state)
    expected = {("partials by q", "partials", "K"): by_q, ("partials by v", "partials", "C"): by_v}
    if varying:
        columns = []
        for step in np.eye(system.nv):  # inverse dynamics is quadratic in v: differences of any step are exact
            up, down = ({**state, "v": state["v"] + sign * step} for sign in (1.0, -1.0))
            columns.append((oracle.inverse_dynamics(up) - oracle.inverse_dynamics(down)) / 2.0)
        expected["differences of rnea by v", "partials", "C"] = np.stack(columns, axis=-1)
    return differences(system, state, expected)


def loops(seed: int) -> Differences:
    """Compare accelerations and multipliers of a tree whose last body a ball joint holds to the base."""
    from tests.oracles.pinocchio_oracle import oracle_of_tree

    pinocchio = import_module("pinocchio")
    tree = first_scene(seed, _may_close)
    oracle, plain = oracle_of_tree(tree), derive(tree, ["mass"])
    model, data, found = oracle.model, oracle.data, list[Any]()
    last = model.getJointId(tree.joints[-1].name)
    point = np.random.default_rng(seed).uniform(-0.5, 0.5, 3)
    for k in range(STATES):  # the place that the body has in a state is where it is held
        state = {name: values[k : k + 1] for name, values in states(plain, seed).items()}
        q = oracle.q(state["q"][0])
        pinocchio.forwardKinematics(model, data, q)
        place = data.oMi[last].act(point)
        ends = Frame(BASE, vector(place.tolist())), Frame(tree.joints[-1].child, vector(point.tolist()))
        closed = replace(tree, constraints=(Constraint("closure", "spherical", *ends),))
        system = derive(closed, ["mass", "coupling", "force", "constraint_jacobian", "constraint_bias"])
        evaluate = tape_evaluator(system)
        B = evaluate("constraint_jacobian", state)["B"][0]
        state["v"] = state["v"] - np.linalg.lstsq(B, B @ state["v"][0], rcond=None)[0]
        values = {name: evaluate(function, state)[block][0] for name, (function, block) in OWN.items()}
        matrix = np.block([[values["M"], B.T], [B, np.zeros((len(B), len(B)))]])
        own = np.linalg.solve(matrix, np.concatenate([values["Q"] - values["h"], -values["g"]]))
        at_place, at_point = (pinocchio.SE3(np.eye(3), place) for place in (place, point))
        contact = pinocchio.RigidConstraintModel(pinocchio.ContactType.CONTACT_3D, model, 0, at_place, last, at_point)
        contacts, memory = pinocchio.StdVec_RigidConstraintModel(), pinocchio.StdVec_RigidConstraintData()
        contacts.append(contact)
        memory.append(contact.createData())
        pinocchio.initConstraintDynamics(model, data, contacts, memory)
        v = oracle.v(state["v"][0])
        a = pinocchio.constraintDynamics(model, data, q, v, np.zeros(model.nv), contacts, memory)[oracle.order]
        force = np.linalg.norm(memory[0].contact_force.linear)
        sizes = np.linalg.norm(own[: system.nv]), np.linalg.norm(own[system.nv :])
        found.append((np.linalg.norm(own[: system.nv] - a) / sizes[0], abs(sizes[1] - force) / sizes[1]))
    return dict(zip(("accelerations", "force of the loop"), np.max(found, axis=0).tolist(), strict=True))


def _may_close(scene: Scene) -> bool:
    """Return whether the last body has mass and five velocities to the base, so that a ball joint is no redundant."""
    carriers = {joint.child: joint for joint in scene.joints}
    freedom, body = 0, scene.joints[-1].child
    while body != BASE:
        freedom, body = freedom + carriers[body].kind.v_size, carriers[body].parent
    massive = all(value_of(body.mass, {}) for body in scene.bodies)
    return massive and freedom >= 5 and scene.joints[-1].type != "fixed"
