"""Patterns of all messages in the source: the texts that reach ``Problem``, exceptions, notes and findings.

A text is followed backwards from the call that makes a message, by names within a function, by results of functions,
by arguments of calls and by fields of classes, and becomes patterns: literal parts with ``{}`` for values.
"""

from __future__ import annotations

import ast
import gc
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Most patterns of one expression: the rest of a large choice becomes a value.
_MOST = 80
#: Depth of the way back from a message to its text.
_DEEPEST = 9
HOLE = "\0"
#: Letters that make a pattern distinct enough; a value within a text with fewer is followed, too.
_ENOUGH = 12
#: Letters of a choice within a text at least that is kept as it is.
_LEAST = 6
#: Choices of a value within a text at most; more are a value.
_CHOICES = 6
#: Marks an assignment that makes a text longer.
_MORE = ast.expr()

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(eq=False)
class Module:
    """A parsed module: functions and classes by name, constants, origins of imported names."""

    name: str
    tree: ast.Module
    functions: dict[str, list[Function]] = field(default_factory=lambda: defaultdict(list))
    constants: dict[str, list[ast.expr]] = field(default_factory=lambda: defaultdict(list))
    imported: dict[str, tuple[str, str]] = field(default_factory=dict)
    calls: dict[str, list[tuple[ast.Call, Function | None]]] = field(default_factory=lambda: defaultdict(list))


@dataclass(frozen=True)
class Site:
    """A place that makes a message.

    Attributes
    ----------
    module, line : where
    kind : name of the exception or of the kind of message
    patterns : texts with ``{}`` for values, none if the text is passed on from elsewhere
    hints : remedies, likewise
    text : the expression
    code : that the source gives; empty if the text alone identifies the message
    """

    module: str
    line: int
    kind: str
    patterns: tuple[str, ...]
    hints: tuple[str, ...]
    text: str
    code: str = ""


