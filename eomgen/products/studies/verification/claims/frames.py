"""Claims of bodies, of frames and of the momentum of all that moves: Jacobians against poses, rates against
Jacobians, sums over bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.base.data import dataclass
from eomgen.compiled.coordinates import configuration_rate
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import Formula, Symbol
from eomgen.lie.numeric import rotated
from eomgen.lie.product import Factor
from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    Engine,
    Space,
    along_motion,
    column,
    fixed,
)
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from eomgen.system.terms import REFERENCES

FAMILY = "frames"
_AXES = ("x", "y", "z")
_POSE = tuple(f"quaternion {part}" for part in "wxyz") + tuple(f"position {axis}" for axis in _AXES)
_TWIST = tuple(f"{part} {axis}" for part in ("omega", "velocity") for axis in _AXES)
#: Derivatives of matrices that cancel, as in cos^2 + sin^2, are of this size, relative to the summands.
_CANCELLING = 1e-3
_MOMENTUM = tuple(f"{part} {axis}" for part in ("angular", "linear") for axis in _AXES)


def frame_claims(space: Space, engine: Engine, system: System, scene: object) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    claims = []
    for reference, (ending, _) in REFERENCES.items():
        rows = tuple(f"{part} of {frame}" for frame in system.frames for part in _TWIST)
        if f"frame_jacobians{ending}" in engine and "frame_poses" in engine:
            claims.append(_jacobians(space, system, reference))
        if f"frame_jacobian_rates{ending}" in engine:
            names = f"frame_jacobians{ending}", f"frame_jacobian_rates{ending}", f"frame_drifts{ending}"
            claims += _in_time(engine, "J", *names, rows)
    if {"frame_mobilities", "frame_jacobians_aligned", "mass"} <= set(engine.functions):
        claims.append(_mobilities(system))
    return claims + _of_all(space, engine, system, scene)


def _of_all(space: Space, engine: Engine, system: System, scene: object) -> list[Claim]:
    """Return the claims of the centre of mass and of the momentum."""
    claims = []
    W = space.along["q"].matrix
    if {"center_of_mass", "center_of_mass_jacobian"} <= set(engine.functions):
        claims.append(
            Claim(
                "center_of_mass_jacobian.J",
                "d c / dq",
                FAMILY,
                lambda engine, state: np.asarray(engine("center_of_mass_jacobian", state)["J"] @ W),
                source=lambda engine, state: engine("center_of_mass", state)["c"],
                directions=fixed({"q": W.T}),
                rows=_AXES,
                columns=space.along["q"].names,
                functions=("center_of_mass",),
            )
        )
    for entry, matrix, drift, rows in (
        ("J", "center_of_mass_jacobian", "center_of_mass_drift", _AXES),
        ("A", "centroidal_momentum", "centroidal_drift", _MOMENTUM),
    ):
        if {matrix, f"{matrix}_rate"} <= set(engine.functions):
            claims += _in_time(engine, entry, matrix, f"{matrix}_rate", drift, rows)
    if "centroidal_momentum" in engine:
        claims += _momentum(space, engine, system, scene)
    return claims


def _in_time(engine: Engine, entry: str, matrix: str, rate: str, drift: str, rows: tuple[str, ...]) -> list[Claim]:
    """Return the claims of dJ/dt along the motion, and of dJ/dt v, the derivative of J v at constant v."""
    out = f"{entry}_dot"

    def product(engine: Engine, state: Blocks) -> Array:
        values = engine(matrix, state)[entry] @ _shaped(state["v"], engine(matrix, state)[entry])
        return np.asarray(values.reshape(*state["q"].shape[:-1], -1))

    def rate_times_velocity(engine: Engine, state: Blocks) -> Array:
        values = engine(rate, state)[out]
        return column((values @ _shaped(state["v"], values)).reshape(*state["q"].shape[:-1], -1))

    def sizes(engine: Engine, state: Blocks) -> Array:
        speeds = np.abs(state["v"])
        result, still = (
            (values @ _shaped(speeds, values)).reshape(len(speeds), -1).max(axis=-1)
            for values in (np.abs(engine(rate, state)[out]), np.abs(engine(matrix, state)[entry]))
        )
        return np.asarray(np.maximum(result, _CANCELLING * still * speeds.max(axis=-1)))

    claims = [
        Claim(
            f"{rate}.{out}",
            f"d {entry} / dt",
            FAMILY,
            lambda engine, state: column(_flat(engine, state, rate, out)),
            source=lambda engine, state: _flat(engine, state, matrix, entry),
            directions=along_motion(("q", "v")),
            functions=(matrix,),
        )
    ]
    if drift in engine:
        claims.append(
            Claim(
                f"{drift}.drift",
                f"d ({entry} v) / dt, v constant",
                FAMILY,
                lambda engine, state: column(_flat(engine, state, drift, "drift")),
                source=product,
                directions=along_motion(("q", "v")),
                second=rate_times_velocity,
                second_name=rate,
                size=sizes,
                rows=rows,
                functions=(matrix,),
            )
        )
    return claims


def _flat(engine: Engine, state: Blocks, function: str, output: str) -> Array:
    """Return an output as vectors, (..., n)."""
    return engine(function, state)[output].reshape(*state["q"].shape[:-1], -1)


def _shaped(v: Array, matrices: Array) -> Array:
    """Return velocities as columns, with as many axes as matrices (..., rows, nv) have."""
    return v.reshape(*v.shape[:-1], *(1,) * (matrices.ndim - v.ndim - 1), v.shape[-1], 1)


def _jacobians(space: Space, system: System, reference: str) -> Claim:
    """Return the claim that J w is the twist of the pose along w, the base held."""
    W, term, count = space.along["q"].matrix, f"frame_jacobians{REFERENCES[reference][0]}", len(system.frames)
    factors = tuple(Factor("SE3", frame, 7 * k, 7, 6 * k, 6) for k, frame in enumerate(system.frames))

    def value(engine: Engine, state: Blocks) -> Array:
        pose = engine("frame_poses", state)["frame_pose"][..., np.newaxis, :, :]
        twists = np.moveaxis(engine(term, state)["J"] @ W, -1, -3)  # (..., columns, frames, 6)
        own = _in_own_axes(pose, twists, reference)
        flat = pose.reshape(*pose.shape[:-2], 7 * count), own.reshape(*own.shape[:-2], 6 * count)
        return np.swapaxes(configuration_rate(factors, *flat), -1, -2)

    return Claim(
        f"{term}.J",
        "d pose / dq",
        FAMILY,
        value,
        source=lambda engine, state: _flat(engine, state, "frame_poses", "frame_pose"),
        directions=fixed({"q": W.T}),
        rows=tuple(f"{part} of {frame}" for frame in system.frames for part in _POSE),
        columns=space.along["q"].names,
        functions=("frame_poses",),
    )


def _in_own_axes(pose: Array, twist: Array, reference: str) -> Array:
    """Return twists (..., 6) of frames with poses (..., 7) in frame axes, about the origins of the frames."""
    if reference == "body":
        return twist
    omega, velocity = twist[..., :3], twist[..., 3:]
    if reference == "world":
        velocity = velocity + np.cross(omega, pose[..., 4:])
    back = pose[..., :4] * [1.0, -1.0, -1.0, -1.0]
    return np.concatenate([rotated(back, omega), rotated(back, velocity)], axis=-1)


def _mobilities(system: System) -> Claim:
    def second(engine: Engine, state: Blocks) -> Array:
        J, M = engine("frame_jacobians_aligned", state)["J"], engine("mass", state)["M"][..., np.newaxis, :, :]
        return column((J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))).reshape(*state["q"].shape[:-1], -1))

    pairs = [f"{left}, {right}" for left in _TWIST for right in _TWIST]
    return Claim(
        "frame_mobilities.mobility",
        "J M^-1 J^T",
        FAMILY,
        lambda engine, state: column(_flat(engine, state, "frame_mobilities", "mobility")),
        second=second,
        second_name="by M",
        rows=tuple(f"{pair} of {frame}" for frame in system.frames for pair in pairs),
    )


def _momentum(space: Space, engine: Engine, system: System, scene: object) -> list[Claim]:
    """Return the claims of A: linear rows by the Jacobian of the centre of mass; all by the sum over rigid bodies."""
    W = space.along["q"].matrix
    claims = []

    def linear(engine: Engine, state: Blocks) -> Array:
        mass = engine("center_of_mass", state)["m"][..., np.newaxis]
        return np.asarray(mass * (engine("center_of_mass_jacobian", state)["J"] @ W))

    if {"center_of_mass", "center_of_mass_jacobian"} <= set(engine.functions):
        claims.append(
            Claim(
                "centroidal_momentum.A, linear",
                "m J of the centre of mass",
                FAMILY,
                lambda engine, state: np.asarray(engine("centroidal_momentum", state)["A"][..., 3:, :] @ W),
                second=linear,
                second_name="center_of_mass_jacobian",
                rows=_MOMENTUM[3:],
                columns=space.along["q"].names,
            )
        )
    rigid = isinstance(scene, Scene) and all(body.beam is None for body in scene.bodies)
    if isinstance(scene, Scene) and rigid and {"poses", "jacobians"} <= set(engine.functions):
        bodies = _RigidBodies(system, scene, space.bodies)
        claims.append(
            Claim(
                "centroidal_momentum.A",
                "sum over bodies",
                FAMILY,
                lambda engine, state: np.asarray(engine("centroidal_momentum", state)["A"] @ W),
                second=lambda engine, state: bodies.momentum(engine, state) @ W,
                second_name="poses and jacobians",
                rows=_MOMENTUM,
                columns=space.along["q"].names,
            )
        )
    return claims


@dataclass(frozen=True)
class _RigidBodies:
    """Rigid bodies of a scene in the order of the terms of bodies."""

    system: System
    scene: Scene
    names: tuple[str, ...]

    def momentum(self, engine: Engine, state: Blocks) -> Array:
        """Return the sum of the bodies' momenta about the common centre of mass, world axes, (..., 6, nv)."""
        given = {body.name: body for body in self.scene.bodies}
        pose, J = engine("poses", state)["pose"], engine("jacobians", state)["J"]
        moving = np.abs(J).max(axis=(-2, -1), initial=0.0)[..., np.newaxis] > 0.0
        masses, centers, linear, spin = [], [], [], []
        for k, name in enumerate(self.names):
            body = given[name]
            c = self.values(body.center_of_mass, state)
            xx, yy, zz, xy, xz, yz = np.moveaxis(self.values(body.inertia, state), -1, 0)
            tensor = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1).reshape(*xx.shape, 3, 3)
            turn = pose[..., k, np.newaxis, :4]
            omega, origin = (np.swapaxes(J[..., k, rows, :], -1, -2) for rows in (slice(3), slice(3, 6)))
            mass = self.values((body.mass,), state) * moving[..., k, :]
            velocity = origin + np.cross(omega, c[..., np.newaxis, :])
            masses.append(mass)
            centers.append(rotated(turn[..., 0, :], c) + pose[..., k, 4:])
            linear.append(mass[..., np.newaxis] * rotated(turn, velocity))
            spin.append(rotated(turn, omega @ tensor) * moving[..., k, np.newaxis, :])
        total = sum(masses)
        moment = sum(mass * center for mass, center in zip(masses, centers, strict=True))
        whole = moment / np.where(total == 0.0, 1.0, total)  # without mass, momentum is the same about every point
        turning = [
            np.cross((center - whole)[..., np.newaxis, :], part) for center, part in zip(centers, linear, strict=True)
        ]
        both = np.concatenate([sum(spin) + sum(turning), sum(linear)], axis=-1)
        return np.swapaxes(both, -1, -2)

    def values(self, formulas: Sequence[Formula], state: Blocks) -> Array:
        """Return formulas of parameters at states, (..., n)."""
        known = {parameter.name: np.asarray(parameter.value) for parameter in self.scene.parameters}
        known |= {parameter.name: state["p"][..., k] for k, parameter in enumerate(self.system.parameters)}

        def value_of(symbol: Symbol) -> Array:
            return known[symbol.name]

        batch = state["q"].shape[:-1]
        return np.stack([np.broadcast_to(evaluate_batch(item, value_of), batch) for item in formulas], axis=-1)


