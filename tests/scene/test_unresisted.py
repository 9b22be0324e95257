"""Motions of several joints that move no mass: held against the eigenvalues of M on random trees."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import DescriptionError, Message, ModelError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import from_data
from eomgen.scene.scene import Scene
from eomgen.system.terms import UNRESISTED
from tests.models.urdf import load_urdf
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.states import random_states

TYPES = ("revolute", "prismatic", "helical", "cylindrical", "universal", "planar", "spherical", "fixed")
HEAVY = {"mass": 2.0, "center_of_mass": [0.1, -0.2, 0.3], "inertia": [0.2, 0.3, 0.4, 0.01, 0.02, -0.03]}
POINT = {"mass": 2.0, "center_of_mass": [0.1, -0.2, 0.3]}


def random_tree(seed: int) -> dict[str, Any]:
    """Return a tree of two to five bodies, about half of them without mass, some with a point mass only."""
    rng = np.random.default_rng(seed)
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    for k in range(int(rng.integers(2, 6))):
        bodies[f"b{k}"] = [{"mass": 0.0}, HEAVY, POINT][rng.choice(3, p=[0.45, 0.35, 0.2])]
        kind = "free" if k == 0 and rng.random() < 0.5 else str(rng.choice(TYPES))
        parent = "base" if k == 0 else f"b{int(rng.integers(max(0, k - 2), k))}"
        joint: dict[str, Any] = {
            "type": kind,
            "parent": parent,
            "child": f"b{k}",
            "position": rng.normal(size=3).tolist(),
        }
        if kind not in ("free", "spherical", "fixed"):
            joint["axis"] = rng.normal(size=3).tolist()
        if kind == "universal":
            axis = np.array(joint["axis"])
            joint["second_axis"] = np.cross(axis, rng.normal(size=3)).tolist()
        if kind == "helical":
            joint["pitch"] = float(rng.normal())
        if kind in ("revolute", "prismatic") and rng.random() < 0.15:
            joint["rotor_inertia"] = 0.1
        joints[f"j{k}"] = joint
    return {"format": 1, "name": "random_tree", "bodies": bodies, "joints": joints}


def unresisted(scene: Scene) -> list[str]:
    return [note for note in scene.notes if Message(note).code in UNRESISTED]


def is_singular(scene: Scene) -> bool:
    """Tell whether M is singular at several random states, its rows scaled."""
    system = derive(scene, ["mass"])
    M = tape_evaluator(system)("mass", random_states(system, 4, np.random.default_rng(0)))["M"]
    size = np.sqrt(np.einsum("...ii->...i", M))
    if not np.all(size > 0.0):
        return True
    return bool(np.all(np.linalg.eigvalsh(M / (size[:, :, None] * size[:, None, :]))[:, 0] < 1e-10))


def compare(seeds: range) -> tuple[int, int]:
    """Compare notes with M; return how many scenes were resisted and how many were not."""
    counts = [0, 0]
    for seed in seeds:
        try:
            scene = from_data(random_tree(seed))
        except DescriptionError:  # an outermost joint carries nothing, which is refused
            continue
        singular = is_singular(scene)
        assert bool(unresisted(scene)) == singular, (seed, unresisted(scene))
        counts[singular] += 1
    return counts[0], counts[1]


@pytest.mark.slow
def test_notes_are_there_where_the_inertia_matrix_is_singular() -> None:
    resisted, not_resisted = compare(range(200))
    assert resisted >= 40 and not_resisted >= 10


ROBOT = """<robot name="floating"><link name="root"/>
<link name="arm"><inertial><mass value="2"/><origin xyz="0 0 0.5"/>
<inertia ixx="1" iyy="1" izz="0.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="root"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>"""


@pytest.mark.slow
def test_a_free_root_without_mass_is_named() -> None:
    """With its root fixed the robot is sound; free, the root turns about the shoulder's axis while the shoulder turns
    back."""
    assert not unresisted(load_urdf(ROBOT))
    scene = load_urdf(ROBOT, root="free")
    note = (
        "no inertia resists the free joint root_joint together with shoulder: they can move without moving any mass, so"
        " the inertia matrix is singular and forward dynamics has no answer; try: mass and inertia for the body root,"
        " or a fixed joint in place of one of them (of other formats: root or lock)"
    )
    assert scene.notes[-1] == note
    assert not unresisted(load_urdf(ROBOT, root="free", lock=["shoulder"]))
    with pytest.raises(
        ModelError, match=r"floating: no inertia resists the free joint root_joint together with shoulder: they"
    ):
        eomgen.build(scene, ["mass", "forward_dynamics"], profile="quick")  # divides by a constant that is zero
    scene = load_urdf(ROBOT.replace("<axis", '<origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/><axis'), root="free")
    with pytest.warns(
        RuntimeWarning, match=r"floating: no inertia resists the free joint root_joint together with shoulder"
    ):
        eomgen.build(scene, ["mass", "forward_dynamics"], profile="quick")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = eomgen.build(scene, ["mass", "inverse_dynamics"], profile="quick")
    assert np.linalg.eigvalsh(model.mass(model.initial_q))[0] == pytest.approx(0.0, abs=1e-12)


def test_small_masses_resist() -> None:
    """A ratio of 1e-13 between a carrier and what it carries is no singular matrix, for the carrier itself has
    inertia."""
    data = {
        "format": 1,
        "name": "ratio",
        "bodies": {"carrier": {"mass": 1e-13}, "load": {"mass": 1.0}},
        "joints": {
            "first": {"type": "prismatic", "parent": "base", "child": "carrier", "axis": [0, 0, 1]},
            "second": {"type": "prismatic", "parent": "carrier", "child": "load", "axis": [0, 0, 1]},
        },
    }
    assert not unresisted(from_data(data))
    data["bodies"]["carrier"]["mass"] = 0.0  # type: ignore[index]
    assert unresisted(from_data(data))[0].startswith(
        "no inertia resists the prismatic joint first together with second: "
    )


@pytest.mark.parametrize("lengths", [(1e-3, 1.0, 1e3), (1e-4, 1.0, 1e4), (1e-6, 1.0, 1e6), (1.0, 1e-5, 1e3)])
def test_short_links_that_carry_long_ones_resist(lengths: tuple[float, ...]) -> None:
    bodies, joints, before = {}, {}, ("base", 0.0)
    for k, length in enumerate(lengths):
        inertia = length**2 / 12.0
        bodies[f"b{k}"] = {"mass": 1.0, "center_of_mass": [0, 0, -length / 2], "inertia": [inertia] * 3}
        place = {"parent": before[0], "child": f"b{k}", "position": [0, 0, -before[1]]}
        joints[f"j{k}"] = {"type": "revolute", "axis": [0, -1, 0], **place}
        before = f"b{k}", length
    scene = from_data({"format": 1, "name": "chain", "bodies": bodies, "joints": joints})
    assert unresisted(scene) == []
