"""A quarter car on a random road of ISO 8608: how likely its suspension comes to its stops.

python examples/quarter_car_on_random_road/demo.py [--samples 4000] [--out FOLDER]
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
#: Travel of the suspension whose probabilities are wanted, m.
THRESHOLDS = (-0.08, -0.05, -0.02, 0.01, 0.04, 0.07)


def scene(hardening: float = 5e6, rebound: float = 500.0) -> eomgen.Scene:
    """Return the car on a road of class D at 15 m/s: stops of rubber beside the spring, a damper that is harder in
    rebound; linear with zeros."""
    builder = eomgen.SceneBuilder(
        "quarter_car_on_random_road", description="quarter car on a random ISO 8608 road of class D", gravity=[0, 0, 0]
    )
    builder.parameter("spring", 16000.0, unit="N/m").parameter("hardening", hardening, unit="N/m^3", tunable=True)
    builder.parameter("damper", 980.0, unit="N s/m").parameter("rebound", rebound, unit="N s/m", tunable=True)
    builder.parameter("tyre", 160000.0, unit="N/m")
    builder.random("road", "road", road_class="D", speed=15, share=0.99, seed=1, unit="m")
    builder.body("wheel", 36.0).body("body", 240.0)
    for name in ("wheel", "body"):
        builder.joint(name, "prismatic", "base", name, axis=[0, 0, 1])
    spring = "spring * (q.body - q.wheel) + hardening * (q.body - q.wheel)**3"
    damper = "damper * (v.body - v.wheel) + rebound * (sqrt((v.body - v.wheel)**2 + 0.5**2) - 0.5)"
    builder.effort("upper", "body", f"-({spring}) - ({damper})")
    builder.effort("lower", "wheel", f"{spring} + {damper} + tyre * (road * (1 - exp(-(t / 0.5)**2)) - q.wheel)")
    builder.output("travel", formula="q.body - q.wheel", unit="m")
    builder.simulation(method="trapezoidal", step=0.005, duration=2.5)
    return builder.build()


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--out", type=Path, default=FOLDER)
    given = parser.parse_args()
    linear = eomgen.random_vibration(eomgen.build(scene(0.0, 0.0)), "travel", thresholds=THRESHOLDS, points=False)
    model = eomgen.build(scene())
    found = eomgen.random_vibration(model, "travel", thresholds=THRESHOLDS, samples=given.samples)
    (road,) = found.processes
    print(f"road: {road.variables} modes capture {100 * road.captured:.2f} % of the variance")
    print(f"linear: standard deviation {1e3 * linear.moments['first_order'][1]:.3f} mm")
    mean, deviation, skewness, _ = found.moments["monte_carlo"]
    print(f"with stops: mean {1e3 * mean:.3f} mm, standard deviation {1e3 * deviation:.3f} mm, skewness {skewness:.2f}")
    for threshold, below, above in zip(
        THRESHOLDS, found.distributions["quadratic"].below, found.distributions["quadratic"].above, strict=True
    ):
        print(f"{1e3 * threshold:4.0f} mm: P(below) {below:.3e}, P(above) {above:.3e}")

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    at = 1e3 * np.array(THRESHOLDS)
    for label, one, colour, style in (
        ("linear suspension", linear.distributions["first_order"], GREY, "--"),
        ("first order at most probable points", found.distributions["form"], VERMILION, "x:"),
        ("quadratic there", found.distributions["quadratic"], BLUE, "o-"),
    ):
        left.plot(at, special.ndtri(one.below), style, color=colour, label=label)
    counted = found.distributions["monte_carlo"]
    with np.errstate(divide="ignore"):
        low, high = special.ndtri(counted.low), special.ndtri(counted.high)
    known = np.isfinite(low) & np.isfinite(high)
    left.vlines(at[known], low[known], high[known], color=BLACK, linewidth=3, alpha=0.5)
    left.plot([], [], color=BLACK, linewidth=3, alpha=0.5, label=f"{given.samples} samples, 95 %")
    named = np.array([1e-5, 1e-3, 0.05, 0.5, 0.95, 0.999, 1.0 - 1e-5])
    left.set_yticks(special.ndtri(named), [f"{share:g}" for share in named])
    left.set(xlabel="travel of the suspension, mm", ylabel="probability of not more", title="after 2.5 s")
    left.legend(frameon=False, fontsize="small")
    for seed, colour in ((1, BLUE), (2, VERMILION)):
        drawn = np.random.default_rng(seed).standard_normal(road.variables).tolist()
        variables = {f"road_z{k}": value for k, value in enumerate(drawn, 1)}
        run = model.simulate(parameters=variables)
        right.plot(run.t, 1e3 * run.inputs["road"].ravel(), ":", color=colour, linewidth=1)
        right.plot(run.t, 1e3 * run.outputs["travel"].ravel(), color=colour, label=f"sample {seed}")
    right.set(xlabel="time, s", ylabel="mm", title="travel, and the road (dotted)")
    right.legend(frameon=False, fontsize="small")
    for axes in figure.axes:
        axes.grid(alpha=0.3, linewidth=0.5)
    given.out.mkdir(parents=True, exist_ok=True)
    figure.savefig(given.out / "quarter_car_on_random_road.png", dpi=100)


if __name__ == "__main__":
    main()
