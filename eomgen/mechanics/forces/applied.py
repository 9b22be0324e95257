"""All applied loads of a scene by virtual work: laws of force elements, looked up by the names that their classes give,
forces in joints, and stiffness and damping of beams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.base.products import import_target
from eomgen.errors import Problem, UsageError
from eomgen.mechanics.forces.joint_forces import add_joint
from eomgen.mechanics.forces.loads import Law, Loads, no_loads
from eomgen.mechanics.forces.symbols import Offers, Quantities
from eomgen.mechanics.tree.beam_body import ElasticBody, deformations
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar, dot

Rows = list[list[Scalar]]


def stiffness_and_damping(body: ElasticBody, quantities: Quantities) -> tuple[Rows, Rows]:
    """Return stiffness K and damping D of a beam's elastic coordinates, (n, n) each.

    D is stiffness damping times K, plus 2 zeta sqrt(k m) on the diagonal for each coordinate alone, which is modal
    damping if the shapes are modes of the beam alone.
    """
    algebra, integrals, n = body.algebra, body.mass.integrals, body.size
    K, D = ([[algebra.zero] * n for _ in range(n)] for _ in range(2))
    for item, here in deformations(body.beam):
        stiffness, share = quantities.formula(item.stiffness), quantities.formula(item.stiffness_damping)
        for k in here:
            for j in here:
                K[k][j] = stiffness * float(integrals.k[k, j])
                D[k][j] = share * K[k][j]
            if item.damping_ratio:
                critical = 2.0 * algebra.call(Op.SQRT, K[k][k] * body.inertia_of(k))
                D[k][k] = D[k][k] + item.damping_ratio * critical
    return K, D


def add_structure(loads: Loads, body: ElasticBody, quantities: Quantities) -> None:
    """Add the elastic and damping forces -K eta - D eta' of a beam's coordinates to ``loads``, in place, with strain
    energy and dissipated power."""
    K, D = stiffness_and_damping(body, quantities)
    q, v = body.coordinates.q, body.coordinates.v
    for dof, coordinate, rate, stiff, damped in zip(body.coordinates.dofs, q, v, K, D, strict=True):
        elastic, viscous = dot(stiff, q), dot(damped, v)
        loads.efforts[dof] = loads.efforts[dof] - (elastic + viscous)
        loads.potential = loads.potential + 0.5 * (coordinate * elastic)
        loads.power = loads.power - rate * viscous


def law_of(kind: type[ForceElement]) -> Law:
    """Return the force law of a class of force elements, imported from ``kind.law``.

    Raises
    ------
    UsageError
        If the module does not load, or has no law for this class: one of another distribution may be broken.
    """
    try:
        law, why = import_target(kind.law), None
        fault = f"is not an eomgen.mechanics.forces.loads.Law of {kind.__qualname__} [E0500]"
        if isinstance(law, Law) and law.model is kind:
            return law
    except Exception as error:  # any error of a module of another distribution
        fault, why = f"does not load: {type(error).__name__}: {error} [E0499]", error
    text = f"the law {kind.law} of {kind.__module__}.{kind.__qualname__} {fault}"
    raise UsageError(Problem(kind.section, text, "another version of the distribution that brings it")) from why


def laws_of(scene: Scene) -> list[Law]:
    """Return the laws of a scene's force elements in the order of the sections in the register."""
    return [law_of(kind) for kind in dict.fromkeys(type(element) for element in scene.elements)]


def offered_by(scene: Scene) -> Offers:
    """Return the quantities that a scene's force elements offer to formulas."""
    return {kind: (law.model.section, offer) for law in laws_of(scene) for kind, offer in law.offers.items()}


def applied_loads(scene: Scene, tree: Tree, quantities: Quantities) -> Loads:
    """Return all loads on the tree but gravity: force elements, joint forces, stiffness and damping of beams."""
    loads = no_loads(tree)
    laws = laws_of(scene)
    _add_elements(loads, [law for law in laws if law.before_joints], scene, quantities)
    for joint in scene.joints:
        add_joint(loads, joint, quantities)
    for link in tree.links:
        if link.elastic is not None:
            with tree.algebra.tape.block(f"stiffness and damping of {link.name}"):
                add_structure(loads, link.elastic, quantities)
    _add_elements(loads, [law for law in laws if not law.before_joints], scene, quantities)
    return loads


def _add_elements(loads: Loads, laws: Sequence[Law], scene: Scene, quantities: Quantities) -> None:
    for law in laws:
        elements: Sequence[Any] = [element for element in scene.elements if isinstance(element, law.model)]
        if law.together is not None and elements:
            elements = law.together(loads, elements, quantities)
        for element in elements:
            with quantities.algebra.tape.block(element.label):
                law.add(loads, element, quantities)
