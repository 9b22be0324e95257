"""Models written by hand, once in C and once in NumPy, and the way to compile a rendered stepper around the C."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from eomgen.codegen.targets.c.naming import CNames
from eomgen.codegen.targets.c.stepper import stepper_names
from eomgen.codegen.targets.c.templates import environment, stepper_template
from eomgen.integrators.families.register import Method
from eomgen.integrators.newton.matrix import dense
from eomgen.integrators.newton.sample_matrices import SampledPartials
from eomgen.integrators.stepper_data import method_data
from eomgen.integrators.stepper_layout import STEPPER_CDEF, STEPPER_SIZES, default_settings, state_layout
from eomgen.lie.product import Factor
from eomgen.symbolic.operations import Counts
from eomgen.system.system import WHOLE, Facts, Sample
from tests.oracles.stepper import Equations

#: C that tests compile with generated code.
PROGRAMS = Path(__file__).parent / "programs"


def skew(x):
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def rotation(p):
    w, x, y, z = p
    return np.eye(3) + 2 * w * skew([x, y, z]) + 2 * skew([x, y, z]) @ skew([x, y, z])


@dataclass
class Model:
    """The C text of the model functions, what they take and give, and the same equations in NumPy."""

    name: str
    factors: Sequence[Factor]
    functions: dict[str, tuple[tuple[str, ...], tuple[str, ...]]]
    c_text: str
    equations: Equations
    q: np.ndarray
    v: np.ndarray
    input_count: int = 0
    multipliers: tuple[str, ...] = ()
    holonomic: int = 0
    discontinuities: tuple[()] = ()
    events: tuple[()] = ()
    sampled: tuple[()] = ()
    harmonics: tuple[()] = ()
    controllers: tuple[()] = ()
    modes: tuple[()] = ()
    turning: tuple[int, ...] = ()
    initial_z: tuple = ()
    patterns: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    inner_owners: tuple[int, ...] = ()
    relative: tuple[tuple[int, ...], ...] = ()
    links: tuple[tuple[int, int], ...] = ()
    angular: tuple[bool, ...] = ()
    angles: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    sample: Sample = WHOLE

    @property
    def inputs(self) -> tuple[SimpleNamespace, ...]:
        return (SimpleNamespace(size=1),) * self.input_count

    @property
    def facts(self) -> Facts:
        return Facts(constant_mass=True, velocity_forces=False, smooth=True, moving_base=False)

    @property
    def positions(self) -> int:
        return len(self.q)

    @property
    def counts(self) -> dict[str, Counts]:
        return {name: Counts(additions=40) for name in self.functions}

    def samples(self) -> SampledPartials:
        """Return the partials at the initial state, whole matrices, where C has a function that gives them."""
        nv = len(self.v)
        names = self.functions["partials"][1] if "partials" in self.functions else ()
        every = [(row, column) for row in range(nv) for column in range(nv)]
        if self.equations.partials is None:
            matrices = {"K": np.zeros((nv, nv)), "C": np.zeros((nv, nv)), "M": np.eye(nv)}
        else:
            matrices = dict(zip("KCM", self.equations.partials(0.0, self.q, self.v, np.zeros(nv)), strict=True))
        numbers = np.concatenate([[], *(np.ravel(matrices[name]) for name in names)])
        return SampledPartials(
            dense(dict.fromkeys(names, every), nv), numbers[np.newaxis], self.v[np.newaxis], np.ones(nv)
        )


# -- heavy top, unconstrained on SO(3): Bruls and Cardona 2010 ---------------------------------------------------------

_TOP_INERTIA = np.diag([15.234375, 0.46875, 15.234375])
_TOP_CENTER, _GRAVITY, _TOP_MASS = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -9.81]), 15.0

_TOP_C = (PROGRAMS / "top.c").read_text(encoding="utf-8")


def _top_residual(t, q, v, a):
    return (
        _TOP_INERTIA @ a + np.cross(v, _TOP_INERTIA @ v) - _TOP_MASS * np.cross(_TOP_CENTER, rotation(q).T @ _GRAVITY)
    )


def _top_partials(t, q, v, a):
    K = -_TOP_MASS * skew(_TOP_CENTER) @ skew(rotation(q).T @ _GRAVITY)
    return K, skew(v) @ _TOP_INERTIA - skew(_TOP_INERTIA @ v), _TOP_INERTIA


def heavy_top(velocity=(0.0, 150.0, -4.61538)) -> Model:
    """Return the heavy top with its pivot fixed; position of the centre is R e2."""
    factors = [Factor("SO3", "top", 0, 4, 0, 3)]
    equations = Equations(
        factors,
        lambda t, q, v: np.linalg.solve(_TOP_INERTIA, -_top_residual(t, q, v, np.zeros(3))),
        _top_residual,
        _top_partials,
    )
    functions = {
        "residual": (("q", "v", "a"), ("r",)),
        "partials": (("q", "v"), ("K", "C", "M")),
        "forward_dynamics": (("q", "v"), ("vdot",)),
    }
    return Model("top", factors, functions, _TOP_C, equations, np.array([1.0, 0, 0, 0]), np.array(velocity))


# -- a rigid body on SE(3), tied by a spring to a slider on a line that an input pushes --------------------------------

_BODY_INERTIA, _BODY_MASS, _SLIDER_MASS = np.diag([1.0, 2.0, 3.0]), 2.0, 0.5
_STIFFNESS, _DAMPING = 40.0, 0.3

_TIED_C = (PROGRAMS / "tied.c").read_text(encoding="utf-8")


def _tied_residual(u):
    def residual(t, q, v, a):
        R, omega, U = rotation(q[:4]), v[:3], v[3:6]
        force = -_STIFFNESS * (q[4:7] - np.array([q[7], 0, 0]))
        first = _BODY_INERTIA @ a[:3] + np.cross(omega, _BODY_INERTIA @ omega)
        second = _BODY_MASS * (a[3:6] + np.cross(omega, U)) - R.T @ force
        last = _SLIDER_MASS * a[6] - _STIFFNESS * (q[4] - q[7]) + _DAMPING * v[6] - u(t)[0] - 0.25 * u(t)[1]
        return np.concatenate([first, second, [last]])

    return residual


def _tied_partials(t, q, v, a):
    R, omega, U = rotation(q[:4]), v[:3], v[3:6]
    force = -_STIFFNESS * (q[4:7] - np.array([q[7], 0, 0]))
    K, C, M = np.zeros((7, 7)), np.zeros((7, 7)), np.zeros((7, 7))
    M[:3, :3], M[3:6, 3:6], M[6, 6] = _BODY_INERTIA, _BODY_MASS * np.eye(3), _SLIDER_MASS
    C[:3, :3] = skew(omega) @ _BODY_INERTIA - skew(_BODY_INERTIA @ omega)
    C[3:6, :3], C[3:6, 3:6], C[6, 6] = -_BODY_MASS * skew(U), _BODY_MASS * skew(omega), _DAMPING
    K[3:6, :3], K[3:6, 3:6], K[6, 6] = -skew(R.T @ force), _STIFFNESS * np.eye(3), _STIFFNESS
    K[3:6, 6] = K[6, 3:6] = -_STIFFNESS * R[0]
    return K, C, M


def formula_inputs(t):
    return np.array([np.sin(3.0 * t), np.cos(3.0 * t)])


def tied_body(u=formula_inputs) -> Model:
    """Return SE(3) x R with a parameter and two inputs, without forward dynamics in C."""
    factors = [Factor("SE3", "body", 0, 7, 0, 6), Factor("R", "slider", 7, 1, 6, 1)]
    residual = _tied_residual(u)

    def forward_dynamics(t, q, v):
        return np.linalg.solve(_tied_partials(t, q, v, None)[2], -residual(t, q, v, np.zeros(7)))

    functions = {
        "inputs": (("t",), ("u",)),
        "residual": (("p", "q", "v", "a", "u"), ("r",)),
        "partials": (("p", "q", "v"), ("K", "C", "M")),
    }
    q = np.array([0.5, -0.5, 0.5, 0.5, 0.1, 0.2, -0.3, 0.4])
    v = np.array([2.0, -3.0, 1.0, 0.5, -0.2, 0.3, -1.0])
    return Model(
        "tied", factors, functions, _TIED_C, Equations(factors, forward_dynamics, residual, _tied_partials), q, v, 2
    )


# -- a particle on any product of groups: vdot = 0 ---------------------------------------------------------------------


def free_motion(groups: Sequence[str]) -> Model:
    """Return r = vdot on a product of groups; with constant v the motion is q o exp(t v), exactly."""
    sizes = {"R": (1, 1), "SO3": (4, 3), "SE3": (7, 6), "R3xSO3": (7, 6)}
    factors, q_start, v_start = [], 0, 0
    for number, group in enumerate(groups):
        q_size, v_size = sizes[group]
        factors.append(Factor(group, f"factor {number}", q_start, q_size, v_start, v_size))
        q_start, v_start = q_start + q_size, v_start + v_size
    text = f"""
