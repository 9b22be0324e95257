"""What generation_time measures, in a process of its own: imports nothing before its clocks run.

python -m benchmarks.stages stages '{"urdf": "arm.urdf", "root": "fixed", "lock": [], "terms": [], "method": "rk4",
...}'
"""

# ruff: noqa: PLC0415  # importing is part of what is measured
from __future__ import annotations

import resource
import time

_START = time.perf_counter()


def cpu_seconds() -> float:
    """Return CPU seconds of this process and of the compilers it waited for, Python's own start included."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in usage)


class Lap:
    """CPU seconds since the last call, from the start of the process on."""

    def __init__(self) -> None:
        self.last = 0.0

    def __call__(self) -> float:
        now = cpu_seconds()
        taken, self.last = now - self.last, now
        return taken


def stages(urdf: str, root: str, lock: list[str], terms: list[str], method: str, mark: str) -> dict[str, float]:
    """Go through the stages by hand; return CPU seconds of each, CPU and wall seconds of all, and kB of C."""
    lap = Lap()
    from eomgen.codegen.convert import to_program
    from eomgen.codegen.metadata import interface_layout
    from eomgen.codegen.targets.c.interface import INTERFACE_CDEF
    from eomgen.codegen.targets.c.target import written_library
    from eomgen.integrators.families.register import method_named
    from eomgen.integrators.stepper_data import method_data
    from eomgen.mechanics.derive import derive
    from eomgen.scene.load import load
    from eomgen.toolchain.builder import Builder
    from eomgen.toolchain.cache import TEMPLATES

    seconds = {"import": lap()}
    scene = load(urdf, root=root, lock=lock)
    seconds["read"] = lap()
    system = derive(scene, terms)
    seconds["derive"] = lap()
    program = to_program(system, method_data(method_named(method), system, scene.simulation.step))
    seconds["program"] = lap()
    builder = Builder()
    files = dict(written_library(program, builder.cache.folder / TEMPLATES))
    layout = interface_layout(program)
    seconds["files"] = lap()
    builder.build(mark.encode(), files, INTERFACE_CDEF, layout)
    seconds["compile"] = lap()
    seconds |= {"CPU": cpu_seconds(), "wall": time.perf_counter() - _START}
    own = [text for name, text in files.items() if name.endswith(".c") and name != "interface.c"]
    seconds["kB of C"] = sum(map(len, own)) / 1e3
    return seconds


def first_build(
    urdf: str, root: str, lock: list[str], terms: list[str], method: str, mark: str, profile: str
) -> dict[str, float]:
    """Build the model under a name of its own; CPU seconds of Python and of the compilers, CPU and wall seconds of
    all."""
    import dataclasses

    import eomgen

    scene = dataclasses.replace(eomgen.load(urdf, root=root, lock=lock), name=f"model_{mark}")
    eomgen.build(scene, terms, method=method, profile=profile)
    seconds = {"wall": time.perf_counter() - _START, "CPU": cpu_seconds()}
    usage = resource.getrusage(resource.RUSAGE_SELF)
    seconds["Python"] = usage.ru_utime + usage.ru_stime
    return seconds | {"compilers": seconds["CPU"] - seconds["Python"]}


def first_step(urdf: str, root: str, lock: list[str], terms: list[str], method: str) -> dict[str, float]:
    """Build (from the cache, where it is there) and take one step; CPU seconds of each part, CPU and wall seconds of
    all."""
    lap = Lap()
    import eomgen

    seconds = {"import": lap()}
    scene = eomgen.load(urdf, root=root, lock=lock)
    seconds["read"] = lap()
    model = eomgen.build(scene, terms, method=method)
    seconds["build"] = lap()
    solution = model.simulate(1e-3, 1e-3, method=method, error_estimate=False)
    seconds["first step"] = lap()
    if not solution.success:
        raise RuntimeError(solution.message)
    return seconds | {"CPU": cpu_seconds(), "wall": time.perf_counter() - _START}


if __name__ == "__main__":
    import json
    import sys

    task = json.loads(sys.argv[2])
    measure = {"stages": stages, "first build": first_build, "first step": first_step}[sys.argv[1]]
    print(json.dumps(measure(**task)))
