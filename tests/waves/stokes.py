"""Exact regular waves of deep water by Fourier collocation of the stream function (Rienecker and Fenton 1981)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from eomgen.base.arrays import Array


def deep_wave(k: float, height: float, gravity: float = 9.81, count: int = 20) -> tuple[Array, Array, float]:
    """Return places x from crest to trough, elevations there, and the celerity where deep water rests."""
    x = np.arange(count + 1) * np.pi / count  # lengths in 1/k, gravity 1
    number = np.arange(1, count + 1)
    cosine, sine = np.cos(number * x[:, None]), np.sin(number * x[:, None])

    def equations(unknown: Any, steep: float) -> Any:
        eta, b, (c, flow, head) = unknown[: count + 1], unknown[count + 1 : 2 * count + 1], unknown[2 * count + 1 :]
        growth = b * np.exp(number * eta[:, None])
        stream = -c * eta + (growth * cosine).sum(axis=1) - flow
        u, w = -c + (number * growth * cosine).sum(axis=1), (number * growth * sine).sum(axis=1)
        mean = eta[1:-1].sum() + 0.5 * (eta[0] + eta[-1])
        return np.array([*stream, *(0.5 * (u**2 + w**2) + eta - head), mean, eta[0] - eta[-1] - steep])

    found = np.zeros(2 * count + 4)
    found[: count + 1], found[count + 1] = 0.05 * k * height * np.cos(x), 0.05 * k * height
    found[2 * count + 1], found[2 * count + 3] = 1.0, 0.5
    turned = 1e-30j * np.eye(len(found))
    for part in np.linspace(0.1, 1.0, 10):  # from far away other solutions of the collocation are found
        for _ in range(8):
            jacobian = np.array([equations(found + row, part * k * height).imag for row in turned]).T / 1e-30
            found = found - np.linalg.solve(jacobian, equations(found, part * k * height))
    assert np.abs(equations(found, k * height)).max() < 1e-13
    return x / k, found[: count + 1] / k, float(found[2 * count + 1]) * math.sqrt(gravity / k)
