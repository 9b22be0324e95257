"""The geometrically exact beams of a compiled model: as assembly takes them, states with their nodes in place, strains
and loads of their sections along the axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.base.data import dataclass, fields
from eomgen.compiled.terms import ExtensibleModel, Inputs, Parameters, States
from eomgen.errors import Problem, UsageError
from eomgen.solvers.beams import Beams, beams_of
from eomgen.system.terms import PURPOSES


def beams_at(model: ExtensibleModel, t: float, p: Array) -> Beams | None:
    """Return the geometrically exact beams of a model at parameters p (np,) and time t in s, for assembly. None if the
    model has no such beams, or no term ``poses``."""
    description, terms = model.evaluator.description, model.having(("poses",)).evaluator
    if not description.element_stiffness or "poses" not in terms.functions:
        return None
    return beams_of(
        description.element_stiffness,
        description.values(dict(zip(terms.parameter_names, p.tolist(), strict=True))),
        terms.bodies,
        terms.factors,
        lambda q: terms.call("poses", q=q, t=t, parameters=p)[0],
        absolute=bool(description.joints),
    )


def placed_nodes(
    model: ExtensibleModel, before: tuple[Array, Array], after: tuple[Array, Array], p: Array, bodies: Sequence[str]
) -> tuple[Array, Array]:
    """Return q and v with the nodes of each beam placed, and moving, rigidly with the first node of the beam.

    Parameters
    ----------
    before : q, (nq,), with the shapes of the beams at the default parameters, and v, (nv,), of rigid motions
    after : q and v of the remaining coordinates
    p : (np,) parameters
    bodies : names of the bodies whose coordinates stay
    """
    terms = model.evaluator
    shapes, beams = beams_at(model, 0.0, terms.parameters(None)), beams_at(model, 0.0, p)
    if shapes is None or beams is None:
        return after
    from eomgen.solvers.rigid_beams import RigidBeams  # noqa: PLC0415  # few models have exact beams

    rigid = RigidBeams(shapes, terms.factors, np.array([unit == "rad/s" for unit in terms.v_units]), before[0])
    at_start = rigid.velocities(before[0], before[1][np.newaxis])[0]
    rigid = rigid.of(beams)
    kept_q, kept_v = (np.zeros(terms.functions.sizes[block], dtype=bool) for block in "qv")
    for factor in terms.factors:
        if factor.name in bodies:
            kept_q[factor.q], kept_v[factor.v] = True, True
    q = np.where(kept_q, after[0], rigid.place(after[0]))
    along = rigid.velocities(q, after[1][np.newaxis])[0]
    return q, np.where(kept_v | rigid.free, after[1], before[1] - at_start + along)


#: Signs of the loads on halves: added to the transmitted load at the first node, already included at the second node.
_SIGNS = np.array([[1.0], [-1.0]])


@dataclass(frozen=True, repr=False, eq=False)
class SectionLoads:
    """Strains and loads of one beam, of n elements, in the axes of the beam's sections.

    Strains refer to the section in the middle of an element. A load is exerted by the part of the beam beyond a
    section, of larger x, on the part before the section, so pulling and stretching are positive: stiffness times
    strains, plus damping times rates of strains, is the mean load of an element. Loads at the ends of an element differ
    by the distributed loads, the weight and the inertia forces of the element's halves; loads jump at nodes by
    concentrated loads alone.

    Attributes
    ----------
    x : (n,) m, middle of each element along the axis at rest
    curvature : (..., n, 3) 1/m; changes from rest of twist, curvature about y and curvature about z
    strain : (..., n, 3); stretch, shear along y and along z
    moment : (..., n, 3) N m; torque, bending moment about y and about z; mean of the element
    force : (..., n, 3) N; axial force, shear force along y and along z; mean of the element
    moment_at_ends, force_at_ends : (..., n, 2, 3), of the first and the last section of each element
    """

    x: Array
    curvature: Array
    strain: Array
    moment: Array
    force: Array
    moment_at_ends: Array
    force_at_ends: Array

    def __repr__(self) -> str:
        return f"<SectionLoads: {len(self.x)} elements; {', '.join(field.name for field in fields(self))}>"

    @property
    def nodes(self) -> Array:
        """Coordinates x of the nodes at rest, (n + 1,), m."""
        result = [0.0]
        for middle in self.x.tolist():
            result.append(2.0 * middle - result[-1])
        return np.array(result)

    def at(self, x: float) -> tuple[Array, Array]:
        """Return the loads of the section at a place of the axis, linear between the ends of an element.

        The part of the beam beyond the section, of larger x, exerts the loads on the part before. At a node the loads
        are taken on the element beyond the node, at the end on the last element.

        Parameters
        ----------
        x : float
            Place of the section along the axis at rest, m.

        Returns
        -------
        moment : (..., 3) ndarray
            Torque and bending moments about y and z in the axes of the section, N m.
        force : (..., 3) ndarray
            Axial force and shear forces along y and z in the axes of the section, N.

        Raises
        ------
        UsageError
            x is not on the beam.
        """
        nodes = self.nodes
        if not 0.0 <= x <= nodes[-1] * (1.0 + 1e-9):
            fault = f"x = {x:.6g} m is not on the beam, which goes from 0 m to {nodes[-1]:.6g} m [E0248]"
            raise UsageError(Problem("at", fault, "a place on the beam at rest"))
        element = min(int(np.searchsorted(nodes, x + 1e-9 * nodes[-1], side="right")) - 1, len(self.x) - 1)
        share = (x - nodes[element]) / (nodes[element + 1] - nodes[element])
        moment, force = (
            (1.0 - share) * ends[..., element, 0, :] + share * ends[..., element, 1, :]
            for ends in (self.moment_at_ends, self.force_at_ends)
        )
        return moment, force

    def named(self) -> dict[str, Array]:
        """Return the arrays by name.

        Returns
        -------
        dict
            The arrays by name.
        """
        return {field.name: getattr(self, field.name) for field in fields(self)}


def section_loads(
    model: ExtensibleModel,
    q: ArrayLike,
    v: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    u: Inputs = None,
    *,
    a: ArrayLike | None = None,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Mapping[str, SectionLoads]:
    """Return strains and loads along each geometrically exact beam by name; missing terms are compiled once.

    Parameters
    ----------
    t : array_like, optional
        Time (...), s.
    u, z, parameters : mapping or array_like, optional
        Inputs (..., nu), internal states (..., nz) and tunable parameters (..., np), SI units; values of the scene if
        not given.
    base : array_like, optional
        State of the base (..., 19), as returned by ``base``; the scene's motion at t if not given.
    q, v : (..., nq), (..., nv)
        At rest if no v is given.
    a : (..., nv), optional
        Accelerations for the inertia forces on the elements: by default zero at rest, and computed by forward dynamics
        if v is given. If a beam has suppressed strains and no multipliers are given, ``a`` is not taken: accelerations
        and multipliers are both computed by forward dynamics, at rest as well.
    multipliers : (..., rows), optional
        Multipliers of all constraints, for the forces of suppressed strains; unused if no strain is suppressed. By
        default computed by forward dynamics.

    Returns
    -------
    mapping
        ``SectionLoads`` by the name of the beam, with the leading axes of the arguments.

    Raises
    ------
    UsageError
        The model has no geometrically exact beam.
    """
    beams = model.evaluator.description.exact_beams
    if not beams:
        hint = 'model = "cosserat" of an entry of [beams]'
        raise UsageError(Problem("section_loads", "the model has no geometrically exact beam [E0249]", hint))
    model = model.having(("section_loads",))
    rest = np.zeros(model.evaluator.functions.sizes["v"])
    if multipliers is None and "lam" in model.evaluator.functions.inputs("section_loads"):
        a = None  # both are of the dynamics
    elif v is None and a is None:
        a = rest
    if a is None:
        model = model.having(("section_loads", *PURPOSES["accelerations"]))
    v = rest if v is None else v
    names = model.evaluator.functions.output_names("section_loads")
    values = model.evaluator.call(
        "section_loads", q=q, v=v, a=a, t=t, u=u, z=z, multipliers=multipliers, parameters=parameters, base=base
    )
    return by_beam(beams, dict(zip(names, values, strict=True)))


def by_beam(beams: Sequence[Sequence[str]], values: Mapping[str, Array]) -> Mapping[str, SectionLoads]:
    """Return strains and loads of each beam from the blocks of the term ``section_loads``, by the name of the first
    node. ``beams`` are the names of the nodes of each beam; the elements follow one another in the blocks."""
    result, start = {}, 0
    for nodes in beams:
        here = slice(start, start + len(nodes) - 1)
        strain, load = values["strain"][..., here, :], values["load"][..., here, :]
        ends = values["load_at_ends"][..., here, :, :] + _SIGNS * values["load_on_halves"][..., here, :, :]
        x = values["x"][..., here]
        result[nodes[0]] = SectionLoads(
            x.reshape(-1, x.shape[-1])[0],
            strain[..., :3], strain[..., 3:], load[..., :3], load[..., 3:], ends[..., :3], ends[..., 3:],
        )  # fmt: skip  # one line for the parts
        start = here.stop
    return NamedResults("beam", result)
