"""Second derivatives for optimisers: eomgen beside CasADi's symbols, in C and in an optimal control of an arm.

    python -m benchmarks.optimisers [--rounds 9] [--nodes 50] [--quick]

The arm is Panda with locked fingers, read from the same URDF file. Its recursions of Newton and Euler and of
articulated bodies stand here in CasADi's SX symbols, and CasADi writes the C of their derivatives. First table: the
lower triangle of the Hessian of weights . inverse dynamics, ns per call; the numbers are compared before any is timed.
Second table: motion from one pose to another with the least effort, multiple shooting over rk4 with IPOPT and exact
Hessians.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import eomgen
from benchmarks.measure import figure, interleaved, machine, pin_to_core, table
from benchmarks.programs import FLAGS, Program, default_folder, timing_program
from benchmarks.robots import ROBOTS, driven, pinocchio_model, scene
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive

FUNCTION, STATES = "inverse_dynamics_hessian", 64
WEIGHTS = (0.3, -0.7, 0.5, 1.1, -0.4, 0.2, 0.9)
TOLERANCE = 1e-11


class Arm:
    """An arm of revolute joints in SX symbols, from a model of Pinocchio."""

    def __init__(self, model: Any) -> None:
        self.model, self.joints = model, range(1, model.njoints)
        self.axes = [None] + [np.eye(3)["XYZ".index(model.joints[i].shortname()[-1])] for i in self.joints]

    def rotations(self, q: Any) -> list[Any]:
        """Return the rotation of each link against its parent."""
        found = [None]
        for i in self.joints:
            c, s, axis = ca.cos(q[i - 1]), ca.sin(q[i - 1]), int(np.argmax(self.axes[i]))
            rows = [[1, 0, 0], [0, c, -s], [0, s, c]]
            order = [(k - axis) % 3 for k in range(3)]
            turned = ca.vertcat(*[ca.horzcat(*[rows[j][k] for k in order]) for j in order])
            placement = self.model.jointPlacements[i].rotation
            found.append(ca.SX(np.where(np.abs(placement) < 1e-14, 0.0, placement)) @ turned)
        return found

    def inverse_dynamics(self, q: Any, v: Any, a: Any) -> Any:
        """Return tau by the recursion of Newton and Euler (Featherstone 2008, section 5.3), 3-vectors."""
        cross, R = ca.cross, self.rotations(q)
        omega, alpha, acceleration = [ca.SX.zeros(3)], [ca.SX.zeros(3)], [ca.SX(-self.model.gravity.linear)]
        forces, moments = [ca.SX.zeros(3)], [ca.SX.zeros(3)]
        for i in self.joints:
            up, p, axis = self.model.parents[i], ca.SX(self.model.jointPlacements[i].translation), self.axes[i]
            carried = R[i].T @ omega[up]
            omega.append(carried + axis * v[i - 1])
            alpha.append(R[i].T @ alpha[up] + axis * a[i - 1] + cross(carried, axis * v[i - 1]))
            inward = cross(omega[up], cross(omega[up], p))
            acceleration.append(R[i].T @ (acceleration[up] + cross(alpha[up], p) + inward))
            body = self.model.inertias[i]
            lever, central, w, al = ca.SX(body.lever), ca.SX(body.inertia), omega[i], alpha[i]
            force = body.mass * (acceleration[i] + cross(al, lever) + cross(w, cross(w, lever)))
            forces.append(force)
            moments.append(central @ al + cross(w, central @ w) + cross(lever, force))
        tau: list[Any] = [None] * self.model.nv
        for i in reversed(self.joints):
            up, p = self.model.parents[i], ca.SX(self.model.jointPlacements[i].translation)
            tau[i - 1] = ca.dot(ca.SX(self.axes[i]), moments[i])
            forces[up] += R[i] @ forces[i]
            moments[up] += R[i] @ moments[i] + cross(p, R[i] @ forces[i])
        return ca.vertcat(*tau)

    def forward_dynamics(self, q: Any, v: Any, tau: Any) -> Any:
        """Return vdot by articulated bodies (Featherstone 2008, section 7.3), spatial vectors, angular first."""

        def skew(x: Any) -> Any:
            return ca.vertcat(ca.horzcat(0, -x[2], x[1]), ca.horzcat(x[2], 0, -x[0]), ca.horzcat(-x[1], x[0], 0))

        def crossed(x: Any, y: Any) -> Any:
            return ca.vertcat(ca.cross(x[:3], y[:3]), ca.cross(x[:3], y[3:]) + ca.cross(x[3:], y[:3]))

        def crossed_dual(x: Any, f: Any) -> Any:
            return ca.vertcat(ca.cross(x[:3], f[:3]) + ca.cross(x[3:], f[3:]), ca.cross(x[:3], f[3:]))

        R, X, S, V, bias, inertia, force = self.rotations(q), [None], [None], [ca.SX.zeros(6)], [None], [None], [None]
        for i in self.joints:
            E, r = R[i].T, ca.SX(self.model.jointPlacements[i].translation)
            X.append(ca.vertcat(ca.horzcat(E, ca.SX(3, 3)), ca.horzcat(-E @ skew(r), E)))
            S.append(ca.SX(np.concatenate([self.axes[i], np.zeros(3)])))
            V.append(X[i] @ V[self.model.parents[i]] + S[i] * v[i - 1])
            bias.append(crossed(V[i], S[i] * v[i - 1]))
            body = self.model.inertias[i]
            C, m = skew(ca.SX(body.lever)), body.mass
            inertia_of_body = ca.vertcat(
                ca.horzcat(ca.SX(body.inertia) + m * C @ C.T, m * C), ca.horzcat(m * C.T, m * ca.SX.eye(3))
            )
            inertia.append(inertia_of_body)
            force.append(crossed_dual(V[i], inertia_of_body @ V[i]))
        U, D, drive = {}, {}, {}
        for i in reversed(self.joints):
            up = self.model.parents[i]
            U[i] = inertia[i] @ S[i]
            D[i], drive[i] = ca.dot(S[i], U[i]), tau[i - 1] - ca.dot(S[i], force[i])
            if up:
                left = inertia[i] - U[i] @ U[i].T / D[i]
                moved = force[i] + left @ bias[i] + U[i] * drive[i] / D[i]
                inertia[up] = inertia[up] + X[i].T @ left @ X[i]
                force[up] = force[up] + X[i].T @ moved
        found, acceleration = [], [ca.SX(np.concatenate([np.zeros(3), -self.model.gravity.linear]))]
        for i in self.joints:
            start = X[i] @ acceleration[self.model.parents[i]] + bias[i]
            found.append((drive[i] - ca.dot(U[i], start)) / D[i])
            acceleration.append(start + S[i] * found[-1])
        return ca.vertcat(*found)


def hessian_of_symbols(arm: Arm, shelf: Path, flags: tuple[str, ...]) -> tuple[Program, int]:
    """Return CasADi's C of the Hessian's lower triangle, and its instructions."""
    n = arm.model.nv
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    H = ca.tril(ca.hessian(ca.dot(ca.SX(WEIGHTS), arm.inverse_dynamics(q, v, a)), ca.vertcat(q, v, a))[0])
    function = ca.Function("native_hessian", [q, v, a], [H])
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("native.c")
        generator.add(function)
        generator.generate(f"{folder}/")
        text = (Path(folder) / "native.c").read_text(encoding="utf-8")
    call = (
        f"enum {{ WIDTH = {3 * n}, SIZE = {H.nnz()} }};\n"
        "int native_hessian(const double **arg, double **res, long long *iw, double *w, int mem);\n"
        "static inline void evaluate(const double *state, double *result)\n{\n"
        f"    static double w[{max(function.sz_w(), 1)}];\n"
        f"    const double *arg[{function.sz_arg()}] = {{ state, state + {n}, state + {2 * n} }};\n"
        f"    double *res[{function.sz_res()}] = {{ result }};\n    native_hessian(arg, res, 0, w, 0);\n}}\n"
    )
    return timing_program(shelf, {"native.c": text}, call, flags), function.n_instructions()


def hessian_of_eomgen(described: Any, shelf: Path, flags: tuple[str, ...]) -> tuple[Program, int]:
    """Return eomgen's C of the Hessian's lower triangle, and its operations."""
    system = derive(described, [FUNCTION])
    program = to_program(system, functions=[FUNCTION])
    files = generate_files(program)
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h")) and file != "main.c"}
    n, size, numbers = system.nv, program.functions[0].outputs[0].size, ", ".join(map(repr, WEIGHTS))
    call = (
        f'#include "{program.prefix}.h"\nenum {{ WIDTH = {3 * n}, SIZE = {size} }};\n'
        f"static const double weights[{program.sizes['weights']}] = {{ {numbers} }};\n"
        "static inline void evaluate(const double *state, double *result)\n{\n"
        f"    {program.prefix}_{FUNCTION}(state, state + {n}, state + {2 * n}, weights, result);\n}}\n"
    )
    return timing_program(shelf, sources, call, flags), system.counts[FUNCTION].flops


def of_hessians(rounds: int, shelf: Path) -> None:
    """Print operations and times of the Hessian of inverse dynamics."""
    described = scene(ROBOTS["panda"])
    peer = pinocchio_model(ROBOTS["panda"], described)
    arm, n = Arm(peer.model), peer.model.nv
    with tempfile.TemporaryDirectory() as folder:
        states = Path(folder) / "states"
        peer.states.tofile(states)
        rows, commands, found = [], [], []
        for label, flags in FLAGS.items():
            for name, (built, operations) in (
                ("eomgen", hessian_of_eomgen(described, shelf, flags)),
                ("CasADi", hessian_of_symbols(arm, shelf, flags)),
            ):
                results = Path(folder) / f"{name}_{label}"
                subprocess.run([str(built.file("run")), "results", str(states), str(results)], check=True)
                found.append(np.fromfile(results).reshape(len(peer.states), -1))
                commands.append([str(built.file("run")), "time", str(states), "40"])
                rows.append([name, label, str(operations)])
        off = max(float(np.max(np.abs(one - found[0]))) for one in found) / float(np.max(np.abs(found[0])))
        if off > TOLERANCE:
            sys.exit(f"the Hessians differ by {off:.1e}")
        timings = interleaved(commands, rounds)
    for row, timing in zip(rows, timings, strict=True):
        row.append(figure(timing.median))
    print(f"Hessian of weights . inverse dynamics, {n} joints, lower triangle; largest difference {off:.1e}\n")
    print(table(["", "flags", "operations", "ns per call"], rows))
    for k, label in enumerate(FLAGS):
        print(f"{label}: {timings[2 * k].median / timings[2 * k + 1].median:.2f} of CasADi's time")


def reach(step: Any, n: int, nodes: int) -> tuple[int, float, float, bool]:
    """Return iterations, cost, seconds of the solver and success of a motion between two poses with the least effort.

    Multiple shooting over ``nodes`` steps of (x, u, h), 1.5 s from rest to rest.
    """
    h = 1.5 / nodes
    x, u = ca.MX.sym("x", 2 * n, nodes + 1), ca.MX.sym("u", n, nodes)
    gaps = [step(x[:, k], u[:, k], h) - x[:, k + 1] for k in range(nodes)]
    start = np.array([0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8])
    end = np.array([1.2, 0.4, -0.5, -1.2, 0.6, 2.2, -0.3])
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-8}}
    nlp = {"x": ca.veccat(x, u), "f": h * ca.sumsqr(u) * 1e-3, "g": ca.vertcat(*gaps)}
    solver = ca.nlpsol("reach", "ipopt", nlp, options)
    part = np.linspace(0.0, 1.0, nodes + 1)[:, np.newaxis]
    line = np.concatenate([start + part * (end - start), np.zeros((nodes + 1, n))], axis=1)
    low, high = np.full_like(line, -10.0), np.full_like(line, 10.0)
    low[0] = high[0] = line[0]
    low[-1] = high[-1] = line[-1]
    force = np.full(n * nodes, 100.0)
    began = time.process_time()
    result = solver(
        x0=np.concatenate([line.ravel(), np.zeros(n * nodes)]),
        lbx=np.concatenate([low.ravel(), -force]),
        ubx=np.concatenate([high.ravel(), force]),
        lbg=0.0,
        ubg=0.0,
    )
    seconds, statistics = time.process_time() - began, solver.stats()
    return int(statistics["iter_count"]), float(result["f"]), seconds, bool(statistics["success"])


def native_step(arm: Arm) -> Any:
    """Return a step of rk4 in SX symbols over articulated bodies."""
    n = arm.model.nv
    q, v, tau = (ca.SX.sym(name, n) for name in ("q", "v", "tau"))
    f = ca.Function("f", [ca.vertcat(q, v), tau], [ca.vertcat(v, arm.forward_dynamics(q, v, tau))])
    x, u, h = ca.SX.sym("x", 2 * n), ca.SX.sym("u", n), ca.SX.sym("h")
    k1 = f(x, u)
    k2 = f(x + h / 2 * k1, u)
    k3 = f(x + h / 2 * k2, u)
    k4 = f(x + h * k3, u)
    return ca.Function("native_step", [x, u, h], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


def of_reaching(nodes: int) -> None:
    """Print iterations and processor time of the optimal control."""
    described = scene(ROBOTS["panda"])
    arm = Arm(pinocchio_model(ROBOTS["panda"], described).model)
    own = eomgen.casadi(driven(described), ["forward_dynamics"])["step"]
    rows = []
    for name, step in (("eomgen", own), ("CasADi", native_step(arm))):
        iterations, cost, seconds, success = reach(step, arm.model.nv, nodes)
        rows.append([name, str(iterations), f"{cost:.8f}", f"{seconds:.2f}", str(success)])
    print(f"\nMotion between two poses, {nodes} steps of rk4, exact Hessians\n")
    print(table(["", "iterations", "cost", "processor time, s", "solved"], rows))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--nodes", type=int, default=50)
    parser.add_argument("--quick", action="store_true", help="one round, ten nodes")
    options = parser.parse_args()
    pin_to_core(None)
    print(machine())
    of_hessians(1 if options.quick else options.rounds, default_folder())
    of_reaching(10 if options.quick else options.nodes)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
