"""Parser of a user's formula: a whitelist over Python's syntax tree gives a closed set of nodes; no evaluation.

Every identifier gets a prefix before the text is parsed, so Python's and C's keywords are ordinary names here;
only ``if else and or not`` are words of the language.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Collection
from typing import Any

from eomgen.base.data import replace
from eomgen.base.messages import counted, is_legal, listed, nearest, shown
from eomgen.base.products import fault_of_absent
from eomgen.formula.evaluate import apply, symbols
from eomgen.formula.nodes import Application, EntryQuantity, Formula, Number, Operation, Symbol, quantity_of
from eomgen.formula.units.parser import product_hint
from eomgen.formula.words import FUNCTIONS, WORDS, Word, added_word, own_words
from eomgen.scene.formula.definitions import NamedExpression
from eomgen.scene.formula.scope import (
    DERIVATIVES,
    ENERGIES,
    GAUSSIAN,
    HERE,
    IN_FRAME,
    LOCAL,
    PLACE,
    QUANTITIES,
    REACTION_PARTS,
    SceneNames,
    Scope,
    function_hint,
    kind_hint,
    name_hint,
    parts_hint,
)
from eomgen.scene.formula.tokens import (
    DEGREES,
    DEPTH,
    IN_RADIANS,
    ON_A_POINT,
    TOO_DEEP,
    FormulaError,
    FormulaText,
)
from eomgen.scene.joint_types import JOINTS

LARGEST_EXPONENT = 64.0
_BINARY = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.Pow: "pow"}
#: Names with a meaning in some scopes: the kind of symbol that such a scope allows, the meaning, and the symbol.
_OF_SCOPES = {
    PLACE: ("place", "place along the beam", Symbol("place")),
    GAUSSIAN: ("gaussian", "Gaussian process", Symbol("gaussian")),
    **{
        name: ("frame", "coordinate of the second frame's origin", Symbol("local", "position", number))
        for number, name in enumerate(IN_FRAME)
    },
}
_COMPARISONS = {ast.Lt: ("lt", False), ast.LtE: ("le", False), ast.Gt: ("lt", True), ast.GtE: ("le", True)}


#: A function before its argument without brackets, as in ``sin q.arm``.
_WITHOUT_BRACKETS = re.compile(rf"\b({'|'.join(sorted(FUNCTIONS))})\s+([A-Za-z_][\w.\[\]]*)")


def _remedy(text: str, fault: str) -> str:
    """Return the remedy of a malformed formula from the fault that the parser of Python names."""
    if "expected 'else'" in fault:
        return "both branches: 5 if t > 1 else 0"
    if (call := _WITHOUT_BRACKETS.search(text)) and call[2] not in WORDS:
        return f"{call[1]}({call[2][:40]})"
    return "operators between terms and matching brackets"


def read_formula(text: str, names: SceneNames, scope: Scope) -> Formula:
    """Return the formula of a text, of at most 2000 characters and 50 levels, as a tree of nodes, with symbols under
    the names in the text. ``names`` are the names that the scene declares, ``scope`` says which kinds of symbols may
    occur. Raises FormulaError with column and hint."""
    return _FormulaReader(text, names, scope).read()


def with_other_quantities(text: str, replacement: Callable[[str, str, str, int], str]) -> str:
    """Return a formula with other texts for its quantities; a broken formula stays.

    Parameters
    ----------
    replacement : callable
        From text, word, name and index of a quantity, ``("q.hinge", "q", "hinge", 0)``, to the text in its place; the
        word is empty for a name alone.
    """
    try:
        formula = FormulaText(text)
        ahead: list[ast.AST] = [formula.tree()]
    except (FormulaError, SyntaxError, RecursionError, MemoryError, ValueError):
        return text
    places: list[tuple[int, int, str]] = []
    while ahead:
        node = ahead.pop()
        if isinstance(node, ast.Call):
            ahead += node.args
        elif (quantity := _quantity_at(node)) is None:
            ahead += ast.iter_child_nodes(node)
        elif isinstance(node, ast.expr):
            start, end = (formula.column(offset or 0) - 1 for offset in (node.col_offset, node.end_col_offset))
            places.append((start, end, replacement(text[start:end], *quantity)))
    for start, end, changed in sorted(places, reverse=True):
        text = text[:start] + changed + text[end:]
    return text


def _quantity_at(node: ast.AST) -> tuple[str, str, int] | None:
    """Return word, name and index of the quantity that a node of a syntax tree is, ``("q", "hinge", 0)``; the word is
    empty for a name alone, and None stands for other nodes."""
    index = 0
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int):
        index, node = node.slice.value, node.value
    words = _name_words(node)
    if len(words) == 2:
        return words[0], words[1], index
    return ("", words[0], 0) if len(words) == 1 else None


class _FormulaReader:
    def __init__(self, text: str, names: SceneNames, scope: Scope) -> None:
        self.text = FormulaText(text)
        self.names = names
        self.scope = scope
        self.constants: dict[int, float] = {}  # values of operations on constants, by identity

    def read(self) -> Formula:
        try:
            tree = self.text.tree()
        except SyntaxError as error:
            column = self.text.column(max((error.offset or 1) - 1, 0))
            rest = self.text.text[column - 1 :].strip()
            near = f"at {shown(rest[:20])}" if rest else "at its end"
            fault = f"the formula is not well formed {near} [E1521]"
            word = re.match(r"[A-Za-z_0-9]*", rest)
            in_degrees = word is not None and word[0] in DEGREES
            hint = IN_RADIANS if in_degrees else _remedy(self.text.text, error.msg)
            raise FormulaError(fault, column, hint) from None
        except (RecursionError, MemoryError, ValueError):
            raise FormulaError(TOO_DEEP, 1, "a shorter formula") from None
        return self.convert(tree, 1)

    def error(self, node: ast.expr, fault: str, hint: str = "") -> FormulaError:
        return FormulaError(fault, self.text.column(node.col_offset), hint)

    def convert(self, node: ast.expr, depth: int) -> Formula:
        """Return the formula of a node of Python's syntax tree at the nesting level ``depth``. Raises FormulaError for
        a node that formulas do not have, and beyond 50 levels."""
        if depth > DEPTH:
            fault = f"{TOO_DEEP} (each term of a long sum counts) [E1523]"
            raise self.error(node, fault, "brackets around groups of terms")
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return Number(float(node.value))  # type: ignore[arg-type]
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            return self.binary(node, depth)
        if isinstance(node, ast.UnaryOp):
            return self.unary(node, depth)
        if isinstance(node, ast.Compare):
            return self.comparison(node, depth)
        if isinstance(node, ast.BoolOp):
            parts = [self.condition(value, depth + 1) for value in node.values]
            return self.fold(node, "mul" if isinstance(node.op, ast.And) else "max", parts)
        if isinstance(node, ast.IfExp):
            branches = [self.convert(branch, depth + 1) for branch in (node.body, node.orelse)]
            return self.operation(node, "select", [self.condition(node.test, depth + 1), *branches])
        if isinstance(node, ast.Call):
            return self.call(node, depth)
        if isinstance(node, ast.Name):
            return self.bare(node)
        if isinstance(node, ast.Subscript) and (word := self.word_of(node.value)):
            return self.quantity_of_entry(word, node, node.value, depth)
        if isinstance(node, ast.Attribute | ast.Subscript):
            return self.quantity(node)
        comma = re.fullmatch(r"\s*([+-]?\d+),(\d+)\s*([A-Za-z][^,]*)?", self.text.text)
        hint = f"{comma[1]}.{comma[2]} with a decimal point" if comma else "one expression that gives one number"
        raise self.error(node, "this is not a number, a name, an operation or a function [E1524]", hint)

    def constant(self, formula: Formula) -> float | None:
        """Return the value of a formula of numbers; None for other formulas."""
        return formula.value if isinstance(formula, Number) else self.constants.get(id(formula))

    def operation(self, node: ast.expr, name: str, parts: list[Formula]) -> Formula:
        result, values = Operation(name, tuple(parts)), [self.constant(part) for part in parts]
        if None not in values:
            try:
                self.constants[id(result)] = apply(name, [value for value in values if value is not None])
            except ArithmeticError as error:
                raise self.error(node, f"the constant {error} [E1525]", "a finite constant") from None
        return result

    def fold(self, node: ast.expr, name: str, parts: list[Formula]) -> Formula:
        """Apply an associative operation to many arguments by halves, which keeps the depth small."""
        if len(parts) == 1:
            return parts[0]
        half = len(parts) // 2
        return self.operation(node, name, [self.fold(node, name, parts[:half]), self.fold(node, name, parts[half:])])

    def binary(self, node: ast.BinOp, depth: int) -> Formula:
        name = _BINARY[type(node.op)]
        parts = [self.convert(node.left, depth + 1), self.convert(node.right, depth + 1)]
        exponent = self.constant(parts[1])
        if name == "pow" and exponent is not None and abs(exponent) > LARGEST_EXPONENT:
            fault = f"the exponent {exponent:.6g} is beyond {LARGEST_EXPONENT:.0f} [E1526]"
            raise self.error(node.right, fault, "exp() or a smaller exponent")
        if name == "div" and exponent == 0.0 and self.constant(parts[0]) is None:
            raise self.error(node.right, "the divisor is zero [E1527]", "another divisor")
        return self.operation(node, name, parts)

    def unary(self, node: ast.UnaryOp, depth: int) -> Formula:
        if isinstance(node.op, ast.Not):
            return self.operation(node, "sub", [Number(1.0), self.condition(node.operand, depth + 1)])
        formula = self.convert(node.operand, depth + 1)
        if isinstance(node.op, ast.UAdd):
            return formula
        return Number(-formula.value) if isinstance(formula, Number) else self.operation(node, "neg", [formula])

    def comparison(self, node: ast.Compare, depth: int) -> Formula:
        operands = [self.convert(operand, depth + 1) for operand in (node.left, *node.comparators)]
        parts = []
        for index, operator in enumerate(node.ops):
            if type(operator) not in _COMPARISONS:
                raise self.error(node, "this comparison is not part of formulas [E1528]", "< <= > >=")
            name, swapped = _COMPARISONS[type(operator)]
            pair = operands[index : index + 2]
            parts.append(self.operation(node, name, pair[::-1] if swapped else pair))
        return self.fold(node, "mul", parts)

    def condition(self, node: ast.expr, depth: int) -> Formula:
        name = node.id if isinstance(node, ast.Name) else ""
        if not (_is_condition(node) or self.defines_condition(name)):
            hint = "a comparison such as x > 0"
            if name in self.names.definitions:
                hint = f"{name} > 0, or a comparison as the formula of {name}"
            raise self.error(node, "a condition is needed here, not a number [E1529]", hint)
        return self.convert(node, depth)

    def defines_condition(self, name: str) -> bool:
        """Return whether a name is a definition whose text is a comparison or a combination of comparisons, perhaps by
        way of further definitions. A bare name in a definition of an included file is not followed."""
        seen: set[str] = set()
        while name in self.names.definitions and name not in seen:
            seen.add(name)
            text = self.names.definitions[name].text
            try:
                node = FormulaText(text).tree()
            except (FormulaError, SyntaxError, RecursionError, MemoryError, ValueError):
                return False
            if _is_condition(node):
                return True
            plain = type(text) is str  # texts of included files have names of their own
            name = node.id if plain and isinstance(node, ast.Name) else ""
        return False

    def call(self, node: ast.Call, depth: int) -> Formula:
        """Return the formula of a call: inverse dynamics ``tau``, a quantity of an entry, a curve or a function. Raises
        FormulaError for any other call and for a wrong number of arguments."""
        words = _name_words(node.func)
        of_component = _name_words(node.func.value) if isinstance(node.func, ast.Subscript) else words
        if len(of_component) == 2 and of_component[0] == "tau":
            return self.tau(node)
        if word := self.word_of(node):
            return self.quantity_of_entry(word, node, node, depth)
        if len(words) == 2:
            return self.application(node, words[1], words[0], depth)
        if len(words) != 1:
            hint = f"one of {', '.join(sorted(FUNCTIONS))}"
            if isinstance(node.func, ast.Attribute) and (call := self.call_of_entry(node.func.attr)):
                hint = f"{call} without a word before it: it has no derivative in formulas"
            raise self.error(node, "only functions can be called [E1530]", hint)
        (name,) = words
        if name in self.names.curves:
            return self.application(node, name, "", depth)
        if name not in FUNCTIONS:
            raise self.unknown_function(node, name)
        variadic = name in ("min", "max")
        example = f"{name}({', '.join(('yx' if name == 'atan2' else 'xy')[: FUNCTIONS[name]])})"
        parts = self.arguments(node, name, FUNCTIONS[name], example, depth, more=variadic)
        return self.fold(node, name, parts) if variadic else self.operation(node, name, parts)

    def arguments(
        self, node: ast.Call, label: str, count: int, example: str, depth: int, *, more: bool = False
    ) -> list[Formula]:
        """Return the arguments of a call that takes ``count`` of them, or ``more``. Raises FormulaError for another
        number."""
        plain = [argument for argument in node.args if not isinstance(argument, ast.Starred)]
        fits = len(plain) == count or (more and len(plain) > count)
        if not fits or len(plain) < len(node.args) + len(node.keywords):
            needed = f"{counted(count, 'argument')}{' or more' * more}"
            raise self.error(node, f"{label}() takes {needed}, not {len(plain)} [E1532]", example)
        return [self.convert(argument, depth + 1) for argument in plain]

    def unknown_function(self, node: ast.Call, name: str) -> FormulaError:
        """Return, without raising, the error for a call of a name that is not a function; the hint is the nearest name
        or meaning."""
        if name in self.declared_names():
            return self.error(node, f"{name} is a number, not a function [E1533]", f"{name} alone, or {name} * (...)")
        hint = IN_RADIANS if name in DEGREES else function_hint(name, self.names.curves, sorted(FUNCTIONS))
        if name in self.kinds() and len(node.args) == 1 and isinstance(node.args[0], ast.Name):
            hint = f"{name}.{node.args[0].id}"
        if (added := added_word(name)) and (entries := self.names.entries.get(added.section)):
            hint = added.call(next(iter(entries)))
        return self.error(node, f"unknown function {shown(name)} [E1534]", self.call_of_entry(name) or hint)

    def application(self, node: ast.Call, name: str, word: str, depth: int) -> Formula:
        """Return a curve, or a derivative of a curve, at an argument: ``NAME(x)``, or ``WORD.NAME(x)`` with ``word``
        such as ``derivative``. Raises FormulaError for an unknown name, word, or number of arguments."""
        call = f"{word}.{name}" if word else name
        if word in self.kinds() and word not in DERIVATIVES:
            raise self.error(node, f"{call} is a quantity, not a function [E1535]", f"{call} without brackets")
        if word not in DERIVATIVES and (absent := fault_of_absent(word)):
            raise self.error(node, f"unknown quantity {shown(word)}: {absent[0]} [E1563]", absent[1])
        if word and word not in DERIVATIVES:
            hint = self.call_of_entry(name) or _plain_hint(word, name)
            raise self.error(node, f"only functions can be called, not {shown(f'{word}.{name}')} [E1536]", hint)
        if name not in self.names.curves:
            hint = nearest(name, self.names.curves) or "a [curves] section"
            if call_hint := self.call_of_entry(name):
                hint = f"{call_hint}, which has no derivative in formulas"
            raise self.error(node, f"there is no curve {shown(name)} [E1537]", hint)
        self.allow(node, "curve", f"the curve {shown(name)}")
        (argument,) = self.arguments(node, call, 1, f"{call}(t)", depth)
        return Application(self.names.curves[name], argument, DERIVATIVES.get(word, 0))

    def call_of_entry(self, name: str) -> str:
        """Return the call of an entry of a section that has a word, as maps have; empty if no entry has the name."""
        for word in own_words().values():
            if item := self.names.entries.get(word.section, {}).get(name):
                return word.call(name, item)
        return ""

    def word_of(self, node: ast.expr) -> Word | None:
        """Return the word of the register in a call such as ``WORD.NAME(x, y)``; None for other nodes."""
        words = _name_words(node.func) if isinstance(node, ast.Call) else []
        name = words[0] if len(words) in (2, 3) else ""  # WORD.NAME, or WORD.NAME.COMPONENT
        return None if not name or name in DERIVATIVES or name in _MODULES or name in self.kinds() else added_word(name)

    def quantity_of_entry(self, word: Word, node: ast.expr, call: ast.expr, depth: int) -> EntryQuantity:
        """Return a quantity of a section's entry at given arguments: ``WORD.NAME(x, y)[1]``. ``call`` is the call
        within ``node``, which may have an index. Raises FormulaError for an unknown entry, or unfit arguments or
        components."""
        assert isinstance(call, ast.Call)  # checked by ``word_of``
        _, name, part = [*_name_words(call.func), ""][:3]
        label = f"{word.name}.{name}"
        entries = self.names.entries.get(word.section, {})
        if name not in entries:
            hint = nearest(name, entries) or f"a [{word.section}] section, and [{word.section}.{name[:64]}]"
            fault = f"{word.name}.{name[:64]}: there are no {word.section} {shown(name)} [E1538]"
            raise self.error(call, fault, hint)
        item = entries[name]
        if word.scope:
            self.allow(call, word.scope, label)
        if any(Symbol("time") in symbols(formula) for formula in word.added(item)):
            self.allow(call, "time", f"{label}, which depends on time,")
        example = word.call(name[:64], item, part)
        arguments = self.arguments(call, label, len(word.arguments_of(item)), example, depth)
        named = self.part(call, word, item, part)
        written = self.index(node) if isinstance(node, ast.Subscript) else None
        index = self.component(node, label, written, word.components, word.call(item.name, item))
        quantity = quantity_of(word, item, tuple(arguments), named or index)
        if quantity.curves():
            self.allow(call, "curve", label)
        return quantity

    def part(self, call: ast.Call, word: Word, item: Any, part: str) -> int:
        """Return the index of the result ``part`` of an entry's quantity that has results by name; 0 for an empty name.
        Raises FormulaError for an unknown name, and for none if there are several results."""
        parts, label = word.parts_of(item), f"{word.name}.{item.name}"
        if part and part not in parts:
            hint = f"{label}.{nearest(part, parts)}" if parts else word.call(item.name, item)
            raise self.error(call, f"{label} has no result {shown(part)} [E1545]", hint)
        if not part and len(parts) > 1:
            fault = f"{label} has the results {listed(parts)} [E1547]"
            raise self.error(call, fault, f"{label}.{parts[0]}({', '.join(word.arguments_of(item))})")
        return parts.index(part) if part else 0

    def tau(self, node: ast.Call) -> Symbol:
        """Return the symbol of a joint's component of inverse dynamics for a reference motion: ``tau.elbow(servo)``.
        Raises FormulaError unless the argument is the name of an entry in [references]."""
        assert isinstance(node.func, ast.Attribute | ast.Subscript)  # checked by ``call``
        joint = self.quantity(node.func, called=True)
        label = f"tau.{joint.name}"
        argument = node.args[0] if len(node.args) == 1 and not node.keywords else None
        if not isinstance(argument, ast.Name):
            fault = f"{label}() takes the name of one reference [E1548]"
            raise self.error(node, fault, f"{label}(servo), and [references.servo]")
        name = argument.id
        if name not in self.names.references:
            hint = nearest(name, self.names.references) or "a [references] section"
            raise self.error(argument, f"there is no reference {shown(name)} [E0253]", hint)
        return replace(joint, reference=name)

    def bare(self, node: ast.Name) -> Formula:
        """Return the formula of a name alone: pi, the time, a parameter, an input, a state or a definition. Raises
        FormulaError for an unknown name, and for a name that is not a number."""
        name = node.id
        if name == "pi":
            return Number(math.pi)
        if symbol := self.scope_symbol(node, name) or self.signal(node, name):
            return symbol
        if name in self.names.definitions:
            return self.definition(name)
        raise self.not_a_number(node, name)

    def scope_symbol(self, node: ast.Name, name: str) -> Symbol | None:
        """Return the symbol of the time ``t``, or of a name with a meaning in some scopes alone, as ``s`` along a beam;
        None for other names. Raises FormulaError if a parameter or a definition has the same name."""
        if name == "t":
            self.allow(node, "time", "time t")
            return Symbol("time")
        kind, meaning, symbol = {**_OF_SCOPES, **self.scope.names}.get(name, ("", "", None))
        if kind not in self.scope.kinds:
            return None
        for noun, taken in (("parameter", self.names.parameters), ("definition", self.names.definitions)):
            if name in taken:
                fault = f"{name} is the {meaning} here, and a {noun} is called so too [E1549]"
                raise self.error(node, fault, f"another name for the {noun}")
        return symbol

    def signal(self, node: ast.Name, name: str) -> Symbol | None:
        """Return the symbol of a parameter, an input, a law of a product, a state or an output of a controller; None
        for other names. Raises FormulaError if the scope excludes the symbol."""
        if name in self.names.parameters:
            if self.names.parameters[name] and "fixed" in self.scope.kinds:
                fault = f"the tunable parameter {shown(name)} cannot be used here [E1556]"
                raise self.error(node, fault, "a fixed parameter (tunable = false)")
            self.allow(node, "fixed" if "fixed" in self.scope.kinds else "parameter", f"parameter {shown(name)}")
            return Symbol("parameter", name)
        if name in self.names.inputs:
            self.allow(node, "time" if name in self.names.motions else "input", f"the input {shown(name)}")
            return Symbol("input", name)
        for section, laws in self.names.laws.items():
            if name in laws.formulas:
                self.allow(node, "time", f"the {laws.noun} {shown(name)}")
                return Symbol(section, name)
        for kind, names in (("state", self.names.states), ("controller", self.names.controllers)):
            if name in names:
                self.allow(node, kind, f"the {kind} {shown(name)}")
                return Symbol(kind, name)
        return None

    def not_a_number(self, node: ast.Name, name: str) -> FormulaError:
        """Return, without raising, the error for a name that is unknown, or names an object that is not a number, with
        a hint."""
        if name in FUNCTIONS:
            return self.error(node, f"the function {name} needs arguments [E1550]", f"{name}(x)")
        if name in self.names.curves:
            return self.error(node, f"{shown(name)} is a curve, which needs an argument [E1551]", f"{name}(t)")
        for noun, movable in (("joint", self.names.joints), ("beam", self.names.beams)):
            if name in movable:
                hint = ON_A_POINT if name in self.names.exact_beams else f"q.{name} or v.{name}"
                return self.error(node, f"{shown(name)} is a {noun}, not a number [E1552]", hint)
        known = [*self.declared_names(), *FUNCTIONS, "t", "pi"]
        hint = IN_RADIANS if name in DEGREES else name_hint(name, self.names, self.scope, known)
        unit = re.fullmatch(rf"\s*([\d.eE+-]+?)\s*\*\s*({re.escape(name)})\s*", self.text.text)
        if unit and name not in DEGREES:
            hint = product_hint(unit[1], unit[2]) or hint
        return FormulaError(f"unknown name {shown(name)} [E1553]", self.text.column(node.col_offset), hint, name)

    def declared_names(self) -> list[str]:
        """Return the names of numbers that the scene declares."""
        names, laws = self.names, (laws.formulas for laws in self.names.laws.values())
        every = (names.parameters, names.inputs, *laws, names.states, names.controllers, names.definitions)
        return [name for declared in every for name in declared]

    def definition(self, name: str) -> Formula:
        """Return a definition: a number, or a symbol until the definition is expanded and checked."""
        definition: NamedExpression = self.names.definitions[name]
        if (number := definition.number) is None:
            return Symbol("definition", name)
        definition.used = True
        return Number(number)

    def allow(self, node: ast.expr, kind: str, quantity: str) -> None:
        if kind not in self.scope.kinds:
            for absent, reason, instead in self.scope.reasons:
                if absent == kind:
                    raise self.error(node, f"{quantity} cannot be used here: {reason} [E1555]", instead)
            raise self.error(node, f"{quantity} cannot be used here [E1556]", f"{self.scope.description} only")

    def quantity(self, node: ast.Attribute | ast.Subscript, *, called: bool = False) -> Symbol:
        """Return the symbol of a component of a quantity: ``q.joint``, ``position.point[2]``. ``called``: a reference
        motion in brackets follows, as ``tau`` needs. Raises FormulaError for unknown names, and for components that do
        not exist."""
        inner, index = (node.value, self.index(node)) if isinstance(node, ast.Subscript) else (node, None)
        words = _name_words(inner)
        if len(words) == 3 and words[0] == "reaction":
            return self.reaction(node, words[1], words[2], index)
        if len(words) != 2:
            fault = "only quantities such as q.joint or position.point[2] have parts [E1557]"
            word, part = "".join(words) if len(words) == 1 else "", "" if index is None else str(index)
            if len(words) == 3 and words[0] in QUANTITIES:
                word, part = ".".join(words[:2]), words[2]
            raise self.error(node, fault, parts_hint(self.names, word, part))
        kind, name = words
        if kind in LOCAL and name == HERE and name not in self.names.points:
            return self.local(node, kind, index)
        self.check_complete(node, kind, name, called=called)
        known, size = self.family(kind, name)
        if known is None:
            raise self.unknown_kind(node, kind, name)
        self.check_name(node, kind, name, known)
        return Symbol(kind, name, self.component(node, f"{kind}.{name}", index, size))

    def index(self, node: ast.Subscript) -> int:
        """Return the index of a component."""
        if not (isinstance(node.slice, ast.Constant) and type(node.slice.value) is int):
            raise self.error(node, "an index must be a whole number [E1558]", "[0]")
        return int(node.slice.value)

    def check_complete(self, node: ast.expr, kind: str, name: str, *, called: bool) -> None:
        """Raise FormulaError if a kind and a name alone do not make a quantity, because a part of a reaction,
        arguments, or the reference motion of ``tau`` are missing."""
        label = f"{kind}.{name[:64]}"
        if kind == "reaction":
            raise self.error(node, f"{label} is a force and a moment [E1559]", f"{label}.force[0] or {label}.moment[0]")
        if kind not in self.kinds() and (added := added_word(kind)):
            item = self.names.entries.get(added.section, {}).get(name)
            arguments = added.arguments if item is None else added.arguments_of(item)
            call = added.call(name[:64], item)
            fault = f"{kind}.{name[:64]} is a function of {listed(arguments)}, and needs arguments [E1560]"
            raise self.error(node, fault, f"{call}[0]" if added.components > 1 else call)
        if kind == "tau" and not called:
            fault = f"{label} needs a reference motion [E1561]"
            raise self.error(node, fault, f"{label}(servo), and [references.servo]")

    def unknown_kind(self, node: ast.expr, kind: str, name: str) -> FormulaError:
        """Return, without raising, the error for a kind of quantity that the scene does not have, with a hint."""
        if kind == "mode":
            fault = f"mode.{name[:64]}: the scene has no [modes] [E1562]"
            return self.error(node, fault, f"[modes] and {name[:64]} = 1")
        if absent := fault_of_absent(kind):
            return self.error(node, f"unknown quantity {shown(kind)}: {absent[0]} [E1563]", absent[1])
        meant = next((each for each in (name, f"{kind}_{name}") if each in self.declared_names()), "")
        hint = meant or kind_hint(kind, name, self.names, self.kinds())
        return self.error(node, f"unknown quantity {shown(kind)} [E1563]", hint)

    def check_name(self, node: ast.expr, kind: str, name: str, known: Collection[str]) -> None:
        """Raise FormulaError if the scope excludes a quantity, or if the name is not among the names ``known`` for its
        kind."""
        offered = self.names.offered.get(kind)
        scope_kind = offered.scope if offered else "power" if kind == "energy" and name.endswith("power") else kind
        self.allow(node, scope_kind, f"{kind}.{name if is_legal(name) else shown(name)}")
        of_joints = kind in ("q", "v", "a")
        if name not in known:
            if kind == "rate" and name in self.names.states:
                fault = f"rate.{name}: the rate of a state has no name, or it could depend on itself [E1565]"
                raise self.error(node, fault, f"its formula, or the state {name}")
            if QUANTITIES.get(kind) == "body" and name in self.beam_names:
                fault = f"{kind}.{name}: the beam {name} bends, and has no axes of its own [E1566]"
                raise self.error(node, fault, "a body that is fixed to the beam at the place of interest")
            noun = "joint or beam" if of_joints and self.names.beams else _words(self.names.section_of(kind))
            having, remedy = (f" with {kind}", offered.remedy) if offered and offered.remedy else ("", "")
            fault = f"{kind}.{name[:64]}: there is no {noun} {shown(name)}{having} [E1568]"
            raise self.error(node, fault, ", or ".join(filter(None, (nearest(name, known), remedy))))
        if of_joints and name in self.names.exact_beams and name not in self.names.joints:
            fault = f"{kind}.{name}: a geometrically exact beam has no elastic coordinates [E1564]"
            raise self.error(node, fault, ON_A_POINT)

    def component(self, node: ast.expr, label: str, index: int | None, size: int | None, call: str = "") -> int:
        """Return the index of a component, None if not given, that fits the number of components ``size``, None for an
        unknown number. Raises FormulaError for any other index; ``call`` stands for the quantity in hints."""
        call = call or label
        if size == 0:
            raise self.error(node, f"{label}: a fixed joint has no coordinates [E1571]", "a moving joint")
        if size is not None and index is None and size > 1:
            raise self.error(node, f"{label} has {size} components [E1543]", f"{call}[0]")
        if size is not None and index is not None and index >= size:
            hint = f"an index from 0 to {size - 1}" if size > 1 else call
            raise self.error(node, f"{label} has no component {index} [E1544]", hint)
        return index or 0

    def local(self, node: ast.expr, kind: str, index: int | None) -> Symbol:
        """Return the symbol for a component of a quantity at the point of a load: ``velocity.here[2]``. Raises
        FormulaError outside loads, and for an index other than 0 to 2."""
        label = f"{kind}.{HERE}"
        if "local" not in self.scope.kinds:
            fault = f"{label}: {HERE} is where a load acts, of [forces] or [distributed_loads] [E1572]"
            raise self.error(node, fault, "the name of a point")
        return Symbol("local", kind, self.component(node, label, index, 3))

    def reaction(self, node: ast.expr, name: str, part: str, index: int | None) -> Symbol:
        """Return the symbol of a component of the reaction of a joint or a constraint: ``reaction.hinge.force[2]``,
        with ``inner`` for the node without the index. Raises FormulaError for an unknown name or part, or an index
        other than 0 to 2."""
        label = f"reaction.{name[:64]}"
        self.allow(node, "reaction", label)
        if fault := self.names.fault_of_reaction(name):
            raise self.error(node, f"{label}: {fault[0]}", fault[1])
        if part not in REACTION_PARTS:
            message = f"{label} has no part {shown(part)} [E1576]"
            raise self.error(node, message, f"{label}.force[0] or {label}.moment[0]")
        return Symbol("reaction", name, REACTION_PARTS[part] + self.component(node, f"{label}.{part}", index, 3))

    @property
    def beam_names(self) -> tuple[str, ...]:
        """Names of the beams, which have no axes of their own."""
        return (*self.names.beams, *self.names.exact_beams)

    def kinds(self) -> list[str]:
        """Return the kinds of quantities that have names here."""
        return [*QUANTITIES, *self.names.offered, *(["mode"] if self.names.modes else [])]

    def family(self, kind: str, name: str) -> tuple[list[str] | None, int | None]:
        """Return the names that a kind of quantity may have, None for an unknown kind, and the number of components for
        ``name``, None if unknown."""
        if kind in ("q", "v", "a"):
            row = JOINTS.get(self.names.joints.get(name, ""))
            size = (row.q_size if kind == "q" else row.v_size) if row else None
            size = size or self.names.beams.get(name, size) or size  # a fixed joint may have the name of its beam
            return [*self.names.joints, *self.names.beams], size
        if kind in ("gravity", "tau"):
            row = JOINTS.get(self.names.joints.get(name, ""))
            return list(self.names.joints), row.v_size if row else None
        if kind in ("position", "velocity", "acceleration"):
            return list(self.names.points), 3
        if QUANTITIES.get(kind) == "body":
            return [name for name in self.names.bodies if name not in self.beam_names], 3
        if kind == "drive_effort":
            row = JOINTS.get(self.names.joints.get(name, ""))
            size = max(len(row.coordinates), 1) if row and name not in self.names.constraints else 1
            return [*self.names.joints, *self.names.constraints], size
        if kind == "mode" and self.names.modes:
            return list(self.names.modes), 1
        if kind in self.names.offered:
            return list(self.names.offered[kind].names), 1
        return (list(ENERGIES), 1) if kind == "energy" else (None, 0)


def _is_condition(node: ast.expr) -> bool:
    """Return whether a node is a comparison, or comparisons with ``and``, ``or`` and ``not``."""
    is_not = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)
    return is_not or isinstance(node, ast.Compare | ast.BoolOp)


def _name_words(node: ast.AST) -> list[str]:
    """Return the words of dotted names; empty for other nodes."""
    if isinstance(node, ast.Attribute) and (before := _name_words(node.value)):
        return [*before, node.attr]
    return [node.id] if isinstance(node, ast.Name) else []


def _plain_hint(word: str, name: str) -> str:
    """Return a hint in place of ``word.name(...)``, a call of a module of Python, which formulas do not have."""
    if word in _MODULES and name in FUNCTIONS:
        return f"{name}(...)"
    if word in _MODULES and re.fullmatch(r"u?int\d*|float\d*|longdouble|double|single|half", name):
        return f'the number alone: NumPy writes {word}.{name}(...) into a text, f"{{float(x)}}" writes a plain one'
    return f"one of {', '.join(sorted(FUNCTIONS))}"


_MODULES = ("np", "numpy", "math")


def _words(section: str) -> str:
    """Return the noun for an entry of a section; ``energy`` for a symbol without a section."""
    return "body" if section == "bodies" else section.removesuffix("s").replace("_", " ") or "energy"
