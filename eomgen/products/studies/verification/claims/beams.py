"""Claims of beams: terms equal differences to equations with soft or unshortened beams; section loads equal forces
on nodes and stiffness times strains.

The loads of an element's two end sections are in equilibrium, since no load acts between its nodes; the mean over the
element, along the helix between the ends, is stiffness times strain of the middle section, at rest. The jump of the
loads at a node is the beam's generalized force there, and follows from the equations with and without the beam.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from eomgen.base.data import dataclass, replace
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import ZERO, Number
from eomgen.lie import numeric
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor
from eomgen.pipeline import pipeline
from eomgen.products.studies.verification.claims.claim import (
    COMPLEX_STEP,
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Second,
    Space,
    Value,
    column,
    move_state,
    on_tape,
    spread,
)
from eomgen.scene.bodies.cosserat import BeamElement, BeamSection, Cosserat, Rows
from eomgen.scene.bodies.model import Beam
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.forces.distributed_loads import DistributedLoad
from eomgen.scene.scene import Scene
from eomgen.solvers.quadrature import gauss_legendre
from eomgen.system.system import System


@dataclass(frozen=True)
class _Change:
    """The inverse dynamics of a scene and of the same scene with other beams, as functions that take complex
    numbers."""

    full: Engine
    bare: Engine
    name: str

    def along(self, state: Blocks, block: str, rates: Array) -> Array:
        """Return the differences of the derivatives of tau along rates (count, nv) of a block, (..., nv, count)."""
        stepped = move_state(self.full, spread(state), {block: rates}, 1j * COMPLEX_STEP)
        by_rate = [engine("inverse_dynamics", stepped)["tau"].imag / COMPLEX_STEP for engine in (self.full, self.bare)]
        return np.asarray(np.swapaxes(by_rate[0] - by_rate[1], -1, -2))


def beam_claims(space: Space) -> list[Claim]:
    """Return the claims that the matrices K, D and K_geo of the term ``elastic`` are effects of beams on the equations.
    The part of shortening in the partials of the elastic rows is K_geo for straight beams with coordinates at rest,
    without the part of distributed loads: such loads push along the axis, and K_geo includes only forces at the end.
    Empty without this term."""
    scene = space.scene
    if not space.has("elastic", "inverse_dynamics") or not isinstance(scene, Scene):
        return []
    beams = {body.name for body in scene.bodies if body.beam is not None}
    engine, factors = on_tape(space.system), [factor for factor in space.system.factors if factor.name in beams]
    soft = _Change(engine, _with(scene, _soften), "equations without stiffness")
    elements = tuple(item for item in scene.elements if item.section != "distributed_loads")
    bare = replace(scene, elements=elements)
    unforced = engine if len(elements) == len(scene.elements) else _with(bare, lambda beam: beam)
    stiff = _Change(unforced, _with(bare, lambda beam: replace(beam, stiffening=False)), "equations without shortening")
    straight = _straight(factors)
    rows = np.concatenate([np.arange(item.v_start, item.v_start + item.v_size) for item in factors])
    return [
        _claim(space, "K", "q", "structural stiffness", soft),
        _claim(space, "D", "v", "structural damping", soft),
        replace(_claim(space, "K_geo", "q", "where beams are straight and at rest", stiff, rows), at=straight),
    ]


def _soften(beam: Beam) -> Beam:
    return replace(beam, deformations=tuple(replace(item, stiffness=Number(0.0)) for item in beam.deformations))


def _with(scene: Scene, changed: Callable[[Beam], Beam]) -> Engine:
    bodies = tuple(body if body.beam is None else replace(body, beam=changed(body.beam)) for body in scene.bodies)
    return on_tape(pipeline.derive(replace(scene, bodies=bodies), ["inverse_dynamics"]))


def _straight(factors: list[Factor]) -> Callable[[Engine, Blocks], dict[str, Array]]:
    """Return a function that maps a state to the state with q, v and a of the beams' `factors` set to zero."""

    def straight(engine: Engine, state: Blocks) -> dict[str, Array]:
        result = dict(state)
        for block in ("q", "v", "a"):
            result[block] = state[block].copy()
            for factor in factors:
                start = factor.q_start if block == "q" else factor.v_start
                result[block][..., start : start + factor.v_size] = 0.0
        return result

    return straight


