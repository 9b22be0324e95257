"""The contestants of robot_dynamics: each builds timing programs for one robot, or says what is missing to do so."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.programs import FLAGS, NATIVE, Program, build, timing_program
from benchmarks.robots import STATES, Array, PinocchioModel, driven
from eomgen.codegen.convert import to_program
from eomgen.codegen.program import ProgramFunction
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene

EOMGEN, CPP, TRACE = "eomgen", "Pinocchio C++", "Pinocchio > CasADi > C"
LARGEST_AUTOMATIC = 30  # degrees of freedom
FUNCTIONS = ("inverse_dynamics", "mass", "forward_dynamics", "partials")

#: Limits of Boost's lists that Pinocchio's headers need, as its own build files set them.
_BOOST = (
    "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "-DBOOST_FUSION_INVOKE_MAX_ARITY=12",
)  # fmt: skip  # a table


@dataclass(frozen=True)
class Contestant:
    """One function by one road, ready to be run.

    Attributes
    ----------
    command : words before the file of states; ``results`` or ``time`` goes in second.
    to_reference : brings rows of results to Pinocchio's order and to full matrices.
    operations : additions and multiplications, None where nobody counts them.
    seconds : CPU time of the compiler for this function alone, None where it is shared.
    """

    peer: str
    function: str
    variant: str
    flags: str
    command: tuple[str, ...]
    states: Path
    to_reference: Callable[[Array], Array]
    operations: int | None
    seconds: float | None

    def timing(self, batches: int) -> list[str]:
        return [self.command[0], "time", *self.command[1:], str(self.states), str(batches)]

    def results(self, output: Path) -> Array:
        """Return one row of results for each state, in the reference's order."""
        subprocess.run([self.command[0], "results", *self.command[1:], str(self.states), str(output)], check=True)
        return self.to_reference(np.fromfile(output).reshape(STATES, -1))


def eigen() -> Path:
    """Return the folder of Eigen's headers: EIGEN_INCLUDE, that of the package cmeel-eigen or casadi, or the
    system's."""
    if given := os.environ.get("EIGEN_INCLUDE"):
        return Path(given)
    for package, folder in (("cmeel-eigen", "cmeel.prefix/include/eigen3"), ("casadi", "casadi/include/eigen3")):
        if missing_package(package) is None:
            return Path(str(importlib.metadata.distribution(package).locate_file(folder)))
    return Path("/usr/include/eigen3")


def missing_compiler(name: str) -> str | None:
    """Return what to install when a compiler is not there."""
    return None if shutil.which(name) else f"{name} is missing: apt install {name}"


def missing_package(name: str) -> str | None:
    """Return what to install when a distribution is not there."""
    try:
        importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        return f"the Python package {name} is missing: pip install {name}"
    return None


def missing_for_cpp() -> str | None:
    """Return the first thing that programs against Pinocchio's headers lack."""
    lacking = missing_package("pin") or missing_compiler("g++")
    if lacking or (eigen() / "Eigen" / "Core").exists():
        return lacking
    return f"there is no Eigen in {eigen()}: pip install cmeel-eigen, or set EIGEN_INCLUDE"


def missing_for_trace() -> str | None:
    """Return the first thing that the traced peer lacks."""
    return missing_for_cpp() or missing_package("casadi") or missing_compiler("gcc")


# -- eomgen ------------------------------------------------------------------------------------------------------------


def of_eomgen(
    scene: Scene, peer: PinocchioModel, states: Path, shelf: Path, functions: Sequence[str]
) -> Iterator[Contestant]:
    """Yield eomgen's generated functions, each compiled on its own."""
    plain = derive(scene, [name for name in functions if name != "forward_dynamics"])
    pushed = derive(driven(scene), ["forward_dynamics"])
    for name in functions:
        system = pushed if name == "forward_dynamics" else plain
        program = to_program(system, functions=[name])
        files = generate_files(program)
        sources = {file: text for file, text in files.items() if file.endswith((".c", ".h")) and file != "main.c"}
        call = call_of_eomgen(program.prefix, program.functions[0], system.nq, system.nv)
        for label, flags in FLAGS.items():
            built = timing_program(shelf, sources, call, flags)
            command, operations = (str(built.file("run")),), system.counts[name].flops
            yield Contestant(
                EOMGEN, name, "", label, command, states, _from_eomgen(peer, name), operations, built.seconds
            )


