"""The regressor Y and tau0: inverse dynamics is Y pi + tau0, pi being the parameters of ``linear_parameters``.

The regressor Y: inverse dynamics is Y pi + tau0, pi being the parameters of ``linear_parameters``.

A column of a body is the virtual work of its inertia forces along each joint's motion per unit of one parameter, so it
follows from the body's acceleration field, the motion that each velocity component gives it, and one kernel
(``laws/rigid_bodies``): no wrench is carried from body to body, and bodies on other branches have zeros by structure.
"""

from __future__ import annotations

from collections.abc import Callable

from eomgen.base.data import replace
from eomgen.formula.nodes import ZERO, Formula
from eomgen.mechanics.dynamics.separated import generalized_force
from eomgen.mechanics.forces.applied import applied_loads
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.bodies import Columns, link_columns
from eomgen.mechanics.kinematics.fields import LinkField, total_fields
from eomgen.mechanics.laws.derived import LAWS
from eomgen.mechanics.linear_parameters import (
    OF_BODY,
    JointParameter,
    joint_parameters,
    linear_parameters,
    moving_bodies,
)
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.tree.base import BaseMotion
from eomgen.mechanics.tree.inertia import body_inertia
from eomgen.mechanics.tree.links import Mount, Tree
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, apply, cross, multiply, plus, transpose
from eomgen.system.system import Block


def regressor(scene: Scene, tree: Tree, base: BaseMotion, quantities: Quantities) -> list[list[Scalar]]:
    """Return the regressor Y, (nv, parameters), with structural zeros; columns are ordered as ``linear_parameters``.

    Parameters
    ----------
    tree : in joint coordinates, inertias of single bodies or grouped
    base : motion of the base, with gravity in base axes
    quantities : for formulas of friction
    """
    fields = total_fields(tree, base, accelerations=True, gravity=True)
    motions = link_columns(tree)
    rows: list[list[Scalar]] = [[] for _ in range(tree.nv)]
    for body in moving_bodies(scene):
        mount = tree.mounts[body.name]
        with tree.algebra.tape.block(f"regressor of body {body.name}"):
            work = _body_columns(tree, mount, fields[mount.link], motions[mount.link])
        for dof in range(tree.nv):
            rows[dof] += work.get(dof, [tree.algebra.zero] * len(OF_BODY))
    for item in joint_parameters(scene):
        with tree.algebra.tape.block(f"regressor of joint {item.joint.name}"):
            effort = _joint_column(item, quantities)
            work_of = quantities.work_of(item.joint.name, item.index)
        for dof in range(tree.nv):
            rows[dof].append(work_of[dof] * effort if dof in work_of else tree.algebra.zero)
    return rows


def _body_columns(tree: Tree, mount: Mount, field: LinkField, motions: Columns) -> dict[int, list[Scalar]]:
    """Return by velocity component the virtual work per unit of each of the ten inertial parameters of a body.
    ``field`` is the acceleration field of the body's link, ``motions`` are the columns of the link, see
    ``link_columns``."""
    algebra, back = tree.algebra, transpose(mount.orientation)
    acceleration, alpha = apply(back, field.at(mount.position)), apply(back, field.alpha)
    symmetric = multiply(multiply(back, field.symmetric), mount.orientation)
    values = {}
    for i in range(3):
        values[f"A{i}"], values[f"r{i}"] = acceleration[i], alpha[i]
        for j in range(i, 3):
            values[f"C{i}{j}"] = symmetric[i][j]
    work: dict[int, list[Scalar]] = {}
    for dof, (angular, linear) in motions.items():
        turn, travel = apply(back, angular), apply(back, plus(linear, cross(angular, mount.position)))
        along = {f"w{k}": turn[k] for k in range(3)} | {f"l{k}": travel[k] for k in range(3)}
        work[dof] = LAWS["regressor_of_rigid_body"].instantiate(algebra, values | along)
    return work


def _joint_column(item: JointParameter, quantities: Quantities) -> Scalar:
    """Return the effort on a joint's coordinate per unit of a coefficient: acceleration, velocity, or friction law."""
    algebra, name, index = quantities.algebra, item.joint.name, item.index
    if item.kind == "rotor_inertia":
        return quantities.tree.coordinates[name].a[index]
    rate = quantities.tree.coordinates[name].v[index]
    if item.kind == "damping":
        return rate
    (friction,) = (law for law in item.joint.friction if law.index == index)
    slip = algebra.call(Op.TANH, rate / quantities.formula(friction.velocity))
    if friction.stribeck is None:
        return slip
    share = rate / quantities.formula(friction.stribeck)
    of_static = algebra.call(Op.EXP, -(share * share))
    return slip * (of_static if item.kind == "static" else 1.0 - of_static)


def parameter_values(algebra: Algebra, scene: Scene, number: Callable[[Formula], Scalar]) -> list[Scalar]:
    """Return the values of the regressor's parameters in the scene, in the order of columns. ``number`` gives the value
    of a formula on the tape."""
    result: list[Scalar] = []
    for body in moving_bodies(scene):
        inertia = body_inertia(algebra, body, number)
        S = inertia.second
        result += [inertia.mass, *inertia.first, S[1][1] + S[2][2], S[0][0] + S[2][2], S[0][0] + S[1][1]]
        result += [-S[0][1], -S[0][2], -S[1][2]]
    return result + [number(item.value) for item in joint_parameters(scene)]


def regressor_blocks(derivation: Derivation) -> list[Block]:
    """Return the blocks Y, (nv, parameters), and tau0, (nv,), with tau = Y pi + tau0. tau0 has springs, inputs and all
    forces by formulas, with the sign of tau."""
    scene, tree, quantities = derivation.scene, derivation.tree, derivation.quantities
    rows = regressor(scene, tree, derivation.motion, quantities)
    names = [item.name for item in linear_parameters(scene)]
    derivation.energies()  # which formulas of forces may name
    # damping and dry friction in joints have columns
    others = replace(scene, joints=tuple(replace(joint, damping=ZERO, friction=()) for joint in scene.joints))
    loads = applied_loads(others, tree, quantities)
    zero = (tree.algebra.zero_vector, tree.algebra.zero_vector)
    wrenches = generalized_force(tree, [zero if load is None else load for load in loads.wrenches], "other forces")
    left = [-(x + y) for x, y in zip(wrenches, loads.efforts, strict=True)]
    description = f"tau per unit of {', '.join(names)}"
    return [
        derivation.block("Y", (tree.nv, len(names)), [value for row in rows for value in row], description),
        derivation.block("tau0", (tree.nv,), left, "part of tau that is independent of the regressor's parameters"),
    ]


def regressor_parameters(derivation: Derivation) -> list[Block]:
    """Return pi, (parameters,): the values of the parameters in the scene."""
    scene = derivation.scene
    result = parameter_values(derivation.algebra, scene, derivation.constant)
    names = ", ".join(item.name for item in linear_parameters(scene))
    return [derivation.block("pi", (len(result),), result, names)]
