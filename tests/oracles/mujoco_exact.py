"""MuJoCo's data without two of its approximations, by MuJoCo's own functions.

A tendon through a ring touches it at a point that MuJoCo searches to 1e-6 rad: the Jacobian of the tendon is made anew
from the point that Newton's method finds from there. MuJoCo takes a centre of mass that is nearer to the frame of the
body than about 1e-6 m as the origin of the frame: `mj_rne` without this flag has the rest of M and of the bias.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from tests.oracles.evaluation import Array


def refine_rings(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Replace the Jacobians of tendons through rings, and all that MuJoCo's positions make of them."""
    refined = False
    for tendon in range(model.ntendon):
        for first, ring, last, divisor in _contacts(model, data, tendon):
            exact = _exact(model, data, first, ring, last)
            change = _slope(model, data, first, exact, last) - _slope(model, data, first, ring, last)
            start, count = model.ten_J_rowadr[tendon], model.ten_J_rownnz[tendon]
            columns = model.ten_J_colind[start : start + count]
            data.ten_J[start : start + count] += change[columns] / divisor
            refined = True
    if refined:
        mujoco.mj_makeM(model, data)
        mujoco.mj_transmission(model, data)


Contact = tuple[int, Array]  # a geom, and the point of the tendon on it
End = tuple[int, Array]  # a body, and a point of the tendon on it


def _contacts(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Iterator[tuple[End, Contact, End, float]]:
    """Yield the contacts with rings: the ends of the straight parts before and after, and the divisor of the pulley."""
    start, count = int(data.ten_wrapadr[tendon]), int(data.ten_wrapnum[tendon])
    objects = data.wrap_obj.reshape(-1)[start : start + count]
    points = data.wrap_xpos.reshape(-1, 3)[start : start + count].copy()
    listed = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
    pulleys = iter(model.wrap_prm[k] for k in listed if model.wrap_type[k] == mujoco.mjtWrap.mjWRAP_PULLEY)
    sites = [model.wrap_objid[k] for k in listed if model.wrap_type[k] == mujoco.mjtWrap.mjWRAP_SITE]
    bodies = [int(model.site_bodyid[site]) for site in sites]
    divisor, passed = 1.0, -1
    for k in range(count):
        if objects[k] == -2:
            divisor = float(next(pulleys))
        elif objects[k] == -1:
            passed += 1
        elif k and objects[k - 1] == objects[k] and np.array_equal(points[k - 1], points[k]):
            ends = (bodies[passed], points[k - 2]), (bodies[passed + 1], points[k + 1])
            yield ends[0], (int(objects[k]), points[k]), ends[1], divisor


def _exact(model: mujoco.MjModel, data: mujoco.MjData, first: End, ring: Contact, last: End) -> Contact:
    """Return the point of the ring at which the way between two points is shortest, near a point on it."""
    geom, point = ring
    centre, axes = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE:
        e1 = (point - centre) / np.linalg.norm(point - centre)
        normal = np.cross(first[1] - centre, last[1] - centre)
        normal /= np.linalg.norm(normal)
        e1 = np.cross(np.cross(normal, e1), normal)
        e1 /= np.linalg.norm(e1)
        axes = np.column_stack([e1, np.cross(normal, e1), normal])
    local = [(axes.T @ (place - centre)) for place in (first[1], point, last[1])]
    a, near, b = (place[0] + 1j * place[1] for place in local)
    radius, angle = model.geom_size[geom, 0], np.angle(near)
    for _ in range(50):
        p = radius * np.exp(1j * angle)
        slope = curvature = 0.0
        for end in (a, b):
            length, along, across = abs(end - p), np.imag(end * p.conjugate()), np.real(end * p.conjugate())
            slope -= along / length
            curvature += across / length - along**2 / length**3
        step = slope / curvature
        angle -= step
        if abs(step) < 1e-16:
            break
    p = radius * np.exp(1j * angle)
    before, after = abs(a - p), abs(b - p)
    height = (local[0][2] * after + local[2][2] * before) / (before + after)
    return geom, centre + axes @ np.array([p.real, p.imag, height])


def _slope(model: mujoco.MjModel, data: mujoco.MjData, first: End, ring: Contact, last: End) -> Array:
    """Return d(length)/dq of the two straight parts at a ring, (nv,)."""
    geom, point = ring
    at_ring = _jacobian(model, data, int(model.geom_bodyid[geom]), point)
    total = np.zeros(model.nv)
    for body, place in (first, last):
        straight = place - point
        total += straight / np.linalg.norm(straight) @ (_jacobian(model, data, body, place) - at_ring)
    return total


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData, body: int, point: Array) -> Array:
    J = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, J, None, point, body)
    return J


def neglected_offsets(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """Return the parts of M, (nv, nv), and of the bias, (nv,), of centres of mass taken at frames of bodies.

    The data must hold positions and velocities; both are computed anew.
    """
    flags = model.body_sameframe.copy()
    near = (flags == mujoco.mjtSameFrame.mjSAMEFRAME_BODY) & np.any(model.body_ipos != 0.0, axis=1)
    if not near.any():
        return np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    exact = _inverse_dynamics(model, data, np.where(near, 0, flags))
    rounded = _inverse_dynamics(model, data, flags)
    return exact[0] - rounded[0], exact[1] - rounded[1]


def _inverse_dynamics(model: mujoco.MjModel, data: mujoco.MjData, flags: Array) -> tuple[Array, Array]:
    """Return M and the bias by `mj_rne`, with flags of bodies whose frames of inertia are their own."""
    model.body_sameframe[:] = flags
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    columns = []
    for unit in (np.zeros(model.nv), *np.eye(model.nv)):
        column = np.zeros(model.nv)
        data.qacc[:] = unit
        mujoco.mj_rne(model, data, 1, column)
        columns.append(column)
    bias, M = columns[0], np.array(columns[1:]).T
    return M - bias[:, None], bias
