"""Claims of the equations of motion: M, h and b from the kinetic energy, sums of blocks, the energy balance.

Euler-Poincare equations of the kinetic energy T, left-trivialised: M a + h + b = dp/dt - ad(v)^T p - dT/dq with p =
dT/dv.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.compiled.coordinates import configuration_rate
from eomgen.lie.product import Factor, bracket_matrix
from eomgen.products.studies.verification.claims.claim import (
    Array,
    Blocks,
    Claim,
    ClaimOutput,
    Engine,
    Second,
    Space,
    Value,
    along_motion,
    column,
    constant_directions,
    jacobian,
    spread,
)
from eomgen.scene.scene import Scene
from eomgen.solvers.regular_inertia import regular_inertia

_POSE = (Factor("SE3", "pose", 0, 7, 0, 6),)


def motion_claims(space: Space) -> list[Claim]:
    """Return the claims of the terms of the equations of motion, energies and momenta that the model has. Water that
    moves with hulls has the inertia of Morison's equation, the added mass times the acceleration of each place, which
    no kinetic energy gives: then inertia is not asked to follow from M."""
    scene, blocks = space.scene, ("coupling", "force")
    by_energy = not (isinstance(scene, Scene) and any(element.adds_mass_to for element in scene.elements))
    claims: list[Claim] = []
    if space.has("mass", "energy"):
        claims.append(_mass(space))
    if space.has("mass"):
        claims.append(_definite(constrained=space.has("constraint_jacobian")))
    if by_energy and space.has("mass", "coupling"):
        claims.append(_coupling(space))
    if by_energy and space.has("mass", "coupling", "base_motion", "energy"):
        claims.append(_inertia(space, "base_motion.b", "M a + h + b by T", _by_blocks))
    if space.has("inverse_dynamics", *blocks, "energy") and not space.has("mass"):
        if by_energy:
            claims.append(_inertia(space, "inverse_dynamics.tau", "tau + Q by T", _by_recursion))
        claims.append(
            _by_blocks_of_tau(space, "coupling.h", "h + b - Q = tau at a = 0", _rest, _tau_at_rest, "inverse_dynamics")
        )
    if space.has("mass", *blocks, "inverse_dynamics"):
        tau = ClaimOutput("inverse_dynamics", "tau").column
        claims.append(_by_blocks_of_tau(space, "inverse_dynamics.tau", "tau = M a + h + b - Q", tau, _sum))
    if space.has(*blocks, "inverse_dynamics", "residual"):
        r = ClaimOutput("residual", "r").column
        claims.append(_by_blocks_of_tau(space, "residual.r", "r = tau + B^T lam", r, _tau_with_reactions))
    if space.has("mass", *blocks, "forward_dynamics"):
        # products with M instead of its inverse are as well conditioned as the blocks
        free = "forward_dynamics.vdot", "M vdot = Q - h - b"
        claims.append(_by_blocks_of_tau(space, *free, _inertial_forces, lambda *of: -_rest(*of), at=_free))
    if space.has("inverse_dynamics", "force", "forward_dynamics") and not space.has("mass"):
        tau, still = ClaimOutput("inverse_dynamics", "tau").column, lambda _, state: np.zeros((*state["v"].shape, 1))
        free = "forward_dynamics.vdot", "tau at vdot = 0"
        claims.append(_by_blocks_of_tau(space, *free, tau, still, "inverse_dynamics", at=_free))
    if space.has("energy", *blocks, "residual", "inverse_dynamics"):
        claims.append(_balance(space))
    if space.has("momenta", "force", "energy"):
        claims += [_momentum(space), _momentum_rate(space)]
    if space.has("base"):
        claims.append(_base())
    return claims


def momentum(engine: Engine, state: Blocks, along: Array) -> Array:
    """Return dT/dv along directions (..., count, nv), by differences that are exact: T is quadratic in v."""
    around = spread(state)
    forth = engine("energy", {**around, "v": around["v"] + along})["energy"][..., 0]
    back = engine("energy", {**around, "v": around["v"] - along})["energy"][..., 0]
    return np.asarray(0.5 * (forth - back))


def times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., np.newaxis])[..., 0])


def _mass(space: Space) -> Claim:
    """Return the claim that M is the second derivative of kinetic energy by v."""
    few, also = space.few.matrix, space.has("partials")

    def projection(of: ClaimOutput) -> Value:
        return lambda engine, state: np.asarray(few.T @ of(engine, state) @ few)

    return Claim(
        "mass.M",
        "d2 T / dv2",
        projection(ClaimOutput("mass", "M")),
        source=lambda engine, state: momentum(engine, state, few.T),
        directions=constant_directions({"v": few.T}),
        second=Second("partials", projection(ClaimOutput("partials", "M"))) if also else None,
        rows=space.few.names,
        columns=space.few.names,
        functions=("energy",),
    )


def _definite(*, constrained: bool) -> Claim:
    """Return the claim that M is symmetric and positive definite; if constrained, along motions that constraints
    allow."""

    def value(engine: Engine, state: Blocks) -> Array:
        M = engine("mass", state)["M"]
        if constrained:
            M = regular_inertia(M, engine("constraint_jacobian", state)["B"], np.ones(M.shape[-1]))
        scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diagonal(M, axis1=-2, axis2=-1)), 1e-300))
        scaled = M * scale[..., np.newaxis] * scale[..., np.newaxis, :]
        skew = np.max(np.abs(scaled - np.swapaxes(scaled, -1, -2)), axis=(-2, -1))
        least = np.linalg.eigvalsh(scaled)[..., 0]
        return column(np.stack([skew, np.where(least > 0.0, 0.0, 1.0 - least)], axis=-1))

    return Claim(
        "mass.M, definite",
        "symmetric, positive definite",
        value,
        second=Second("eigenvalues", lambda _, state: np.zeros((*state["q"].shape[:-1], 2, 1))),
        size=lambda _, state: np.ones(state["q"].shape[:-1]),
        rows=("M - M^T", "1 - smallest eigenvalue of M"),
    )


def _coupling(space: Space) -> Claim:
    """Return the claim that the term h follows from derivatives of the inertia matrix by q. h w = d(M v)/dt w - ad(v)^T
    M v w - d(v M v / 2)/dq w, with v held constant."""
    W = space.along["q"].matrix

    def source(engine: Engine, state: Blocks) -> Array:
        return times(engine("mass", state)["M"], state["v"])

    def along(state: Blocks) -> dict[str, Array]:
        return {"q": _motion_first(state["v"], W)}

    def combine(engine: Engine, state: Blocks, G: Array) -> Array:
        v = state["v"]
        turned = times(np.swapaxes(bracket_matrix(engine.factors, v), -1, -2), source(engine, state))
        by_time = (G[..., 0] - turned) @ W
        by_place = np.einsum("...i,...ij->...j", v, G[..., 1:])
        return column(by_time - 0.5 * by_place)

    return Claim(
        "coupling.h",
        "by d M / dq",
        (ClaimOutput("coupling", "h") @ W).column,
        source=source,
        directions=along,
        combine=combine,
        rows=space.along["q"].names,
        functions=("mass",),
    )


def _by_blocks(engine: Engine, state: Blocks) -> Array:
    """Return M a + h + b."""
    rest = engine("coupling", state)["h"] + engine("base_motion", state)["b"]
    return np.asarray(times(engine("mass", state)["M"], state["a"]) + rest)


def _by_recursion(engine: Engine, state: Blocks) -> Array:
    """Return M a + h + b without M, which is not formed for long trees."""
    return np.asarray(engine("inverse_dynamics", state)["tau"] + engine("force", state)["Q"])


def _inertia(space: Space, name: str, meaning: str, of: Value) -> Claim:
    """Return the claim that forces of inertia are the rate of momentum minus the derivative of kinetic energy by q.
    `of` gives these forces (..., nv); `name` and `meaning` are texts of the claim."""
    few = space.few.matrix

    def source(engine: Engine, state: Blocks) -> Array:
        kinetic = engine("energy", state)["energy"][..., :1]
        return np.concatenate([momentum(engine, state, few.T), kinetic], axis=-1)

    def along(state: Blocks) -> dict[str, Array]:
        still = np.zeros_like(few)
        directions = {"q": _motion_first(state["v"], few), "v": _motion_first(state["a"], still)}
        return directions | {"t": np.eye(1 + few.shape[1])[:, :1]}

    def combine(engine: Engine, state: Blocks, G: Array) -> Array:
        turned = np.swapaxes(bracket_matrix(engine.factors, state["v"]) @ few, -1, -2)
        return column(G[..., :-1, 0] - momentum(engine, state, turned) - G[..., -1, 1:])

    return Claim(
        name,
        meaning,
        lambda engine, state: column(of(engine, state) @ few),
        source=source,
        directions=along,
        combine=combine,
        rows=space.few.names,
        functions=("energy",),
    )


def _motion_first(rate: Array, others: Array) -> Array:
    """Return a rate (..., size) and further columns (size, count) as directions (..., 1 + count, size)."""
    rest = np.broadcast_to(others.T, (*rate.shape[:-1], *others.T.shape))
    return np.concatenate([rate[..., np.newaxis, :], rest], axis=-2)


def _parts(engine: Engine, state: Blocks) -> list[Array]:
    """Return M a, h, b and -Q."""
    result = [engine("coupling", state)["h"], -engine("force", state)["Q"]]
    result += [engine("base_motion", state)["b"]] if "base_motion" in engine else []
    if "mass" in engine:
        return [times(engine("mass", state)["M"], state["a"]), *result]
    return [engine("inverse_dynamics", state)["tau"] - np.sum(result, axis=0), *result]


def _largest(values: list[Array]) -> Array:
    return np.asarray(np.max([np.max(np.abs(value), axis=-1) for value in values], axis=0))


def _by_blocks_of_tau(
    space: Space, name: str, meaning: str, value: Value, second: Value, by: str = "sum of blocks", **more: Any
) -> Claim:
    """Return the claim that forces by two derivations, `value` and `second`, are equal. Errors are judged by the
    largest of M a, h, b and -Q, which may cancel. ``by`` names the second one; ``more`` is of ``Claim``."""
    return Claim(
        name,
        meaning,
        value,
        second=Second(by, second),
        size=lambda engine, state: _largest(_parts(engine, state)),
        rows=space.rows["v"],
        **more,
    )


def _inertial_forces(engine: Engine, state: Blocks) -> Array:
    """Return M a."""
    return column(_parts(engine, state)[0])


def _sum(engine: Engine, state: Blocks) -> Array:
    """Return M a + h + b - Q."""
    return column(np.sum(_parts(engine, state), axis=0))


def _rest(engine: Engine, state: Blocks) -> Array:
    """Return h + b - Q."""
    return column(np.sum(_parts(engine, state)[1:], axis=0))


def _tau_at_rest(engine: Engine, state: Blocks) -> Array:
    return column(engine("inverse_dynamics", {**state, "a": np.zeros_like(state["a"])})["tau"])


def _tau_with_reactions(engine: Engine, state: Blocks) -> Array:
    tau = engine("inverse_dynamics", state)["tau"]
    if "constraint_jacobian" in engine:
        tau = tau + times(np.swapaxes(engine("constraint_jacobian", state)["B"], -1, -2), state["lam"])
    return column(tau)


def _free(engine: Engine, state: Blocks) -> dict[str, Array]:
    """Return the state with the free acceleration."""
    return {**state, "a": engine("forward_dynamics", state)["vdot"]}


def _balance(space: Space) -> Claim:
    """Return the claim of the energy balance along any motion, also one that violates the equations. d(T + V)/dt =
    power + power of base and drivers + v r - lam w, r and w residuals of motion and constraints."""

    def value(engine: Engine, state: Blocks) -> Array:
        powers = engine("energy", state)["energy"][..., 2:].sum(axis=-1)
        powers = powers + np.sum(state["v"] * engine("residual", state)["r"], axis=-1)
        if "constraint_velocity" in engine:
            powers = powers - np.sum(state["lam"] * engine("constraint_velocity", state)["w"], axis=-1)
        return column(column(powers))

    def size(engine: Engine, state: Blocks) -> Array:
        v, powers = state["v"], engine("energy", state)["energy"][..., 2:]
        works = [np.sum(np.abs(v * load), axis=-1) for load in _parts(engine, state)]
        return np.asarray(np.sum([np.sum(np.abs(powers), axis=-1), *works], axis=0))

    return Claim(
        "energy",
        "d(T + V) / dt = powers",
        value,
        source=ClaimOutput("energy", "energy")[..., :2],
        directions=along_motion(space.engine, "q", "v", "z"),
        combine=lambda engine, state, G: np.sum(G, axis=-2, keepdims=True),
        size=size,
        rows=("T + V",),
    )


#: The kinetic energy.
_KINETIC = ClaimOutput("energy", "energy")[..., :1]


def _momentum(space: Space) -> Claim:
    row = ClaimOutput("momenta", "momentum")[..., np.newaxis, :]
    return jacobian(space, row, _KINETIC, "v", ["T"], meaning="dT / dv")


def _momentum_rate(space: Space) -> Claim:
    rate, force = ClaimOutput("momenta", "momentum_rate"), ClaimOutput("force", "Q")
    return jacobian(
        space,
        lambda engine, state: (rate(engine, state) - force(engine, state))[..., np.newaxis, :],
        _KINETIC,
        "q",
        ["T"],
        name="momenta.momentum_rate",
        meaning="dT / dq + Q",
        size=lambda engine, state: _largest([rate(engine, state), force(engine, state)]),
    )


def _base() -> Claim:
    """Return the claim that velocities and accelerations of the base are the derivatives of the pose and twist."""

    def value(engine: Engine, state: Blocks) -> Array:
        base = engine("base", state)["base"]
        return column(
            np.concatenate([configuration_rate(_POSE, base[..., :7], base[..., 7:13]), base[..., 13:]], axis=-1)
        )

    names = [
        f"{part}[{k}]"
        for part, size in (("quaternion", 4), ("position", 3), ("omega", 3), ("velocity", 3))
        for k in range(size)
    ]
    return Claim(
        "base",
        "d pose, d twist / dt",
        value,
        source=ClaimOutput("base", "base")[..., :13],
        directions=constant_directions({"t": np.ones((1, 1))}),
        rows=tuple(names),
    )
