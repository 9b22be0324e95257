"""System -> Program: decides all names, orders and function parts, so that templates only print; a Map on the tape
becomes a loop of the Program, its kernel as statements, its constants and gather indices as tables.

In a function that runs a loop, its gathered inputs and its results lie in the workspace, in separate ranges, so
that neither the length of the code nor the number of locals grows with the number of elements. Runs of equally spaced
places, the rule in meshes and chains, are copied by loops too. Elements that need no others are taken several at a
time, with a sum each, which compilers turn into vectors without changing the order of any sum.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from eomgen.base.data import replace
from eomgen.base.version import __version__
from eomgen.codegen.program import (
    NEST_LIMIT,
    PART_LIMIT,
    FunctionPart,
    OutputArray,
    Program,
    ProgramCurve,
    ProgramExternal,
    ProgramFunction,
    ProgramLoop,
    SceneSource,
)
from eomgen.codegen.scheduling.bodies import Bodies, RunLoop
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.target import Names
from eomgen.errors import Message, ModelError
from eomgen.integrators.events import jump_data
from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import CurveLike, Op
from eomgen.system.signals import CONTROLLER_ARGUMENTS
from eomgen.system.sparsity import packed_places
from eomgen.system.system import BASE_LAYOUT, BASE_SIZE, INPUT_BLOCKS, OBSERVED, Function, Quantity, System
from eomgen.system.terms import NONZEROS, TERMS

#: Largest number of values between the parts and loops of one function: these values are on the stack, 16 MB as
#: doubles.
WORKSPACE_LIMIT = 2_000_000


def to_program(
    system: System,
    method: Mapping[str, Any] | None = None,
    functions: Sequence[str] | None = None,
    *,
    part_limit: int = PART_LIMIT,
    nest_limit: int = NEST_LIMIT,
    live_limit: int = 0,
    names: Names = NAMES,
    scheduled: bool = True,
) -> Program:
    """Return the Program of a System.

    Parameters
    ----------
    method : mapping, optional
        Data for the templates of integrators; without data the model has functions only.
    functions : names, optional
        The functions wanted, in this order; all by default.
    part_limit, nest_limit : int
        Operations per compiled part and per statement at most.
    live_limit : int
        Live values per part at most, in functions without loops; parts then compute values of earlier parts
        again, and have any length. 0: parts by length.
    names : Names
        Of the target language; C's by default.
    scheduled : bool
        Whether the functions have statements; a Program without gives the text of the stepper, which only calls them.

    Raises
    ------
    ModelError
        A function that does not exist, takes an unknown input, or has outputs of the wrong size.
    """
    wanted = list(system.functions) if functions is None else list(functions)
    unknown = [name for name in wanted if name not in system.functions]
    if unknown:
        raise ModelError(
            f"the model has no function {', '.join(unknown)} [E0205]", f"one of {', '.join(system.functions)}"
        )
    tape = system.tape
    bodies = Bodies(shared=[] if scheduled and _is_long(system, wanted) else None)
    limits = (part_limit, nest_limit, live_limit) if scheduled else None
    made = _functions(names, system, wanted, bodies, limits)
    series: tuple[ProgramFunction, ...] = ()
    data = dict(method or {})
    if data.get("inputs") == "series":
        from eomgen.codegen.series.functions import series_functions  # noqa: PLC0415  # few methods step by series

        series, sizes, breakpoints = series_functions(system, bodies)
        if breakpoints:
            data["jumps"] = jump_data((*system.discontinuities, *breakpoints), data["max_order"])
        data |= sizes
    base_read, base_of_step = _base_of_step(system, wanted, nest_limit) if method else ((), None)
    curves = {id(curve): curve for curve, _ in tape.curves}
    return Program(
        prefix=names.model(system.name),
        description=system.description,
        sizes={
            "q": system.nq,
            "v": system.nv,
            "z": system.nz,
            "u": sum(item.size for item in system.inputs),
            "p": len(system.parameters),
            "lam": len(system.multipliers),
            "holonomic": system.holonomic,
            "bodies": len(system.bodies),
            "base": BASE_SIZE,
            **{block: size for block, size in system.rate_sizes.items() if size},
            **system.second_sizes,
        },
        factors=tuple(map(asdict, system.factors)),
        angles=system.angles,
        parameters=_name_quantities(names, system.parameters, "p_"),
        inputs=_name_quantities(names, system.inputs, "u_"),
        states=_name_quantities(names, system.states, "z_"),
        outputs=_name_quantities(names, system.outputs, "y_"),
        bodies=system.bodies,
        frames=system.frames,
        multipliers=system.multipliers,
        row_units=system.row_units,
        warnings=system.warnings,
        left_out=system.left_out,
        base_fields=BASE_LAYOUT,
        base_zeros=system.base_zeros,
        base_read=base_read,
        base_of_step=base_of_step,
        functions=made,
        loops=_program_loops(bodies.loops),
        shared=tuple(bodies.shared or ()),
        initial_q=system.initial_q,
        initial_v=system.initial_v,
        initial_z=system.initial_z,
        asked_q=system.asked_q,
        asked_v=system.asked_v,
        dof_parent=system.dof_parent,
        discontinuities=tuple(map(asdict, system.discontinuities)),
        sampled=tuple(map(asdict, system.sampled)),
        sources=_sources(system, names.model(system.name), bodies.calls),
        external=tuple(map(_external, bodies.calls)),
        validity=tuple(map(asdict, system.validity)),
        facts=asdict(system.facts),
        defaults=dict(system.defaults),
        kept=system.kept,
        dropped=system.dropped,
        notes=tuple(Message(note).line for note in system.notes),
        constants=_constants(names, system, wanted),
        beams=system.beams,
        slopes=tuple(map(asdict, system.slopes)),
        axes=tuple(map(asdict, system.axes)),
        version=__version__,
        method=data,
        series=series,
        curves=tuple(_curve(curves[key]) for key in bodies.curves),
        patterns=_patterns(system, wanted),
    )


def _program_loops(loops: Sequence[RunLoop]) -> tuple[ProgramLoop, ...]:
    if not loops:
        return ()
    from eomgen.codegen.scheduling.program_loops import program_loop  # noqa: PLC0415  # as in _function

    return tuple(map(program_loop, loops))


#: Operations of all functions from which on equal stretches are shared: compilers take eight seconds for text of their
#: own. Functions of a few thousand operations take up to a third longer with calls, longer functions less time.
LONG = 60_000


def _is_long(system: System, wanted: Sequence[str]) -> bool:
    """Return whether the wanted functions have ``LONG`` operations or more, for which equal stretches are shared."""
    if 2 * len(system.tape.op) < LONG:  # functions share operations, so a sum is rarely more than twice the tape
        return False
    return sum(len(system.tape.live(system.functions[name].refs)) for name in wanted) >= LONG


def _patterns(system: System, wanted: Sequence[str]) -> dict[str, str]:
    """Return the packed positions of the nonzeros of matrices, as text (``packed_places``), by the name of the output.
    Only outputs of wanted functions are included that are partial derivatives or lists of nonzeros: ``iteration``,
    ``input_derivatives``, the functions of ``NONZEROS`` and the differentiated terms."""
    derivatives = (name for name in wanted if name in TERMS and TERMS[name].differentiated)
    functions = ("iteration", "input_derivatives", *NONZEROS.values(), *derivatives)
    names = {block.name for name in functions if name in wanted for block in system.functions[name].outputs}
    return {name: packed_places(pairs) for name, pairs in system.patterns.items() if name in names}


def _sources(system: System, prefix: str, calls: Sequence[Call]) -> tuple[SceneSource, ...]:
    """Return the C files that the scene brings along, each once, with the functions that are called in the file. The
    functions are named by controllers of the scene, with prototypes of ``CONTROLLER_ARGUMENTS``; for external functions
    in ``calls`` only prototypes are listed. Files get the name ``<prefix>_user_<name>.c``, with a number appended if
    two files would have the same name."""
    functions: dict[tuple[str, str], list[str]] = {}
    prototypes: dict[tuple[str, str], list[str]] = {}
    codes = [call.function.code for call in calls]
    python = {(code.source.name, code.source.text): code.source.python for code in codes}
    for item in system.controllers:
        if item.source is not None:
            key = (item.source.name, item.source.text)
            functions.setdefault(key, []).append(item.function)
            prototypes.setdefault(key, []).append(f"int {item.function}({CONTROLLER_ARGUMENTS});")
    for code in codes:
        key = (code.source.name, code.source.text)
        functions.setdefault(key, [])
        prototypes.setdefault(key, []).extend(code.prototypes)
    made: list[SceneSource] = []
    for key, called in functions.items():
        name, text = key
        stem = "".join(c if c.isascii() and c.isalnum() else "_" for c in name.removesuffix(".c"))
        same = sum(file.name.startswith(f"{prefix}_user_{stem}") for file in made)
        file = f"{prefix}_user_{stem}{f'_{same + 1}' if same else ''}.c"
        declared = tuple(dict.fromkeys(prototypes[key]))
        made.append(SceneSource(file, name, text, tuple(dict.fromkeys(called)), declared, python.get(key)))
    return tuple(made)


def _external(call: Call) -> ProgramExternal:
    law = call.function
    return ProgramExternal(
        law.label,
        call.columns,
        law.arguments,
        law.parameters,
        law.results,
        law.scales,
        law.code.function,
        law.code.slopes,
        law.code.real,
    )


def _base_of_step(
    system: System, wanted: Sequence[str], nest_limit: int
) -> tuple[tuple[int, ...], FunctionPart | None]:
    """Return the components of the base struct that the equations of a step read, and statements that compute these
    alone.

    The function ``base`` computes all components: a quaternion that no equation needs costs a sine and a cosine. The
    result is ((), None) if ``base`` is not in ``wanted``. The second item is None if the components need a loop or a
    curve: these are functions of the model's own file, which steppers do not see. Observing functions do not count.
    """
    if "base" not in wanted:
        return (), None
    tape, law = system.tape, system.functions["base"].refs
    equations = [ref for name in wanted if name not in OBSERVED for ref in system.functions[name].refs]
    read = tuple(sorted(symbol.index for symbol in tape.depends_on(equations) if symbol.block == "base"))
    refs = [law[component] for component in read]
    if any(tape.op[node] in (Op.MAP, Op.CURVE) for node in tape.live(refs)):
        return read, None
    from eomgen.codegen.scheduling.scheduler import schedule  # noqa: PLC0415  # as in _function

    (part,) = schedule(tape, [refs], INPUT_BLOCKS, len(tape.op) + 1, nest_limit, fill=False, reroll=False).parts
    return read, part


def _curve(curve: CurveLike) -> ProgramCurve:
    breaks, coefficients = curve.breaks.tolist(), curve.coefficients.tolist()
    rows = [(start, *row) for start, row in zip(breaks, [*coefficients, [0.0] * len(coefficients[0])], strict=True)]
    return ProgramCurve(curve.name, tuple(rows), curve.outside, *curve.end_values)


def _constants(names: Names, system: System, wanted: Sequence[str]) -> tuple[Quantity, ...]:
    """Return the named constants whose value occurs in the wanted functions, in either sign, with names for the target.
    If several names have the same value, only the first is returned."""
    if not system.constants:
        return ()
    tape = system.tape
    live = tape.live([ref for name in wanted for ref in system.functions[name].refs])
    used = {abs(tape.constants[tape.a[node]]) for node in live if tape.op[node] is Op.CONST}
    first = {item.value: item for item in reversed(system.constants)}
    held = [item for item in system.constants if item.value in used and first[item.value] is item]
    return _name_quantities(names, held, "")


def _name_quantities(names: Names, quantities: Sequence[Quantity], prefix: str) -> tuple[Quantity, ...]:
    return tuple(replace(item, member=names.member(item.name, prefix), value=float(item.value)) for item in quantities)


def _functions(
    names: Names, system: System, wanted: Sequence[str], bodies: Bodies, limits: tuple[int, int, int] | None
) -> tuple[ProgramFunction, ...]:
    """Return the wanted functions as functions of the Program, in the order of ``wanted``.

    A function with the same inputs and results as an earlier one has no statements and names this function in
    ``same_as``; the outputs may have another shape. ``bodies`` are of the whole Program, and grow in place.
    ``limits``: operations per part and per statement, and live values, at most; None for functions without
    statements.
    """
    made: list[ProgramFunction] = []
    known: dict[tuple[object, ...], ProgramFunction] = {}
    for name in wanted:
        function = system.functions[name]
        key = (function.inputs, tuple(block.refs for block in function.outputs))
        first = known.get(key)
        if first is None:
            made.append(_function(names, system, function, bodies, limits))
            known[key] = made[-1]
            continue
        outputs = tuple(
            replace(  # the same numbers may be another shape here: packed nonzeros of a full matrix
                output,
                name=block.name,
                argument=names.output(block.name, first.inputs),
                shape=block.shape,
                description=block.description,
            )
            for output, block in zip(first.outputs, (b for b in function.outputs if b.refs), strict=True)
        )
        made.append(
            replace(
                first,
                name=names.function(name, "the function"),
                description=function.description,
                outputs=outputs,
                parts=(FunctionPart((), (), (), False, 0),),
                workspace=0,
                operations=0,
                same_as=first.name,
            )
        )
    return tuple(made)


def check_workspace(name: str, values: int) -> None:
    """Raise ModelError if a function keeps more than ``WORKSPACE_LIMIT`` values on the stack; names the function."""
    if values > WORKSPACE_LIMIT:
        raise ModelError(
            f"function {name} keeps {values} values on the stack, more than {WORKSPACE_LIMIT} [E0206]",
            "fewer elements, or without this function",
        )


def _function(
    names: Names, system: System, function: Function, bodies: Bodies, limits: tuple[int, int, int] | None
) -> ProgramFunction:
    """Return one function as a function of the Program, with scheduled statements and all outputs that have components.

    ``bodies`` belong to the whole Program and are extended in place. ``limits``: operations per part and per statement,
    and live values; None leaves the function without statements. The function ``base`` has one output, the struct of
    ``BASE_SIZE`` numbers. Raises ModelError for an unknown input block, an output with a wrong number of components, a
    value that depends on a block that is not an input, or a full stack.
    """
    name = names.function(function.name, "the function")
    unknown = [block for block in function.inputs if block not in INPUT_BLOCKS]
    if unknown:
        raise ModelError(
            f"function {name} takes {', '.join(unknown)}, not an input block [E0207]",
            f"some of {', '.join(INPUT_BLOCKS)}",
        )
    inputs = tuple(block for block in INPUT_BLOCKS if block in function.inputs)
    blocks = [(block.name, block.shape, block.refs, block.description) for block in function.outputs if block.refs]
    for label, shape, refs, _ in blocks:
        if math.prod(shape) != len(refs):
            raise ModelError(f"output {label} of function {name} has shape {shape} but {len(refs)} components [E0208]")
    if name == "base":
        refs = function.refs
        if len(refs) != BASE_SIZE:
            raise ModelError(f"function base gives {len(refs)} components, the base's state has {BASE_SIZE} [E0209]")
        blocks = [("base", (BASE_SIZE,), refs, "state of the base")]
    outputs = [refs for _, _, refs, _ in blocks]
    parts: tuple[FunctionPart, ...] = ()
    workspace, operations = 0, 0
    if limits is not None:
        from eomgen.codegen.scheduling.scheduler import schedule  # noqa: PLC0415  # known texts need no statements

        result = schedule(
            system.tape,
            outputs,
            INPUT_BLOCKS,
            *limits[:2],
            bodies,
            fill=name != "base",
            sample=system.sample,
            live_limit=limits[2],
        )  # the base is a struct, whose components no loop can fill
        parts, workspace, operations = result.parts, result.workspace, result.operations
    missing = sorted({block for part in parts for block in part.inputs} - set(inputs))
    if missing:
        raise ModelError(f"function {name} depends on {', '.join(missing)}, which is not among its inputs [E0210]")
    check_workspace(name, workspace)
    return ProgramFunction(
        name=name,
        description=function.description,
        inputs=inputs,
        outputs=tuple(
            OutputArray(label, label if name == "base" else names.output(label, inputs), shape, len(refs), description)
            for label, shape, refs, description in blocks
        ),
        parts=parts,
        workspace=workspace,
        operations=operations,
        counts=asdict(system.counts[function.name]),
    )
