"""Forward dynamics of a planar chain of rods, from its description to a compiled function: eomgen, SymPy, PyDy, CasADi.

    python symbolic.py PEER LINKS SHELF

derives and compiles once in a process of its own and prints the CPU seconds of that, imports left out. SymPy's and
PyDy's way is Kane's method in absolute angles with common subexpressions, CasADi's is Lagrange's by differentiation.
"""

from __future__ import annotations

import importlib
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from serve import Prepared, serve

from benchmarks import taylor_and_heyoka
from benchmarks.contestants import call_of_eomgen
from benchmarks.programs import FLAGS, timing_program
from benchmarks.taylor_and_heyoka import GRAVITY, LENGTH, MASS

STATES = 64


@dataclass
class Made:
    """A function of rows of q and v: all accelerations, and what times a call; seconds of deriving and compiling."""

    seconds: float
    accelerations: Callable[[Any], Any]
    nanoseconds: Callable[[], float]
    packages: list[str]
    note: str = ""


def states(links: int) -> Any:
    """Return rows of angles between neighbours and their rates."""
    return np.random.default_rng(11).uniform(-1.0, 1.0, (STATES, 2 * links))


def absolute(rows: Any) -> Any:
    """Return angles from the vertical, and rates, for those between neighbours."""
    return np.concatenate([np.cumsum(half, axis=1) for half in np.hsplit(rows, 2)], axis=1)


def of_program(sources: dict[str, str], call: str, rows: Any, shelf: Path, derived: float, **told: Any) -> Made:
    """Return a function of generated C and its compile time."""
    built = timing_program(shelf, sources, call, FLAGS["O3"])
    file = built.folder / "states"
    np.ascontiguousarray(rows).tofile(file)
    program = str(built.file("run"))

    def accelerations(_: Any) -> Any:
        output = built.folder / "results"
        subprocess.run([program, "results", str(file), str(output)], check=True)
        return np.fromfile(output).reshape(STATES, -1)

    def nanoseconds() -> float:
        said = subprocess.run([program, "time", str(file), "15"], capture_output=True, text=True, check=True).stdout
        return float(said.split()[0])

    return Made(derived + built.seconds, accelerations, nanoseconds, **told)


def eomgen(links: int, shelf: Path) -> Made:
    from eomgen.codegen.convert import to_program
    from eomgen.codegen.targets.c.target import generate_files
    from eomgen.mechanics.derive import derive

    for module in ("eomgen.scene.builder", "eomgen.codegen.targets.c.templates"):  # imported by a first scene and text
        importlib.import_module(module)

    began = time.process_time()
    system = derive(taylor_and_heyoka.chain(links), ["forward_dynamics"])
    program = to_program(system, functions=["forward_dynamics"])
    files = generate_files(program)
    derived = time.process_time() - began
    sources = {name: text for name, text in files.items() if name.endswith((".c", ".h")) and name != "main.c"}
    call = call_of_eomgen(program.prefix, program.functions[0], system.nq, system.nv)
    note = f"{system.counts['forward_dynamics'].flops} + and *"
    made = of_program(sources, call, _with_padding(states(links)), shelf, derived, packages=["eomgen"], note=note)
    relative = made.accelerations
    made.accelerations = lambda rows: np.cumsum(relative(rows), axis=1)
    return made


