"""Second derivatives for optimisers: eomgen beside CasADi's symbols, in C and in an optimal control of an arm.

    python -m benchmarks.optimisers [--robots panda,talos] [--rounds 9] [--nodes 50] [--quick]

The robots are Panda with locked fingers, and Talos with a free base, read from the same URDF files. Recursions of
Newton and Euler and of articulated bodies stand here in CasADi's SX symbols, and CasADi writes the C of their
derivatives. First table, for each robot: the lower triangle of the Hessian of weights . inverse dynamics, ns per call,
beside Pinocchio's tensors of second derivatives (all components of tau, as C++ of its headers); the numbers are
compared before any is timed. Second table: motion of Panda from one pose to another with the least effort, multiple
shooting over rk4 with IPOPT and exact Hessians. Third table: one real-time iteration of acados around the UR5 (20 nodes
of rk4 over 0.5 s, Gauss-Newton, HPIPM), with eomgen's functions and with functions that CasADi writes; ``make acados``
comes first.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import eomgen
from benchmarks.contestants import cpp_program, missing_for_cpp
from benchmarks.measure import figure, interleaved, machine, pin_to_core, table
from benchmarks.programs import FLAGS, default_folder, timing_program
from benchmarks.robots import ROBOTS, Array, PinocchioModel, driven, pinocchio_model, scene
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene

FUNCTION = "inverse_dynamics_hessian"
TOLERANCE = 1e-11
#: Velocity components up to which C is timed with both sets of flags: gcc takes minutes for CasADi's C of Talos.
_LARGE = 20


class Robot:
    """A tree of revolute joints, the first of which may be free, in SX symbols, from a model of Pinocchio."""

    def __init__(self, model: Any) -> None:
        self.model, self.joints = model, range(1, model.njoints)
        self.free = model.joints[1].nv == 6
        names = ["" if model.joints[i].nv == 6 else model.joints[i].shortname() for i in self.joints]
        self.axes = [None] + [np.eye(3)["XYZ".index(name[-1])] if name else None for name in names]

    def rotations(self, q: Any) -> list[Any]:
        """Return the rotation of each link against its parent."""
        found = [None]
        for i in self.joints:
            angle = q[self.model.idx_qs[i] :]
            if self.axes[i] is None:
                found.append(turned_by(angle[3:7]))
                continue
            c, s, axis = ca.cos(angle[0]), ca.sin(angle[0]), int(np.argmax(self.axes[i]))
            rows = [[1, 0, 0], [0, c, -s], [0, s, c]]
            order = [(k - axis) % 3 for k in range(3)]
            turned = ca.vertcat(*[ca.horzcat(*[rows[j][k] for k in order]) for j in order])
            placement = self.model.jointPlacements[i].rotation
            found.append(ca.SX(np.where(np.abs(placement) < 1e-14, 0.0, placement)) @ turned)
        return found

    def inverse_dynamics(self, q: Any, v: Any, a: Any, turn: Any = None) -> Any:
        """Return tau by the recursion of Newton and Euler (Featherstone 2008, section 5.3), 3-vectors.

        ``turn`` is a small rotation of the free joint, its exponential up to squares.
        """
        cross, R, index = ca.cross, self.rotations(q), self.model.idx_vs
        if turn is not None:
            R[1] = R[1] @ (ca.SX.eye(3) + ca.skew(turn) + ca.skew(turn) @ ca.skew(turn) / 2)
        omega, alpha, acceleration = [ca.SX.zeros(3)], [ca.SX.zeros(3)], [ca.SX(-self.model.gravity.linear)]
        forces, moments = [ca.SX.zeros(3)], [ca.SX.zeros(3)]
        for i in self.joints:
            up, p, axis = self.model.parents[i], ca.SX(self.model.jointPlacements[i].translation), self.axes[i]
            carried, place = R[i].T @ omega[up], index[i]
            if axis is None:
                omega.append(v[3:6])
                alpha.append(a[3:6])
                acceleration.append(R[i].T @ acceleration[up] + a[:3] + cross(v[3:6], v[:3]))
            else:
                omega.append(carried + axis * v[place])
                alpha.append(R[i].T @ alpha[up] + axis * a[place] + cross(carried, axis * v[place]))
                inward = cross(omega[up], cross(omega[up], p))
                acceleration.append(R[i].T @ (acceleration[up] + cross(alpha[up], p) + inward))
            body = self.model.inertias[i]
            lever, central, w, al = ca.SX(body.lever), ca.SX(body.inertia), omega[i], alpha[i]
            force = body.mass * (acceleration[i] + cross(al, lever) + cross(w, cross(w, lever)))
            forces.append(force)
            moments.append(central @ al + cross(w, central @ w) + cross(lever, force))
        tau: list[Any] = [None] * self.model.njoints
        for i in reversed(self.joints):
            up, p = self.model.parents[i], ca.SX(self.model.jointPlacements[i].translation)
            if self.axes[i] is None:
                tau[i] = ca.vertcat(forces[i], moments[i])
                continue
            tau[i] = ca.dot(ca.SX(self.axes[i]), moments[i])
            forces[up] += R[i] @ forces[i]
            moments[up] += R[i] @ moments[i] + cross(p, R[i] @ forces[i])
        return ca.vertcat(*tau[1:])

    def hessian(self) -> Any:
        """Return the function of q, v, a and weights with the lower triangle of the Hessian of weights . tau."""
        n, model = self.model.nv, self.model
        q, v, a, weights = (ca.SX.sym(name, k) for name, k in (("q", model.nq), ("v", n), ("a", n), ("weights", n)))
        turn = ca.SX.sym("turn", 3) if self.free else None
        tau = self.inverse_dynamics(q, v, a, turn)
        # a uniform field of gravity does not depend on the free joint's travel
        places = [q] if turn is None else [ca.SX.sym("travel", 3), turn, q[7:]]
        H = ca.tril(ca.hessian(ca.dot(weights, tau), ca.vertcat(*places, v, a))[0])
        if turn is not None:
            H = ca.sparsify(ca.substitute(H, turn, ca.SX.zeros(3)))
        return ca.Function("native_hessian", [q, v, a, weights], [H])

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


@dataclass(frozen=True)
class Timed:
    """A program with the Hessian: its operations, how to run it, and how its rows become dense Hessians in Pinocchio's
    order."""

    name: str
    flags: str
    operations: int | None
    program: str
    model: tuple[str, ...]
    states: Path
    weights: tuple[str, ...]
    dense: Callable[[Array], Array]


def turned_by(quaternion: Any) -> Any:
    """Return the rotation matrix of a unit quaternion (x, y, z, w)."""
    K = ca.skew(quaternion[:3])
    return ca.SX.eye(3) + 2 * quaternion[3] * K + 2 * K @ K


def dense(rows: Array, places: tuple[Array, Array], size: int) -> Array:
    """Return symmetric matrices, (states, size, size), of the nonzeros of one triangle."""
    rows = np.atleast_2d(rows)
    matrices = np.zeros((len(rows), size, size))
    matrices[:, places[0], places[1]] = matrices[:, places[1], places[0]] = rows
    return matrices


def of_symbols(robot: Robot, states: Path, weights: Array, shelf: Path, label: str) -> Timed:
    """Return CasADi's C of the Hessian's lower triangle."""
    n, width, function = robot.model.nv, robot.model.nq + 2 * robot.model.nv, robot.hessian()
    H = function.sparsity_out(0)
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("native.c")
        generator.add(function)
        generator.generate(f"{folder}/")
        text = (Path(folder) / "native.c").read_text(encoding="utf-8")
    places = ", ".join(f"state + {start}" for start in (0, robot.model.nq, robot.model.nq + n))
    call = (
        f"enum {{ WIDTH = {width}, SIZE = {H.nnz()} }};\n"
        "int native_hessian(const double **arg, double **res, long long *iw, double *w, int mem);\n"
        f"static const double weights[{n}] = {{ {', '.join(map(repr, weights.tolist()))} }};\n"
        "static inline void evaluate(const double *state, double *result)\n{\n"
        f"    static double w[{max(function.sz_w(), 1)}];\n"
        f"    const double *arg[{function.sz_arg()}] = {{ {places}, weights }};\n"
        f"    double *res[{function.sz_res()}] = {{ result }};\n    native_hessian(arg, res, 0, w, 0);\n}}\n"
    )
    built = timing_program(shelf, {"native.c": text}, call, FLAGS[label])
    rows, columns = (np.array(part) for part in H.get_triplet())
    made = partial(dense, places=(rows, columns), size=3 * n)
    return Timed("CasADi", label, function.n_instructions(), str(built.file("run")), (), states, (), made)


def of_eomgen(described: Scene, peer: PinocchioModel, states: Path, weights: Array, shelf: Path, label: str) -> Timed:
    """Return eomgen's C of the Hessian's lower triangle."""
    system = derive(described, [FUNCTION])
    program = to_program(system, functions=[FUNCTION])
    files = generate_files(program)
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h")) and file != "main.c"}
    nq, n, size, order = system.nq, system.nv, program.functions[0].outputs[0].size, peer.v_order
    own = np.empty(n)
    own[order] = weights
    call = (
        f'#include "{program.prefix}.h"\nenum {{ WIDTH = {nq + 2 * n}, SIZE = {size} }};\n'
        f"static const double weights[{n}] = {{ {', '.join(map(repr, own.tolist()))} }};\n"
        "static inline void evaluate(const double *state, double *result)\n{\n"
        f"    {program.prefix}_{FUNCTION}(state, state + {nq}, state + {nq + n}, weights, result);\n}}\n"
    )
    built = timing_program(shelf, sources, call, FLAGS[label])
    block, place = np.divmod(np.array(system.patterns[FUNCTION]), n)
    rows, columns = (block * n + np.argsort(order)[place]).T
    made, operations = partial(dense, places=(rows, columns), size=3 * n), system.counts[FUNCTION].flops
    return Timed("eomgen", label, operations, str(built.file("run")), (), states, (), made)


def of_pinocchio(model: Path, n: int, states: Path, weights: Path, shelf: Path) -> Timed:
    """Return Pinocchio's tensors of second derivatives."""
    program = "second_derivatives_pinocchio"
    built = cpp_program(shelf, program, ("-O3", "-march=native"), ())
    as_model, as_weights = (str(model),), (str(weights),)
    return Timed(
        "Pinocchio, all tau", "O3", None, str(built.file(program)), as_model, states, as_weights,
        lambda rows: rows.reshape(len(rows), 3 * n, 3 * n),
    )  # fmt: skip