_BODIES = "bodies"


def body_claims(space: Space, engine: Engine) -> list[Claim]:
    """Return the claims of the terms that ``engine`` has."""
    there = set(engine.functions)
    claims = [_twists(space)] if {"poses", "twists"} <= there else []
    if {"twists", "accelerations"} <= there:
        claims.append(_accelerations(space))
    if {"twists", "jacobians"} <= there:
        claims.append(_body_jacobians(space))
    return claims


def _joined(values: Array) -> Array:
    return values.reshape(*values.shape[:-2], -1)


def _named(space: Space, parts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{part} of {body}" for body in space.bodies for part in parts)


def _twists(space: Space) -> Claim:
    factors = tuple(Factor("SE3", body, 7 * k, 7, 6 * k, 6) for k, body in enumerate(space.bodies))

    def value(engine: Engine, state: Blocks) -> Array:
        poses, twists = _joined(engine("poses", state)["pose"]), _joined(engine("twists", state)["twist"])
        return column(configuration_rate(factors, poses, twists))

    return Claim(
        "twists",
        "d pose / dt",
        _BODIES,
        value,
        source=lambda engine, state: _joined(engine("poses", state)["pose"]),
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
        return column(_joined(rates + turning))

    return Claim(
        "accelerations",
        "d twist / dt",
        _BODIES,
        lambda engine, state: column(_joined(engine("accelerations", state)["acceleration"])),
        source=lambda engine, state: _joined(engine("twists", state)["twist"]),
        directions=along_motion(("q", "v"), ("v", "a")),
        combine=combine,
        rows=_named(space, _TWIST),
        functions=("twists",),
    )


def _body_jacobians(space: Space) -> Claim:
    along = space.along["v"]

    def value(engine: Engine, state: Blocks) -> Array:
        J = engine("jacobians", state)["J"] @ along.matrix
        return np.asarray(J.reshape(*J.shape[:-3], -1, J.shape[-1]))

    return Claim(
        "jacobians",
        "d twist / dv",
        _BODIES,
        value,
        source=lambda engine, state: _joined(engine("twists", state)["twist"]),
        directions=lambda _: {"v": along.matrix.T},
        rows=_named(space, _TWIST),
        columns=along.names,
        functions=("twists",),
    )
