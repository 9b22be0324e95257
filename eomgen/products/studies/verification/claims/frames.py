"""Claims on bodies, frames and the total momentum: Jacobians against poses, rates against Jacobians, sums over
bodies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from eomgen.compiled.coordinates import configuration_rate
from eomgen.formula.evaluate import evaluate_batch
from eomgen.formula.nodes import Formula
from eomgen.lie.numeric import rotated, rotation_matrix
from eomgen.lie.product import Factor
from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Second,
    Space,
    along_motion,
    column,
    constant_directions,
    jacobian,
)
from eomgen.scene.scene import Scene
from eomgen.system.terms import REFERENCES

_AXES = ("x", "y", "z")
_POSE = tuple(f"quaternion {part}" for part in "wxyz") + tuple(f"position {axis}" for axis in _AXES)
_TWIST = tuple(f"{part} {axis}" for part in ("omega", "velocity") for axis in _AXES)
_MOMENTUM = tuple(f"{part} {axis}" for part in ("angular", "linear") for axis in _AXES)


def frame_claims(space: Space) -> list[Claim]:
    """Return the claims on Jacobians, drifts and mobilities of frames, and on the centre of mass, as far as the model
    has these terms."""
    claims = []
    for reference, (ending, _) in REFERENCES.items():
        names = f"frame_jacobians{ending}", f"frame_jacobian_rates{ending}", f"frame_drifts{ending}"
        if space.has(names[0], "frame_poses"):
            claims.append(_jacobians(space, reference))
        if space.has(names[1]):
            claims += _in_time(space, "J", *names, _row_names(space.system.frames, _TWIST))
    if space.has("frame_mobilities", "frame_jacobians_aligned", "mass"):
        claims.append(_mobilities(space))
    return claims + _center_of_mass_claims(space)


def _row_names(names: Sequence[str], parts: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{part} of {name}" for name in names for part in parts)


#: The centre of mass with its Jacobian.
_CENTER, _CENTER_JACOBIAN = ClaimOutput("center_of_mass", "c"), ClaimOutput("center_of_mass_jacobian", "J")


def _center_of_mass_claims(space: Space) -> list[Claim]:
    """Return the claims of the centre of mass and of the centroidal momentum that the model's terms allow."""
    claims = []
    if space.has("center_of_mass", "center_of_mass_jacobian"):
        claims.append(jacobian(space, _CENTER_JACOBIAN, _CENTER, "q", _AXES))
    for entry, matrix, drift, rows in (
        ("J", "center_of_mass_jacobian", "center_of_mass_drift", _AXES),
        ("A", "centroidal_momentum", "centroidal_drift", _MOMENTUM),
    ):
        if space.has(matrix, f"{matrix}_rate"):
            claims += _in_time(space, entry, matrix, f"{matrix}_rate", drift, rows)
    if space.has("centroidal_momentum"):
        claims += _momentum(space)
    return claims


def _in_time(space: Space, entry: str, matrix: str, rate: str, drift: str, rows: tuple[str, ...]) -> list[Claim]:
    """Return the claims on dJ/dt along the motion, and on dJ/dt v, the derivative of J v at constant v. `matrix`,
    `rate` and `drift` are the functions with J (output `entry`), its rate, and dJ/dt v; no second claim without the
    function `drift`."""
    J, J_dot = ClaimOutput(matrix, entry), ClaimOutput(rate, f"{entry}_dot")
    motion = along_motion(space.engine, "q")

    def times_velocity(matrices: Array, v: Array) -> Array:
        columns = v.reshape(*v.shape[:-1], *(1,) * (matrices.ndim - v.ndim - 1), v.shape[-1], 1)
        return np.asarray((matrices @ columns).reshape(*v.shape[:-1], -1))

    def sizes(engine: Engine, state: Blocks) -> Array:
        speeds = np.abs(state["v"])
        result, still = (
            times_velocity(np.abs(of(engine, state)), speeds).reshape(len(speeds), -1).max(axis=-1) for of in (J_dot, J)
        )
        # derivatives of matrices that cancel, as in cos^2 + sin^2, are a thousandth of the summands
        return np.asarray(np.maximum(result, 1e-3 * still * speeds.max(axis=-1)))

    claims = [
        Claim(f"{rate}.{entry}_dot", f"d {entry} / dt", J_dot.flat.column, source=J.flat, directions=motion),
    ]
    if space.has(drift):
        claims.append(
            Claim(
                f"{drift}.drift",
                f"d ({entry} v) / dt, v constant",
                ClaimOutput(drift, "drift").flat.column,
                source=lambda engine, state: times_velocity(J(engine, state), state["v"]),
                directions=motion,
                second=Second(rate, lambda engine, state: column(times_velocity(J_dot(engine, state), state["v"]))),
                size=sizes,
                rows=rows,
                functions=(matrix,),
            )
        )
    return claims