def _claim(space: Space, name: str, block: str, meaning: str, change: _Change, kept: Array | None = None) -> Claim:
    """Return the claim that matrix `name` of the term ``elastic`` equals a difference of derivatives of inverse
    dynamics. `change` has the equations with and without an effect, `block` is q or v. Only the rows and columns
    ``kept`` of the second derivation count, if given."""
    along = space.along[block].matrix

    def second(engine: Engine, state: Blocks) -> Array:
        if kept is None:
            return change.along(state, block, along.T)
        nv = space.system.nv
        result = np.zeros((*state["q"].shape[:-1], nv, nv))
        result[..., kept[:, np.newaxis], kept] = change.along(state, block, np.eye(nv)[kept])[..., kept, :]
        return np.asarray(result @ along)

    return Claim(
        f"elastic.{name}",
        meaning,
        ClaimOutput("elastic", name) @ along,
        second=Second(change.name, second),
        rows=space.rows["v"],
        columns=space.along[block].names,
    )


#: Nodes and weights of Gauss's rule on 0 to 1: exact to rounding for elements that turn by less than half a turn.
_PLACES, _WEIGHTS = (numbers[0] for numbers in gauss_legendre(np.array([0.0, 1.0]), 16))
_LOADS = ("moment x", "moment y", "moment z", "force x", "force y", "force z")
_NOTHING: Rows = ((ZERO,) * 6,) * 6


def section_claims(space: Space) -> list[Claim]:
    """Return the claims that section loads of geometrically exact beams are in equilibrium with nodes, strains and
    loads. Empty without the terms ``section_loads`` and ``poses``."""
    scene = space.scene
    if not space.has("section_loads", "poses") or not isinstance(scene, Scene):
        return []
    beams = _BeamElements.of(space, scene)
    claims = [_balance(beams), _mean(beams), _strains(beams, space.system)]
    if space.has("jacobians", "force"):
        claims.append(_jumps(space, beams, scene))
    if space.has("jacobians", "residual"):
        claims.append(_halves(space, beams, scene))
    return claims


@dataclass(frozen=True)
class _BeamElements:
    """The geometrically exact beams of a scene, and the numbers of the bodies at the first and second end of each
    element. Elements are in the order of the term ``section_loads``."""

    beams: tuple[Cosserat, ...]
    first: tuple[int, ...]
    second: tuple[int, ...]

    @classmethod
    def of(cls, space: Space, scene: Scene) -> _BeamElements:
        beams = tuple(item.beam for item in scene.elements if isinstance(item, CosseratBeam))
        number = {name: index for index, name in enumerate(space.system.bodies)}
        first = tuple(number[node] for beam in beams for node in beam.nodes[:-1])
        second = tuple(number[node] for beam in beams for node in beam.nodes[1:])
        return cls(beams, first, second)

    @property
    def parts(self) -> list[tuple[Cosserat, BeamElement]]:
        return [(beam, part) for beam in self.beams for part in beam.parts]

    def rows(self, names: Sequence[str]) -> tuple[str, ...]:
        elements = [f"element {number} of {beam.name}" for beam in self.beams for number in range(1, beam.elements + 1)]
        return tuple(f"{name} of {element}" for element in elements for name in names)

    def on_nodes(self, first: Value, second: Value) -> Value:
        """Return a function for the generalized forces (..., nv, 1) of wrenches on the nodes at both ends of all
        elements. `first` and `second` give the wrenches (..., elements, 6) in the axes of the nodes."""

        def value(engine: Engine, state: Blocks) -> Array:
            J = engine("jacobians", state)["J"]
            ends = ((self.first, first), (self.second, second))
            parts = [
                np.einsum("...kij,...ki->...j", J[..., list(nodes), :, :], of(engine, state)) for nodes, of in ends
            ]
            return column(parts[0] + parts[1])

        return value

    def twists(self, engine: Engine, state: Blocks) -> Array:
        """Return the logarithm of the second node's pose in the first, (..., elements, 6)."""
        poses = engine("poses", state)["pose"]
        first, second = poses[..., list(self.first), :], poses[..., list(self.second), :]
        return numeric.log(SE3, numeric.compose(SE3, numeric.inverse(SE3, first), second))