def call_of_eomgen(prefix: str, function: ProgramFunction, nq: int, nv: int) -> str:
    places = {"q": "state", "v": f"state + {nq}", "a": f"state + {nq + nv}", "u": f"state + {nq + nv}"}
    arguments = [places[block] for block in function.inputs]
    start = 0
    for output in function.outputs:
        arguments.append(f"result + {start}")
        start += output.size
    return (
        f'#include "{prefix}.h"\nenum {{ WIDTH = {nq + 2 * nv}, SIZE = {start} }};\n'
        "static inline void evaluate(const double *state, double *result)\n"
        f"{{\n    {prefix}_{function.name}({', '.join(arguments)});\n}}\n"
    )


def _from_eomgen(peer: PinocchioModel, function: str) -> Callable[[Array], Array]:
    order, n = peer.v_order, peer.model.nv
    if function in ("inverse_dynamics", "forward_dynamics"):
        return lambda rows: rows[:, order]
    return lambda rows: rows.reshape(len(rows), -1, n, n)[:, :, order][:, :, :, order].reshape(len(rows), -1)


# -- Pinocchio in C++ --------------------------------------------------------------------------------------------------

_CPP_VARIANTS = {
    "inverse_dynamics": ("rnea",),
    "mass": ("crba local", "crba world"),
    "forward_dynamics": ("aba local", "aba world", "crba, bias, cholesky"),
    "partials": ("analytic derivatives",),
    "regressor": ("joint torque regressor",),
}


def of_pinocchio(model: Path, states: Path, shelf: Path, functions: Sequence[str]) -> Iterator[Contestant]:
    """Yield Pinocchio's algorithms in C++, from one program."""
    program = cpp_program(shelf, "time_pinocchio", ("-O3", "-march=native"), ())
    for name in functions:
        for variant in _CPP_VARIANTS[name]:
            command = (str(program.file("time_pinocchio")), variant, str(model))
            yield Contestant(CPP, name, variant, "O3", command, states, lambda rows: rows, None, program.seconds)


def cpp_program(shelf: Path, name: str, flags: Sequence[str], libraries: Sequence[Path]) -> Program:
    """Build a program of ``native`` against the headers and libraries of Pinocchio's wheel."""
    prefix = Path(str(importlib.metadata.distribution("pin").locate_file("cmeel.prefix")))
    folders = [*libraries, prefix / "lib"]
    names = [*("-lcasadi" for _ in libraries), "-lpinocchio_default", "-lboost_serialization", "-lboost_filesystem"]
    includes = [prefix / "include", eigen(), *(folder / "include" for folder in libraries)]
    command = [
        "g++",
        "-std=c++17",
        "-DNDEBUG",
        *flags,
        *_BOOST,
        *(f"-I{folder}" for folder in includes),
        f"{name}.cpp",
        "-o",
        name,
        *(f"-L{folder}" for folder in folders),
        *names,
        *(f"-Wl,-rpath,{folder}" for folder in folders),
    ]
    files = {
        file: (NATIVE / file).read_text(encoding="utf-8")
        for file in (f"{name}.cpp", "read_model.hpp", "time_batches.h")
    }
    note = f"compiling native/{name}.cpp against Pinocchio's headers, which takes a minute or two (once)"
    return build(shelf, files, [command], note=note)


# -- Pinocchio traced by CasADi ----------------------------------------------------------------------------------------