class Source:
    """All modules of the package."""

    def __init__(self, root: Path = ROOT / "eomgen") -> None:
        self.modules: dict[str, Module] = {}
        self.fields: dict[str, list[tuple[str, int]]] = defaultdict(list)
        self.bases: dict[str, set[str]] = defaultdict(set)
        self.owner: dict[ast.AST, Function] = {}
        self.parent: dict[ast.AST, ast.AST] = {}
        self._everywhere: dict[str, list[tuple[Function, Module]]] = defaultdict(list)
        self._calls: dict[str, list[tuple[ast.Call, Function | None, Module]]] = defaultdict(list)
        self._bindings: dict[Function, dict[str, list[tuple[ast.expr, int | None]]]] = {}
        self._known: dict[tuple[ast.expr, int], list[str]] = {}
        gc.disable()  # millions of nodes that stay
        try:
            for path in sorted(root.rglob("*.py")):
                name = ".".join(path.relative_to(root.parent).with_suffix("").parts).removesuffix(".__init__")
                self._read(Module(name, ast.parse(path.read_text(encoding="utf-8"))))
        finally:
            gc.enable()

    def _read(self, module: Module) -> None:
        self.modules[module.name] = module
        self._walk(module)
        for node in module.tree.body:
            for target, value in _assigned(node):
                if isinstance(target, ast.Name):
                    module.constants[target.id].append(value)

    def _walk(self, module: Module) -> None:
        ahead: list[tuple[ast.AST, Function | None]] = [(module.tree, None)]
        while ahead:
            node, owner = ahead.pop()
            inner = node if isinstance(node, Function) else owner
            self._enter(node, owner, module)
            children = list(ast.iter_child_nodes(node))
            for child in children:
                self.parent[child] = node
                if inner is not None:
                    self.owner[child] = inner
            ahead += [
                (child, inner) for child in reversed(children) if not isinstance(child, ast.expr_context | ast.operator)
            ]

    def _enter(self, node: ast.AST, owner: Function | None, module: Module) -> None:
        if isinstance(node, ast.Call):
            module.calls[called(node.func)].append((node, owner))
            self._calls[called(node.func)].append((node, owner, module))
        elif isinstance(node, Function):
            module.functions[node.name].append(node)
            self._everywhere[node.name].append((node, module))
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module.imported[alias.asname or alias.name] = (node.module, alias.name)
        elif isinstance(node, ast.ClassDef):
            self.bases[node.name] |= {called(base) for base in node.bases}
            annotated = [
                it.target.id for it in node.body if isinstance(it, ast.AnnAssign) and isinstance(it.target, ast.Name)
            ]
            for place, name in enumerate(annotated):
                self.fields[name].append((node.name, place))

    def descends(self, name: str, ancestor: str) -> bool:
        """Return whether a class descends from another."""
        seen, ahead = set[str](), [name]
        while ahead:
            one = ahead.pop()
            if one not in seen:
                seen.add(one)
                ahead += self.bases.get(one, ())
        return ancestor in seen

    # texts

    def texts(self, node: ast.expr | None, owner: Function | None, module: Module, depth: int = 0) -> list[str]:
        """Return the patterns of an expression; a value that is no text is one hole."""
        if node is None or depth > _DEEPEST:
            return [HOLE]
        known = self._known.get((node, depth))
        if known is None:
            self._known[node, depth] = [HOLE]  # of a name that is bound to itself
            found = list(dict.fromkeys(self._texts(node, owner, module, depth)))
            known = self._known[node, depth] = found[:_MOST] or [HOLE]
        return known

    def _texts(self, node: ast.expr, owner: Function | None, module: Module, depth: int) -> Iterator[str]:
        match node:
            case ast.Constant(value=str() as text):
                yield text
            case ast.JoinedStr(values=values):
                yield from self._joined(values, owner, module, depth)
            case ast.IfExp(body=body, orelse=other):
                yield from self.texts(body, owner, module, depth)
                yield from self.texts(other, owner, module, depth)
            case ast.BoolOp(values=values):
                for value in values:
                    yield from self.texts(value, owner, module, depth)
            case ast.NamedExpr(value=value) | ast.Starred(value=value) | ast.Await(value=value):
                yield from self.texts(value, owner, module, depth)
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                for first in self.texts(left, owner, module, depth + 1):
                    for second in self.texts(right, owner, module, depth + 1):
                        yield first + second
            case ast.BinOp(left=left, op=ast.Mult()):
                for text in self.texts(left, owner, module, depth + 1):
                    yield text
                    yield ""
            case ast.Name(id=name):
                yield from self._named(name, None, owner, module, depth + 1)
            case ast.Subscript(value=value, slice=index):
                yield from self._items(value, index, owner, module, depth + 1)
            case ast.Call():
                yield from self._results(node, None, owner, module, depth + 1)
            case ast.Lambda(body=body):
                yield from self.texts(body, owner, module, depth + 1)
            case ast.Attribute(value=value, attr=attribute):
                if isinstance(value, ast.Name) and value.id in module.imported and attribute.isupper():
                    pass
                yield from self._field(attribute, module, depth + 1)
            case _:
                yield HOLE

    def _bound_in(self, function: Function) -> dict[str, list[tuple[ast.expr, int | None]]]:
        """Return the values that names have in a function, each with its place in a tuple."""
        known = self._bindings.get(function)
        if known is None:
            known = self._bindings[function] = defaultdict(list)
            for node in ast.walk(function):
                for target, value in _assigned(node):
                    for name, place in _names(target):
                        known[name].append((value, place))
                if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                    known[node.target.id].append((_MORE, None))
        return known

    def _joined(self, values: Sequence[ast.expr], owner: Function | None, module: Module, depth: int) -> Iterator[str]:
        made = [""]
        literal = sum(letters(str(it.value)) for it in values if isinstance(it, ast.Constant))
        for value in values:
            if isinstance(value, ast.Constant):
                options = [str(value.value)]
            elif isinstance(value, ast.FormattedValue) and value.format_spec is None and literal < _ENOUGH:
                options = [
                    it if letters(it) >= _LEAST else HOLE for it in self.texts(value.value, owner, module, depth + 1)
                ]
                options = list(dict.fromkeys(options))
                argument = owner is not None and called(value.value) in {it.arg for it in owner.args.args}
                if len(options) > (_MOST if argument and literal < _LEAST else _CHOICES):
                    options = [HOLE]
            else:
                options = [HOLE]
            if len(made) * len(options) > _MOST:
                options = [HOLE]
            made = [one + option for one in made for option in options]
        yield from made

    def _named(self, name: str, part: int | None, owner: Function | None, module: Module, depth: int) -> Iterator[str]:
        """Yield the texts of a name, or of a part of a name that is a tuple."""
        values: list[tuple[ast.expr, int | None]] = []
        scope = owner
        while scope is not None and not values:
            values += self._bound_in(scope).get(name, ())
            if not values:
                found = list(self._argument(name, scope, module, depth))
                if found:
                    yield from found
                    return
            scope = self.owner.get(scope)
        if not values and name in module.constants:
            values = [(value, None) for value in module.constants[name]]
        if not values and name in module.imported:
            origin, there = module.imported[name]
            other = self.modules.get(origin)
            if other is not None and there in other.constants:
                for value in other.constants[there]:
                    yield from self.texts(value, None, other, depth)
                return
        if not values and part is None and (functions := self._functions(name, module)):
            for function, home in functions:
                yield from self._returned(function, None, home, depth)
            return
        if not values:
            yield HOLE
        longer = any(value is _MORE for value, _ in values)
        for value, place in values:
            if value is _MORE:
                continue
            where = self.owner.get(value, owner)
            if place is None and part is None:
                texts: Iterable[str] = self.texts(value, where, module, depth)
            else:
                texts = self._part(value, part if place is None else place, where, module, depth)
            yield from (text + HOLE for text in texts) if longer else texts

    def _part(
        self, value: ast.expr, place: int | None, owner: Function | None, module: Module, depth: int
    ) -> Iterator[str]:
        """Yield the texts of one part of a tuple."""
        match value:
            case ast.Tuple(elts=parts) | ast.List(elts=parts):
                if place is not None and place < len(parts):
                    yield from self.texts(parts[place], owner, module, depth)
            case ast.IfExp(body=body, orelse=other):
                yield from self._part(body, place, owner, module, depth)
                yield from self._part(other, place, owner, module, depth)
            case ast.BoolOp(values=values):
                for one in values:
                    yield from self._part(one, place, owner, module, depth)
            case ast.Call():
                yield from self._results(value, place, owner, module, depth + 1)
            case ast.NamedExpr(value=inner):
                yield from self._part(inner, place, owner, module, depth)
            case ast.Name(id=name):
                if depth < _DEEPEST:
                    yield from self._named(name, place, owner, module, depth + 1)
            case ast.Subscript(value=inner):
                for one in self._values(inner, owner, module):
                    yield from self._part(one, place, owner, module, depth + 1)

    def _values(self, node: ast.expr, owner: Function | None, module: Module) -> Iterator[ast.expr]:
        """Yield the values of a mapping or a sequence that is written out."""
        match node:
            case ast.Dict(values=values):
                yield from values
            case ast.Tuple(elts=values) | ast.List(elts=values):
                yield from values
            case ast.Name(id=name):
                for value in module.constants.get(name, ()):
                    yield from self._values(value, owner, module)

    def _items(
        self, value: ast.expr, index: ast.expr, owner: Function | None, module: Module, depth: int
    ) -> Iterator[str]:
        if isinstance(index, ast.Constant) and isinstance(index.value, int):
            yield from self._part(value, index.value, owner, module, depth)
        else:
            for one in self._values(value, owner, module):
                yield from self.texts(one, owner, module, depth)

    def _functions(self, name: str, module: Module) -> list[tuple[Function, Module]]:
        if name in module.functions:
            return [(it, module) for it in module.functions[name]]
        if name in module.imported:
            origin, there = module.imported[name]
            other = self.modules.get(origin)
            if other is not None:
                return [(it, other) for it in other.functions.get(there, ())]
        return []

    def _results(
        self, call: ast.Call, place: int | None, owner: Function | None, module: Module, depth: int
    ) -> Iterator[str]:
        """Yield the texts that a function returns, or one part of them."""
        name = called(call.func)
        if isinstance(call.func, ast.Attribute) and name in (
            "format",
            "strip",
            "rstrip",
            "replace",
            "removesuffix",
            "partition",
        ):
            for text in self.texts(call.func.value, owner, module, depth):
                yield filled(text) if name == "format" else text
            return
        if name == "next" and call.args:
            call_or = call.args[0]
            if isinstance(call_or, ast.GeneratorExp):
                yield from self.texts(call_or.elt, owner, module, depth)
                return
            if isinstance(call_or, ast.Call):
                call, name = call_or, called(call_or.func)
        if name in ("str", "min", "max") and call.args and place is None:
            yield HOLE
            return
        for function, home in self._methods(name, module) if depth < _DEEPEST else ():
            yield from self._returned(function, place, home, depth)

    def _returned(self, function: Function, place: int | None, module: Module, depth: int) -> Iterator[str]:
        """Yield the texts that a function returns or yields, or one part of them."""
        for node in ast.walk(function):
            if isinstance(node, ast.Return | ast.Yield) and node.value is not None and self.owner.get(node) is function:
                if place is None:
                    yield from self.texts(node.value, function, module, depth + 1)
                else:
                    yield from self._part(node.value, place, function, module, depth + 1)

    def _methods(self, name: str, module: Module) -> list[tuple[Function, Module]]:
        if found := self._functions(name, module):
            return found
        everywhere = self._everywhere.get(name, [])
        return everywhere if len(everywhere) <= 25 else []

    def _argument(self, name: str, function: Function, module: Module, depth: int) -> Iterator[str]:
        """Yield the texts of an argument of a function by its calls."""
        arguments = [*function.args.posonlyargs, *function.args.args]
        names = [it.arg for it in (*arguments, *function.args.kwonlyargs)]
        if name not in names or depth >= _DEEPEST:
            return
        method = bool(arguments) and arguments[0].arg in ("self", "cls")
        called = function.name
        if called == "__init__":
            called = next(
                (
                    node.name
                    for node in ast.walk(module.tree)
                    if isinstance(node, ast.ClassDef) and function in node.body
                ),
                "",
            )
        for call, owner, home in self.calls_of(called, module):
            starred = any(isinstance(it, ast.Starred) for it in call.args)
            place = names.index(name) - method
            given = next((it.value for it in call.keywords if it.arg == name), None)
            if given is None and not starred and 0 <= place < len(call.args):
                given = call.args[place]
            if given is not None:
                yield from self.texts(given, owner, home, depth + 1)
            elif starred:
                at = next(k for k, it in enumerate(call.args) if isinstance(it, ast.Starred))
                if place >= at:
                    yield from self._part(call.args[at].value, place - at, owner, home, depth + 1)

    def calls_of(self, name: str, module: Module) -> Iterator[tuple[ast.Call, Function | None, Module]]:
        """Yield the calls of a function: in its module and in modules that import it, else everywhere."""
        every = self._calls.get(name, [])
        near = [one for one in every if one[2] is module or one[2].imported.get(name, ("", ""))[0] == module.name]
        if near or len(every) <= 60:
            yield from near or every

    def _field(self, name: str, module: Module, depth: int) -> Iterator[str]:
        """Yield the texts of a field by the calls of the classes that have it, and of properties of this name."""
        if depth >= _DEEPEST or name in ("name", "label", "key", "what", "hint", "text", "message"):
            yield HOLE
            return
        for kind, place in self.fields.get(name, ()):
            for call, owner, other in self._calls.get(kind, ()):
                given = next((it.value for it in call.keywords if it.arg == name), None)
                if given is None and place < len(call.args):
                    given = call.args[place]
                if given is not None:
                    yield from self.texts(given, owner, other, depth + 2)
        for function, home in self._methods(name, module):
            for node in ast.walk(function):
                if isinstance(node, ast.Return) and node.value is not None:
                    yield from self.texts(node.value, function, home, depth + 2)