def _transform_wrench(twist: Array, load: Array) -> Array:
    """Return a wrench, (..., 6), at the frame exp(twist), given at the reference frame: Ad^T(exp(twist)) load."""
    adjoint = numeric.adjoint(SE3, numeric.exp(SE3, twist))
    return np.asarray(np.einsum("...ji,...j->...i", adjoint, load))


def _flat(values: Array) -> Array:
    return column(values.reshape(*values.shape[:-2], -1))


_ENDS, _LOAD = ClaimOutput("section_loads", "load_at_ends"), ClaimOutput("section_loads", "load")
_FIRST, _SECOND = _ENDS[..., 0, :], _ENDS[..., 1, :]


def _largest_load(engine: Engine, state: Blocks) -> Array:
    return np.asarray(np.max(np.abs(_ENDS(engine, state)), axis=(-3, -2, -1)))


def _balance(beams: _BeamElements) -> Claim:
    return Claim(
        "section_loads.load_at_ends",
        "equilibrium of each element",
        lambda engine, state: _flat(_SECOND(engine, state)),
        second=Second(
            "poses", lambda engine, state: _flat(_transform_wrench(beams.twists(engine, state), _FIRST(engine, state)))
        ),
        size=_largest_load,
        rows=beams.rows(_LOADS),
    )


def _mean(beams: _BeamElements) -> Claim:
    """Return the claim that the section load of an element is the mean of transformed end wrenches along the
    element."""

    def second(engine: Engine, state: Blocks) -> Array:
        twists, first = beams.twists(engine, state), _FIRST(engine, state)
        along = [
            weight * _transform_wrench(share * twists, first) for share, weight in zip(_PLACES, _WEIGHTS, strict=True)
        ]
        return _flat(np.sum(along, axis=0))

    return Claim(
        "section_loads.load",
        "mean along each element",
        lambda engine, state: _flat(_LOAD(engine, state)),
        second=Second("poses", second),
        size=_largest_load,
        rows=beams.rows(_LOADS),
    )


def _strains(beams: _BeamElements, system: System) -> Claim:
    """Return the claim that stiffness of the sections times strains is the mean load at rest, with zero multipliers."""
    numbers = {parameter.name: k for k, parameter in enumerate(system.parameters)}

    def matrices(state: Blocks) -> Array:
        parameters = state.get("p", np.zeros((1, 0)))[0]

        def number(entry: object) -> float:
            return evaluate(entry, lambda symbol: float(parameters[numbers[symbol.name]]))  # type: ignore[arg-type]

        rows = [[[number(entry) for entry in row] for row in part.section.stiffness] for _, part in beams.parts]
        return np.array(rows)

    def still(engine: Engine, state: Blocks) -> dict[str, Array]:
        return {name: np.zeros_like(array) if name in ("v", "lam") else array for name, array in state.items()}

    def value(engine: Engine, state: Blocks) -> Array:
        strains = engine("section_loads", state)["strain"]
        return _flat(np.einsum("kij,...kj->...ki", matrices(state), strains))

    return Claim(
        "section_loads.strain",
        "stiffness times strain",
        value,
        second=Second("load at rest", lambda engine, state: _flat(_LOAD(engine, state))),
        size=lambda engine, state: np.max(np.abs(_LOAD(engine, state)), axis=(-2, -1)),
        rows=beams.rows(_LOADS),
        at=still,
    )