def _jacobians(space: Space, reference: str) -> Claim:
    """Return the claim that a frame Jacobian J times w is the twist of the pose along w, with the base held.
    `reference` says in which axes J is: ``body``, ``world`` or aligned."""
    frames, count = space.system.frames, len(space.system.frames)
    W, J = space.along["q"].matrix, ClaimOutput(f"frame_jacobians{REFERENCES[reference][0]}", "J")
    factors = _pose_space(frames)

    def value(engine: Engine, state: Blocks) -> Array:
        pose = engine("frame_poses", state)["frame_pose"][..., np.newaxis, :, :]
        twists = np.moveaxis(J(engine, state) @ W, -1, -3)  # (..., columns, frames, 6)
        in_axes = _in_own_axes(pose, twists, reference)
        flat = pose.reshape(*pose.shape[:-2], 7 * count), in_axes.reshape(*in_axes.shape[:-2], 6 * count)
        return np.swapaxes(configuration_rate(factors, *flat), -1, -2)

    return Claim(
        f"{J.function}.J",
        "d pose / dq",
        value,
        source=ClaimOutput("frame_poses", "frame_pose").flat,
        directions=constant_directions({"q": W.T}),
        rows=_row_names(frames, _POSE),
        columns=space.along["q"].names,
    )


def _pose_space(names: Sequence[str]) -> tuple[Factor, ...]:
    """Return the configuration space of poses."""
    return tuple(Factor("SE3", name, 7 * k, 7, 6 * k, 6) for k, name in enumerate(names))


def _in_own_axes(pose: Array, twist: Array, reference: str) -> Array:
    """Return twists (..., 6) of frames with poses (..., 7) in frame axes, about the origins of the frames. `reference`
    says in which axes, and about which point, the given twists are: ``body``, ``world``, or else aligned."""
    if reference == "body":
        return twist
    omega, velocity = twist[..., :3], twist[..., 3:]
    if reference == "world":
        velocity = velocity + np.cross(omega, pose[..., 4:])
    back = pose[..., :4] * [1.0, -1.0, -1.0, -1.0]
    return np.concatenate([rotated(back, omega), rotated(back, velocity)], axis=-1)


def _mobilities(space: Space) -> Claim:
    def second(engine: Engine, state: Blocks) -> Array:
        J, M = engine("frame_jacobians_aligned", state)["J"], engine("mass", state)["M"][..., np.newaxis, :, :]
        return column((J @ np.linalg.solve(M, np.swapaxes(J, -1, -2))).reshape(*state["q"].shape[:-1], -1))

    return Claim(
        "frame_mobilities.mobility",
        "J M^-1 J^T",
        ClaimOutput("frame_mobilities", "mobility").flat.column,
        second=Second("by M", second),
        rows=_row_names(space.system.frames, [f"{left}, {right}" for left in _TWIST for right in _TWIST]),
    )


def _momentum(space: Space) -> list[Claim]:
    """Return the claims on the centroidal momentum matrix A: linear rows by the Jacobian of the centre of mass, all
    rows by the sum over rigid bodies."""
    scene, A = space.scene, ClaimOutput("centroidal_momentum", "A")
    W, names = space.along["q"].matrix, space.along["q"].names
    claims = []

    def linear(engine: Engine, state: Blocks) -> Array:
        mass = engine("center_of_mass", state)["m"][..., np.newaxis]
        return np.asarray(mass * (_CENTER_JACOBIAN(engine, state) @ W))

    if space.has("center_of_mass", "center_of_mass_jacobian"):
        claims.append(
            Claim(
                "centroidal_momentum.A, linear",
                "m J of the centre of mass",
                A[..., 3:, :] @ W,
                second=Second("center_of_mass_jacobian", linear),
                rows=_MOMENTUM[3:],
                columns=names,
            )
        )
    rigid = isinstance(scene, Scene) and all(body.beam is None for body in scene.bodies)
    if isinstance(scene, Scene) and rigid and space.has("poses", "jacobians"):
        claims.append(
            Claim(
                "centroidal_momentum.A",
                "sum over bodies",
                A @ W,
                second=Second(
                    "poses and jacobians", lambda engine, state: _sum_over_bodies(space, scene, engine, state) @ W
                ),
                rows=_MOMENTUM,
                columns=names,
            )
        )
    return claims


