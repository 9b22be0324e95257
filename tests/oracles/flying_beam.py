"""The flying beam of Hante, Tumiotto and Arnold (2022) in dense NumPy, from their equations alone.

Constant strains on S^3 semidirect R^3 (which is SE(3)), lumped inertia, no shear, steps of RATTLie; nothing is shared
with the package. Twists have rotations first; the axis of a section is its third one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
LENGTH, THROWN = 10.0, 5.0
STIFFNESS = np.array([500.0, 500.0, 500.0, 1e4, 1e4, 1e4])
STRAIGHT = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
#: Of a metre, rotations first.
INERTIA = np.array([10.0, 10.0, 10.0, 1.0, 1.0, 1.0])
SHEAR = [3, 4]


def skew(a: Array) -> Array:
    """Return the matrices of a x, (..., 3, 3)."""
    found = np.zeros((*a.shape, 3))
    found[..., 0, 1], found[..., 0, 2], found[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return found - np.swapaxes(found, -1, -2)


def coefficients(angle: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return sin x/x, (1 - cos x)/x^2, (x - sin x)/x^3, (2 - x cot(x/2))/(2 x^2) and what belongs to its change."""
    square = np.einsum("...i,...i->...", angle, angle)
    small = square < 0.04
    x = np.sqrt(np.where(small, 1.0, square))
    found = (
        (np.sin(x) / x, 1 - square / 6 + square**2 / 120 - square**3 / 5040 + square**4 / 362880),
        ((1 - np.cos(x)) / x**2, 0.5 - square / 24 + square**2 / 720 - square**3 / 40320 + square**4 / 3628800),
        (
            (x - np.sin(x)) / x**3,
            1 / 6 - square / 120 + square**2 / 5040 - square**3 / 362880 + square**4 / 39916800,
        ),
        (
            (2 - x / np.tan(x / 2)) / (2 * x**2),
            1 / 12 + square / 720 + square**2 / 30240 + square**3 / 1209600 + square**4 / 47900160,
        ),
        (
            (x * np.sin(x) + 4 * np.cos(x) + x**2 - 4) / (4 * x**4 * np.sin(x / 2) ** 2),
            1 / 360 + square / 7560 + square**2 / 201600 + square**3 / 5987520 + 691 * square**4 / 130767436800,
        ),
    )
    one, two, three, four, five = (np.where(small, series, closed) for closed, series in found)
    return one, two, three, four, five


def inverse_tangent(twist: Array) -> Array:
    """Return T^-1 of SE(3), (..., 6, 6)."""
    turn, shift = twist[..., :3], twist[..., 3:]
    *_, six, eight = (f[..., None, None] for f in coefficients(turn))
    S, U = skew(turn), skew(shift)
    along = np.einsum("...i,...i->...", turn, shift)[..., None, None]
    found = np.zeros((*twist.shape, 6))
    found[..., :3, :3] = found[..., 3:, 3:] = np.eye(3) + 0.5 * S + six * S @ S
    found[..., 3:, :3] = 0.5 * U + six * (U @ S + S @ U) + eight * along * S @ S
    return found