void free_residual(const real *a, real *r) {{ memcpy(r, a, {v_start} * sizeof *r); }}
void free_partials(real *dq, real *dv, real *M)
{{
    int i;
    for (i = 0; i < {v_start**2}; ++i) {{ dq[i] = dv[i] = K(0.0); M[i] = K(i % {v_start + 1} == 0 ? 1.0 : 0.0); }}
}}
void free_forward_dynamics(real *vdot) {{ int i; for (i = 0; i < {v_start}; ++i) vdot[i] = K(0.0); }}
"""
    functions = {"residual": (("a",), ("r",)), "partials": ((), ("K", "C", "M")), "forward_dynamics": ((), ("vdot",))}
    q = np.concatenate(
        [[1.0, *np.zeros(size - 1)] if size > 1 else [0.0] for size in (factor.q_size for factor in factors)]
    )
    equations = Equations(factors, lambda t, q, v: np.zeros_like(v))
    return Model("free", factors, functions, text, equations, q, np.zeros(v_start))


# -- one coordinate that can be made to misbehave ----------------------------------------------------------------------

_EDGE_C = (PROGRAMS / "edge.c").read_text(encoding="utf-8")


def edge() -> Model:
    """Return a pendulum, m vdot + 400 sin q = 0, whose residual is not a number after ``p_last_time``.

    ``p_stiffness`` is 400 for the right derivative; its C lacks the velocity derivative, which is zero.
    """
    functions = {"residual": (("p", "t", "q", "a"), ("r",)), "partials": (("p", "q"), ("K", "M"))}
    equations = Equations(
        [Factor("R", "angle", 0, 1, 0, 1)],
        lambda t, q, v: -400.0 * np.sin(q),
        lambda t, q, v, a: a + 400.0 * np.sin(q),
        lambda t, q, v, a: (400.0 * np.cos(q)[:, None], np.zeros((1, 1)), np.eye(1)),
    )
    return Model("edge", equations.factors, functions, _EDGE_C, equations, np.array([1.0]), np.array([0.0]))


EDGE_PARAMETERS = {"p_mass": 1.0, "p_last_time": 1e9, "p_stiffness": 400.0}


# -- from a model to a running stepper ---------------------------------------------------------------------------------


BAD_ARGUMENT = (
    "a setting is out of its range, a step does not move time on, or an input has neither a formula nor a table"
)


@dataclass
class Outcome:
    status: int
    text: str
    state: dict[str, np.ndarray]
    rows: np.ndarray


class Stepper:
    """A compiled stepper behind the flat interface."""

    def __init__(self, library: ctypes.CDLL, program: StepperContext, parameters: Sequence[float]) -> None:
        self.library, self.program = library, program
        library.eomgen_stepper_size.restype = ctypes.c_long
        library.eomgen_status_text.restype = ctypes.c_char_p
        self.sizes = {name: int(library.eomgen_stepper_size(k)) for k, name in enumerate(STEPPER_SIZES)}
        self.settings = default_settings(program.method)
        self.parameters = np.array([*parameters, 0.0])
        self.layout = state_layout(program.method)
        self.state = np.zeros(self.sizes["state"])
        self.workspace = np.zeros(self.sizes["workspace"])

    def initialize(self, q, v, t=0.0, table=None, **settings) -> Outcome:
        self.settings |= settings
        self.state[:] = 0.0
        self.state[self.layout["t"]], self.state[self.layout["q"]], self.state[self.layout["v"]] = t, q, v
        given = (self.parameters, self._settings(), table, self.state, self.workspace)
        status = self.library.eomgen_initialize(*map(_pointer, given))
        return self._outcome(status, np.zeros((0, 0)))

    def run(self, steps, every=1, table=None, **settings) -> Outcome:
        self.settings |= settings
        record = np.zeros((steps // every + 1, self.sizes["row"]))
        recorded = ctypes.c_long(-1)
        status = self.library.eomgen_run(
            *(_pointer(array) for array in (self.parameters, self._settings(), self.state, self.workspace)),
            *(ctypes.c_long(steps), ctypes.c_long(every), _pointer(table), _pointer(record), ctypes.byref(recorded)),
        )
        return self._outcome(status, record[: recorded.value])

    def _settings(self) -> np.ndarray:
        return np.array(list(self.settings.values()), float)

    def _outcome(self, status: int, rows: np.ndarray) -> Outcome:
        state = {name: self.state[part].copy() for name, part in self.layout.items()}
        return Outcome(status, self.library.eomgen_status_text(status).decode(), state, rows)


def _pointer(array):
    return None if array is None else np.ascontiguousarray(array).ctypes.data_as(ctypes.c_void_p)


@dataclass(frozen=True)
class Function:
    name: str
    inputs: tuple[str, ...]
    outputs: tuple[SimpleNamespace, ...]


@dataclass(frozen=True)
class StepperContext:
    """All that the steppers' templates read of a Program."""

    prefix: str
    sizes: dict[str, int]
    functions: tuple[Function, ...]
    parameters: tuple[SimpleNamespace, ...]
    method: dict[str, Any]
    has_base: bool
    version: str = "test"
    angles: tuple[str, ...] = ()

    def function(self, name: str) -> Function:
        return next(function for function in self.functions if function.name == name)

    @property
    def function_names(self) -> tuple[str, ...]:
        return tuple(function.name for function in self.functions)


