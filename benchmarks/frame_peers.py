"""The shear frame with a pendulum by others: heyoka, SciPy's Radau and BDF, CVODE of SUNDIALS.

Each gets its best: heyoka eomgen's forward dynamics and equations written by hand, all modes of compilation; SciPy and
CVODE the compiled forward dynamics with the exact Jacobian, absolute tolerances by the scale of each coordinate; CVODE
all orders of BDF with and without its detection of stability limits, and no Python between. CVODE is the library within
the wheel of scikit-sundae. The setting of each is the first tolerance of a ladder that meets an error.
"""

from __future__ import annotations

import functools
import importlib.util
import itertools
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from benchmarks.programs import FLAGS, NATIVE, build, default_folder
from eomgen.codegen.convert import to_program
from eomgen.codegen.targets.c.target import generate_files
from eomgen.pipeline.pipeline import derive
from eomgen.scene.scene import Scene
from tests.models.shear_frame import SCALE, shear_frame

Array = NDArray[np.float64]
TOLERANCES = tuple(10.0 ** (-k / 4) for k in range(8, 53))
#: Halves of the factor of ten, for runs of seconds.
COARSE_TOLERANCES = TOLERANCES[::2]
#: Evaluations of SciPy and steps of CVODE that a run may take to be of any use.
EVALUATIONS, STEPS = 60_000, 300_000
#: What absolute tolerances are relative to: the scale of each coordinate, and less care for the first storey.
SCALES = (SCALE, SCALE * [1e3, 1, 1, 1, 1e3, 1, 1, 1])
_DECLARED = """
void frame_rates(double t, const double *y, double *dy);
void frame_jacobian(double t, const double *y, double *J);
"""
_DECLARED_CVODE = """
typedef struct Integrator Integrator;
Integrator *frame_cvode(double relative, const double *scale, int order, int detect_stability_limit);
long frame_cvode_run(Integrator *one, double end, long most, double *y);
"""
_LIBRARIES = ("core", "cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense")


@dataclass(frozen=True)
class Run:
    """One way to the end.

    Attributes
    ----------
    label : the setting
    call : runs it once; q and v at the end, None where it fails
    steps : of the last run
    give_up : whether a run that failed leaves no hope for smaller tolerances
    """

    label: str
    call: Callable[[], Array | None]
    steps: Callable[[], int]
    give_up: bool = False

    def seconds(self) -> float:
        """Return the processor's time of a run, s."""
        began = time.thread_time_ns()
        self.call()
        return 1e-9 * (time.thread_time_ns() - began)


Ways = Iterator[tuple[Callable[[float], Run], Sequence[float]]]


def missing(package: str) -> str | None:
    """Return what to install when a package of one of the peers is not there."""
    module = {"scikit-sundae": "sksundae", "pyelastica": "elastica"}.get(package, package)
    found = importlib.util.find_spec(module)
    return None if found else f"the Python package {package} is missing: pip install {package}"


def cheapest(ways: Ways, missed: Callable[[Array], float], errors: Sequence[float]) -> dict[float, tuple[Run, float]]:
    """Return for each error, largest first, the fastest of the ways with what it misses by, each way by its first
    tolerance that meets the error."""
    found: dict[float, list[tuple[float, Run, float]]] = {error: [] for error in errors}
    for way, tolerances in ways:
        asked = list(errors)
        for run in map(way, tolerances):
            end = run.call()
            error = np.inf if end is None else missed(end)
            while asked and error <= asked[0]:
                found[asked.pop(0)].append((min(run.seconds() for _ in range(3)), run, error))
            if not asked or (end is None and run.give_up):
                break
    return {error: min(those, key=lambda item: item[0])[1:] for error, those in found.items() if those}


# -- heyoka ------------------------------------------------------------------------------------------------------------


def frame_in_heyoka(ground_stiffness: float) -> dict[str, Any]:
    """Return the frame's equations by name."""
    from benchmarks import heyoka_equations as equations  # noqa: PLC0415  # the other peers run without heyoka

    written = equations.shear_frame(ground_stiffness)
    return {**of_scene_in_heyoka(shear_frame(ground_stiffness=ground_stiffness)), "by hand": written}


def of_scene_in_heyoka(scene: Scene) -> dict[str, Any]:
    """Return a scene's forward dynamics by name."""
    from benchmarks import heyoka_equations as equations  # noqa: PLC0415  # as above

    return {"forward dynamics": equations.of_system(derive(scene))}


def heyoka_ways(systems: Mapping[str, Any], start: Array, end: float) -> Ways:
    """Yield heyoka with all equations and modes of compilation."""
    for (name, system), (mode, options) in itertools.product(systems.items(), _MODES.items()):
        yield functools.partial(_heyoka, f"{name}, {mode}", system, options, start, end), TOLERANCES


_MODES: dict[str, dict[str, bool]] = {
    "straight": {},
    "straight, fast math": {"fast_math": True},
    "compact": {"compact_mode": True},
}


