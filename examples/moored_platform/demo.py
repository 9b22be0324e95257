"""A moored platform in an irregular sea, with a load on its crane: motion, and heave by linear theory and by a run.

    python examples/moored_platform/demo.py

Heave over frequency comes from one sea of twenty small regular waves whose periods divide 120 s: the forces that they
exert on the platform at rest and the partials of the equations give the linear response; a run over 120 s from the
linear state gives it again, by its Fourier coefficients.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.base.arrays import Array

FOLDER = Path(__file__).parent
BLUE, VERMILION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "0.5"
#: Draught, distance of the columns from the middle, their diameter, and the rope of the load, m.
DRAUGHT, APART, DIAMETER, ROPE = 30.0, 20.0, 8.0, 20.0
STORM: dict[str, Any] = {
    "spectrum": {"type": "jonswap", "height": 3, "period": 9},
    "spreading": {"exponent": 15, "directions": 3},
    "heading": "30 deg",
    "components": 25,
    "seed": 3,
    "depth": 120,
    "ramp": 40,
}
#: The waves of the response: periods of REPEATED/j, each of so small an amplitude, m, that all is linear.
REPEATED, NUMBERS, SMALL = 120.0, range(5, 25), 1e-4


def scene(waves: dict[str, Any] | None = None) -> eomgen.Scene:
    """Return the platform in a storm, or in other waves: a ring of four columns with heave plates, four mooring lines,
    and a load of 30 t on a crane 30 m ahead."""
    builder = eomgen.SceneBuilder("moored_platform", description="a moored platform with a load on its crane")
    builder.waves("sea", **(STORM if waves is None else waves))
    builder.parameter("chain", 60e3, unit="N/m", tunable=True).parameter("slack", 397.0, unit="m", tunable=True)
    builder.body("platform", 6.115e6, center_of_mass=[0, 0, -18], inertia=[4.4e9, 4.4e9, 5e9])
    builder.joint("afloat", "free", "base", "platform")
    builder.body("load", 30e3, center_of_mass=[0, 0, -ROPE], inertia=[1e5, 1e5, 1e5])
    builder.joint(
        "tip",
        "universal",
        "platform",
        "load",
        position=[30, 0, 40],
        axis=[1, 0, 0],
        second_axis=[0, 1, 0],
        damping=[2e5, 2e5],
    )
    for name, x, y in (("bow", 1, 1), ("port", -1, 1), ("stern", -1, -1), ("starboard", 1, -1)):
        builder.hull(
            name,
            "platform",
            start=[APART * x, APART * y, -DRAUGHT],
            end=[APART * x, APART * y, 15],
            diameter=DIAMETER,
            waves="sea",
            wet=DRAUGHT,
            stations=4,
            axial_added_mass=8e5,
            axial_drag=4e5,
        )
        builder.point(f"fairlead_{name}", "platform", [24 * x, 24 * y, -20])
        builder.point(f"anchor_{name}", "world", [300 * x, 300 * y, -120])
        builder.spring(f"line_{name}", f"fairlead_{name}", f"anchor_{name}", stiffness="chain", length="slack")
    builder.point("deck", "platform", [0, 0, 15]).point("crane", "platform", [30, 0, 40])
    builder.point("hook", "load", [0, 0, -ROPE])
    builder.output("elevation", formula="elevation.sea(position.deck[0], position.deck[1])", unit="m")
    builder.output("deck", position="deck").output("hook", position="hook").output("crane", position="crane")
    builder.output("tension", formula="tension.line_bow", unit="N")
    builder.simulation(step=0.05, duration=240.0, start="equilibrium")
    return builder.build()


def small_waves() -> dict[str, Any]:
    """Return waves along x whose periods divide the time after which they repeat themselves."""
    waves = [{"amplitude": SMALL, "period": REPEATED / j, "phase": 0.7 * j * j} for j in NUMBERS]
    return {"regular": waves, "depth": STORM["depth"]}


def moved(q: Array, along: Array) -> Array:
    """Return a state after a small motion: of the platform's frame in its own axes, and of the two angles."""
    turned = Rotation.from_quat(q[:4], scalar_first=True)
    after = turned * Rotation.from_rotvec(along[:3])
    return np.concatenate([after.as_quat(scalar_first=True), q[4:7] + turned.apply(along[3:6]), q[7:] + along[6:]])


