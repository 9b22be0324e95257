"""The road that generation_time compares with: SymPy's KanesMethod, its common subexpressions, and gcc."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from sympy.physics import mechanics

from benchmarks.programs import build
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KaneRun:
    """Seconds of each stage, operations, and the numbers at a state: M (n, n) and M vdot (n,), all in CPU time."""

    derive: float
    print_code: float
    compile: float
    operations: int
    mass: Array
    forcing: Array


def kane(scene: Scene, joints: int, q: Array, v: Array, shelf: Path) -> KaneRun:
    """Derive, print and compile mass matrix and forcing of the first revolute joints of an arm, and evaluate them."""
    start = time.process_time()
    coordinates = list(mechanics.dynamicsymbols(f"q:{joints}"))
    speeds = list(mechanics.dynamicsymbols(f"v:{joints}"))
    ground = mechanics.ReferenceFrame("N")
    origin = mechanics.Point("O")
    origin.set_vel(ground, 0)
    frames, points = {"base": ground}, {"base": origin}
    bodies, loads = [], []
    gravity = [sympy.Float(_number(item)) for item in scene.gravity]
    for number, (joint, body) in enumerate(zip(scene.joints[:joints], scene.bodies[:joints], strict=True)):
        parent = frames[joint.parent]
        placed = mechanics.ReferenceFrame(f"P{number}")
        placed.orient_dcm(parent, sympy.Matrix(3, 3, [_exact(x) for row in joint.orientation for x in row]).T)
        frame = mechanics.ReferenceFrame(f"B{number}")
        axis = _vector(placed, joint.axis)
        frame.orient_axis(placed, axis, coordinates[number])
        frame.set_ang_vel(placed, speeds[number] * axis)
        pivot = points[joint.parent].locatenew(f"A{number}", _vector(parent, [_number(x) for x in joint.position]))
        pivot.v2pt_theory(points[joint.parent], ground, parent)
        centre = pivot.locatenew(f"C{number}", _vector(frame, [_number(x) for x in body.center_of_mass]))
        centre.v2pt_theory(pivot, ground, frame)
        xx, yy, zz, xy, xz, yz = (sympy.Float(_number(x)) for x in body.inertia)
        inertia = mechanics.inertia(frame, xx, yy, zz, xy, yz, xz)
        mass = sympy.Float(_number(body.mass))
        bodies.append(mechanics.RigidBody(f"body{number}", centre, frame, mass, (inertia, centre)))
        loads.append((centre, mass * (gravity[0] * ground.x + gravity[1] * ground.y + gravity[2] * ground.z)))
        frames[joint.child], points[joint.child] = frame, pivot
    rates = [q.diff() - v for q, v in zip(coordinates, speeds, strict=True)]
    method = mechanics.KanesMethod(ground, q_ind=coordinates, u_ind=speeds, kd_eqs=rates)
    method.kanes_equations(bodies, loads)
    derived = time.process_time()

    plain = dict(zip([*coordinates, *speeds], sympy.symbols(f"q:{joints} v:{joints}"), strict=True))
    shared, results = sympy.cse([method.mass_matrix.xreplace(plain), method.forcing.xreplace(plain)])
    code = _code(joints, shared, results)
    printed = time.process_time()
    operations = sum(sympy.count_ops(e) for _, e in shared) + sum(
        sympy.count_ops(e) for matrix in results for e in matrix
    )
    command = ["gcc", "-std=c99", "-O2", "-march=native", "-fPIC", "-shared", "kane.c", "-o", "kane.so", "-lm"]
    built = build(shelf, {"kane.c": code}, [command])
    mass_matrix, forcing = np.empty((joints, joints)), np.empty(joints)
    pointer = ctypes.POINTER(ctypes.c_double)
    arrays = (np.ascontiguousarray(q), np.ascontiguousarray(v), mass_matrix, forcing)
    ctypes.CDLL(str(built.file("kane.so"))).kane(*(array.ctypes.data_as(pointer) for array in arrays))
    return KaneRun(derived - start, printed - derived, built.seconds, int(operations), mass_matrix, forcing)


def _number(formula: Formula) -> float:
    if not isinstance(formula, Number):
        raise TypeError("the scene has parameters; this road takes numbers only")
    return formula.value


def _exact(number: float) -> float:
    return int(number) if number in (0.0, 1.0, -1.0) else number


def _vector(frame: Any, components: Sequence[float]) -> Any:
    x, y, z = (_exact(float(component)) for component in components)
    return x * frame.x + y * frame.y + z * frame.z


def _code(joints: int, shared: Sequence[tuple[Any, Any]], results: Sequence[Any]) -> str:
    lines = ["#include <math.h>", "void kane(const double *q, const double *v, double *mass, double *forcing)", "{"]
    lines += [f"const double q{k} = q[{k}], v{k} = v[{k}];" for k in range(joints)]
    lines += [f"const double {name} = {sympy.ccode(value)};" for name, value in shared]
    for target, matrix in zip(("mass", "forcing"), results, strict=True):
        lines += [f"{target}[{k}] = {sympy.ccode(value)};" for k, value in enumerate(matrix)]
    return "\n".join([*lines, "}", ""])