@dataclass
class Beam:
    """The beam in so many elements at some time; ``turn`` (n + 1, 3, 3), ``place`` (n + 1, 3), ``p`` its momenta."""

    elements: int
    turn: Array = field(init=False)
    place: Array = field(init=False)
    p: Array = field(init=False)
    lam_before: Array = field(init=False)
    lam_after: Array = field(init=False)
    t: float = 0.0

    def __post_init__(self) -> None:
        n = self.elements
        axis = np.cross([0.0, 0.0, 1.0], np.array([-6.0, 8.0, 0.0]) / 10.0)
        self.turn = np.tile(Rotation.from_rotvec(0.5 * np.pi * axis).as_matrix(), (n + 1, 1, 1))
        self.place = np.linspace([6.0, 0.0, 0.0], [0.0, 8.0, 0.0], n + 1)
        self.p = np.zeros((n + 1, 6))
        self.lam_before, self.lam_after = np.zeros((2, 2 * n))
        shares = np.ones(n + 1)
        shares[[0, -1]] = 0.5
        self.inertia = LENGTH / n * shares[:, None] * INERTIA

    def moved(self, twist: Array) -> tuple[Array, Array]:
        """Return q o exp(twist)."""
        one, two, three, *_ = (f[..., None, None] for f in coefficients(twist[:, :3]))
        S = skew(twist[:, :3])
        turned = np.eye(3) + one * S + two * S @ S
        shifted = (np.eye(3) + two * S + three * S @ S) @ twist[:, 3:, None]
        return self.turn @ turned, self.place + (self.turn @ shifted)[..., 0]

    def model(self, turn: Array, place: Array, t: float) -> tuple[Array, Array, Array, Array]:
        """Return the forces on the nodes, (n + 1, 6), Phi, B, and the potential."""
        n, ds = self.elements, LENGTH / self.elements
        between = np.swapaxes(turn[:-1], -1, -2)
        angle = Rotation.from_matrix(between @ turn[1:]).as_rotvec()
        *_, six, _ = coefficients(angle)
        S = skew(angle)
        back = np.eye(3) - 0.5 * S + six[:, None, None] * S @ S
        shift = back @ between @ np.diff(place, axis=0)[..., None]
        twist = np.concatenate([angle, shift[..., 0]], axis=1)
        strain = twist / ds - STRAIGHT
        load = STIFFNESS * strain
        load[:, SHEAR] = 0.0
        first, second = -inverse_tangent(-twist), inverse_tangent(twist)
        forces = np.zeros((n + 1, 6))
        forces[:-1] -= np.einsum("eij,ei->ej", first, load)
        forces[1:] -= np.einsum("eij,ei->ej", second, load)
        push = 80.0 * max(0.0, min(t, THROWN - t))
        forces[0] += push * (turn[0].T @ np.array([[0.0, 0.1], [-0.5, 0.0], [-1.0, 0.0]])).T.ravel()
        B = np.zeros((n, 2, n + 1, 6))
        each = np.arange(n)
        B[each, :, each] = first[:, SHEAR]
        B[each, :, each + 1] = second[:, SHEAR]
        energy = 0.5 * ds * float(np.sum(load * strain))
        return forces, twist[:, SHEAR].ravel(), B.reshape(2 * n, -1), np.array(energy)

    def step(self, h: float) -> None:
        """Go on by one step: equations R1 to R4, solved to rounding."""
        forces, _, B, _ = self.model(self.turn, self.place, self.t)
        M, size = self.inertia, self.p.size
        w, impulse = self.p / M, h * self.lam_before
        known = self.p + 0.5 * h * forces
        matrix = np.zeros((size + len(B), size + len(B)))
        matrix[:size, :size] = np.diag(M.ravel())
        matrix[:size, size:] = 0.5 * B.T
        before = np.inf
        for _ in range(50):
            turn, place = self.moved(h * w)
            there = self.model(turn, place, self.t + h)
            r = known - np.einsum("kij,ki->kj", inverse_tangent(-h * w), M * w)
            matrix[size:, :size] = there[2]
            right = np.concatenate([r.ravel() - 0.5 * B.T @ impulse, -there[1] / h])
            change = np.linalg.solve(matrix, right)
            w, impulse = w + change[:size].reshape(w.shape), impulse + change[size:]
            length = float(np.abs(change[:size]).max())
            if length < 1e-11 or (length > 0.5 * before and length < 1e-8):
                break
            before = length
        else:
            raise ArithmeticError("the steps of the oracle do not converge")
        self.lam_after = impulse / h
        self.turn, self.place = self.moved(h * w)
        self.t += h
        forces, _, B, _ = self.model(self.turn, self.place, self.t)
        c = np.einsum("kij,ki->kj", inverse_tangent(h * w), M * w) + 0.5 * h * forces
        weighted = B / M.ravel()
        reaction = np.linalg.solve(weighted @ B.T, weighted @ c.ravel())
        self.p = c - (B.T @ reaction).reshape(c.shape)
        self.lam_before = 2.0 / h * reaction

    def energy(self) -> float:
        """Return kinetic and potential energy, J."""
        return float(0.5 * np.sum(self.p**2 / self.inertia) + self.model(self.turn, self.place, self.t)[3])

    def momentum(self) -> Array:
        """Return the linear momentum in world axes, N s."""
        return np.asarray(np.einsum("kij,kj->i", self.turn, self.p[:, 3:]))

    def centre(self) -> Array:
        """Return the centre of mass, m."""
        share = self.inertia[:, 3]
        return np.asarray(share @ self.place / share.sum())
