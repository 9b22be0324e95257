"""Planar trees of point masses at the tips of massless rods, hinged at the tips of others: Lagrange's equations in 50
digits.

Absolute angles theta_k = sum of the relative angles q on the path to rod k; with l_i e(theta_i) for rod i,

    M_ij = sum of m_k over the rods k beyond both i and j, times l_i l_j cos(theta_i - theta_j)
    sum_j M_ij alpha_j = sum_j (M_ij's masses) l_i l_j sin(theta_j - theta_i) omega_j^2 - g l_i cos(theta_i) sum_k m_k
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import numpy as np

from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

GRAVITY = 9.81


@dataclass(frozen=True)
class PlanarTree:
    """Masses, kg, lengths, m, and for each rod the number of its parent, -1 for the base."""

    masses: tuple[float, ...]
    lengths: tuple[float, ...]
    parents: tuple[int, ...]

    @classmethod
    def chain(cls, masses: Sequence[float], lengths: Sequence[float]) -> PlanarTree:
        return cls(tuple(masses), tuple(lengths), tuple(range(-1, len(masses) - 1)))

    def path(self, k: int) -> list[int]:
        return [] if k < 0 else [*self.path(self.parents[k]), k]

    def text(self) -> str:
        """Return the scene file; gravity along -y, rods along x at q = 0."""
        lines = ["format = 1", 'name = "tree"', f"gravity = [0, {-GRAVITY}, 0]"]
        for k, (mass, length, parent) in enumerate(zip(self.masses, self.lengths, self.parents, strict=True)):
            place = [self.lengths[parent] if parent >= 0 else 0.0, 0.0, 0.0]
            carrier = "base" if parent < 0 else f"b{parent}"
            lines += [f"[bodies.b{k}]", f"mass = {mass!r}", f"center_of_mass = [{length!r}, 0, 0]"]
            lines += ["inertia = [0, 0, 0]", f"[joints.j{k}]", 'type = "revolute"', f'parent = "{carrier}"']
            lines += [f'child = "b{k}"', "axis = [0, 0, 1]", f"position = {place!r}"]
        return "\n".join(lines)

    def scene(self) -> Scene:
        return load_toml(self.text())

    def accelerations(self, q: Sequence[float], v: Sequence[float]) -> list[mpmath.mpf]:
        """Return the relative angular accelerations in 50 digits."""
        with mpmath.workdps(50):
            size = len(self.masses)
            paths = [self.path(k) for k in range(size)]
            m, length = map(mpmath.mpf, self.masses), [mpmath.mpf(x) for x in self.lengths]
            mass = list(m)
            theta = [mpmath.fsum(mpmath.mpf(q[i]) for i in path) for path in paths]
            omega = [mpmath.fsum(mpmath.mpf(v[i]) for i in path) for path in paths]
            M, right = mpmath.matrix(size, size), mpmath.matrix(size, 1)
            for i in range(size):
                beyond = mpmath.fsum(mass[k] for k in range(size) if i in paths[k])
                right[i] = -beyond * mpmath.mpf(GRAVITY) * length[i] * mpmath.cos(theta[i])
                for j in range(size):
                    both = mpmath.fsum(mass[k] for k in range(size) if i in paths[k] and j in paths[k])
                    M[i, j] = both * length[i] * length[j] * mpmath.cos(theta[i] - theta[j])
                    right[i] += both * length[i] * length[j] * mpmath.sin(theta[j] - theta[i]) * omega[j] ** 2
            alpha = mpmath.lu_solve(M, right)
            return [alpha[k] - (alpha[self.parents[k]] if self.parents[k] >= 0 else 0) for k in range(size)]

    def motion(self, q: Sequence[float], v: Sequence[float], end: float, steps: int = 24) -> list[mpmath.mpf]:
        """Return q at the end by extrapolated midpoint steps of order 16 (Gragg, Bulirsch and Stoer), 50 digits."""
        with mpmath.workdps(50):
            size, step = len(self.masses), mpmath.mpf(end) / steps

            def rate(y: Sequence[mpmath.mpf]) -> list[mpmath.mpf]:
                return [*y[size:], *self.accelerations(y[:size], y[size:])]

            def moved(y: Sequence[mpmath.mpf], h: mpmath.mpf, slope: Sequence[mpmath.mpf]) -> list[mpmath.mpf]:
                return [a + h * b for a, b in zip(y, slope, strict=True)]

            state = [mpmath.mpf(x) for x in (*q, *v)]
            for _ in range(steps):
                row: list[list[mpmath.mpf]] = []
                for j in range(1, 9):
                    h = step / (2 * j)
                    before, here = state, moved(state, h, rate(state))
                    for _ in range(2 * j - 1):
                        before, here = here, moved(before, 2 * h, rate(here))
                    smooth = [(a + b) / 2 for a, b in zip(before, moved(here, h, rate(here)), strict=True)]
                    new = [smooth]
                    for k, old in enumerate(row, 1):
                        factor = 1 / ((mpmath.mpf(j) / (j - k)) ** 2 - 1)
                        new.append([b + factor * (b - a) for a, b in zip(old, new[-1], strict=True)])
                    row = new
                state = row[-1]
            return state[:size]

    def error(self, found: Sequence[float], q: Sequence[float], v: Sequence[float]) -> float:
        """Return the relative error of accelerations, norm-wise."""
        true = self.accelerations(q, v)
        with mpmath.workdps(50):
            off = mpmath.norm([mpmath.mpf(float(x)) - y for x, y in zip(found, true, strict=True)])
            return float(off / mpmath.norm(true))


def random_tree(rng: np.random.Generator, size: int, decades: float, *, branched: bool) -> PlanarTree:
    """Return a tree whose masses or lengths span some decades in arbitrary order."""
    spread = 10.0 ** rng.uniform(-decades / 2, decades / 2, size)
    masses, lengths = (spread, rng.uniform(0.5, 2.0, size)) if rng.random() < 0.6 else (np.ones(size), spread**0.25)
    parents = tuple(int(rng.integers(-1, k)) if branched else k - 1 for k in range(size))
    return PlanarTree(tuple(masses.tolist()), tuple(lengths.tolist()), parents)