def of_hessians(name: str, rounds: int, shelf: Path) -> None:
    """Print operations and times of the Hessian of inverse dynamics."""
    described = scene(ROBOTS[name])
    peer = pinocchio_model(ROBOTS[name], described)
    robot, n = Robot(peer.model), peer.model.nv
    weights = np.random.default_rng(20261125).uniform(-1.0, 1.0, n)
    with tempfile.TemporaryDirectory() as given:
        folder = Path(given)
        states, own_states, model, of_weights = (folder / part for part in ("states", "own", "model", "weights"))
        peer.states.tofile(states)
        peer.states_of_eomgen().tofile(own_states)
        weights.tofile(of_weights)
        model.write_text(peer.text, encoding="utf-8")
        all_timed = []
        labels = list(FLAGS)[: 1 if n > _LARGE else None]
        for label in labels:
            all_timed.append(of_eomgen(described, peer, own_states, weights, shelf, label))
            all_timed.append(of_symbols(robot, states, weights, shelf, label))
        if (missing := missing_for_cpp()) is None:
            all_timed.append(of_pinocchio(model, n, states, of_weights, shelf))
        else:
            print(f"without Pinocchio: {missing}")
        commands, found = [], []
        for timed in all_timed:
            words = [*timed.model, str(timed.states)]
            results = str(folder / "results")
            subprocess.run([timed.program, "results", *words, results, *timed.weights], check=True)
            found.append(timed.dense(np.fromfile(results).reshape(len(peer.states), -1)))
            commands.append([timed.program, "time", *words, "40"])
        off = max(float(np.max(np.abs(one - found[0]))) for one in found) / float(np.max(np.abs(found[0])))
        if off > TOLERANCE:
            sys.exit(f"the Hessians of {name} differ by {off:.1e}")
        timings = interleaved(commands, rounds)
    rows = [
        [timed.name, timed.flags, "-" if timed.operations is None else str(timed.operations), figure(timing.median)]
        for timed, timing in zip(all_timed, timings, strict=True)
    ]
    print(f"\n{name}: Hessian of weights . inverse dynamics, {n} velocities; largest difference {off:.1e}\n")
    print(table(["", "flags", "operations", "ns per call"], rows))
    for k, label in enumerate(labels):
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