def _with_padding(rows: Any) -> Any:
    """Return rows with a third block: timing programs take q, v and one of accelerations or efforts."""
    return np.concatenate([rows, np.zeros((len(rows), rows.shape[1] // 2))], axis=1)


def kane(links: int, gravity: Any) -> tuple[Any, Any, Any, Any]:
    """Return angles, rates, mass matrix and forcing."""
    import sympy
    from sympy.physics import mechanics

    angles, rates = mechanics.dynamicsymbols(f"q:{links}"), mechanics.dynamicsymbols(f"u:{links}")
    ground, pivot = mechanics.ReferenceFrame("N"), mechanics.Point("O")
    pivot.set_vel(ground, 0)
    bodies, loads = [], []
    inertia = MASS * LENGTH**2 / 12.0
    for k in range(links):
        frame = ground.orientnew(f"A{k}", "Axis", [angles[k], ground.y])
        frame.set_ang_vel(ground, rates[k] * ground.y)
        center = pivot.locatenew(f"C{k}", -0.5 * LENGTH * frame.z)
        center.v2pt_theory(pivot, ground, frame)
        end = pivot.locatenew(f"P{k}", -LENGTH * frame.z)
        end.v2pt_theory(pivot, ground, frame)
        tensor = (mechanics.inertia(frame, inertia, inertia, 1e-3), center)
        bodies.append(mechanics.RigidBody(f"rod{k}", center, frame, sympy.Float(MASS), tensor))
        loads.append((center, -MASS * gravity * ground.z))
        pivot = end
    kinematic = [q.diff() - u for q, u in zip(angles, rates, strict=True)]
    method = mechanics.KanesMethod(ground, q_ind=angles, u_ind=rates, kd_eqs=kinematic)
    method.kanes_equations(bodies, loads)
    return angles, rates, method.mass_matrix, method.forcing


def sympy_cse(links: int, shelf: Path) -> Made:
    import sympy

    began = time.process_time()
    angles, rates, mass, forcing = kane(links, GRAVITY)
    plain = dict(zip([*angles, *rates], sympy.symbols(f"q:{links} v:{links}"), strict=True))
    shared, (M, f) = sympy.cse([mass.xreplace(plain), forcing.xreplace(plain)])
    lines = [f"const double q{k} = q[{k}], v{k} = v[{k}];" for k in range(links)]
    lines += [f"const double {name} = {sympy.ccode(value)};" for name, value in shared]
    lines += [f"double M[{links}][{links}];"]
    lines += [f"M[{i}][{j}] = {sympy.ccode(M[i, j])};" for i in range(links) for j in range(i + 1)]
    lines += [f"a[{k}] = {sympy.ccode(value)};" for k, value in enumerate(f)]
    # L D L^T in place, then both substitutions
    lines += [
        f"for (int k = 0; k < {links}; ++k) for (int i = k + 1; i < {links}; ++i) {{",
        "const double share = M[i][k] / M[k][k];",
        f"for (int j = i; j < {links}; ++j) M[j][i] -= share * M[j][k]; a[i] -= share * a[k]; }}",
        f"for (int k = {links} - 1; k >= 0; --k) {{",
        f"for (int i = k + 1; i < {links}; ++i) a[k] -= M[i][k] * a[i]; a[k] /= M[k][k]; }}",
    ]
    head = "#include <math.h>\nvoid chain(const double *q, const double *v, double *a)\n{\n"
    derived = time.process_time() - began
    call = (
        f"enum {{ WIDTH = {3 * links}, SIZE = {links} }};\nvoid chain(const double *q, const double *v, double *a);\n"
        "static inline void evaluate(const double *state, double *result)\n"
        f"{{\n    chain(state, state + {links}, result);\n}}\n"
    )
    rows = _with_padding(absolute(states(links)))
    return of_program({"chain.c": head + "\n".join(lines) + "\n}\n"}, call, rows, shelf, derived, packages=["sympy"])


def casadi(links: int, shelf: Path) -> Made:
    import casadi as ca

    began = time.process_time()
    q, v = ca.SX.sym("q", links), ca.SX.sym("v", links)
    x, z, energy, inertia = 0, 0, 0, MASS * LENGTH**2 / 12.0
    potential = 0
    for k in range(links):
        center = ca.vertcat(x - 0.5 * LENGTH * ca.sin(q[k]), z - 0.5 * LENGTH * ca.cos(q[k]))
        moving = ca.jtimes(center, q, v)
        energy += 0.5 * MASS * ca.dot(moving, moving) + 0.5 * inertia * v[k] ** 2
        potential += MASS * GRAVITY * center[1]
        x, z = x - LENGTH * ca.sin(q[k]), z - LENGTH * ca.cos(q[k])
    momentum = ca.gradient(energy, v)
    M = ca.jacobian(momentum, v)
    forcing = ca.gradient(energy - potential, q) - ca.jtimes(momentum, q, v)
    D, LT, order = ca.ldl(M)
    function = ca.Function("chain", [q, v], [ca.ldl_solve(forcing, D, LT, order)])
    generator = ca.CodeGenerator("chain.c")
    generator.add(function)
    source = generator.dump()
    derived = time.process_time() - began
    sizes = [max(1, function.sz_arg()), max(1, function.sz_res()), max(1, function.sz_iw()), max(1, function.sz_w())]
    call = (
        f"enum {{ WIDTH = {3 * links}, SIZE = {links} }};\n"
        "int chain(const double **arg, double **res, long long int *iw, double *w, int mem);\n"
        f"static const double *arg[{sizes[0]}];\nstatic double *res[{sizes[1]}];\n"
        f"static long long int iw[{sizes[2]}];\nstatic double w[{sizes[3]}];\n"
        "static inline void evaluate(const double *state, double *result)\n"
        f"{{\n    arg[0] = state;\n    arg[1] = state + {links};\n    res[0] = result;\n"
        "    chain(arg, res, iw, w, 0);\n}\n"
    )
    rows, note = _with_padding(absolute(states(links))), f"{function.n_instructions()} instructions"
    return of_program({"chain.c": source}, call, rows, shelf, derived, packages=["casadi"], note=note)


def pydy(links: int, shelf: Path) -> Made:
    import sympy
    from pydy.codegen.ode_function_generators import generate_ode_function

    began, before = time.process_time(), _children()
    gravity, numbers = sympy.Symbol("g"), np.array([GRAVITY])
    angles, rates, mass, forcing = kane(links, gravity)
    how = {"mass_matrix": mass, "coordinate_derivatives": sympy.Matrix(rates), "generator": "cython"}
    right_side = generate_ode_function(forcing, angles, rates, [gravity], constants_arg_type="array", **how)
    seconds = time.process_time() - began + _children() - before
    rows = absolute(states(links))

    def nanoseconds() -> float:
        calls, start = 0, time.process_time()
        while time.process_time() - start < 0.05:
            right_side(rows[calls % STATES], 0.0, numbers)
            calls += 1
        return 1e9 * (time.process_time() - start) / calls

    def accelerations(_: Any) -> Any:
        return np.array([right_side(row, 0.0, numbers)[links:].copy() for row in rows])

    return Made(seconds, accelerations, nanoseconds, ["pydy", "sympy"], "called from Python")


def _children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


PEERS = {"eomgen": eomgen, "sympy": sympy_cse, "pydy": pydy, "casadi": casadi}


def prepare(task: dict[str, Any]) -> Prepared:
    links, shelf = task["links"], Path(task["shelf"])
    made = PEERS[task["peer"]](links, shelf)

    def build() -> float:
        import tempfile

        with tempfile.TemporaryDirectory() as fresh:
            words = [sys.executable, __file__, task["peer"], str(links), fresh]
            said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        return float(json.loads(said.splitlines()[-1]))

    taken = build if task["what"] == "build" else lambda: 1e-9 * made.nanoseconds()
    return Prepared(list, 1, lambda: made.accelerations(None), made.packages, made.note, taken)


if __name__ == "__main__":
    if len(sys.argv) == 4:
        print(json.dumps(PEERS[sys.argv[1]](int(sys.argv[2]), Path(sys.argv[3])).seconds))
    else:
        serve(prepare)
