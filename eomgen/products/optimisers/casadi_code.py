"""The target ``casadi``: C with the interface of CasADi's external functions, values, Jacobians and Hessians.

Of a function NAME with inputs i and one output, CasADi looks for ``jac_NAME`` (of the inputs, and the output: a block
for each input), ``adj1_NAME`` (inputs, output, weights: a gradient for each input), ``fwd1_NAME`` (inputs, output,
a direction for each input: a derivative), and for the Jacobians of these: ``jac_adj1_NAME`` (the blocks of the Hessian
of weights . NAME), ``jac_jac_NAME`` (of the Jacobian's columns one after another) and ``jac_fwd1_NAME``. Blocks in
results that are arguments are empty. Sparsity is by compressed columns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import nearest, shown
from eomgen.codegen.folder import MANIFEST, manifest
from eomgen.codegen.program import Program
from eomgen.codegen.targets.c.interface import fingerprint
from eomgen.codegen.targets.c.naming import NAMES
from eomgen.codegen.targets.c.target import generate_files
from eomgen.codegen.targets.c.templates import environment
from eomgen.codegen.targets.target import Target
from eomgen.errors import Message, Problem, UsageError
from eomgen.products.optimisers.discrete_steps import chain_of, why_no_step
from eomgen.products.optimisers.functions import Exported, Pattern, Places, dense, empty, plain
from eomgen.system.terms import DIFFERENTIATED

#: Terms that are written by name alone.
_BY_NAME = ("frame_poses",)


@dataclass
class Texts:
    """Sparsity patterns and integer tables of one generated C file, by number; equal ones are stored once."""

    patterns: list[tuple[int, ...]] = field(default_factory=list)
    tables: list[tuple[int, ...]] = field(default_factory=list)

    def pattern(self, pattern: Pattern) -> int:
        """Return the number of a pattern."""
        return _number(self.patterns, pattern.casadi_sparsity)

    def table(self, numbers: Iterable[int]) -> int:
        """Return the number of a table."""
        return _number(self.tables, tuple(int(number) for number in numbers))

    def argument(self, name: str, pattern: Pattern) -> dict[str, Any]:
        """Return an input or output of a function of CasADi."""
        return {"name": name, "sparsity": self.pattern(pattern)}

    def component_derivatives(
        self, exported: Exported, first: bool = True, second: bool = True
    ) -> dict[str, Any] | None:
        """Return the products that give derivatives in components of q, with their tables replaced by numbers and
        sizes. None for functions without quaternions. `first` and `second`: whether tables of first and of second
        derivatives are kept."""
        if exported.components is None:
            return None
        written = {name: first if name == "first" else second for name in exported.components["tables"]}
        tables = {name: table for name, table in exported.components["tables"].items() if table and written[name]}
        numbered = {name: (self.table(chain(*table)), len(table)) for name, table in tables.items()}
        return {**exported.components, "tables": numbered}


def _number(known: list[tuple[int, ...]], item: tuple[int, ...]) -> int:
    if item not in known:
        known.append(item)
    return known.index(item)


def _penalty_of_jacobians(arguments: int, results: int) -> float:
    """Return the smallest ``jac_penalty`` with which CasADi takes the gradient of one weighted sum from ``adj1_NAME``.

    CasADi compares the penalty times a number of nonzeros with the number of directions, weighted by 0.33 for forward
    and 0.67 for reverse ones. ``fwd1_NAME`` evaluates the whole Jacobian, so from three directions on the call of
    ``jac_NAME`` is cheaper; with CasADi's own penalty of 2 each column of a Jacobian is a call of ``fwd1_NAME``.
    """
    return math.ceil(1e4 * max(1 / results, 0.67 / 0.33 / arguments)) / 1e4


def symbol_of(program: Program, name: str) -> str:
    """Return the name of a function in CasADi."""
    return f"{program.prefix}_casadi_{name}"


def _functions_of(program: Program, exported: Exported, texts: Texts) -> list[dict[str, Any]]:
    """Return descriptions, for the template, of the functions of CasADi that belong to one function: value, Jacobian,
    gradient, Hessian, and derivatives of rows. Patterns and tables are added to `texts`."""
    symbol, (output, rows) = symbol_of(program, exported.name), exported.output
    is_step = exported.name == "step"
    inputs = list[dict[str, Any]]()
    of_jacobian = {name: exported.jacobian.block(slice(0, rows), s) for name, s in exported.slices.items()}
    for name, size in exported.sizes.items():
        block = of_jacobian[name]
        tables = {"columns": block.columns, "rows": block.rows, "gathered": block.places}
        numbers = {key: texts.table(table) if len(table) else 0 for key, table in tables.items()}
        numbered = {"number": len(inputs), "count": len(block.rows)}
        inputs.append({"name": name, "size": size, **numbered, **numbers})
    function = {"name": exported.name, "inputs": inputs, "step": is_step, "first": exported.first}
    function |= {"components": texts.component_derivatives(exported), "bent": exported.work > exported.first}
    own_inputs = [texts.argument(name, dense(size)) for name, size in exported.sizes.items()]
    result = texts.argument(output, dense(rows))
    after, weights = texts.argument(f"out_{output}", empty(rows, 1)), texts.argument(f"adj_{output}", dense(rows))
    gradients = [texts.argument(f"adj_{name}", dense(size)) for name, size in exported.sizes.items()]
    unused = [texts.argument(f"out_adj_{name}", empty(size, 1)) for name, size in exported.sizes.items()]

    def entry(start: str, kind: str, inputs: Sequence[Any], outputs: Sequence[Any], **more: Any) -> dict[str, Any]:
        work = exported.work if kind in ("hessian", "step", "rows") or is_step else exported.first
        work = exported.work if exported.components else work
        work = 0 if kind == "value" else work + rows if kind == "rows" else work
        made = {"symbol": f"{start}{symbol}", "kind": kind, "inputs": inputs, "outputs": outputs, "work": work}
        return {**made, "function": function, "first_blocks": [], "second_blocks": [], "rows": rows, **more}

    first, second = _Blocks(texts), _Blocks(texts)
    for name, block in of_jacobian.items():
        first.add(f"jac_{output}_{name}", block, "J")
    for name, of_rows in exported.slices.items():
        for column_block, of_columns in exported.slices.items():
            second.add(f"jac_adj_{name}_{column_block}", exported.hessian.block(of_rows, of_columns), "H")
        size = exported.sizes[name]
        second.add(f"jac_adj_{name}_out_{output}", empty(size, rows), "")
        second.add(f"jac_adj_{name}_adj_{output}", of_jacobian[name].transpose, "J")
    forward = [texts.argument(f"fwd_{name}", dense(size)) for name, size in exported.sizes.items()]
    any_gradient = [f"res[{k}] != NULL" for k, item in enumerate(inputs) if item["count"]]
    taken = [*own_inputs, after]
    return [
        entry("", "step" if is_step else "value", own_inputs, [result]),
        entry("jac_", "jacobian", taken, first.outputs, **first.description),
        entry("adj1_", "adjoint", [*taken, weights], gradients, first_blocks=any_gradient),
        entry("jac_adj1_", "hessian", [*taken, weights, *unused], second.outputs, **second.description),
        *_row_functions(exported, entry, (own_inputs, after, forward), texts),
    ]


def _row_functions(
    exported: Exported, entry: Callable[..., dict[str, Any]], arguments: tuple[list[Any], Any, list[Any]], texts: Texts
) -> list[dict[str, Any]]:
    """Return descriptions of the CasADi functions for second derivatives of single rows: derivative along a direction,
    its Jacobian, and the Jacobian of the Jacobian.

    Empty if there are more than 20 000 numbers, since these would be written as tables.

    Parameters
    ----------
    entry : makes the description of a function
    arguments : inputs, the output, directions
    """
    (inputs, after, forward), (output, rows) = arguments, exported.output
    by_column = np.zeros((rows, sum(exported.sizes.values())), bool)
    by_column[exported.jacobian.rows, exported.jacobian.columns] = True
    both = by_column[:, exported.hessian.rows] & by_column[:, exported.hessian.columns]
    if np.count_nonzero(both) > 20_000:
        return []
    row, nonzero = np.nonzero(both)
    column, along = exported.hessian.rows[nonzero], exported.hessian.columns[nonzero]
    positions = exported.hessian.places[nonzero]
    of_jacobian, of_direction = _Blocks(texts), _Blocks(texts)
    for name, of_columns in exported.slices.items():
        size, in_columns = exported.sizes[name], (of_columns.start <= column) & (column < of_columns.stop)
        sums = []
        for number, (column_block, of_directions) in enumerate(exported.slices.items()):
            kept = in_columns & (of_directions.start <= along) & (along < of_directions.stop)
            numbers = row[kept], column[kept] - of_columns.start, along[kept] - of_directions.start, positions[kept]
            of_jacobian.add_rows(
                f"jac_jac_{output}_{name}_{column_block}", (rows, size, exported.sizes[column_block]), numbers
            )
            sums.append((number, *numbers))
        of_jacobian.add(f"jac_jac_{output}_{name}_out_{output}", empty(rows * size, rows), "")
        of_direction.add_sums(f"jac_fwd_{output}_{name}", (rows, size), sums)
    of_direction.add(f"jac_fwd_{output}_out_{output}", empty(rows, rows), "")
    for name, of_columns in exported.slices.items():
        block = exported.jacobian.block(slice(0, rows), of_columns)
        of_direction.add(f"jac_fwd_{output}_fwd_{name}", block, "J")
    derivative = texts.argument(f"fwd_{output}", dense(rows))
    unused = [texts.argument(f"out_jac_{output}_{name}", empty(rows, size)) for name, size in exported.sizes.items()]
    fixed = texts.argument(f"out_fwd_{output}", empty(rows, 1))
    taken = [*inputs, after, *forward]
    first = entry("fwd1_", "forward", taken, [derivative], first_blocks=["res[0] != NULL"])
    return [
        first,
        entry("jac_jac_", "rows", [*inputs, after, *unused], of_jacobian.outputs, **of_jacobian.description),
        entry("jac_fwd1_", "rows", [*taken, fixed], of_direction.outputs, **of_direction.description),
    ]


class _Blocks:
    """Results of one CasADi function that are blocks of derivatives, in order: ``outputs`` with the sparsity, and
    ``blocks`` with the source of the numbers."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts
        self.outputs: list[dict[str, Any]] = []
        self.blocks: list[dict[str, Any]] = []

    def add(self, name: str, pattern: Pattern, source: str) -> None:
        """Add a block whose nonzeros are among the numbers ``source``."""
        count = len(pattern.rows)
        table = self.texts.table(pattern.places) if count else 0
        self._add(name, pattern, count=count, table=table, source=source)

    def _add(self, name: str, pattern: Pattern, **more: Any) -> None:
        described = {"number": len(self.outputs), "count": 0, "source": "", "rows": [], "nonzeros": 0}
        self.blocks.append({**described, **more})
        self.outputs.append(self.texts.argument(name, pattern))

    def add_rows(self, name: str, shape: tuple[int, int, int], numbers: Sequence[Places]) -> None:
        """Add the derivatives of a block's columns, one after another, which are second derivatives of single rows.

        Parameters
        ----------
        shape : rows, columns, directions
        numbers : row, column, direction and place among the numbers of the row's Hessian, of each nonzero
        """
        rows, width, directions = shape
        row, column, along, position = numbers
        flat, order = row + rows * column, np.lexsort((row + rows * column, along))
        pattern = Pattern((rows * width, directions), flat[order], along[order], np.arange(len(order)))
        targets = np.empty(len(order), np.int64)
        targets[order] = np.arange(len(order))
        by_row = np.argsort(row, kind="stable")
        starts = np.searchsorted(row[by_row], np.arange(rows + 1))
        tables = {"starts": starts, "targets": targets[by_row], "numbers": position[by_row]}
        self._add(name, pattern, rows=[self._number_tables(tables)] if len(order) else [])

    def _number_tables(self, tables: Mapping[str, Places]) -> dict[str, int]:
        return {name: self.texts.table(table) for name, table in tables.items()}

    def add_sums(self, name: str, shape: tuple[int, int], parts: Sequence[tuple[Any, ...]]) -> None:
        """Add a block (rows, columns) whose entries are sums of second derivatives of rows, multiplied by directions.
        `parts` have the number of the argument whose direction it is, and numbers as in ``add_rows``."""
        rows, width = shape
        flat = np.unique(np.concatenate([row + rows * column for _, row, column, _, _ in parts]))
        pattern = Pattern((rows, width), flat % rows, flat // rows, np.arange(len(flat)))
        rows_of_parts: list[dict[str, Any]] = []
        for number, row, column, along, position in parts:
            by_row = np.argsort(row, kind="stable")
            tables = {"starts": np.searchsorted(row[by_row], np.arange(rows + 1))}
            tables["targets"] = np.searchsorted(flat, (row + rows * column)[by_row])
            tables |= {"numbers": position[by_row], "along": along[by_row]}
            rows_of_parts += [{**self._number_tables(tables), "direction": number}] if len(row) else []
        self._add(name, pattern, rows=rows_of_parts, nonzeros=len(flat))

    @property
    def description(self) -> dict[str, Any]:
        """The blocks, with the conditions, in C, that one of first or of second derivatives is asked for."""
        asked = {"J": list[str](), "H": list[str](), "": list[str]()}
        for block in (block for block in self.blocks if block["count"]):
            asked[block["source"]].append(f"res[{block['number']}] != NULL")
        return {"blocks": self.blocks, "first_blocks": asked["J"], "second_blocks": asked["H"]}


def twice_differentiated(program: Program) -> Program:
    """Return a Program without first derivatives of functions that have no second ones in its scene."""
    known = set(program.function_names)
    single = {f"{name}_derivatives" for name in DIFFERENTIATED if f"{name}_hessian" not in known}
    return replace(program, functions=tuple(item for item in program.functions if item.name not in single))


def exported_functions(program: Program) -> list[Exported]:
    """Return the functions of a model with derivatives."""
    known = program.function_names
    there = [name for name in DIFFERENTIATED if {name, f"{name}_derivatives", f"{name}_hessian"} <= set(known)]
    return [plain(program, name) for name in there if program.function(name).outputs]


def files_of(program: Program, method: str | None) -> dict[str, str]:
    """Return the files of a Program for CasADi, text by name: the model's C, ``<prefix>_casadi.c``, README.md, the
    manifest. Raises UsageError if the terms name no function with derivatives.

    Parameters
    ----------
    method : of the function ``step``; None: the default
    """
    program = twice_differentiated(program)
    functions = exported_functions(program)
    step = chain_of(program, functions, method, ("u", "p", "t", "h"))
    whole = generate_files(replace(program, uniform=True))
    files = {name: text for name, text in whole.items() if name not in ("main.c", "README.md", MANIFEST)}
    exported = [*functions, *([] if step is None else [step.export()])]
    if not exported:
        hint = "inverse_dynamics; residual and constraint, of scenes with constraints"
        fault = f"{program.prefix} has none of the functions that the terms name [E2195]"
        raise UsageError(Problem("terms", fault, hint))
    texts = Texts()
    entries = [entry for item in exported for entry in _functions_of(program, item, texts)]
    longest = max(1, *(size for item in exported for size in item.sizes.values()), *(i.output[1] for i in exported))
    names: dict[str, Any] = {"program": program, "prefix": program.prefix, "functions": []}
    for item in functions:
        entries_of_item = [entry for entry in entries if entry["function"]["name"] == item.name]
        names["functions"].append({**entries_of_item[0]["function"], "output": item.output[0]})
    names |= {"entries": entries, "sparsities": texts.patterns, "tables": texts.tables, "longest": longest}
    names |= {"step": step}
    why = str(Message(why_no_step(program))) or "functions of a step are not among the terms"
    absent = {} if step is not None else {"step": why}
    name = f"{program.prefix}_casadi.c"
    files[name] = environment().get_template("optimisers/casadi.c.jinja").render(**names)
    sources = sorted(file for file in files if file.endswith(".c"))
    library = f"lib{program.prefix}_casadi.so"
    command = f"cc -std=c99 -O2 -ffp-contract=off -fPIC -shared {' '.join(sources)} -o {library} -lm"
    signatures = [
        {
            "symbol": symbol_of(program, item.name),
            "inputs": dict(item.sizes),
            "output": dict([item.output]),
            "jacobian": len(item.jacobian.rows),
            "hessian": len(item.hessian.rows),
            "options": {"jac_penalty": _penalty_of_jacobians(sum(item.sizes.values()), item.output[1])},
        }
        for item in exported
    ]
    texts_of_readme = {"command": command, "library": library, "signatures": signatures, "absent": absent}
    readme = environment().get_template("optimisers/README.md.jinja").render(**names, **texts_of_readme)
    files["README.md"] = readme
    mark = fingerprint(files)
    files[MANIFEST] = manifest(program, files, fingerprint=mark, compile=command, casadi=signatures, absent=absent)
    return files


def check_named(terms: Sequence[str] | None) -> None:
    """Raise UsageError for a list without names."""
    if terms is not None and not terms:
        hint = "forward_dynamics; all of the scene without terms"
        raise UsageError(Problem("terms", "a list of functions is needed, and this one is empty [E2188]", hint))


def needed_terms(terms: Sequence[str] | None) -> list[str]:
    """Return the terms of a model that the folder needs: each named function with first and second derivatives. All
    functions with derivatives by default, except functions that are written by name alone.

    Raises
    ------
    UsageError
        A term without derivatives in all arguments, or an empty list of terms.
    """
    check_named(terms)
    chosen = [name for name in DIFFERENTIATED if name not in _BY_NAME] if terms is None else list(terms)
    for name in chosen:
        if name not in DIFFERENTIATED:
            fault = f"the target casadi writes functions with derivatives, and {shown(str(name))} has none [E0939]"
            raise UsageError(Problem("terms", fault, nearest(str(name), DIFFERENTIATED)))
    return [term for name in chosen for term in (name, f"{name}_derivatives", f"{name}_hessian")]


CASADI = Target("casadi", "C for CasADi", NAMES, files_of, terms=needed_terms, takes_method=True)
