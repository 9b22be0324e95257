"""The targets ``ros2`` and ``cortex-m4``: computed torque around the inverse dynamics of a robot.

Both have the C of the model, and a step in C that computes efforts = inverse dynamics (q, v, a) with a = goal's
acceleration + gains times the errors of position and velocity. Without gains this is the compensation of gravity.
Luh, Walker, Paul, Resolved-acceleration control of mechanical manipulators, IEEE Transactions on Automatic Control 25
(1980).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import Any

from eomgen.base.data import replace
from eomgen.base.files import template_folder
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import compile_command, generate_files
from eomgen.codegen.targets.c.templates import environment
from eomgen.codegen.targets.target import Target
from eomgen.errors import ModelError, Problem
from eomgen.symbolic.operations import NAMES as ELEMENTARY_NAMES

_TERM = "inverse_dynamics"
#: Cycles of the processor's arithmetic (Arm, Cortex-M4 Technical Reference Manual, section 3.3 and 7): a division or a
#: square root, half of ``eg_sincos`` of eomgen_real.h, and all that the step does for a joint besides the model.
DIVISION, SINE, JOINT = 14, 26, 16
#: N m or N, of a joint whose description has no effort, or 0, which exporters write for none.
_NO_LIMIT = 1e30
#: Bytes of the stack in a call besides local values: registers that a function saves.
_SAVED = 128


def _terms(names: Sequence[str] | None) -> list[str]:
    return list(dict.fromkeys((_TERM, *(names or ()))))


def _check_machine(program: Program) -> None:
    """Raise ModelError for a machine whose efforts do not follow from position and velocity of each joint."""
    joints = [str(factor["name"]) for factor in program.factors if factor["v_size"] != 1 or factor["q_size"] != 1]
    held = {"t": "time", "z": "internal states", "base": "the motion of its base"}
    depends = [held[block] for block in program.function(_TERM).inputs if block in held]
    if joints or program.angles:
        fault = f"{', '.join(joints or program.angles)} has more numbers than a position [E2247]"
        raise ModelError(Problem(program.prefix, fault, "hinges and slides, one for each drive"))
    if program.sizes["lam"]:
        fault = "its loops are closed by constraints, so a position does not determine the efforts [E2248]"
        raise ModelError(
            Problem(program.prefix, fault, "actuator_efforts of a model, which shares them out over the drives")
        )
    if depends:
        fault = f"its inverse dynamics depends on {' and '.join(depends)}, which no drive measures [E2249]"
        raise ModelError(Problem(program.prefix, fault, "a scene without them for the controller"))


def arithmetic_cycles(program: Program) -> int:
    """Return the cycles of a Cortex-M4 for the arithmetic of a step, by the number of operations; loads and stores, and
    functions from the C library, are not counted."""
    counts = program.function(_TERM).counts
    plain = counts["additions"] + counts["multiplications"] + counts["selections"] + JOINT * program.sizes["v"]
    return plain + DIVISION * counts["divisions"] + SINE * counts["functions"]


def stack_bytes(program: Program) -> int:
    """Return a bound of the stack of a step in float: each local value of the functions in memory."""
    function = program.function(_TERM)
    values = function.counts["statements"] + function.counts["functions"] + function.workspace + program.sizes["v"]
    return 4 * values + _SAVED * (2 + (len(function.parts) > 1))


def _files(name: str, real: str, program: Program) -> dict[str, str]:
    """Return the files of a controller.

    Parameters
    ----------
    name : of the target, and of the folder with templates of the files besides the C of the model
    real : number type in which the files are compiled
    """
    _check_machine(program)
    program = replace(program, defaults={**program.defaults, "real": real})
    files = generate_files(program)
    for file in ("main.c", "README.md", MANIFEST):
        del files[file]
    prefix, joints = program.prefix, program.sizes["v"]
    names = [str(factor["name"]) for factor in program.factors]
    motors = [program.defaults["metadata"].get("motors", {}).get(joint, {}) for joint in names]
    limits = [repr(limit if 0.0 < (limit := motor.get("effort", 0.0)) < _NO_LIMIT else _NO_LIMIT) for motor in motors]
    # Names of packages begin with a letter, and have single underscores.
    package = re.sub(r"_+", "_", f"{prefix.lower().strip('_')}_controller")
    controller = package if package[0].isalpha() else f"robot_{package}"
    model = sorted(file for file in files if file.endswith(".c"))
    called = {word.lower() for word in re.findall(r"\bEG_([A-Z]+2?)\(", "".join(files[file] for file in model))}
    single = {"data": 4 * (9 * joints + max(1, program.sizes["p"])), "stack": stack_bytes(program)}
    single["cycles"] = arithmetic_cycles(program)
    known: dict[str, Any] = {
        **single,
        **{"program": program, "prefix": prefix, "upper": prefix.upper(), "controller": controller, "real": real},
        "joints": [motor.get("name", joint) for joint, motor in zip(names, motors, strict=True)],
        "limits": [limit if "." in limit else limit.replace("e", ".0e") for limit in limits],  # as YAML has floats
        "inputs": program.function(_TERM).inputs,
        **{"counts": program.function(_TERM).counts, "model": model},
        "library": sorted(called & {*ELEMENTARY_NAMES.values(), "atan2", "pow"} - {"sin", "cos", "sqrt"}),
    }
    for folder in ("step", name):
        for path in sorted((template_folder() / "controllers" / folder).glob("*.jinja")):
            template = environment().get_template(f"controllers/{folder}/{path.name}")
            files[path.stem.replace("controller", controller)] = template.render(known)
    command = compile_command(program, sorted(file for file in files if file.endswith(".c")))
    more = {"cortex_m4": single} if real == "float" else {}
    return {**files, MANIFEST: manifest(program, files, fingerprint=fingerprint(files), compile=command, **more)}


ROS2 = Target("ros2", "C++ for ROS 2", NAMES, partial(_files, "ros2", "double"), terms=_terms)
"""A package for ros2_control, Humble and Jazzy."""
CORTEX_M4 = Target("cortex-m4", "C in float", NAMES, partial(_files, "cortex-m4", "float"), terms=_terms)
"""Fixed memory and no double, with an estimate of the cycles."""
