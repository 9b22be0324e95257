"""A frame of three storeys in an earthquake: how likely its first storey drifts too far.

python examples/frame_in_earthquake/demo.py [--samples 4000] [--out FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from scipy import special

import eomgen

GREY, BLUE, VERMILION, BLACK = "#999999", "#0072B2", "#D55E00", "#000000"  # Okabe and Ito
FOLDER = Path(__file__).parent
STOREYS = 3
#: Drift of the first storey whose probabilities are wanted, m.
THRESHOLDS = (-0.1, -0.06, -0.02, 0.02, 0.06, 0.1)


def scene(softening: float = 0.2) -> eomgen.Scene:
    """Return the frame; coordinates are drifts of storeys, and the share ``softening`` of their stiffness is gone where
    they drift by far more than 5 cm; linear with zero."""
    builder = eomgen.SceneBuilder(
        "frame_in_earthquake", description="frame of three storeys in an earthquake", gravity=[0, 0, 0]
    )
    builder.parameter("mass", 2000.0, unit="kg").parameter("storey", 2e5, unit="N/m")
    builder.parameter("damper", 2000.0, unit="N s/m").parameter("softening", softening, tunable=True)
    builder.random(
        "ground",
        "kanai_tajimi",
        standard_deviation="1 m/s^2",
        frequency="15 rad/s",
        damping=0.6,
        modes=40,
        seed=1,
        unit="m/s^2",
    )
    for floor in range(1, STOREYS + 1):
        name = f"floor{floor}"
        builder.body(name, "mass")
        builder.joint(f"x{floor}", "prismatic", f"floor{floor - 1}" if floor > 1 else "base", name, axis=[1, 0, 0])
        drift, above = f"q.x{floor}", f"mass * {STOREYS + 1 - floor}"
        columns = f"storey * {drift} * (1 - softening + softening / sqrt(1 + ({drift} / 0.05)**2))"
        shaken = f"{above} * ground * t / 2 * exp(1 - t / 2)"
        builder.effort(f"storey{floor}", f"x{floor}", f"-{columns} - damper * v.x{floor} - {shaken}")
    builder.output("drift", formula="q.x1", unit="m")
    builder.simulation(method="trapezoidal", step=0.02, duration=5.0)
    return builder.build()


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    linear = eomgen.random_vibration(eomgen.build(scene(0.0)), "drift", thresholds=THRESHOLDS, points=False)
    model = eomgen.build(scene())
    times = np.linspace(0.5, 5.0, 10).tolist()
    found = eomgen.random_vibration(
        model, "drift", thresholds=THRESHOLDS, samples=given.samples, times=times, levels=[0.06, 0.1]
    )
    (ground,) = found.processes
    print(f"ground: {ground.variables} modes capture {100 * ground.captured:.2f} % of the variance")
    print(f"linear: standard deviation {1e3 * linear.moments['first_order'][1]:.3f} mm")
    mean, deviation, *_ = found.moments["monte_carlo"]
    print(f"softening: mean {1e3 * mean:.3f} mm, standard deviation {1e3 * deviation:.3f} mm")
    for threshold, above in zip(THRESHOLDS, found.distributions["quadratic"].above, strict=True):
        print(f"{1e3 * threshold:4.0f} mm: P(above) {above:.3e}")
    for level, values in found.first_passage.items():
        rate, counted = values["crossing_rate"], values["monte_carlo"]
        print(f"first passage of {1e3 * level:.0f} mm: {rate:.4f} by crossings, {counted:.4f} of samples")

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    at = 1e3 * np.array(THRESHOLDS)
    for label, one, colour, style in (
        ("linear columns", linear.distributions["first_order"], GREY, "--"),
        ("first order at most probable points", found.distributions["form"], VERMILION, "x:"),
        ("quadratic there", found.distributions["quadratic"], BLUE, "o-"),
    ):
        left.plot(at, special.ndtri(one.below), style, color=colour, label=label)
    counts = found.distributions["monte_carlo"]
    low, high = special.ndtri(counts.low), special.ndtri(counts.high)
    known = np.isfinite(low) & np.isfinite(high)
    left.vlines(at[known], low[known], high[known], color=BLACK, linewidth=3, alpha=0.5)
    left.plot([], [], color=BLACK, linewidth=3, alpha=0.5, label=f"{given.samples} samples, 95 %")
    named = np.array([1e-5, 1e-3, 0.05, 0.5, 0.95, 0.999, 1.0 - 1e-5])
    left.set_yticks(special.ndtri(named), [f"{share:g}" for share in named])
    left.set(xlabel="drift of the first storey, mm", ylabel="probability of not more", title="after 5 s")
    left.legend(frameon=False, fontsize="small")
    for seed, colour in ((1, BLUE), (2, VERMILION)):
        drawn = np.random.default_rng(seed).standard_normal(ground.variables).tolist()
        variables = {f"ground_z{k}": value for k, value in enumerate(drawn, 1)}
        run = model.simulate(parameters=variables)
        right.plot(run.t, 1e3 * run.outputs["drift"].ravel(), color=colour, label=f"sample {seed}")
    right.set(xlabel="time, s", ylabel="drift, mm", title="samples")
    right.legend(frameon=False, fontsize="small")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "frame_in_earthquake.png", dpi=100)


if __name__ == "__main__":
    main()
