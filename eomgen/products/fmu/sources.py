"""C sources of an FMU: the model and the stepper, and the functions of FMI in one file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from eomgen.base.data import replace
from eomgen.codegen.folder import MANIFEST
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.printer import wrap_text
from eomgen.codegen.targets.c.target import generate_files
from eomgen.codegen.targets.c.templates import environment
from eomgen.products.fmu.arrays import listed
from eomgen.products.fmu.dependencies import PATTERNS
from eomgen.products.fmu.interface import Interface, Variable, event_rows, mode_parameters

#: Before every source, so that no compiler fuses products with sums.
_EXACT = """\
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

"""


def source_files(interface: Interface, derivatives: Mapping[str, Any] | None = None) -> dict[str, str]:
    """Return the sources by name; ``wrapper_name`` gives the file that has the functions of FMI.

    This file includes the stepper, which therefore is a header, not a source.

    Parameters
    ----------
    derivatives : of ``derivative_data``; None: the FMU gives no derivatives
    """
    program = interface.program
    kept = program.functions
    if derivatives is None:  # which give dependencies alone
        kept = tuple(function for function in kept if function.name not in PATTERNS)
    written = generate_files(replace(program, functions=kept, uniform=True))
    files = {name: text for name, text in written.items() if name not in ("main.c", "README.md", MANIFEST)}
    names = _context(interface, replace(program, functions=kept), derivatives)
    text = environment().get_template(f"fmu/fmi{interface.version}.c.jinja").render(**names)
    files[wrapper_name(interface)] = wrap_text(text)
    files[f"{interface.identifier}_step.h"] = files.pop(f"{interface.identifier}_step.c")
    return {name: _EXACT + text if name.endswith(".c") else text for name, text in files.items()}


def wrapper_name(interface: Interface) -> str:
    """Return the name of the source with the functions of FMI."""
    return f"{interface.identifier}_fmi{interface.version}.c"


def compiled_sources(interface: Interface, files: Mapping[str, str]) -> list[str]:
    """Return the names of the sources that are compiled, first the file with the functions of FMI."""
    first = wrapper_name(interface)
    return [first, *sorted(name for name in files if name.endswith(".c") and name != first)]


def _context(interface: Interface, program: Program, derivatives: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the names that the templates of the wrapper use; ``derivatives`` as in ``source_files``."""
    explicit = not program.sizes["lam"] and "forward_dynamics" in program.function_names
    sizes = program.sizes
    rotations = [factor for factor in program.factors if factor["group"] != "R"]
    continuous = [item.index for item in interface.of("z")]
    method = program.method
    labels = {name: label for whole in listed(interface) for name, label in whole.labels.items()}
    dynamics = str(derivatives["dynamics"][0]) if derivatives else ""
    return {
        "program": program,
        "interface": interface,
        "method": method,
        "P": program.prefix,
        "N": program.prefix.upper(),
        "nq": sizes["q"],
        "nv": sizes["v"],
        "nz": sizes["z"],
        "nu": sizes["u"],
        "nl": sizes["lam"],
        "nh": sizes["holonomic"],
        "ny": sum(item.size for item in program.outputs),
        "states": interface.states,
        "first_z": len(interface.states) - len(continuous),
        "nx": len(interface.states),
        "rotations": rotations,
        "quaternions": [_name_of_quaternion(interface, factor["q_start"]) for factor in rotations],
        "reports": bool(event_rows(program) or method.get("samples"))
        or (interface.exchange and bool(sizes["lam"] or rotations)),
        **_inputs(interface, program),
        "continuous": continuous,
        "events": event_rows(program),
        "modes": mode_parameters(program),
        "samples": method.get("samples"),
        **_time_events(program),
        "places": _places(interface),
        "names": [labels.get(item.name, item.name) for item in interface.variables],
        "ranges": _ranges(interface),
        "explicit": explicit,
        "dae": interface.options.dae,
        "minimal": interface.options.minimal,
        "sizes_of_arrays": _sizes(interface),
        "solved": not explicit,
        "scratch": () if derivatives is None else derivatives["scratch"],
        "adaptive": any(item["name"] == "tolerance" for item in method["settings"]),
        "derivatives": derivatives,
        # the function with derivatives in positions, which give nominal values
        "stiffness": dynamics if derivatives and derivatives["functions"][dynamics]["count"] else "",
    }


def _inputs(interface: Interface, program: Program) -> dict[str, Any]:
    """Return the names of the templates on inputs: set by the importer, and followed by formulas of the scene."""
    method, inputs = program.method, [item.index for item in interface.of("input")]
    return {
        "inputs": inputs,
        "formulas": sorted(set(range(program.sizes["u"])) - set(inputs)),
        "given": "inputs" in program.function_names,
        "follows_not_a_number": "jumps" in method or method["own_steps"] or method["inputs"] == "series",
        "linear": method["inputs"] == "sampled",
    }


def _time_events(program: Program) -> dict[str, Any]:
    """Return times, and times with periods, at which forces or their first two derivatives jump, so that model exchange
    asks for an event."""
    jumps = [item for item in program.discontinuities if item["order"] <= 2]
    return {
        "once": sorted({item["time"] for item in jumps if not item["period"]}),
        "periodic": list(dict.fromkeys((item["time"], item["period"]) for item in jumps if item["period"])),
    }


def _ranges(interface: Interface) -> tuple[Variable, ...]:
    """Return the parameters if one has a range."""
    parameters = interface.of("parameter")
    return parameters if any((item.lower, item.upper) != (None, None) for item in parameters) else ()


def _sizes(interface: Interface) -> list[int]:
    """Return the number of values by value references, 0 for numbers within an array; an empty list without arrays."""
    every = listed(interface) if interface.options.arrays else ()
    return [size for whole in every for size in (whole.size, *[0] * (whole.size - 1))]


def _name_of_quaternion(interface: Interface, start: int) -> str:
    """Return the name of the variables whose first four are a quaternion, without their index."""
    return next(item.name for item in interface.of("q") if item.index == start).rsplit("[", 1)[0]


def _places(interface: Interface) -> list[str]:
    """Return the C text of each variable's number in an instance's memory, in the order of value references."""
    program, rate, result = interface.program, 0, list[str]()
    arrays = {
        "input": "input",
        "formula": "u",
        "q": "run.state.q",
        "turns": "run.state.q",
        "v": "run.state.v",
        "z": "run.state.z",
        "sampled": "run.state.z",
        "output": "y",
        "mode": "run.state.event_state.mode",
        "indicator": "indicator",
        "residual": "residual",
        "drift": "drift",
        "minimal": "s",
    }
    for item in interface.variables:
        if item.kind == "time":
            result.append("run.state.t")
        elif item.kind == "switch":
            result.append("dae")
        elif item.kind == "algebraic":
            nv = program.sizes["v"]
            result.append(f"a[{item.index}]" if item.index < nv else f"lam[{item.index - nv}]")
        elif item.kind == "parameter":
            result.append(f"run.parameters.{program.parameters[item.index].member}")
        elif item.derivative is not None:
            result.append(f"dx[{rate}]")
            rate += 1
        else:
            result.append(f"{arrays[item.kind]}[{item.index}]")
    return result