def _sum_over_bodies(space: Space, scene: Scene, engine: Engine, state: Blocks) -> Array:
    """Return the sum of the momenta of a scene's rigid bodies about the common centre of mass, world axes, (..., 6,
    nv)."""
    bodies = {body.name: body for body in scene.bodies}
    of_rows = [bodies[name] for name in space.system.bodies]
    batch = state["q"].shape[:-1]
    known = {parameter.name: np.asarray(parameter.value) for parameter in scene.parameters}
    known |= {parameter.name: state["p"][..., k] for k, parameter in enumerate(space.system.parameters)}

    def values(formulas: Iterable[Formula], *shape: int) -> Array:
        parts = [np.broadcast_to(evaluate_batch(item, lambda symbol: known[symbol.name]), batch) for item in formulas]
        return np.stack(parts, axis=-1).reshape(*batch, len(of_rows), *shape)

    pose, J = engine("poses", state)["pose"], engine("jacobians", state)["J"]
    turn, omega = rotation_matrix(pose[..., :4]), J[..., :3, :]
    moving = np.abs(J).max(axis=(-2, -1), initial=0.0) > 0.0
    mass = values(body.mass for body in of_rows) * moving
    center = values((entry for body in of_rows for entry in body.center_of_mass), 3)
    places = (0, 3, 4, 3, 1, 5, 4, 5, 2)  # of a tensor's entries in xx, yy, zz, xy, xz, yz
    inertia = values((body.inertia[k] for body in of_rows for k in places), 3, 3) * moving[..., np.newaxis, np.newaxis]
    linear = turn @ (J[..., 3:, :] + np.cross(omega, column(center), axis=-2)) * mass[..., np.newaxis, np.newaxis]
    away = (turn @ column(center))[..., 0] + pose[..., 4:]
    total = mass.sum(axis=-1)[..., np.newaxis]
    # without mass, momentum is the same about every point
    away = away - ((column(mass) * away).sum(axis=-2) / np.where(total == 0.0, 1.0, total))[..., np.newaxis, :]
    angular = turn @ inertia @ omega + np.cross(column(away), linear, axis=-2)
    return np.asarray(np.concatenate([angular, linear], axis=-2).sum(axis=-3))


_BODY_POSE, _BODY_TWIST = ClaimOutput("poses", "pose").flat, ClaimOutput("twists", "twist").flat


def body_claims(space: Space) -> list[Claim]:
    """Return the claims of twists, accelerations and Jacobians of bodies that the model has."""
    claims = [_twists(space)] if space.has("poses", "twists") else []
    if space.has("twists", "accelerations"):
        claims.append(_accelerations(space))
    if space.has("twists", "jacobians"):
        rows = _row_names(space.system.bodies, _TWIST)
        claims.append(jacobian(space, _body_jacobians, _BODY_TWIST, "v", rows, name="jacobians"))
    return claims


def _body_jacobians(engine: Engine, state: Blocks) -> Array:
    J = engine("jacobians", state)["J"]
    return np.asarray(J.reshape(*J.shape[:-3], -1, J.shape[-1]))


def _twists(space: Space) -> Claim:
    factors = _pose_space(space.system.bodies)
    return Claim(
        "twists",
        "d pose / dt",
        lambda engine, state: column(
            configuration_rate(factors, _BODY_POSE(engine, state), _BODY_TWIST(engine, state))
        ),
        source=_BODY_POSE,
        directions=along_motion(space.engine, "q"),
        rows=_row_names(space.system.bodies, _POSE),
    )


def _accelerations(space: Space) -> Claim:
    """Return the claim that accelerations are the time derivatives of twists."""

    def combine(engine: Engine, state: Blocks, G: Array) -> Array:
        """Return rates of components as accelerations: the origin's gains omega x velocity, in body axes."""
        twist = engine("twists", state)["twist"]
        turning = np.zeros_like(twist)
        turning[..., 3:] = np.cross(twist[..., :3], twist[..., 3:])
        return np.asarray(G + turning.reshape(G.shape))

    return Claim(
        "accelerations",
        "d twist / dt",
        ClaimOutput("accelerations", "acceleration").flat.column,
        source=_BODY_TWIST,
        directions=along_motion(space.engine, "q", "v"),
        combine=combine,
        rows=_row_names(space.system.bodies, _TWIST),
    )
