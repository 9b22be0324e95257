"""Claims of bodies: twists against poses, accelerations and Jacobians against twists."""

from __future__ import annotations

import numpy as np

from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie.product import Factor
from eomgen.products.studies.verification.claims.claim import Claim, Space, along_motion, column
from eomgen.products.studies.verification.engines import Array, Blocks, Engine

FAMILY = "bodies"
_TWIST = ("omega x", "omega y", "omega z", "velocity x", "velocity y", "velocity z")
_POSE = ("quaternion w", "quaternion x", "quaternion y", "quaternion z", "position x", "position y", "position z")


def body_claims(space: Space, engine: Engine) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    there = set(engine.functions)
    claims = [_twists(space)] if {"poses", "twists"} <= there else []
    if {"twists", "accelerations"} <= there:
        claims.append(_accelerations(space))
    if {"twists", "jacobians"} <= there:
        claims.append(_jacobians(space))
    return claims


def _flat(values: Array) -> Array:
    return values.reshape(*values.shape[:-2], -1)


def _named(space: Space, parts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{part} of {body}" for body in space.bodies for part in parts)


def _twists(space: Space) -> Claim:
    factors = tuple(Factor("SE3", body, 7 * k, 7, 6 * k, 6) for k, body in enumerate(space.bodies))

    def value(engine: Engine, state: Blocks) -> Array:
        poses, twists = _flat(engine("poses", state)["pose"]), _flat(engine("twists", state)["twist"])
        return column(configuration_rate(factors, poses, twists))

    return Claim(
        "twists",
        "d pose / dt",
        FAMILY,
        value,
        source=lambda engine, state: _flat(engine("poses", state)["pose"]),
        directions=along_motion(("q", "v")),
        rows=_named(space, _POSE),
        functions=("poses",),
    )


def _accelerations(space: Space) -> Claim:
    def combine(engine: Engine, state: Blocks, G: Array) -> Array:
        """Return rates of components as accelerations: the origin's gains omega x velocity, in body axes."""
        twist = engine("twists", state)["twist"]
        rates = G[..., 0].reshape(twist.shape)
        turning = np.zeros_like(twist)
        turning[..., 3:] = np.cross(twist[..., :3], twist[..., 3:])
        return column(_flat(rates + turning))

    return Claim(
        "accelerations",
        "d twist / dt",
        FAMILY,
        lambda engine, state: column(_flat(engine("accelerations", state)["acceleration"])),
        source=lambda engine, state: _flat(engine("twists", state)["twist"]),
        directions=along_motion(("q", "v"), ("v", "a")),
        combine=combine,
        rows=_named(space, _TWIST),
        functions=("twists",),
    )


def _jacobians(space: Space) -> Claim:
    along = space.along["v"]

    def value(engine: Engine, state: Blocks) -> Array:
        J = engine("jacobians", state)["J"] @ along.matrix
        return np.asarray(J.reshape(*J.shape[:-3], -1, J.shape[-1]))

    return Claim(
        "jacobians",
        "d twist / dv",
        FAMILY,
        value,
        source=lambda engine, state: _flat(engine("twists", state)["twist"]),
        directions=lambda _: {"v": along.matrix.T},
        rows=_named(space, _TWIST),
        columns=along.names,
        functions=("twists",),
    )
