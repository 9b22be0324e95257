"""Beams of shape functions by quadrature along their axis: docs/scene.md, "beams"."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from tests.oracles.interpreter.jets import Jet, jet, stack

Array = NDArray[Any]

NODES = 60


class ShapedBeam:
    """Shape functions at Gauss points, masses there, stiffness and damping of the elastic coordinates."""

    def __init__(self, data: Mapping[str, Any], value: Callable[[Any], float]) -> None:
        self.length, self.start = value(data["length"]), value(data.get("start", 0.0))
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        self.s, self.weights = 0.5 * (nodes + 1.0), 0.5 * weights * self.length
        profile = np.polynomial.Polynomial([value(c) for c in data.get("mass_profile", [1.0])])
        self.masses = value(data["mass_per_length"]) * profile(self.s) * self.weights
        self.polar_inertia = value(data.get("polar_inertia", 0.0)) * self.length
        self.order, self.stiffening = data.get("order", 1), data.get("stiffening", True)
        self.ways: list[tuple[str, int]] = []
        blocks = []
        for way in ("bending_y", "bending_z", "stretch"):
            if way in data:
                table = data[way]
                self.ways += [(way, k) for k in range(table["modes"])]
                blocks.append(self._stiffness(way, table, value))
        self.kinds = {
            way: data[way].get("shapes", "clamped_free") for way in ("bending_y", "bending_z", "stretch") if way in data
        }
        self.count = len(self.ways)
        self.K, self.D = np.zeros((self.count,) * 2), np.zeros((self.count,) * 2)
        at = 0
        for K, D in blocks:
            self.K[at : at + len(K), at : at + len(K)] = K
            self.D[at : at + len(K), at : at + len(K)] = D
            at += len(K)

    def _stiffness(self, way: str, table: Mapping[str, Any], value: Callable[[Any], float]) -> tuple[Array, Array]:
        bent = 2 if way.startswith("bending") else 1
        kind = table.get("shapes", "clamped_free")
        f = np.array([shape(way, kind, k, self.s, bent) for k in range(table["modes"])]) / self.length**bent
        profile = np.polynomial.Polynomial([value(c) for c in table.get("profile", [1.0])])
        K = value(table["stiffness"]) * (f * profile(self.s) * self.weights) @ f.T
        return K, value(table.get("stiffness_damping", 0.0)) * K

    def positions(self, elastic: list[Jet], at: Array | None = None) -> Jet:
        """Places (..., points, 3) of the axis in the beam's frame at s (the Gauss points)."""
        s = self.s if at is None else at
        x = self.start + self.length * s
        parts: dict[str, Any] = {"bending_y": jet(0.0 * s), "bending_z": jet(0.0 * s), "stretch": jet(0.0 * s)}
        for (way, k), number in zip(self.ways, elastic, strict=True):
            parts[way] = parts[way] + number[..., None] * shape(way, self.kinds[way], k, s, 0)
        along = x + parts["stretch"]
        if self.stiffening:
            along = along - self._shortening(elastic, s)
        return stack(
            [along + 0.0 * parts["bending_y"], parts["bending_y"] + 0.0 * along, parts["bending_z"] + 0.0 * along]
        )

    def _shortening(self, elastic: list[Jet], s: Array) -> Jet:
        """Half the integral of the squared slopes from the frame's origin, x = 0, to s."""
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        origin = -self.start / self.length
        lower = min(max(origin, 0.0), 1.0)
        inner = lower + 0.5 * (nodes + 1.0) * (s[:, None] - lower)  # (points, nodes)
        measure = 0.5 * weights * (s[:, None] - lower) * self.length
        total: Any = jet(0.0)
        for bending in ("bending_y", "bending_z"):
            slope: Any = None
            for (way, k), number in zip(self.ways, elastic, strict=True):
                if way == bending:
                    term = number[..., None, None] * (shape(way, self.kinds[way], k, inner, 1) / self.length)
                    slope = term if slope is None else slope + term
            if slope is not None:
                total = total + (slope * slope * measure).sum()
        return 0.5 * total


def shape(way: str, kind: str, k: int, s: Array, derivative: int) -> Array:
    """Shape function k (from 0) of natural normalisation, or a derivative in s."""
    if kind == "pinned_pinned":
        return _sine((k + 1) * math.pi, s, derivative)
    if way == "stretch":
        if kind == "free_free":
            w = (k + 1) * math.pi
            return w**derivative * np.cos(w * s + 0.5 * math.pi * derivative)
        return _sine((k + 0.5) * math.pi, s, derivative)
    if kind == "clamped_free":
        beta = _root(lambda b: math.cos(b) + 1.0 / math.cosh(b), (k + 0.5) * math.pi)
        ratio = (math.cosh(beta) + math.cos(beta)) / (math.sinh(beta) + math.sin(beta))
        return _combined(beta, s, derivative, (1.0, -1.0, -ratio, ratio))
    beta = _root(lambda b: math.cos(b) - 1.0 / math.cosh(b), (k + 1.5) * math.pi)
    ratio = (math.cosh(beta) - math.cos(beta)) / (math.sinh(beta) - math.sin(beta))
    return _combined(beta, s, derivative, (1.0, 1.0, -ratio, -ratio))


def _sine(w: float, s: Array, derivative: int) -> Array:
    return w**derivative * np.sin(w * s + 0.5 * math.pi * derivative)


def _combined(b: float, s: Array, derivative: int, factors: tuple[float, float, float, float]) -> Array:
    """Derivative of a cosh + b cos + c sinh + d sin of b s; by exponentials, which do not cancel."""
    ch, co, sh, si = factors
    turn = 0.5 * math.pi * derivative
    sign = (-1.0) ** derivative
    growing, falling = 0.5 * (ch + sh), 0.5 * (ch - sh)
    hyperbolic = growing * np.exp(b * s) + sign * falling * np.exp(-b * s)
    return b**derivative * (hyperbolic + co * np.cos(b * s + turn) + si * np.sin(b * s + turn))


def _root(function: Callable[[float], float], guess: float) -> float:
    return float(brentq(function, guess - 0.6, guess + 0.6, xtol=1e-15, rtol=1e-15))
