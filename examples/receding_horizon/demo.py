"""Balance a pole on a cart at 1 kHz: a receding horizon of acados over eomgen's dynamics, around a stepper of a pole
that is heavier than the controller knows, and that is hit twice.

python examples/receding_horizon/demo.py [--duration 7] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import eomgen
from eomgen.base.arrays import Array

FOLDER = Path(__file__).parent
SCENE = FOLDER.parent / "cart_pole_swing_up" / "model" / "scene.toml"
#: Time between calls of the controller, s, and step of the plant, s.
SAMPLE, STEP = 1e-3, 2.5e-4
#: Horizon, s, its nodes, and the largest force, N.
HORIZON, NODES, FORCE = 1.0, 25, 20.0
UPRIGHT = np.array([0.0, np.pi, 0.0, 0.0])
#: Pole of the plant, kg; the controller has the value of the scene.
POLE = 0.39
#: Angular velocities that hits add, rad/s, by time, s.
HITS = {3.0: -2.5, 4.5: 3.5}


class Loop(NamedTuple):
    """A run under control: times (n,), states (n, 4), forces (n,), and processor time of each call, s, (n,)."""

    t: Array
    x: Array
    u: Array
    seconds: Array


def controller(folder: Path) -> Any:
    """Return acados' solver of the horizon, one iteration of sequential quadratic programming for each call."""
    os.environ.setdefault("ACADOS_SOURCE_DIR", str(Path(sys.prefix) / "acados"))
    eomgen.generate(SCENE, folder / "cart_pole", target="acados")
    sys.path.insert(0, str(folder / "cart_pole"))
    cart_pole = importlib.import_module("cart_pole_acados")
    from acados_template import AcadosOcp  # noqa: PLC0415  # the module above has found the package

    ocp = AcadosOcp()
    ocp.model, ocp.dims.N, ocp.code_export_directory = cart_pole.model("ERK"), NODES, str(folder / "c")
    ocp.cost.cost_type = ocp.cost.cost_type_e = "LINEAR_LS"
    ocp.cost.Vx, ocp.cost.Vu = np.eye(5, 4), np.eye(5)[:, 4:]
    ocp.cost.W, ocp.cost.yref = np.diag([2.0, 10.0, 0.1, 0.1, 0.002]), np.append(UPRIGHT, 0.0)
    ocp.cost.Vx_e, ocp.cost.W_e, ocp.cost.yref_e = np.eye(4), np.diag([20.0, 100.0, 2.0, 2.0]), UPRIGHT
    ocp.constraints.x0 = np.zeros(4)
    ocp.constraints.idxbu, ocp.constraints.ubu = np.array([0]), np.array([FORCE])
    ocp.constraints.lbu = -ocp.constraints.ubu
    options = ocp.solver_options
    options.tf, options.integrator_type, options.nlp_solver_type = HORIZON, "ERK", "SQP_RTI"
    options.qp_solver, options.qp_solver_cond_N = "PARTIAL_CONDENSING_HPIPM", 5
    with Path(os.devnull).open("w") as silent, contextlib.redirect_stdout(silent):
        solver = cart_pole.solver(ocp, json_file=str(folder / "ocp.json"))
    for node in range(NODES + 1):
        solver.set(node, "x", UPRIGHT * node / NODES)
    return solver


def controlled(solver: Any, duration: float) -> Loop:
    """Return a run from hanging, with the force of the first node of each horizon held over one sample."""
    model = eomgen.build(SCENE)
    plant = model.start(step=STEP, method="rk4", parameters={"pole_mass": POLE})
    rows, hits = [], dict(HITS)
    for sample in range(round(duration / SAMPLE)):
        t = sample * SAMPLE
        if hits and t >= min(hits):
            plant.set_state({"v": plant.v + np.array([0.0, hits.pop(min(hits))])})
        x = np.concatenate([plant.q, plant.v])
        began = time.thread_time()
        for side in ("lbx", "ubx"):
            solver.constraints_set(0, side, x)
        status = solver.solve()
        force = solver.get(0, "u")
        rows.append((t, *x, force[0], time.thread_time() - began))
        if status:
            raise RuntimeError(f"acados returned the status {status} at {t:.3f} s")
        plant.step(float(force[0]), round(SAMPLE / STEP))
    table = np.array(rows)
    return Loop(table[:, 0], table[:, 1:5], table[:, 5], table[:, 6])


def draw(loop: Loop, file: Path) -> None:
    """Write the picture of a run."""
    import matplotlib as mpl  # noqa: PLC0415  # for the picture alone

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    figure, (upper, middle, lower) = plt.subplots(3, 1, figsize=(9, 6.0), layout="constrained", sharex=True)
    upper.plot(loop.t, np.degrees(loop.x[:, 1]), color="#0072B2", linewidth=1.2)
    upper.axhline(180.0, color="#888888", linewidth=0.8)
    upper.set(ylabel="angle of the pole, °")
    of_cart = upper.twinx()
    of_cart.plot(loop.t, loop.x[:, 0], color="#D55E00", linewidth=1.0)
    of_cart.set_ylabel("cart, m", color="#D55E00")
    upper.set_title("Swing-up, and two hits, of a pole 30 % heavier than the controller knows", loc="left")
    middle.plot(loop.t, loop.u, color="#0072B2", linewidth=1.0)
    middle.set(ylabel="force, N")
    lower.plot(loop.t, 1e3 * loop.seconds, ".", color="#009E73", markersize=2)
    lower.axhline(1e3 * SAMPLE, color="#D55E00", linewidth=0.8)
    lower.set(xlabel="time, s", ylabel="call, ms", ylim=(0.0, 1.1e3 * SAMPLE))
    middle_time = f"median {1e6 * np.median(loop.seconds):.0f} µs"
    lower.set_title(
        f"Processor time of a call of acados, {middle_time}; line: the sample of {1e3 * SAMPLE:g} ms", loc="left"
    )
    for axes in (upper, middle, lower):
        axes.grid(alpha=0.3, linewidth=0.5)
    for hit in (at for at in HITS if at < loop.t[-1]):
        for axes in (upper, middle, lower):
            axes.axvline(hit, color="#CC79A7", linewidth=0.8)
    figure.savefig(file, dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=7.0)
    parser.add_argument("--out", type=Path, default=FOLDER)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        loop = controlled(controller(Path(folder)), options.duration)
    late = np.mean(loop.seconds > SAMPLE)
    median, most = (1e6 * np.quantile(loop.seconds, part) for part in (0.5, 0.99))
    print(f"call of acados: median {median:.0f} us of processor time, 99 % of calls below {most:.0f} us")
    print(f"calls above {1e3 * SAMPLE:g} ms: {100.0 * late:.2f} %")
    print(f"angle at the end: {np.degrees(loop.x[-1, 1]):.2f} degrees, cart {loop.x[-1, 0]:.3f} m")
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out.resolve() / "receding_horizon.png"
    draw(loop, file)
    print(file)
    return 0 if abs(loop.x[-1, 1] - np.pi) < 0.1 else 1


if __name__ == "__main__":
    raise SystemExit(main())