def native_step(arm: Robot) -> Any:
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
    arm = Robot(pinocchio_model(ROBOTS["panda"], described).model)
    own = eomgen.casadi(driven(described), ["forward_dynamics"])["step"]
    rows = []
    for name, step in (("eomgen", own), ("CasADi", native_step(arm))):
        iterations, cost, seconds, success = reach(step, arm.model.nv, nodes)
        rows.append([name, str(iterations), f"{cost:.8f}", f"{seconds:.2f}", str(success)])
    print(f"\nMotion between two poses, {nodes} steps of rk4, exact Hessians\n")
    print(table(["", "iterations", "cost", "processor time, s", "solved"], rows))


def real_time_iteration(model: Any, make: Any, folder: Path, size: int) -> Any:
    """Return a solver of acados that brings an arm to rest at a pose, one iteration of SQP for each call."""
    from acados_template import AcadosOcp  # noqa: PLC0415  # installed apart

    ocp, n = AcadosOcp(), size // 2
    folder.mkdir(parents=True)
    ocp.model, ocp.dims.N, ocp.code_export_directory = model, 20, str(folder / "c")
    ocp.cost.cost_type = ocp.cost.cost_type_e = "LINEAR_LS"
    ocp.cost.W = np.diag([10.0] * n + [0.1] * n + [1e-4] * n)
    ocp.cost.Vx, ocp.cost.Vu = np.eye(3 * n, size), np.eye(3 * n)[:, size:]
    ocp.cost.yref = np.zeros(3 * n)
    ocp.cost.W_e, ocp.cost.Vx_e, ocp.cost.yref_e = 10.0 * np.eye(size), np.eye(size), np.zeros(size)
    ocp.constraints.x0 = np.zeros(size)
    ocp.constraints.idxbu = np.arange(n)
    ocp.constraints.lbu, ocp.constraints.ubu = np.full(n, -150.0), np.full(n, 150.0)
    options = ocp.solver_options
    options.tf, options.integrator_type, options.nlp_solver_type = 0.5, "ERK", "SQP_RTI"
    options.qp_solver, options.qp_solver_cond_N = "PARTIAL_CONDENSING_HPIPM", 5
    return make(ocp, json_file=str(folder / "ocp.json"))


