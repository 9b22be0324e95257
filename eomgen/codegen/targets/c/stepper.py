"""Context of the stepper templates: sizes, choices, calls and unrolled statements of a Program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from eomgen.codegen.program import Expression, Program, ProgramFunction, Statement
from eomgen.codegen.scheduling.matrix_loops import assembly
from eomgen.codegen.targets.c.printer import BranchingPrinter, Printer, indent_lines, number
from eomgen.codegen.targets.c.tables import Lookup, offset
from eomgen.integrators.newton.matrix import WEIGHTS

#: Nonzeros of B, and velocity components, up to which the increment of the configuration is written out.
WRITTEN_OUT = (300, 100)
#: Number of statements of an elimination up to which it is one function, and number of statements per function of a
#: longer elimination. In one long function gcc keeps stored factors in registers for rows far below, and spills
#: registers: 4863 statements take 1.6 times as long as in parts of 200, and 1.9 times as long to compile.
_WHOLE, _PART = 1000, 200


#: Products of a series up to which each sum of products has a text of its own, and the sums stay in registers.
FEW_PRODUCTS = 40


def row_of_factors(program: Program) -> str:
    """Return the text of the distance of the coefficients of a factor: whole vectors, except in lanes."""
    method = program.method
    padded = method["room"] != method["products"]
    return f"{program.prefix.upper()}_ROOM" if padded else str(method["room"])


def stepper_names(program: Program) -> dict[str, Any]:
    """Return the names that every template of a stepper may use, in addition to ``program``.

    ``P``, ``N``: prefix of functions and of constants; ``nq, nv, nz, nu``: sizes; ``method``; ``turns``: numbers in q
    that are stepped without whole turns; ``wrapped``: the step is called by a step that handles turns or angles;
    ``begin``: start of a run; ``remembers``: a state contains the inputs and parameters of its accelerations;
    ``rotations``: runs of the configuration that are rotations or poses; ``blocks`` of a state, with sizes;
    ``kernels``: functions on the groups; ``number, call, copy_state, finite, row_unit``: see ``FunctionCalls``. With
    constraints also ``un``: the unknowns; ``nl, nh``: numbers of rows, and of holonomic rows;
    ``ni``: number of independent components;
    ``point``: arguments.
    """
    prefix, sizes, method = program.prefix, program.sizes, program.method
    calls = FunctionCalls(program)
    wrapped = bool(method["turning"] or program.angles)
    names: dict[str, Any] = {
        "P": prefix,
        "N": prefix.upper(),
        "nq": sizes["q"],
        "nv": sizes["v"],
        "nz": sizes["z"],
        "nu": sizes["u"],
        "method": method,
        "turns": method["turning"],
        "wrapped": wrapped,
        "begin": f"{prefix}_{'begin' if wrapped else 'initialize'}",
        "remembers": method["remembers"],
        "nl": sum(size for name, size in method["row"] if name == "lam"),
        "rotations": [run for run in method["lie"]["runs"] if run["group"] != "R"],
        "blocks": [(block, sizes[block]) for block in ("q", "v", "z") if block != "z" or sizes["z"]],
        "kernels": _kernels(method),
        "number": calls.number,
        "call": calls.call,
        "copy_state": calls.copy_state,
        "finite": calls.finite,
        "row_unit": calls.row_unit,
        "good_settings": _good_settings(program),
        **method["choices"],
    }
    if "unknowns" in method:
        un = method["unknowns"]
        names |= {"un": un, "nh": un["holonomic"], "ni": un["v"] - un["lam"], "point": POINT}
    if "solver" in method:
        names |= _linear_system(program)
    if "form" in method:
        names |= _newton(program) | {
            "differ": calls.differ,
            "copy_parameters": calls.copy_parameters,
            "evaluate_residual": calls.residual,
        }
    if "room" in method:
        texts = {"angle": "angles and quaternions, which 1 rad is large for", "length": "lengths"}
        kinds = ", and ".join(texts[kind["name"]] for kind in method["kinds"])
        names |= {
            "call_series": calls.series,
            "series": {item.name: item for item in program.series},
            "norm": calls.norm,
            "kinds_compared": kinds,
            "room": row_of_factors(program),
            "few_products": FEW_PRODUCTS,
        }
    return names


def _linear_system(program: Program) -> dict[str, Any]:
    """Return the facts by which templates choose the linear systems of implicit steps. ``solver``; ``scaled``: kinetic
    energy measures the unknowns; ``assembled``: gives the function that fills the iteration matrix; ``partials``:
    position of the first number of the matrix; ``entries_are_finite``; ``unrolled`` rows and ``substitution`` of an
    elimination written out; ``kinds`` of an elimination by fronts."""
    solver = program.method["solver"]
    return {
        "solver": solver,
        "scaled": bool(solver["inertia"]),
        "assembled": partial(_assembly_text, solver),
        "partials": {name: f"work->numbers{offset(start)}" for name, (start, _) in solver["blocks"].items()},
        "entries_are_finite": f"{program.prefix}_finite(work->entries, {solver['nonzeros']})",
        **_elimination(program),
    }


def _newton(program: Program) -> dict[str, Any]:
    """Return the facts by which templates choose steps with iterations.

    ``direct``: accelerations are a function of the model; ``perturbed``: positions alone are constrained (index 3);
    ``held``: velocities are brought onto the constraints in each iteration; ``moved``: statements of the increment, if
    written out; ``violation``: of row i of Phi; ``jacobian``: B at the start of a step; ``tolerance`` and ``rounding``
    of velocities, ``multiplier_rounding``; ``iterate``: arguments.
    """
    method, un = program.method, program.method["unknowns"]
    constrained, stabilised, holonomic = un["lam"] > 0, un["eta"] > 0, un["holonomic"] > 0
    functions, quaternions = program.function_names, frozenset(method["quaternions"])
    unit = [int(i in quaternions) for i in range(program.sizes["q"])]
    return {
        "direct": not constrained and "forward_dynamics" in functions,
        "perturbed": holonomic and not stabilised,
        "held": constrained and (stabilised or not holonomic) and "constraint_velocity" in functions,
        "moved": _increment(method),
        "iterate": ITERATE,
        "violation": f"work->right[{un['phi']} + i]" if stabilised else "work->constraint[i]",
        "jacobian": "work->jacobian" if stabilised else "NULL",
        "right_is_finite": " && ".join(
            f"{program.prefix}_finite(work->right{offset}, {size})"
            for offset, size in (("", un["v"]), (f" + {un['first_z']}", program.sizes["z"]))
            if size
        ),
        "speed_rounding": f"K(4.0) * {program.prefix}_EPSILON * work->speed[0]",
        "unit_numbers": unit,
        "spacing": f"({Lookup('unit', unit).at()} ? K(1.0) : EG_ABS(q[i]))" if quaternions else "EG_ABS(q[i])",
        **_tolerances(program),
    }


def _good_settings(program: Program) -> str:
    """Return the condition that settings meet the bounds of the method."""

    def text(side: str | float) -> str:
        if isinstance(side, str):
            return " + ".join(f"s->{name}" for name in side.split(" + "))
        return str(side) if isinstance(side, int) else FunctionCalls.number(side)

    return " && ".join(
        f"{program.prefix}_finite(&s->{bound['left']}, 1)"
        if bound["relation"] == "finite"
        else f"{text(bound['left'])} {bound['relation']} {text(bound['right'])}"
        for bound in program.method["bounds"]
    )


def _tolerances(program: Program) -> dict[str, str]:
    """Return C texts of ``tolerance`` and ``rounding`` of velocities, and of ``multiplier_rounding``. Velocities are
    measured by kinetic energy, or if M is not known by the largest component of the same kind."""
    un, scaled = program.method["unknowns"], bool(program.method["solver"]["inertia"])
    kind = "0" if scaled else Lookup("angular", program.method["angular"]).at()
    rounding = f"K(4.0) * {program.prefix}_EPSILON * work->speed[{kind}]"
    with_positions = f"{rounding} + work->position_rounding" if un["holonomic"] else rounding
    if un["holonomic"] and not un["eta"]:
        tolerance = "(least * work->speed[0] + work->position_rounding) * work->unit[i]"
        return {
            "tolerance": tolerance,
            "rounding": f"({with_positions}) * work->unit[i]",
            "multiplier_rounding": with_positions,
        }
    if scaled:
        tolerance, rounding = "least * work->speed[0] * work->unit[i]", f"({rounding}) * work->unit[i]"
    else:
        tolerance = f"least * work->speed[{kind}]"
    return {"tolerance": tolerance, "rounding": rounding, "multiplier_rounding": with_positions}


def _elimination(program: Program) -> dict[str, Any]:
    """Return the data by which templates print an elimination with pivots chosen beforehand. For one that is written
    out, ``unrolled`` (rows by function, with the test of each pivot) and ``substitution`` (text, and text of each
    unknown by column); else ``kinds`` of fronts, empty for other eliminations."""
    solver, un = program.method["solver"], program.method["unknowns"]
    data = solver.get("elimination", {})
    smallest = f"{program.prefix}_SMALLEST_PIVOT"

    def size(upper: Sequence[tuple[int, str]]) -> str:
        return " + ".join(f"EG_ABS(a{slot}){other_unit}" for slot, other_unit in upper)

    def is_large(diagonal: int, unit: str, upper: Sequence[tuple[int, str]]) -> str:
        """Return the test of a pivot, a_diagonal, against the other entries of the row, in the units of the
        unknowns."""
        if not upper:
            return f"EG_ABS(a{diagonal}) > K(0.0)"
        return f"EG_ABS(a{diagonal}){unit} > {smallest} * ({size(upper)})"

    def pivot_test(diagonal: int, unit: str, upper: Sequence[tuple[int, str]]) -> dict[str, str]:
        """Return the test of a pivot, and if no other factorization follows, the pivot that takes its place."""
        if solver["fallback"] or not solver["iterated"] or not upper:
            return {"is_large": is_large(diagonal, unit, upper)}
        pivot = f"{program.prefix}_pivot(a{diagonal}, {unit.removeprefix(' * ') or 'K(1.0)'}, {size(upper)})"
        return {"pivot": pivot, "is_large": is_large(diagonal, "", ())}

    if "unrolled" in data:
        rows, columns = data["rows"], data["columns"]
        units = [f" * unit[{column}]" if column < un["size"] else " * K(1.0)" for column in columns]
        unrolled_rows = []
        forward, backward = [], []
        upper = [{column: slot for slot, column in row["upper"]} for row in data["unrolled"]]
        for k, row in enumerate(data["unrolled"]):
            if "sum" in row:  # against the summands, in the units of the row
                summands = [(slot, "") for slot in (row["sum"], *row["within"])]
                test = {"is_large": is_large(row["diagonal"], "", summands)}
            else:
                test = pivot_test(row["diagonal"], units[k], [(slot, units[column]) for slot, column in row["upper"]])
            unrolled_rows.append({**row, "row": rows[k], "column": columns[k], **test})
            right = _right_side(rows[k], un, plain=solver["plain"])
            if "sources" in row:
                forward += _forward_with_sources(k, right, row, data, upper)
            else:
                taken = "".join(f" - F[{slot}] * y{column}" for slot, column in row["lower"])
                forward.append(f"const real y{k} = {right}{taken};")
            taken = "".join(f" - F[{slot}] * x{column}" for slot, column in reversed(row["upper"]))
            backward.append(f"const real x{k} = y{k} * F[{row['diagonal']}]{taken};")
        solution = [(column, f"x{k}") for k, column in reversed(list(enumerate(columns))) if column < un["size"]]
        text = indent_lines([*forward, *reversed(backward)], 1)
        return {"unrolled": in_parts(unrolled_rows), "substitution": {"text": text, "solution": solution}}
    kinds = []
    for kind in data.get("kinds", ()):
        rows = []
        for row in kind["rows"]:
            test = {}
            if "diagonal" in row:
                units = [f" * {_front_place(local)}" if solver["inertia"] else "" for local in row["columns"]]
                test = pivot_test(row["diagonal"], units[0], list(zip(row["upper"], units[1:], strict=True)))
            rows.append({**row, **test})
        kinds.append({**kind, "parts": in_parts(rows)})
    return {"kinds": kinds}


def in_parts(rows: Sequence[Mapping[str, Any]]) -> list[list[Mapping[str, Any]]]:
    """Return the rows of an elimination in groups, one for each C function, by the number of statements."""
    statements = [_statements(row) for row in rows]
    limit = _PART if sum(statements) > _WHOLE else _WHOLE
    parts: list[list[Mapping[str, Any]]] = [[]]
    taken = 0
    for row, count in zip(rows, statements, strict=True):
        if parts[-1] and taken + count > limit:
            parts.append([])
            taken = 0
        parts[-1].append(row)
        taken += count
    return parts


def _statements(row: Mapping[str, Any]) -> int:
    """Return the number of statements that eliminate a row."""
    updates = sum(1 + len(taken["updates"]) + len(taken.get("outside", ())) for taken in row["taken"])
    return len(row["loads"]) + len(row.get("upper", ())) + updates


def _forward_with_sources(
    k: int, right: str, row: Mapping[str, Any], data: Mapping[str, Any], upper: Sequence[Mapping[int, int]]
) -> list[str]:
    """Return the C statements that substitute forward in row ``k`` of an elimination of links with sources. The
    statements declare sources ``f`` on links, the source ``n`` of the row, and the whole row ``y``. ``right`` is the
    text of the right-hand side; ``data`` the elimination; ``upper`` maps columns to slots of the factors of each
    row."""
    lines = []
    for column, source, earlier in row["sources"]:
        entry = [f"{'-' if source < 0 else ''}r[{abs(source) - 1}]"] if source else []
        left = [f"(F[{upper[e][column]}] * f{e}_{k} - F[{upper[e][k]}] * f{e}_{column})" for e in earlier]
        lines.append(f"const real f{k}_{column} = {' + '.join(entry + left)};")
    taken = ""
    for slot, e in row["lower"]:
        if data["groups"][e] == data["groups"][k] >= 0:
            taken += f" - F[{slot}] * n{e} - F[{data['unrolled'][e]['kept']}] * f{e}_{k}"
        else:
            taken += f" - F[{slot}] * y{e}"
    if data["groups"][k] < 0:
        return [*lines, f"const real y{k} = {right}{taken};"]
    sources = "".join(f" + f{k}_{column}" for column, _, _ in row["sources"])
    return [*lines, f"const real n{k} = {right}{taken};", f"const real y{k} = n{k}{sources};"]


def _front_place(local: Sequence[int]) -> str:
    """Return the text of a position: of the front, or of the k-th front that receives contributions."""
    front, offset = local
    return f"y{front if front else ''}[{offset}]"


def _right_side(row: int, un: Mapping[str, int], *, plain: bool) -> str:
    """Return the C text of the right-hand side of a row: ``plain`` as it is, else times the factor for this kind of
    row. Rows beyond the unknowns ``un`` have the right-hand side 0."""
    if plain:
        return f"r[{row}]"
    if row >= un["size"]:
        return "K(0.0)"
    kind = "r" if row < un["v"] or row >= un["first_z"] else "phi" if row < un["w"] else "w"
    return f"scale->{kind} * r[{row}]"


def _kernels(method: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the group functions that a stepper calls, as mappings with C texts: name, description, arguments and
    ``body``. Tangents of groups that the linear solver does not need are left out."""
    tangents = {tangent["group"] for tangent in method["solver"]["tangents"]} if "solver" in method else set()
    result = []
    for kernel in method["lie"]["kernels"]:
        operation, _, group = kernel["name"].partition("_")
        if operation == "tangent" and group not in tangents:
            continue
        statements = [Statement("let", (index, value)) for index, value in kernel["statements"]]
        statements += [Statement("out", (0, index, value)) for index, value in enumerate(kernel["results"])]
        printer = BranchingPrinter({name: f"{name}[{{}}]" for name, _ in kernel["inputs"]}, ["out"])
        arguments = ", ".join([*(f"const real *{name}" for name, _ in kernel["inputs"]), "real *out"])
        result.append(
            {
                "name": kernel["name"],
                "description": kernel["description"],
                "arguments": arguments,
                "body": indent_lines(printer.lines(statements), 1),
            }
        )
    return result