def _heyoka(label: str, system: Any, options: dict[str, bool], start: Array, end: float, tolerance: float) -> Run:
    import heyoka  # noqa: PLC0415  # as above

    integrator = heyoka.taylor_adaptive(system, start.copy(), tol=tolerance, **options)
    taken = [0]

    def call() -> Array:
        integrator.time = 0.0
        integrator.state[:] = start
        taken[0] = integrator.propagate_until(end)[3]
        return np.array(integrator.state)

    return Run(f"{tolerance:.1e}, order {integrator.order}, {label}", call, lambda: taken[0])


# -- the compiled right-hand side, for SciPy and CVODE -----------------------------------------------------------------


@functools.cache
def compiled(ground_stiffness: float, with_cvode: bool) -> tuple[cffi.FFI, Any]:
    """Return the frame's rates and Jacobian as a library of C, and CVODE on both."""
    scene = shear_frame(ground_stiffness=ground_stiffness)
    program = to_program(derive(scene, ["forward_dynamics", "partials"]))
    files = {name: text for name, text in generate_files(program).items() if name.endswith((".c", ".h"))}
    del files["main.c"]
    files["frame_cvode.c"] = (NATIVE / "frame_cvode.c").read_text(encoding="utf-8")
    command = ["gcc", *FLAGS["fast"], "-shared", "-fPIC", *(name for name in files if name.endswith(".c"))]
    linked = _sundials() if with_cvode else []
    if linked:
        command += ["-DWITH_CVODE", *map(str, linked), f"-Wl,-rpath,{linked[0].parent}"]
    made = build(default_folder(), files, [[*command, "-o", "frame.so", "-lm"]])
    ffi = cffi.FFI()
    ffi.cdef(_DECLARED + (_DECLARED_CVODE if linked else ""))
    return ffi, ffi.dlopen(str(made.file("frame.so")))


def _sundials() -> list[Path]:
    """Return the libraries that the wheel of scikit-sundae brings."""
    package = importlib.util.find_spec("sksundae")
    assert package is not None and package.origin is not None
    folder = Path(package.origin).parents[1] / "scikit_sundae.libs"
    return [next(folder.glob(f"libsundials_{name}-*.so*")) for name in _LIBRARIES]


def scipy_ways(ground_stiffness: float, start: Array, end: float, method: str) -> Ways:
    """Yield Radau or BDF of SciPy."""
    ffi, library = compiled(ground_stiffness, False)
    for scale in SCALES:
        yield functools.partial(_scipy, method, ffi, library, start, end, scale), COARSE_TOLERANCES


def _scipy(method: str, ffi: cffi.FFI, library: Any, start: Array, end: float, scale: Array, tolerance: float) -> Run:
    seen = ffi.from_buffer
    counted = [0, 0]

    def rates(t: float, y: Array) -> Array:
        dy = np.empty(8)
        library.frame_rates(t, seen("double[]", y), seen("double[]", dy))
        counted[0] += 1
        if counted[0] > EVALUATIONS:
            raise _TooLong
        return dy

    def jacobian(t: float, y: Array) -> Array:
        columns = np.empty((8, 8))
        library.frame_jacobian(t, seen("double[]", y), seen("double[]", columns))
        return columns.T

    def call() -> Array | None:
        counted[0] = 0
        options = {"method": method, "jac": jacobian, "rtol": max(tolerance, 3e-14), "atol": tolerance * scale}
        try:
            found = solve_ivp(rates, (0.0, end), start, **options)
        except _TooLong:
            return None
        counted[1] = len(found.t) - 1
        return np.asarray(found.y[:, -1]) if found.success else None

    return Run(f"{tolerance:.1e}{_loose(scale)}", call, lambda: counted[1], give_up=True)


def _loose(scale: Array) -> str:
    return "" if scale is SCALE else ", first storey 1e3 as loose"


class _TooLong(Exception):
    """A run took more evaluations than are of any use."""


def cvode_ways(ground_stiffness: float, end: float) -> Ways:
    """Yield CVODE with BDF of all orders."""
    ffi, library = compiled(ground_stiffness, True)
    for scale, (order, detect) in itertools.product(SCALES, ((2, 0), (3, 0), (4, 0), (4, 1), (5, 0), (5, 1))):
        yield functools.partial(_cvode, ffi, library, end, scale, order, detect), TOLERANCES


def _cvode(ffi: cffi.FFI, library: Any, end: float, scale: Array, order: int, detect: int, tolerance: float) -> Run:
    integrator = library.frame_cvode(tolerance, ffi.from_buffer("double[]", scale), order, detect)
    if integrator == ffi.NULL:
        raise RuntimeError("CVODE cannot be set up")
    y, taken = np.empty(8), [0]

    def call() -> Array | None:
        taken[0] = library.frame_cvode_run(integrator, end, STEPS, ffi.from_buffer("double[]", y))
        return y.copy() if taken[0] >= 0 else None

    detected = ", stability limits detected" if detect else ""
    return Run(f"{tolerance:.1e}, order {order}{detected}{_loose(scale)}", call, lambda: taken[0])
