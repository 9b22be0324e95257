"""Inertial kinetic energy, potential energy, non-conservative power, and power of base and prescribed motions.

Along every motion d(kinetic + potential)/dt = power + base power. Inertial parameters of bodies are used, not grouped
ones. Internal forces do no work on a rigid motion of the whole scene, so the wrench of the base is the total inertia
wrench less weight and external forces, whether joints, springs or constraints transmit it.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.mechanics.dynamics.separated import field_wrenches
from eomgen.mechanics.forces.loads import Loads
from eomgen.mechanics.kinematics.fields import carry, total_fields
from eomgen.mechanics.kinematics.points import Kinematics
from eomgen.mechanics.laws.derived import LAWS
from eomgen.mechanics.tree.inertia import RecordedInertia
from eomgen.mechanics.tree.links import CARRIER, ROOT, Tree
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, apply, cross, dot, minus, plus, scaled


def kinetic_energy(algebra: Algebra, inertia: RecordedInertia, omega: Vector, velocity: Vector) -> Scalar:
    """Return the kinetic energy of a rigid body, J, with its added masses of water. ``omega`` (rad/s) and ``velocity``
    (m/s) are the inertial twist of the origin of the body frame, in body axes."""
    values = {"m": inertia.mass}
    for i in range(3):
        values[f"v{i}"], values[f"w{i}"], values[f"d{i}"] = velocity[i], omega[i], inertia.first[i]
        for j in range(3):
            values[f"S{i}{j}"] = inertia.second[i][j]
    (energy,) = LAWS["kinetic_energy_of_rigid_body"].instantiate(algebra, values)
    for item in inertia.added:
        at = plus(velocity, cross(omega, item.position))
        energy = energy + 0.5 * dot(at, apply(item.matrix, at))
    return energy


def energies(
    tree: Tree, kinematics: Kinematics, loads: Loads, drivers: Scalar, held: Sequence[tuple[int, Vector, Vector]] = ()
) -> dict[str, Scalar]:
    """Return the energies ``kinetic``, ``potential`` and ``total``, J, and the powers ``power`` and ``base_power``, W.

    ``power`` is of non-conservative loads, ``base_power`` of the base and of prescribed motions.

    Parameters
    ----------
    loads : applied loads with their potential and power; the potential of gravity is added here
    drivers : power of prescribed motions, W
    held : link, point, m, and force, N, in link axes, of constraints between points and the world
    """
    base, carrier = kinematics.base, kinematics.carrier
    algebra = tree.algebra
    kinetic, potential = algebra.zero, loads.potential
    for index, link in enumerate(tree.links):
        with algebra.tape.block(f"energy of link {link.name}"):
            twist = kinematics.inertial_twist(index)
            kinetic = kinetic + kinetic_energy(algebra, link.inertia, *twist)
            if link.elastic is not None:
                kinetic = kinetic + link.elastic.kinetic_energy(*twist)
            for rotor, value in zip(link.rotor_inertias, link.velocities, strict=True):
                kinetic = kinetic + 0.5 * (rotor * (value * value))
            R, p = kinematics.pose(index)
            moment = plus(scaled(link.inertia.mass, p), apply(R, link.inertia.first))
            in_world = plus(scaled(link.inertia.mass, base.position), apply(base.orientation, moment))
            potential = potential - dot(base.gravity_world, in_world)
    moving = base_power(tree, kinematics, loads, held) if carrier.moving else algebra.zero
    total = kinetic + potential
    return {
        "kinetic": kinetic,
        "potential": potential,
        "total": total,
        "power": loads.power,
        "base_power": moving + drivers,
    }


def base_power(tree: Tree, kinematics: Kinematics, loads: Loads, held: Sequence[tuple[int, Vector, Vector]]) -> Scalar:
    """Return the power, W, of the wrench that the base exerts on the scene: inertia less weight and external forces.

    Parameters
    ----------
    kinematics : on the frame that carries the tree's root: the prescribed base, or the world in absolute coordinates
    held : as in ``energies``
    """
    algebra, base, carrier = tree.algebra, kinematics.base, kinematics.carrier
    fields = total_fields(tree, base.motion(), accelerations=True, gravity=True)
    net = field_wrenches(tree, fields)
    for index, external in enumerate(loads.external):
        if external is not None:
            net[index] = (minus(net[index][0], external[0]), minus(net[index][1], external[1]))
    moment, force = algebra.zero_vector, algebra.zero_vector
    of_base = ROOT if carrier is base else CARRIER
    for number, at, push in held:
        if number >= 0:
            net[number] = (minus(net[number][0], cross(at, push)), minus(net[number][1], push))
        elif number == of_base:
            R, p = kinematics.pose(number)
            turned = apply(R, push)
            moment = minus(moment, cross(plus(p, apply(R, at)), turned))
            force = minus(force, turned)
    for index in reversed(range(len(tree.links))):
        link = tree.links[index]
        with algebra.tape.block(f"load that the base carries through joint {link.joint.name}"):
            load = carry(link, net[index])
            if link.parent == ROOT:
                moment, force = plus(moment, load[0]), plus(force, load[1])
            else:
                net[link.parent] = (plus(net[link.parent][0], load[0]), plus(net[link.parent][1], load[1]))
    omega, velocity = carrier.omega, carrier.velocity
    if carrier is not base:
        omega, velocity = apply(carrier.orientation, omega), apply(carrier.orientation, velocity)
        velocity = minus(velocity, cross(omega, carrier.position))
    return dot(moment, omega) + dot(force, velocity)
