"""A storm by particles beside linear theory, and a swell as two radars see it.

python examples/storm_in_lagrangian_waves/demo.py [--seas 100] [--seed 3] [--costs] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from eomgen.base.arrays import Array
from eomgen.waves import Components, Jonswap, Radar, Sea, Spreading, discretized, statistics_of

BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
FOLDER = Path(__file__).parent
GRAVITY = 9.81
HEIGHT, PERIOD = 7.0, 10.0
LABELS = 4096
QUANTILES = (0.001, 0.999)
INCIDENCE = math.radians(23.0)


def linear(waves: Components, x: Array) -> tuple[Array, Array]:
    """Return elevation and horizontal velocity at the surface by linear theory at fixed points: exp(k z) at z = eta."""
    k = waves.vectors[:, :1]
    theta = k * x + waves.phase[:, None]
    eta = (waves.amplitude[:, None] * np.cos(theta)).sum(axis=0)
    speed = waves.amplitude[:, None] * np.sqrt(GRAVITY * k) * np.exp(k * eta)
    return eta, (speed * np.cos(theta)).sum(axis=0)


def quantiles(values: Array, weights: Array) -> list[float]:
    """Return ``QUANTILES`` over the plane of values that each stand for so much of it."""
    order = np.argsort(values)
    share = np.cumsum(weights[order]) / weights.sum()
    return [float(np.interp(part, share, values[order])) for part in QUANTILES]


def table(seas: int) -> dict[str, dict[str, list[float]]]:
    """Return quantiles of elevation and of horizontal velocity at the surface by each theory, from many seas."""
    storm = discretized(Jonswap(HEIGHT, PERIOD), height=HEIGHT)
    by_order = {order: Sea(storm.realisation(0), order=order) for order in (1, 2)}
    found: dict[str, list[tuple[Array, Array, Array]]] = {"linear": [], "order 1": [], "order 2": []}
    for seed in range(seas):
        waves = storm.realisation(seed)
        for order, sea in by_order.items():
            profile = sea.with_waves(waves).profile(LABELS, 0.0)
            found[f"order {order}"].append((profile.z, profile.u, profile.xa))
        x = profile.labels[::4]
        found["linear"].append((*linear(waves, x), np.ones_like(x)))
    columns = {name: [np.concatenate(part) for part in zip(*parts, strict=True)] for name, parts in found.items()}
    return {name: {"z": quantiles(z, w), "u": quantiles(u, w)} for name, (z, u, w) in columns.items()}


def draw_storm(axes: plt.Axes, seed: int) -> None:
    storm = discretized(Jonswap(HEIGHT, PERIOD), height=HEIGHT)
    waves = storm.realisation(seed)
    one, two = (Sea(waves, order=order).profile(LABELS, 0.0) for order in (1, 2))
    x = np.linspace(0.0, float(two.labels[-1]), LABELS)
    eta, _ = linear(waves, x)
    place = float(two.x[np.argmax(two.z)])
    window = (place - 180.0, place + 180.0)
    for along, up, label, colour, style in (
        (x, eta, "linear, fixed points", "black", ":"),
        (one.x, one.z, "particles, order 1", GREEN, "--"),
        (two.x, two.z, "particles, order 2", BLUE, "-"),
    ):
        axes.plot(along - place, up, style, color=colour, linewidth=1.3, label=label)
    axes.set_xlim(window[0] - place, window[1] - place)
    axes.set_title("Highest crest of 5 km of storm, Hs = 7 m, Tp = 10 s", loc="left", fontsize=10)
    axes.set_xlabel("along the waves, m")
    axes.set_ylabel("elevation, m")
    axes.legend(frameon=False, fontsize=8)


def swell() -> Sea:
    """Return a swell that runs nearly along the flight, 1.5 m high, with waves of 9 s."""
    spectrum = discretized(
        Jonswap(1.5, 9.0, 5.0), length=1500.0, band=(0.8, 1.35), spreading=Spreading(60.0, heading=0.4, directions=7)
    )
    return Sea(spectrum.realisation(2))


def draw_image(axes: plt.Axes, sea: Sea, radar: Radar, title: str, pixel: float) -> Array:
    edges = np.arange(0.0, 1000.0 + pixel, pixel)
    image = radar.image(sea, 0.0, edges, edges, labels_per_cell=4)
    axes.imshow(
        image, origin="lower", extent=(0.0, float(edges[-1]), 0.0, float(edges[-1])), cmap="gray", vmin=0.0, vmax=3.0
    )
    axes.set_title(title, loc="left", fontsize=10)
    axes.set_xlabel("flight, m")
    axes.set_ylabel("range, m")
    return image


def costs() -> None:
    """Print the process time of sums over pairs at labels."""
    cases = {
        "no bottom, one direction": (discretized(Jonswap(7.0, 10.0)), math.inf),
        "20 m, one direction": (discretized(Jonswap(2.0, 8.0), depth=20.0), 20.0),
        "30 m, five directions": (
            discretized(Jonswap(3.0, 8.0), depth=30.0, length=600.0, spreading=Spreading(10.0, directions=5)),
            30.0,
        ),
    }
    labels = np.column_stack((np.linspace(0.0, 5000.0, 2048), np.zeros(2048)))
    for name, (spectrum, depth) in cases.items():
        sea, taken = Sea(spectrum.realisation(1), depth), []
        sea.motion(labels[:8], 0.0)
        for _ in range(7):
            began = time.process_time()
            sea.motion(labels, 1.0)
            taken.append(time.process_time() - began)
        count = len(spectrum.energy)
        each = float(np.median(taken)) / (0.5 * count * (count - 1) * len(labels))
        print(f"{name}: {count} components, {1e9 * each:.2f} ns a pair and label")


def main(seas: int, seed: int, out: Path, pixel: float = 12.5) -> None:
    began = time.perf_counter()
    known = statistics_of(discretized(Jonswap(HEIGHT, PERIOD), height=HEIGHT))
    rows = table(seas)
    print(f"quantiles 0.1 % and 99.9 % over {seas} seas of 5 km, {time.perf_counter() - began:.1f} s")
    for name, row in rows.items():
        print(f"{name:10s} z {row['z'][0]:6.2f} {row['z'][1]:6.2f} m    u {row['u'][0]:6.2f} {row['u'][1]:6.2f} m/s")
    print(f"skewness of order 2 {known.skewness:.4f}, drift {known.drift():.4f} m/s")
    figure, axes = plt.subplot_mosaic([["storm", "storm"], ["air", "space"]], figsize=(8.5, 7.6), layout="constrained")
    draw_storm(axes["storm"], seed)
    began, sea = time.perf_counter(), swell()
    for name, over_velocity, title in (
        ("air", 30.0, "from the air, R/V = 30 s"),
        ("space", 120.0, "from space, R/V = 120 s"),
    ):
        image = draw_image(axes[name], sea, Radar(over_velocity, INCIDENCE), f"Swell of 1.5 m {title}", pixel)
        print(f"{title}: mean intensity {image.mean():.3f}, deviation {image.std():.3f}")
    print(f"images {time.perf_counter() - began:.1f} s, {len(sea.amplitude)} components")
    axes["storm"].grid(alpha=0.3, linewidth=0.5)
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "storm_in_lagrangian_waves.png", dpi=120)
    plt.close(figure)
    print("figure", out / "storm_in_lagrangian_waves.png")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seas", type=int, default=100)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--costs", action="store_true", help="print what sums over pairs take, and draw nothing")
    parser.add_argument("--out", type=Path, default=FOLDER)
    arguments = parser.parse_args()
    if arguments.costs:
        costs()
    else:
        main(arguments.seas, arguments.seed, arguments.out)
