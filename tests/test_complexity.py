"""Cyclomatic complexity of functions: none above 30, and above 20 with a written reason alone.

The rules are those of radon: a function starts at one; each branch, loop, ``else`` of a loop or ``try``, handler,
comprehension with its conditions, operand of ``and`` or ``or`` after the first, assertion and case adds one. Functions
within functions count on their own.
"""
# ruff: noqa: E501  # one row of the table a line

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.syntax import facts

PACKAGE = Path(__file__).parents[1] / "eomgen"
READABLE, HIGHEST = 20, 30
#: Reason for a complexity of 21 to 30 by file below eomgen and qualified name: a reader gains nothing from more functions.
REASONS = {
    "analysis/path_following.py::_followed": "the loop along a path, with interruption and limits, and one column of the result a line",
    "analysis/road_excitation.py::_over_profile": "checks of wheels, speeds and rates over one table of inputs; branches are comprehensions",
    "cli/linearize.py::linearize": "one optional product of the command after the other, checked, computed, written and printed",
    "codegen/convert.py::to_program": "one field of the Program a line; branches are comprehensions",
    "codegen/scheduling/plan.py::Plan.__init__": "attributes follow from one another in the order of the class's documentation; each takes one comprehension",
    "codegen/scheduling/rerolling.py::loop_iteration": "one walk over the operations of a loop, whose kernel, inputs and results grow together",
    "codegen/targets/c/printer.py::Printer._print": "one case for each kind of expression; a table would hide precedence",
    "formula/discontinuities.py::affine": "one case for each kind of node of a formula",
    "integrators/families/rosenbrock.py::Rosenbrock.work": "one part of the cost of a step a line, counted if the scene needs this part",
    "integrators/newton/elimination.py::eliminate": "Markowitz's loop over stages, whose candidates change with each pivot",
    "integrators/newton/matrix.py::iteration_terms": "one loop for each block of the iteration matrix, in the order of the formula above it",
    "integrators/newton/stages.py::stages": "minimum degree ordering: one loop over bodies whose neighbours change with each elimination",
    "integrators/stepper_data.py::method_data": "one key of the stepper's data a line; branches are optional keys",
    "linear/augmentation.py::driven_by": "blocks of joined matrices by rows and columns; most branches are comprehensions over names",
    "mechanics/constraints/rows.py::_holonomic": "one kind of row for each type of constraint, over local frames that all types share",
    "mechanics/derive.py::_assembled": "one field of the System a line; branches are comprehensions and defaults",
    "mechanics/forces/cosserat_beams.py::with_linear_moments": "one formula of matrices; branches are loops over six strains",
    "pipeline/equal_elements.py::equal_elements": "one condition after the other under which elements cannot be continued",
    "pipeline/readings.py::to_text.written": "one case for each kind of data of a record, most frequent first",
    "products/comparison/differences.py::_placed": "one decision on frames, from the poses that its branches share",
    "products/reliability/section/covariances.py::Covariances.read": "one check for each key of a covariance, in the order of messages",
    "products/reliability/section/reading.py::Processes._first": "one check for each fault of a correlated process, in the order of messages",
    "products/reliability/section/reading.py::Processes._group": "correlations, their repair and the processes that follow share one matrix",
    "products/reliability/section/reading.py::Processes._lag": "one check for each fault of a process that follows another, in the order of messages",
    "products/reliability/section/reading.py::Processes.read": "processes are read in groups of one covariance, and followers behind the processes that they follow",
    "products/reliability/vibration/study.py::random_vibration": "one stage of the study a line; parts would hand on ten intermediate results",
    "products/studies/work_precision/formulations.py::_in": "one case for each kind of data, as the recursion over a scene reads best in one place",
    "products/waves/section/reading.py::_irregular": "the stages from a spectrum to its components, each of which can end with a reported fault",
    "results/plots.py::chosen_curves": "one meaning of a name after the other, from exact to near",
    "results/scenery.py::scenery": "one list of the picture after the other, each a comprehension over drawn objects",
    "scene/joints/moved_inertia.py::MovableInertia._causes": "one cause of a singular inertia matrix after the other, by kinds of joints",
    "simulation/accuracy/error_estimation.py::_by_steps": "a decision tree over runs at other steps; each run is made only if the runs before leave a doubt",
    "simulation/accuracy/error_estimation.py::_by_tolerance": "the tolerances to try and the reasons to pass one over depend on the same facts of the run",
    "simulation/judgement/remarks.py::passed_springs": "one pass over springs; branches are comprehensions and cases without springs",
    "simulation/simulate.py::simulate": "the stages of a run in order; each hands its result to nearly all later ones",
    "simulation/stepping/chunks.py::run_chunks": "the loop of a run: the order of steps, checkpoints, Ctrl-C and faults of inputs is its content",
    "solvers/redundancy.py::redundancy": "a greedy choice of rows whose bases change with each row that is taken",
    "symbolic/calculus/loops.py::_combined_partials": "sums over directions, elements and results; branches are comprehensions",
    "symbolic/calculus/loops.py::_partials_along": "sums over directions, elements and results; branches are comprehensions",
    "symbolic/calculus/loops.py::map_partials": "the choice among three ways to differentiate a loop needs the same counts",
}

