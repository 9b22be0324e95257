"""Directional and adjoint derivatives of an FMU: data of the C, from nonzeros of derivatives in all arguments.

With x = (q, v, z) and accelerations a and multipliers lam by G(x, a, lam, u, p, t) = 0, the residual and the
accelerations of constraints, a change d of the arguments changes a and lam by -G_(a, lam)^-1 G_d d; rates and outputs
follow. Weights go the same way back, through the transposed matrices.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate
from typing import Any

import numpy as np

from eomgen.codegen.program import Program
from eomgen.products.fmu.dependencies import argument_sizes
from eomgen.products.fmu.interface import Interface
from eomgen.system.sparsity import unpacked_places
from eomgen.system.terms import ARGUMENTS

#: Functions of accelerations: without constraints, with constraints; a system without forward dynamics.
_EXPLICIT, _IMPLICIT, _CONSTRAINED = "forward_dynamics", "inverse_dynamics", ("residual", "constraint_acceleration")
_SUFFIX = "_derivatives"
#: Derivatives of inputs that the scene gives.
_OF_INPUTS = "input_derivatives"
#: Kinds of knowns and of unknowns, as numbered in the C, by kinds of variables.
KNOWNS = {"time": "OF_T", "parameter": "OF_P", "input": "OF_U", "q": "OF_Q", "v": "OF_V", "z": "OF_Z"}
KNOWNS |= {"sampled": "OF_Z", "algebraic": "OF_A"}
UNKNOWNS = {"der_q": "RATE_Q", "der_v": "RATE_V", "der_z": "RATE_Z", "output": "OUTPUT", "residual": "RESIDUAL"}


def derivative_data(program: Program, interface: Interface) -> dict[str, Any] | None:
    """Return the names of ``derivatives.c.jinja``; None of a Program without these functions.

    Returns
    -------
    dict
        ``dynamics``, ``equations``: functions of accelerations, and of residuals; ``functions``: name, number of
        nonzeros, rows and directions; ``firsts``: first direction of each argument; ``kinds`` and ``places``
        of the variables by value references; ``scratch``: names and sizes of arrays of doubles in the memory of an
        instance
    """
    sizes, known = program.sizes, set(program.function_names)
    explicit = not sizes["lam"] and _EXPLICIT in known
    dynamics = (_EXPLICIT,) if explicit else _CONSTRAINED if sizes["lam"] else (_IMPLICIT,)
    residuals = _CONSTRAINED if sizes["lam"] else (_IMPLICIT,)
    equations = residuals if interface.options.dae else ()
    wanted = [*dict.fromkeys((*dynamics, *equations))]
    wanted += ["internal_rate"] if sizes["z"] else []
    wanted += ["outputs"] if program.outputs else []
    if not all(f"{name}{_SUFFIX}" in known or f"{name}{_SUFFIX}" in program.patterns for name in wanted):
        return None
    functions = {name: _function(program, name) for name in wanted}
    *starts, width = accumulate(argument_sizes(program).values(), initial=0)
    firsts = dict(zip(ARGUMENTS, starts, strict=True))
    if _OF_INPUTS in program.patterns:
        functions[_OF_INPUTS] = _functions_of_inputs(program, interface, firsts)
    numbers = sum(function["count"] for function in functions.values())
    scratch = [("direction", width), ("raw", program.input_size("q")), ("solved", sizes["v"] + sizes["lam"])]
    scratch += [("kept", sizes["v"] + sizes["lam"]), ("numbers", max(numbers, 1))]
    scratch += [("weights", max(1, program.input_size("q"), sizes["v"], sizes["z"]))]
    scratch += [("weights_of_outputs", max(1, sum(item.size for item in program.outputs)))]
    table = {**KNOWNS, **UNKNOWNS}
    return {
        "explicit": explicit,
        "dynamics": list(dynamics),
        "equations": list(equations),
        "functions": functions,
        "firsts": firsts,
        "width": width,
        "kinds": [table.get(item.kind, "NEITHER") for item in interface.variables],
        "places": [item.index for item in interface.variables],
        "scratch": scratch,
    }


def _function(program: Program, name: str) -> dict[str, Any]:
    """Return the nonzeros of the Jacobian of a function: number, rows and directions in the order of ``ARGUMENTS``."""
    rows, directions = (np.asarray(places).tolist() for places in unpacked_places(program.patterns[f"{name}{_SUFFIX}"]))
    return {"name": f"{name}{_SUFFIX}", "count": len(rows), "rows": rows, "directions": directions}


def _functions_of_inputs(program: Program, interface: Interface, firsts: Mapping[str, int]) -> dict[str, Any]:
    """Return the nonzeros of the derivatives of inputs by formula: ``own`` has (number, row, direction) of each. Inputs
    that importers set are left out; directions count from ``firsts`` of each argument."""
    rows, columns = (np.asarray(places).tolist() for places in unpacked_places(program.patterns[_OF_INPUTS]))
    importer_inputs = [item.index for item in interface.variables if item.kind == "input"]
    parameters = len(program.parameters)
    directions = [firsts["t"] if column == parameters else firsts["p"] + column for column in columns]
    nonzeros = [(k, rows[k], directions[k]) for k in range(len(rows)) if rows[k] not in importer_inputs]
    return {"name": _OF_INPUTS, "count": len(rows), "own": nonzeros}
