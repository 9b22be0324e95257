"""Random trees in Pinocchio."""

from __future__ import annotations

import numpy as np

from eomgen.mechanics.derive import derive
from tests.oracles.random_scenes import random_scene
from tests.peers.trees import TERMS, Differences, Values, differences, first_scene, kinds, states

#: Joints whose motion subspace changes with their coordinates; planar ones are composites in Pinocchio.
VARYING = {"universal", "planar"}


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