WORDS = re.compile(r"\b(?:if|for|while|else|except|and|or|assert|case)\b")  # each decision is written with one
Function = ast.FunctionDef | ast.AsyncFunctionDef


def _decisions(node: ast.AST) -> int:
    """Return the number of decisions that a node adds by itself, without its parts."""
    match node:
        case ast.If() | ast.IfExp() | ast.Assert():
            return 1
        case ast.For() | ast.AsyncFor() | ast.While():
            return 1 + bool(node.orelse)
        case ast.Try():
            return len(node.handlers) + bool(node.orelse)
        case ast.BoolOp():
            return len(node.values) - 1
        case ast.comprehension():
            return 1 + len(node.ifs)
        case ast.Match():
            rest = any(isinstance(case.pattern, ast.MatchAs) and case.pattern.pattern is None for case in node.cases)
            return len(node.cases) - rest
    return 0


def complexity(function: Function) -> int:
    """Return the complexity of a function, without functions and classes within it."""
    pending: list[ast.AST] = list(function.body)
    decisions = 0
    while pending:
        node = pending.pop()
        if isinstance(node, Function | ast.ClassDef):
            continue
        decisions += _decisions(node)
        if not isinstance(node, ast.Assert):  # radon counts no operands in it
            pending.extend(ast.iter_child_nodes(node))
    return 1 + decisions


def functions(node: ast.AST, scope: str = "") -> Iterator[tuple[str, Function]]:
    """Yield the functions below a node, at any depth of statements, with their qualified names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function | ast.ClassDef):
            name = f"{scope}.{child.name}" if scope else child.name
            if isinstance(child, Function):
                yield name, child
            yield from functions(child, name)
        elif isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from functions(child, scope)


def complex_functions(source: str, above: int, tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Yield the qualified name and the complexity of each function of a source that is more complex than a number."""
    if len(WORDS.findall(source)) < above:
        return
    lines = source.splitlines()
    for name, function in functions(tree):
        text = "\n".join(lines[function.lineno - 1 : function.end_lineno])
        if len(WORDS.findall(text)) >= above and (number := complexity(function)) > above:
            yield name, number


def measured() -> dict[str, int]:
    """Return the complexity of each function of the package that is more complex than ``READABLE``."""
    return {
        f"{file.relative_to(PACKAGE).as_posix()}::{name}": number
        for file, row in facts().items()
        for name, number in row.complexities
    }


def faults(now: Mapping[str, int], reasons: Mapping[str, str]) -> list[str]:
    """Return the functions that are too complex or lack a reason, and the reasons that are not needed."""
    too_complex = [f"{name}: {number}, {HIGHEST} allowed" for name, number in now.items() if number > HIGHEST]
    without = [f"{name}: {number}, and no reason" for name, number in now.items() if reasons.get(name, "") == ""]
    return [*too_complex, *without, *(f"{name}: a reason that is not needed" for name in reasons if name not in now)]


def test_complex_functions_are_few_and_have_a_reason() -> None:
    hint = "decompose into functions with one job each, or replace branches by a table; else write a reason"
    assert not faults(measured(), REASONS), hint
    assert len(REASONS) <= 40


def test_faults_name_functions_and_reasons() -> None:
    now = {"a.py::f": 31, "a.py::g": 21, "a.py::h": 22}
    assert faults(now, {"a.py::f": "long", "a.py::h": "cases", "b.py::f": "gone"}) == [
        "a.py::f: 31, 30 allowed",
        "a.py::g: 21, and no reason",
        "b.py::f: a reason that is not needed",
    ]


EXAMPLE = """
class Reader:
    async def read(self, rows=[a for a in b if c]):
        def inner():
            return x if y else z
        for row in rows:
            pass
        else:
            pass
        while True:
            break
        try:
            with a or b and c: pass
        except ValueError:
            pass
        else:
            assert a and b
        match row:
            case 1: pass
            case [2, *_]: pass
            case _: pass
        return lambda: [b for a in b if c if d]
"""


def test_decisions_are_counted_by_the_rules() -> None:
    # loop 2, while 1, try 2, operators 2, assertion 1, cases 2, comprehension 3; defaults are not of the body
    tree = ast.parse(EXAMPLE)
    assert dict(complex_functions(EXAMPLE, 0, tree)) == {"Reader.read": 14, "Reader.read.inner": 2}
    assert dict(complex_functions(EXAMPLE, 13, tree)) == {"Reader.read": 14}
    assert not dict(complex_functions(EXAMPLE, 14, tree))
