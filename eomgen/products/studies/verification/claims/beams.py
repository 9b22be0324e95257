"""Claims of beams: K, D and K_geo equal the difference to the equations of motion with soft or unshortened beams."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from eomgen.formula.nodes import Number
from eomgen.lie.product import Factor
from eomgen.pipeline import pipeline
from eomgen.products.studies.verification.claims.claim import Claim, Space
from eomgen.products.studies.verification.engines import COMPLEX_STEP, Array, Blocks, Engine, moved, on_tape, spread
from eomgen.scene.bodies.beam import Beam
from eomgen.scene.scene import Scene
from eomgen.system.system import System

FAMILY = "beams"


@dataclass(frozen=True)
class _Change:
    """The equations of a scene, and of the same scene with other beams, on tapes."""

    own: Engine
    other: Engine
    name: str

    def along(self, state: Blocks, block: str, rates: Array) -> Array:
        """Return the differences of the derivatives of tau along rates (count, nv) of a block, (..., nv, count)."""
        stepped = moved(self.own, spread(state), {block: rates}, 1j * COMPLEX_STEP)
        by_rate = [engine("inverse_dynamics", stepped)["tau"].imag / COMPLEX_STEP for engine in (self.own, self.other)]
        return np.asarray(np.swapaxes(by_rate[0] - by_rate[1], -1, -2))


def beam_claims(space: Space, engine: Engine, system: System, scene: object) -> list[Claim]:
    """Return the claims of the term ``elastic``.

    The part of shortening in the partials of the elastic rows is K_geo for straight beams with coordinates at
    rest, without the part of distributed loads: they push along the axis, and K_geo knows only forces at its end.
    """
    if "elastic" not in engine or "inverse_dynamics" not in engine or not isinstance(scene, Scene):
        return []
    own, factors = on_tape(system), _elastic(system, scene)
    soft = _Change(own, _with(scene, _softened), "equations without stiffness")
    elements = tuple(item for item in scene.elements if item.section != "distributed_loads")
    bare = replace(scene, elements=elements)
    unforced = own if len(elements) == len(scene.elements) else _with(bare, lambda beam: beam)
    stiff = _Change(unforced, _with(bare, lambda beam: replace(beam, stiffening=False)), "equations without shortening")
    straight = _straight(factors)
    rows = np.concatenate([np.arange(item.v_start, item.v_start + item.v_size) for item in factors])
    return [
        _claim(space, "K", "q", "structural stiffness", soft, dict),
        _claim(space, "D", "v", "structural damping", soft, dict),
        _claim(space, "K_geo", "q", "where beams are straight and at rest", stiff, straight, rows),
    ]


def _softened(beam: Beam) -> Beam:
    return replace(beam, deformations=tuple(replace(item, stiffness=Number(0.0)) for item in beam.deformations))


def _with(scene: Scene, changed: Callable[[Beam], Beam]) -> Engine:
    bodies = tuple(body if body.beam is None else replace(body, beam=changed(body.beam)) for body in scene.bodies)
    return on_tape(pipeline.derive(replace(scene, bodies=bodies), ["inverse_dynamics"]))


def _elastic(system: System, scene: Scene) -> list[Factor]:
    beams = {body.name for body in scene.bodies if body.beam is not None}
    return [factor for factor in system.factors if factor.name in beams]


def _straight(factors: list[Factor]) -> Callable[[Blocks], dict[str, Array]]:
    """Return a function that gives states with straight beams whose coordinates are at rest."""

    def straight(state: Blocks) -> dict[str, Array]:
        result = dict(state)
        for block in ("q", "v", "a"):
            result[block] = state[block].copy()
            for factor in factors:
                start = factor.q_start if block == "q" else factor.v_start
                result[block][..., start : start + factor.v_size] = 0.0
        return result

    return straight


def _claim(
    space: Space,
    name: str,
    block: str,
    meaning: str,
    change: _Change,
    at: Callable[[Blocks], dict[str, Array]],
    kept: Array | None = None,
) -> Claim:
    """Return the claim of one matrix, of whose second derivation only the rows and columns ``kept`` count, if given."""
    along = space.along[block].matrix

    def second(engine: Engine, state: Blocks) -> Array:
        if kept is None:
            return change.along(at(state), block, along.T)
        result = np.zeros((*state["q"].shape[:-1], space.nv, space.nv))
        result[..., kept[:, np.newaxis], kept] = change.along(at(state), block, np.eye(space.nv)[kept])[..., kept, :]
        return np.asarray(result @ along)

    return Claim(
        f"elastic.{name}",
        meaning,
        FAMILY,
        lambda engine, state: np.asarray(engine("elastic", at(state))[name] @ along),
        second=second,
        second_name=change.name,
        rows=space.rows["v"],
        columns=space.along[block].names,
    )