def _jumps(space: Space, beams: _BeamElements, scene: Scene) -> Claim:
    """Return the claim that section loads at nodes give, by virtual work, the generalized forces of the beams'
    stiffness. The second derivation are the equations with and without stiffness."""
    without = on_tape(pipeline.derive(_without_stiffness(scene), ["force"]))
    tape_engine = on_tape(space.system)
    names = tuple(f"{beam.name}: no " for beam in beams.beams)
    of_beams = np.array([name.startswith(names) for name in space.rows.get("lam", ())], dtype=float)

    def second(engine: Engine, state: Blocks) -> Array:
        result = tape_engine("force", state)["Q"] - without("force", state)["Q"]
        if "lam" in state and "residual" in engine and of_beams.any():
            none = {**state, "lam": np.zeros_like(state["lam"])}
            only = {**state, "lam": state["lam"] * of_beams}
            result = result - engine("residual", only)["r"] + engine("residual", none)["r"]
        return column(result)

    return Claim(
        "section_loads.load_at_ends, at nodes",
        "virtual work on the nodes",
        beams.on_nodes(_FIRST, -1.0 * _SECOND),
        second=Second("equations without stiffness", second),
        size=_largest_load,
        rows=space.rows["v"],
    )


def _halves(space: Space, beams: _BeamElements, scene: Scene) -> Claim:
    """Return the claim that loads on halves of elements give, by virtual work, the effect of loads, weight and inertia.
    The second derivation is the change of the residual by doubled distributed loads and masses."""
    twice = on_tape(pipeline.derive(_with_twice_the_loads(scene), ["residual"]))
    tape_engine, halves = on_tape(space.system), ClaimOutput("section_loads", "load_on_halves")
    return Claim(
        "section_loads.load_on_halves",
        "virtual work on the nodes",
        beams.on_nodes(halves[..., 0, :], halves[..., 1, :]),
        second=Second(
            "equations with twice the loads",
            lambda engine, state: column(tape_engine("residual", state)["r"] - twice("residual", state)["r"]),
        ),
        size=lambda engine, state: np.max(np.abs(tape_engine("residual", state)["r"]), axis=-1),
        rows=space.rows["v"],
    )


def _with_twice_the_loads(scene: Scene) -> Scene:
    """Return a scene whose geometrically exact beams have twice the mass and twice the distributed loads."""

    def heavier(part: BeamElement) -> BeamElement:
        return replace(part, section=_twice_the_mass(part.section), halves=tuple(map(_twice_the_mass, part.halves)))

    heavy = _with_elements(scene, heavier)
    beams = [item.beam for item in heavy.elements if isinstance(item, CosseratBeam)]
    nodes = {body.name: body for beam in beams for body in beam.bodies()}
    elements = tuple(
        replace(
            item, nodes=tuple(replace(load, halves=(2 * load.halves[0], 2 * load.halves[1])) for load in item.nodes)
        )
        if isinstance(item, DistributedLoad) and item.nodes
        else item
        for item in heavy.elements
    )
    return replace(heavy, elements=elements, bodies=tuple(nodes.get(body.name, body) for body in scene.bodies))


def _twice_the_mass(section: BeamSection) -> BeamSection:
    two = Number(2.0)
    x, y, z = (two * inertia for inertia in section.rotary_inertia)
    xy, xz, yz = (two * product for product in section.products)
    mass = two * section.mass_per_length
    return replace(section, mass_per_length=mass, rotary_inertia=(x, y, z), products=(xy, xz, yz))


def _without_stiffness(scene: Scene) -> Scene:
    def slack(part: BeamElement) -> BeamElement:
        return replace(part, section=replace(part.section, stiffness=_NOTHING, damping=_NOTHING), moments=None)

    return _with_elements(scene, slack)


def _with_elements(scene: Scene, changed: Callable[[BeamElement], BeamElement]) -> Scene:
    """Return a scene in which `changed` is applied to each element of the geometrically exact beams."""
    elements = tuple(
        replace(item, beam=replace(item.beam, parts=tuple(map(changed, item.beam.parts))))
        if isinstance(item, CosseratBeam)
        else item
        for item in scene.elements
    )
    return replace(scene, elements=elements)