def heave() -> tuple[Array, Array, Array]:
    """Return periods, s, and by period how high the middle of the deck goes over the amplitude of the wave: by linear
    theory, and by a run from the linear state."""
    model = eomgen.build(scene(small_waves()))
    q, still = model.equilibrium().q, np.zeros(model.nv)
    K, C, M = model.partials(q, still, still)
    times = REPEATED * np.arange(256) / 256
    rest = np.zeros((len(times), model.nv))
    forces = -model.inverse_dynamics(np.tile(q, (len(times), 1)), rest, rest, times)
    q = moved(q, np.linalg.solve(K, forces.mean(axis=0)))  # the equilibrium was one with the waves of t = 0
    j = np.array(NUMBERS)
    w = 2.0 * np.pi * j / REPEATED
    by_wave = (np.fft.rfft(forces, axis=0) * 2.0 / len(times))[j]  # F = sum of re(by_wave exp(i w t))
    response = np.array([np.linalg.solve(K + 1j * w_k * C - w_k**2 * M, f) for w_k, f in zip(w, by_wave, strict=True)])
    initial = {"q": moved(q, response.sum(axis=0).real), "v": (1j * w[:, None] * response).sum(axis=0).real}
    run = model.simulate(REPEATED, 0.05, initial=initial, start="initial")
    height = run.outputs["deck"][:-1, 2]
    found = (np.fft.rfft(height - height.mean()) * 2.0 / len(height))[j]
    axes = Rotation.from_quat(q[:4], scalar_first=True).as_matrix()
    up = np.zeros(model.nv)
    up[:3], up[3:6] = np.cross([0.0, 0.0, 15.0], axes[2]), axes[2]
    return REPEATED / j, np.abs(response @ up) / SMALL, np.abs(found) / SMALL


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    run = eomgen.build(scene()).simulate()
    deck, hook = run.outputs["deck"], run.outputs["hook"] - run.outputs["crane"]
    swing = np.degrees(np.arctan2(np.hypot(hook[:, 0], hook[:, 1]), -hook[:, 2]))
    elevation, tension = run.outputs["elevation"].ravel(), 1e-3 * run.outputs["tension"].ravel()
    late = run.t > STORM["ramp"]
    print(f"elevation {np.std(elevation[late]):.3f} m, deck {np.std(deck[late, 2]):.3f} m (standard deviations)")
    pulls = f"{tension.min():.0f} to {tension.max():.0f} kN"
    print(f"the load swings up to {swing.max():.1f} degrees, the bow line pulls {pulls}")
    periods, linear, found = heave()
    for period, one, other in zip(periods, linear, found, strict=True):
        print(f"{period:6.2f} s: heave {one:.5f} by linear theory, {other:.5f} by the run")

    figure, (top, middle, right) = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    top.plot(run.t, elevation, color=GREY, linewidth=0.8, label="surface under the deck")
    top.plot(run.t, deck[:, 2] - deck[0, 2], color=BLUE, label="deck")
    top.set(xlabel="time, s", ylabel="height, m", title="heave in the sea")
    middle.plot(run.t, swing, color=VERMILION, linewidth=1.0)
    middle.set(xlabel="time, s", ylabel="angle of the rope, degrees", title="load on the crane")
    right.semilogy(periods, linear, "o-", color=BLUE, label="linear theory", markersize=6)
    right.semilogy(periods, found, "x", color=VERMILION, label="run in small waves", markersize=6)
    right.set(xlabel="period, s", ylabel="heave by elevation", title="response")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    top.legend(frameon=False, fontsize="small", loc="upper left")
    top.set_ylim(-3.2, 4.2)
    right.legend(frameon=False, fontsize="small")
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "moored_platform.png", dpi=100)


if __name__ == "__main__":
    main()
