"""Strains and loads of the sections of geometrically exact beams along their axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from eomgen.arrays import Array
from eomgen.calls import ByName
from eomgen.compiled.terms import Extensible, Parameters
from eomgen.errors import Problem, UsageError


@dataclass(frozen=True, repr=False, eq=False)
class SectionLoads:
    """Strains and loads of one beam, of n elements, in the axes of its sections.

    Strains are those of the section in the middle of an element. A load is what the part of the beam beyond a section,
    of larger x, exerts on the part before it, so pulling and stretching are positive: stiffness times strains, plus
    damping times their rates, is its mean over an element. Between its nodes nothing acts on an element, so its two
    ends are in equilibrium, and loads jump at nodes by what acts on these: forces, weight, inertia.

    Attributes
    ----------
    x : (n,) m, middle of each element along the axis at rest
    curvature : (..., n, 3) 1/m; twist, curvature about y and about z, less those at rest
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
        """x of the nodes at rest, (n + 1,), m."""
        found = [0.0]
        for middle in self.x.tolist():
            found.append(2.0 * middle - found[-1])
        return np.array(found)

    def at(self, x: float) -> tuple[Array, Array]:
        """Return moment, N m, and force, N, of the section at x, (..., 3) each, linear between the ends of an element.

        At a node it is that of the element beyond, at the end that of the last one.

        Raises
        ------
        UsageError
            x is not on the beam.
        """
        nodes = self.nodes
        if not 0.0 <= x <= nodes[-1] * (1.0 + 1e-9):
            what = f"x = {x:.6g} m is not on the beam, which goes from 0 m to {nodes[-1]:.6g} m"
            raise UsageError(Problem("at", what, "a place on the beam at rest"))
        element = min(int(np.searchsorted(nodes, x + 1e-9 * nodes[-1], side="right")) - 1, len(self.x) - 1)
        share = (x - nodes[element]) / (nodes[element + 1] - nodes[element])
        moment, force = (
            (1.0 - share) * ends[..., element, 0, :] + share * ends[..., element, 1, :]
            for ends in (self.moment_at_ends, self.force_at_ends)
        )
        return moment, force

    def named(self) -> dict[str, Array]:
        """Return the arrays by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def section_loads(
    model: Extensible,
    q: ArrayLike,
    v: ArrayLike | None = None,
    t: ArrayLike = 0.0,
    *,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
) -> Mapping[str, SectionLoads]:
    """Return strains and loads along each geometrically exact beam by its name; at rest where no v is given.

    Raises
    ------
    UsageError
        The model has no geometrically exact beam; no multipliers, which are the forces of strains that a beam does not
        have.
    """
    beams = model.evaluator.description.exact_beams
    if not beams:
        hint = 'model = "cosserat" of an entry of [beams]'
        raise UsageError(Problem("section_loads", "the model has no geometrically exact beam", hint))
    model = model.having(("section_loads",))
    if multipliers is None and "lam" in model.evaluator.functions.inputs("section_loads"):
        what = "the forces of strains that a beam does not have are multipliers, and none are given"
        raise UsageError(Problem("section_loads", what, "multipliers=..., or section_loads of a solution"))
    v = np.zeros(model.evaluator.functions.sizes["v"]) if v is None else v
    names = model.evaluator.functions.output_names("section_loads")
    values = model.evaluator.call(
        "section_loads", q=q, v=v, t=t, multipliers=multipliers, parameters=parameters, base=base
    )
    return by_beam(beams, dict(zip(names, values, strict=True)))


def by_beam(beams: Sequence[Sequence[str]], found: Mapping[str, Array]) -> Mapping[str, SectionLoads]:
    """Return the blocks of the term ``section_loads`` by beams, which are given by the names of their nodes."""
    result, start = {}, 0
    for nodes in beams:
        here = slice(start, start + len(nodes) - 1)
        strain, load = found["strain"][..., here, :], found["load"][..., here, :]
        ends = found["load_at_ends"][..., here, :, :]
        x = found["x"][..., here]
        result[nodes[0]] = SectionLoads(
            x.reshape(-1, x.shape[-1])[0],
            strain[..., :3], strain[..., 3:], load[..., :3], load[..., 3:], ends[..., :3], ends[..., 3:],
        )  # fmt: skip  # one line for the parts
        start = here.stop
    return ByName("beam", result)