def context_of(model: Model, method: Method, parameters: Sequence[str]) -> StepperContext:
    """Return what a Program would say of a model; its functions have no statements, because their C is written by
    hand."""
    functions = tuple(
        Function(name, inputs, tuple(SimpleNamespace(name=output) for output in outputs))
        for name, (inputs, outputs) in model.functions.items()
    )
    sizes = {"q": len(model.q), "v": len(model.v), "z": 0, "u": model.input_count}
    members = tuple(SimpleNamespace(member=name) for name in parameters)
    data = method_data(method, replace(model, parameters=tuple(parameters)), samples=model.samples())
    return StepperContext(model.name, sizes, functions, members, data, "base" in model.functions)


_TYPES = {"p": "const {0}_parameters *p", "t": "real t", "base": "const {0}_base_state *base"}


def sources(model: Model, program: StepperContext, parameters: Sequence[str] = ()) -> dict[str, str]:
    """Return header, model, stepper and interface as C texts."""
    P, N = program.prefix, program.prefix.upper()
    members = "".join(f"real {name}; " for name in parameters) or "char none;"
    declarations = ""
    for name, (inputs, outputs) in model.functions.items():
        arguments = [_TYPES.get(block, f"const real *{block}").format(P) for block in inputs]
        arguments += [f"{P}_base_state *base"] if name == "base" else [f"real *out{o}" for o in outputs]
        declarations += f"void {P}_{name}({', '.join(arguments)});\n"

    names = stepper_names(program)

    def render(template: str) -> str:
        return environment().get_template(template).render(program=program, prefix=P, upper=N, c=CNames, **names)

    header = f"""#ifndef {N}_H
#define {N}_H
#define EOMGEN_SHORT_NAMES
#include "eomgen_real.h"
typedef struct {{ {members} }} {P}_parameters;
typedef struct {{ real velocity_dot[3]; }} {P}_base_state;
void {P}_initial_state(real *q, real *v, real *z);
void {P}_default_parameters({P}_parameters *p);
{declarations}
{render("c/integrators/common/header.h.jinja")}
#endif
"""
    initial = (
        f"void {P}_initial_state(real *q, real *v, real *z)\n{{\n    (void)z;\n    q[0] = K(1.0);\n    v[0] ="
        f" K(0.0);\n}}\nvoid {P}_default_parameters({P}_parameters *p) {{ (void)p; }}\n"
    )
    return {
        f"{P}.h": header,
        f"{P}.c": f'#include "{P}.h"\n{initial}{model.c_text}',
        f"{P}_step.c": render(stepper_template(program.method["family"])),
        "interface.c": (
            f'#include <stddef.h>\n#include "{P}.h"\n{STEPPER_CDEF}\n' + render("c/interface/stepper.c.jinja")
        ),
        "eomgen_real.h": environment().get_template("c/model/eomgen_real.h.jinja").render(),
    }


_FLAGS = ["-std=c99", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-shared", "-fPIC"]


def build(
    folder: Path,
    model: Model,
    method: Method,
    parameters: dict[str, float] | None = None,
    flags: Sequence[str] = (),
    extra: str = "",
) -> Stepper:
    """Render, compile under the strictest warnings, and open."""
    named = parameters or {}
    program = context_of(model, method, list(named))
    folder.mkdir(parents=True, exist_ok=True)
    texts = sources(model, program, list(named))
    texts[f"{model.name}_step.c"] += extra
    for name, text in texts.items():
        (folder / name).write_text(text)
    library = folder / "model.so"
    files = [str(folder / name) for name in texts if name.endswith(".c")]
    command = ["gcc", *_FLAGS, *flags, *files, "-o", str(library), "-lm"]
    finished = subprocess.run(command, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr[:4000]
    return Stepper(ctypes.CDLL(str(library)), program, list(named.values()))