def called(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _assigned(node: ast.AST) -> Iterator[tuple[ast.expr, ast.expr]]:
    if isinstance(node, ast.Assign):
        for target in node.targets:
            yield target, node.value
    elif isinstance(node, ast.AnnAssign | ast.NamedExpr) and node.value is not None:
        yield node.target, node.value
    elif isinstance(node, ast.For | ast.comprehension):
        iterated = node.iter
        values = (
            iterated.elts if isinstance(iterated, ast.Tuple | ast.List) else [ast.Subscript(iterated, ast.Name("_"))]
        )
        for value in values:
            yield node.target, value


def _names(target: ast.expr) -> list[tuple[str, int | None]]:
    """Return the names of a target of an assignment, each with its place in a tuple."""
    if isinstance(target, ast.Name):
        return [(target.id, None)]
    if isinstance(target, ast.Tuple):
        return [(one.id, place) for place, one in enumerate(target.elts) if isinstance(one, ast.Name)]
    return []


def filled(text: str) -> str:
    """Return a text for ``format`` with its places as holes."""
    made, rest = "", text
    while "{" in rest and "}" in rest:
        before, _, rest = rest.partition("{")
        made += before + HOLE
        rest = rest.partition("}")[2]
    return made + rest


def letters(text: str) -> int:
    return sum(letter.isalpha() for letter in text)