def of_acados(calls: int) -> None:
    """Print times of one real-time iteration of acados around the UR5."""
    acados = Path(os.environ.setdefault("ACADOS_SOURCE_DIR", str(Path(sys.prefix) / "acados")))
    if not (acados / "lib").exists():
        print("\nacados is missing; try: make acados")
        return
    described = scene(ROBOTS["ur5"])
    arm = Robot(pinocchio_model(ROBOTS["ur5"], described).model)
    n = arm.model.nv
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path(name)
        eomgen.generate(driven(described), folder / "own", target="acados")
        sys.path.insert(0, str(folder / "own"))
        own = importlib.import_module(f"{described.name}_acados")
        template = sys.modules["acados_template"]
        native, x, u = template.AcadosModel(), ca.SX.sym("x", 2 * n), ca.SX.sym("u", n)
        native.name, native.x, native.u, native.xdot = "native", x, u, ca.SX.sym("xdot", 2 * n)
        native.f_expl_expr = ca.vertcat(x[n:], arm.forward_dynamics(x[:n], x[n:], u))
        with Path(os.devnull).open("w") as silent, contextlib.redirect_stdout(silent):
            solvers = [
                real_time_iteration(own.model("ERK"), own.solver, folder / "a", 2 * n),
                real_time_iteration(native, template.AcadosOcpSolver, folder / "b", 2 * n),
            ]
        generator, times, off = np.random.default_rng(3), [], 0.0
        pose = np.array([0.2, -1.4, 1.2, -1.3, -1.5, 0.3])
        for _ in range(calls):
            start = np.concatenate([pose + 0.2 * generator.normal(size=n), 0.2 * generator.normal(size=n)])
            row, first = [], []
            for solver in solvers:
                for stage in range(21):
                    solver.set(stage, "x", start)
                for side in ("lbx", "ubx"):
                    solver.constraints_set(0, side, start)
                if solver.solve():
                    sys.exit("acados found no solution")
                row += [float(np.ravel(solver.get_stats(key))[0]) for key in ("time_tot", "time_sim", "time_qp")]
                first.append(solver.get(0, "u"))
            times.append(row)
            off = max(off, float(np.max(np.abs(first[0] - first[1])) / np.max(np.abs(first[1]))))
    if off > TOLERANCE * 1e3:
        sys.exit(f"the controls differ by {off:.1e}")
    medians, largest = np.median(times, axis=0) * 1e3, np.max(times, axis=0) * 1e3
    rows = [
        [title, *(f"{value:.3f}" for value in (*medians[k : k + 3], largest[k]))]
        for title, k in (("eomgen", 0), ("CasADi", 3))
    ]
    print(f"\nReal-time iteration of acados, UR5, 20 nodes, {calls} calls; largest difference of controls {off:.1e}\n")
    print(table(["", "ms, median", "integrator, ms", "QP, ms", "ms, largest"], rows))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", default="panda,talos")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--nodes", type=int, default=50)
    parser.add_argument("--quick", action="store_true", help="one round, ten nodes")
    options = parser.parse_args()
    pin_to_core(None)
    print(machine())
    for name in options.robots.split(","):
        of_hessians(name, 1 if options.quick else options.rounds, default_folder())
    of_reaching(10 if options.quick else options.nodes)
    of_acados(20 if options.quick else 500)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
