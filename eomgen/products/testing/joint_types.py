"""The contract of a joint type: keys of a scene, sizes, poses and motion subspaces against exponentials of twists.

No line here names a type: expected values follow from the chain of elementary motions by other means.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from eomgen.compiled.coordinates import coordinate_units
from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import describe
from eomgen.products.testing.demands import PARTIALS, check_c, demand, partials_error
from eomgen.products.testing.states import Array, random_states, rotation_of, tape_evaluator
from eomgen.scene.joint_types import JOINTS, Connection
from eomgen.scene.joints.tree import joint_displacement
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

OWN = {"axis": "[0.48, 0.6, 0.64]", "second_axis": "[0.8, 0, -0.6]", "x_axis": "[0.8, 0, -0.6]", "pitch": "0.07"}
PITCH = 0.07
HEAD = """format = 1
name = "one"
coordinates = "{coordinates}"
[bodies.a]
mass = {mass}
center_of_mass = [0.1, -0.2, 0.15]
inertia = {inertia}
[bodies.b]
mass = 1.0
inertia = [0.2, 0.2, 0.2]
[joints.next]
type = "fixed"
parent = "base"
child = "b"
[joints.moved]
type = "{kind}"
parent = "base"
child = "a"
position = [0.3, -0.1, 0.2]
rotation = [{{ axis = [0, 1, 0], angle = 0.4 }}]
"""


def text(kind: str, more: str = "", *, mass: float = 2.0, coordinates: str = "joint", without: str = "") -> str:
    row = JOINTS[kind]
    keys = ("axis",) * bool(row.coordinates) + tuple(dict.fromkeys((*row.needed, *filter(None, [row.second_key]))))
    lines = [f"{key} = {OWN[key]}\n" for key in keys if key != without]
    inertia = "[0.2, 0.25, 0.3]" if mass else "[0, 0, 0]"
    return HEAD.format(kind=kind, mass=mass, inertia=inertia, coordinates=coordinates) + "".join(lines) + more


def check_joint_type(name: str) -> None:
    """Check a joint type of an installed distribution, or of eomgen.

    Demands: keys that a joint of the type needs are asked for; sizes and units follow from the chain; poses, velocities
    and motion subspaces are exponentials of the chain's twists; the inertia matrix has full rank; partials agree with
    complex steps; the generated C compiles without warnings.

    Parameters
    ----------
    name : str
        Name of a type that moves, not ``fixed``.

    Raises
    ------
    ContractError
        Naming the type and the demand; also for an unknown type.
    """
    demand(name in JOINTS, name, "there is no joint type of this name; is the distribution installed?")
    row = JOINTS[name]
    demand(row.moves, name, "the type does not move")
    for key in ("axis",) * bool(row.coordinates) + row.needed:
        check_needed(row, key)
    scene = load_toml(text(name))
    check_poses(name, np.random.default_rng(0))
    difference = partials_error(scene)
    demand(difference <= PARTIALS, name, f"partials of the residual differ from complex steps by {difference:.2g}")
    check_c(scene)


def check_needed(row: Connection, key: str) -> None:
    """Check that a joint without a needed key is refused. Raises ContractError."""
    try:
        load_toml(text(row.name, without=key))
    except DescriptionError as error:
        names_key = any(problem.code in ("E1652", "E1418") and key in str(problem) for problem in error.problems)
        demand(names_key, row.name, f"a joint without {key} is refused without the name of the key: {error}")
    else:
        demand(False, row.name, f"a joint without {key} is taken")


def check_poses(kind: str, rng: np.random.Generator) -> None:
    """Check sizes, units, poses, velocities and motion subspaces of a moving type. Raises ContractError."""
    scene, row = load_toml(text(kind)), JOINTS[kind]
    system = derive(scene, ["poses", "twists", "mass"])
    [factor] = system.factors
    sizes = factor.group, factor.q_size, factor.v_size
    demand(sizes == (row.group, *row.sizes), kind, f"the model has group and sizes {sizes}")
    q_units, v_units = coordinate_units(system.factors, describe(scene).coordinates)
    demand(v_units == [f"{unit}/s" for unit in row.units], kind, f"velocities are in {v_units}")
    plain = list(row.coordinates.values())
    demand(not plain or q_units == plain, kind, f"coordinates are in {q_units}")
    evaluate, state = tape_evaluator(system), random_states(system, 1, rng)
    pose, twist = evaluate("poses", state)["pose"][0], evaluate("twists", state)["twist"][0]
    k = list(system.bodies).index("a")
    here, S = exponentials(scene, state["q"][0])
    R, p = placed(scene, here)
    _demand_equal(kind, "the orientation of the child", rotation_of(pose[k, :4]), R, 1e-12)
    _demand_equal(kind, "the place of the child", pose[k, 4:], p, 1e-12)
    _demand_equal(kind, "the velocity of the child", twist[k], S @ state["v"][0], 1e-8)
    item = scene.joints[-1]
    rotation, shift, subspace = joint_displacement(row, item.axis, item.second_axis, state["q"][0], PITCH)
    _demand_equal(kind, "the displacement in numbers", np.column_stack([rotation, shift]), here[:3], 1e-12)
    _demand_equal(kind, "the motion subspace in numbers", subspace, S, 1e-8)
    rank = int(np.linalg.matrix_rank(evaluate("mass", state)["M"][0]))
    demand(rank == row.v_size, kind, f"the inertia matrix has rank {rank}, and not {row.v_size}")


def _demand_equal(kind: str, label: str, computed: Array, expected: Array, tolerance: float) -> None:
    difference = float(np.max(np.abs(computed - expected)))
    demand(
        difference <= tolerance, kind, f"{label} differs from exponentials of the chain's twists by {difference:.2g}"
    )


def exponentials(scene: Scene, q: Array) -> tuple[Array, Array]:
    """Return the displacement (4, 4) of the last joint's child at its coordinates q, without the joint's placement, as
    a product of twist exponentials, and the motion subspace (6, nv), angular first, in child axes, by central
    differences."""
    item = scene.joints[-1]
    directions = np.array([item.axis, item.second_axis, np.cross(item.axis, item.second_axis)])

    def transform(shift: Array, at: Array) -> Array:
        pose = np.eye(4)
        for motion in item.kind.chain:
            if motion.kind in ("ball", "free"):
                pose[:3, :3] = pose[:3, :3] @ rotation_of(at[:4])
                pose[:3, 3] += at[4:7] if motion.kind == "free" else 0.0
                pose = pose @ exponential(np.append(shift, np.zeros(3))[:6])
                continue
            for axis, k in zip(motion.axes, motion.components, strict=True):
                spin = np.zeros(3) if motion.kind == "travel" else directions[axis]
                slide = {"travel": 1.0, "screw": PITCH}.get(motion.kind, 0.0) * directions[axis]
                pose = pose @ exponential(np.concatenate([spin, slide]) * (at[k] + shift[k]))
        return pose

    here = transform(np.zeros(item.kind.v_size), q)
    columns, step = [], 1e-6
    for unit in np.eye(item.kind.v_size) * step:
        twist = np.linalg.inv(here) @ (transform(unit, q) - transform(-unit, q)) / (2.0 * step)
        columns.append([twist[2, 1], twist[0, 2], twist[1, 0], *twist[:3, 3]])
    return here, np.array(columns).T


def exponential(twist: Array) -> Array:
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = np.cross(np.eye(3), twist[:3]), twist[3:]
    return np.asarray(scipy.linalg.expm(matrix))


def placed(scene: Scene, pose: Array) -> tuple[Array, Array]:
    """Return orientation (3, 3) and position (3,) in the world of the last joint's child, from its displacement (4, 4)
    in the joint's frame."""
    item = scene.joints[-1]
    R, p = np.array(item.orientation), np.array([part.value for part in item.position])  # type: ignore[union-attr]
    return R @ pose[:3, :3], p + R @ pose[:3, 3]