def _assembly_text(solver: Mapping[str, Any]) -> dict[str, Any]:
    """Return the C ``text`` that assembles an iteration matrix, and whether ``looped``. ``numbers`` is the name of the
    array with the partial derivatives, ``workspace`` the number of values that are needed."""
    made = assembly(solver)
    numbers = "numbers" if made.looped else "w"
    inputs: dict[str, str | Sequence[str]] = {
        "numbers": f"{numbers}[{{}}]",
        "tangents": "T[{}]",
        "jacobian": "jacobian[{}]",
    }
    inputs["weights"] = [f"c->{name}" for name in WEIGHTS]
    text = indent_lines(Printer(inputs, ["S", "w"]).lines(made.statements), 1)
    return {"text": text, "looped": made.looped, "numbers": numbers, "workspace": made.workspace}


def _increment(method: Mapping[str, Any]) -> str:
    """Return the statements D = E - offset - W B_n^T eta if few, empty if loops are to be printed."""
    un, nonzeros = method["unknowns"], method["solver"]["B"]
    if len(nonzeros) > WRITTEN_OUT[0] or un["v"] > WRITTEN_OUT[1]:
        return ""
    values: list[Expression] = [("in", "unknown", i) for i in range(un["v"])]
    if method["choices"]["offset"]:
        values = [("SUB", value, ("in", "offset", i)) for i, value in enumerate(values)]
    for index, (row, column) in enumerate(nonzeros if un["eta"] else ()):
        if row < un["holonomic"]:
            eta = ("in", "unknown", un["v"] + un["lam"] + row)
            values[column] = ("SUB", values[column], ("MUL", ("in", "jacobian", index), eta))
    printer = Printer({name: f"work->{name}[{{}}]" for name in ("unknown", "offset", "jacobian")}, ["work->increment"])
    return indent_lines(printer.lines([Statement("out", (0, i, value)) for i, value in enumerate(values)]), 1)