_TRACES = {
    "inverse_dynamics": ("rnea",),
    "mass": ("crba",),
    "forward_dynamics": ("aba", "cholesky"),
    "partials": ("analytic", "automatic"),
}


def left_out(peer: PinocchioModel, function: str) -> tuple[str, ...]:
    """Return the traces of a function that are not compiled: the differentiated trace of a large robot takes gcc many
    minutes."""
    return ("automatic",) if function == "partials" and peer.model.nv > LARGEST_AUTOMATIC else ()


def of_trace(
    model: Path, peer: PinocchioModel, states: Path, shelf: Path, functions: Sequence[str]
) -> Iterator[Contestant]:
    """Yield Pinocchio's algorithms traced by CasADi, written as C by CasADi, each compiled on its own."""
    specification = importlib.util.find_spec("casadi")
    casadi = Path(str(specification.origin)).parent if specification else Path()
    tracer = cpp_program(shelf, "trace_pinocchio", ("-O1",), (casadi,))
    variants = {
        name: [variant for variant in _TRACES[name] if variant not in left_out(peer, name)] for name in functions
    }
    wanted = [variant for name in functions for variant in variants[name]]
    text = model.read_text(encoding="utf-8")
    folder = (
        shelf / f"traces-{hashlib.sha256((tracer.folder.name + text + ' '.join(wanted)).encode()).hexdigest()[:20]}"
    )
    if not (folder / "traces.jsonl").exists():
        folder.mkdir(parents=True, exist_ok=True)
        result = subprocess.run(
            [str(tracer.file("trace_pinocchio")), str(model), str(folder), *wanted],
            capture_output=True,
            text=True,
            check=True,
        )
        (folder / "traces.jsonl").write_text(result.stdout, encoding="utf-8")
    lines = (folder / "traces.jsonl").read_text(encoding="utf-8").splitlines()
    described = {trace["name"]: trace for trace in map(json.loads, lines)}
    for name in functions:
        for variant in variants[name]:
            trace = described[f"traced_{variant}"]
            sources = {f"traced_{variant}.c": (folder / f"traced_{variant}.c").read_text(encoding="utf-8")}
            call = _call_of_trace(trace, peer.model.nq, peer.model.nv)
            for label, flags in FLAGS.items():
                built = timing_program(shelf, sources, call, flags)
                command, operations = (str(built.file("run")),), trace["additions"] + trace["multiplications"]
                yield Contestant(
                    TRACE, name, variant, label, command, states, _from_trace(trace), operations, built.seconds
                )


def _call_of_trace(trace: Mapping[str, Any], nq: int, nv: int) -> str:
    name, outputs = trace["name"], trace["outputs"]
    sizes = [len(output["places"]) for output in outputs]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    stores = "".join(f"    res[{k}] = result + {starts[k]};\n" for k in range(len(sizes)))
    return (
        f"enum {{ WIDTH = {nq + 2 * nv}, SIZE = {starts[-1]} }};\n"
        f"int {name}(const double **arg, double **res, long long int *iw, double *w, int mem);\n"
        f"static const double *arg[{trace['arg']} + 1];\nstatic double *res[{trace['res']} + 1];\n"
        f"static long long int iw[{trace['iw']} + 1];\nstatic double w[{trace['w']} + 1];\n"
        "static inline void evaluate(const double *state, double *result)\n{\n"
        f"    arg[0] = state;\n    arg[1] = state + {nq};\n    arg[2] = state + {nq + nv};\n{stores}"
        f"    {name}(arg, res, iw, w, 0);\n}}\n"
    )


def _from_trace(trace: Mapping[str, Any]) -> Callable[[Array], Array]:
    outputs = trace["outputs"]

    def full(rows: Array) -> Array:
        parts, start = [], 0
        for output in outputs:
            part = np.zeros((len(rows), output["size"]))
            part[:, output["places"]] = rows[:, start : start + len(output["places"])]
            start += len(output["places"])
            parts.append(part)
        return np.concatenate(parts, axis=1)

    return full