#: Arguments of calls of model functions by implicit steppers: the iterate.
ITERATE = {
    "p": "p", "t": "t", "a": "work->vdot", "base": "&work->base",
    **{block: f"work->{block}" for block in ("q", "v", "z", "lam", "u")},
}  # fmt: skip  # a table
#: Arguments of coordinate partitioning: a point on the way, at the accelerations of the dependent components
#: alone.
POINT = {**ITERATE, "q": "q", "v": "v", "a": "work->offset", "lam": "work->no_lam"}


class FunctionCalls:
    """Calls of functions, as texts: a stepper never assumes the arguments or results of a function."""

    def __init__(self, program: Program) -> None:
        self.program = program

    @staticmethod
    def number(value: float) -> str:
        """Return a constant."""
        return f"K({number(value)})"

    def call(self, name: str, arguments: Mapping[str, str], results: str | Mapping[str, str]) -> str:
        """Return the C statement that calls a function of the model.

        Parameters
        ----------
        name : of the function, without prefix
        arguments : the text for each input block
        results : the text for each output, or one text for a function with one output
        """
        function = self.program.function(name)
        outputs = [results if isinstance(results, str) else results[output.name] for output in function.outputs]
        return (
            f"{self.program.prefix}_{name}({', '.join([*(arguments[block] for block in function.inputs), *outputs])});"
        )

    def finite(self, owner: str, parts: str = "q v z") -> str:
        """Return the C condition that parts of a state are finite; ``owner`` is the text before a part, as ``work->``.
        ``parts`` are names of blocks with spaces between; names that begin with a have the size of v."""
        sizes, test = self.program.sizes, f"{self.program.prefix}_finite"
        sized = [(part, sizes["v" if part[0] == "a" else part[0]]) for part in parts.split()]
        return " && ".join(f"{test}({owner}{part}, {size})" for part, size in sized if size)

    def row_unit(self, row: str) -> str:
        """Return the unit of a row in the whole matrix: by a macro if rows of w share units with rows of Phi."""
        un = self.program.method["unknowns"]
        is_shifted = un["w"] < un["first_z"] and un["holonomic"] > un["skipped"]
        return f"{self.program.prefix}_ROW_UNIT({row})" if is_shifted else f"unit[{row}]"

    def residual(self) -> str:
        """Return the call of the equations of a step at the iterate: r, Phi and w to work->right.

        With positions alone constrained (index 3), w takes the place of Phi in the right-hand side, so Phi is written
        to an array of its own.
        """
        un = self.program.method["unknowns"]
        if not un["lam"] and not self.program.sizes["z"]:
            return self.call("residual", ITERATE, "work->right")
        results = {"r": "work->right", "zdot": f"work->right + {un['first_z']}"}
        if un["eta"] or not un["holonomic"]:
            results |= {"Phi": f"work->right + {un['phi']}", "w": f"work->right + {un['w']}"}
        else:
            results |= {"Phi": "work->constraint", "w": f"work->right + {un['v']}"}
        return self.call("equations", ITERATE, results)

    def differ(self, left: str, right: str) -> str:
        """Return the condition that two places hold other parameters of generalized-alpha."""
        return " || ".join(f"{left}{name} != {right}{name}" for name in self.program.method["parameters"])

    def copy_parameters(self, left: str, right: str, indent: str) -> str:
        """Return the statements that copy these parameters."""
        return f"\n{indent}".join(f"{left}{name} = {right}{name};" for name in self.program.method["parameters"])

    def copy_state(self, to: str, source: str) -> str:
        """Return the C statement that copies a state ``source`` to ``to``. If a state remembers the arguments of the
        accelerations (``conditions``), these are not copied."""
        if not any(item["group"] == "conditions" for item in self.program.method["state"]):
            return f"{to} = {source};"
        pointers = [text[1:] if text[0] == "*" else f"&{text}" for text in (to, source)]
        return f"memcpy({', '.join(pointers)}, offsetof({self.program.prefix}_state, conditions));"

    def series(self, function: ProgramFunction) -> str:
        """Return the C call of a function of the Taylor recurrence on arrays of the stepper's workspace."""
        sizes, method = self.program.sizes, self.program.method
        room = row_of_factors(self.program)
        texts = {"p": "p", "t": "work->begin + work->begin_low", "t_k": "&t_k", "order": "order"}
        for block in ("q", "v", "z"):
            texts |= {block: f"work->{block}", f"{block}_1": f"work->{block}_rate"}
            texts[f"{block}_k"] = f"work->{block}_row + k * {sizes[block]}"
            texts[f"{block}_next"] = f"work->{block}_row + (k + 1) * {sizes[block]}"
        for name in ("left", "right", "kept"):
            texts |= {name: f"work->{name}", f"{name}_0": f"work->{name}", f"{name}_k": f"work->{name} + k * {room}"}
        size = method.get("previous", 0)
        texts |= {"previous_0": "work->previous", "previous_k": f"work->previous + k * {size}"}
        texts["previous"] = f"work->previous + (k - 1) * {size}"
        texts |= {name: f"work->{name}" for name in ("u", "followed", "extent")}
        texts["sums"] = "sums" if method["products"] <= FEW_PRODUCTS else "work->sums"
        arguments = [*function.inputs, *(output.argument for output in function.outputs)]
        return f"{self.program.prefix}_{function.name}({', '.join(texts[name] for name in arguments)});"

    def norm(self, kind: Mapping[str, Any], block: str, row: str) -> str:
        """Return the largest magnitude of the components of a kind in a row of a block, q or v."""
        prefix, members = self.program.prefix, kind[block]
        if kind[f"{block}_adjacent"]:
            return f"{prefix}_largest({row}{f' + {members[0]}' if members[0] else ''}, {len(members)})"
        return f"{prefix}_norm({row}, {prefix}_{kind['name']}_{block}, {len(members)})"
