"""Expressions of a stepper in lanes: values, and assigned places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pycparser import c_ast

from eomgen.base.data import dataclass
from eomgen.products.ensembles.lane_code.source import (
    Array,
    LaneIntegers,
    LaneMask,
    LaneSource,
    LaneStructure,
    LaneVariable,
    NoValue,
    Pointer,
    Real,
    Region,
    Routine,
    SharedNumber,
    Type,
    UniformInteger,
    element,
    expression_text,
    in_lanes,
    leaf,
    no_lanes,
    type_of,
    type_text,
)

#: Functions of the language for numbers of lanes.
_OF_A_NUMBER = {"fabs": "EG_ABS", "floor": "eg_floor"}
_COMPARISONS = {"<", ">", "<=", ">=", "==", "!="}


@dataclass(frozen=True)
class TypedText:
    """The C text of an expression for lanes, and its type; ``null``: whether the text is a pointer known to be NULL."""

    text: str
    type: Type
    null: bool = False

    def as_pointer(self) -> TypedText:
        """Return an array as the address of the first element."""
        return TypedText(self.text, Pointer(element(self.type)))

    @property
    def known_truth(self) -> bool | None:
        """The value of a condition, if known in advance."""
        return self.text == "1" if isinstance(self.type, UniformInteger) and self.text in {"0", "1"} else None


@dataclass(frozen=True)
class AssignmentTarget:
    """A target of assignments in the C for lanes.

    Attributes
    ----------
    text, type : C text and type of the object
    region : statements with the same active lanes in which it was declared; None for memory of the caller
    lanes : C text of offsets by lane, if lanes have different offsets; else empty
    """

    text: str
    type: Type
    region: Region | None
    lanes: str = ""


class LaneExpressions:
    """Translation of the expressions of one C function to C for lanes.

    Parameters
    ----------
    routine : the function, on which facts are noted for callers and further translations
    outputs : sizes of the output arrays of model functions, by name

    Attributes
    ----------
    top, region : the statements with all lanes of a call, and the position of the statement
    variables : local variables and arguments by name, of the blocks around
    """

    def __init__(self, source: LaneSource, routine: Routine, outputs: Mapping[str, list[int]]) -> None:
        self.source, self.routine, self.outputs = source, routine, outputs
        self.called: list[str] = []
        self.functions: set[str] = set()
        self.foreign: set[str] = set()
        #: Counters that go up once the statement is done.
        self.behind: list[Any] = []
        self._numbers = 0
        #: Pointers that the function compares with NULL, and whether the operand at hand is evaluated for lanes that do
        #: not ask for it, too.
        self._may_be_null = _compared_with_null(routine.node.body)
        self._unasked = False
        self.top = self.region = Region("live")
        self.variables: list[dict[str, LaneVariable]] = [{}]

    def find(self, name: str) -> LaneVariable | None:
        """Return the local variable or argument of a name, None if there is none."""
        return next((scope[name] for scope in reversed(self.variables) if name in scope), None)

    def mask(self) -> str:
        """Return the variable that says which lanes are here."""
        return self.region.mask

    def fresh(self, stem: str) -> str:
        """Return a name that no other variable has."""
        self._numbers += 1
        return f"{stem}_{self._numbers}"

    # -- conversions -------------------------------------------------------------------------------------------------

    def to(self, value: TypedText, kind: Type, node: Any) -> str:
        """Return the C text of a value converted to the type `kind`. Raises UntranslatableConstruct, with the place of
        `node`, if there is no conversion."""
        match kind, value.type:
            case (Real(), Real()) | (LaneIntegers(), LaneIntegers()) | (LaneStructure(), LaneStructure()):
                return value.text
            case (SharedNumber(), SharedNumber()) | (UniformInteger(), UniformInteger()):
                return value.text
            case Real(), SharedNumber() | UniformInteger():
                return f"EG_WIDE((double)({value.text}))"
            case Real(), LaneIntegers():
                return f"eg_real_of({value.text})"
            case LaneIntegers(), UniformInteger():
                return f"EG_WHOLES({value.text})"
            case LaneIntegers(), LaneMask():
                return f"({value.text} & 1)"
            case Pointer(), Pointer() | UniformInteger():
                return value.text
        raise no_lanes(f"{value.type} as {kind} in {value.text}", node)

    def truths(self, value: TypedText) -> str:
        """Return the C text of a mask of the lanes in which a value is not zero."""
        match value.type:
            case LaneMask():
                return value.text
            case LaneIntegers():
                return f"({value.text} != 0)"
            case _:
                return f"EG_WHOLES(({value.text}) ? -1 : 0)"

    def _common(self, left: TypedText, right: TypedText, node: Any) -> tuple[str, str, Type]:
        """Return the C texts of two values converted to the smallest type that holds both, and this type."""
        kinds = {type(left.type), type(right.type)}
        kind = left.type if isinstance(left.type, LaneStructure | Pointer) else right.type
        for wider, of in ((Real(), Real), (SharedNumber(), SharedNumber), (LaneIntegers(), LaneIntegers | LaneMask)):
            if any(issubclass(each, of) for each in kinds):
                kind = wider
                break
        return self.to(left, kind, node), self.to(right, kind, node), kind

    # -- values --------------------------------------------------------------------------------------------------------

    def value(self, node: Any) -> TypedText:
        """Return the C text for lanes, with its type, of an expression of the syntax tree. Counters that the expression
        increments afterwards are kept for the end of the statement. Raises UntranslatableConstruct."""
        match node:
            case c_ast.Constant():
                return TypedText(
                    node.value, UniformInteger() if node.type in {"int", "long int", "long"} else SharedNumber()
                )
            case c_ast.ID():
                return self._value_of_name(node)
            case c_ast.ArrayRef() | c_ast.StructRef():
                target = self.place(node)
                if target.lanes:
                    kind = "real" if isinstance(target.type, Real) else "wholes"
                    return TypedText(f"eg_gather_{kind}({self.mask()}, {target.text}, {target.lanes})", target.type)
                if self._unasked and isinstance(node, c_ast.ArrayRef) and isinstance(node.name, c_ast.ID):
                    name = node.name.name
                    if name in self._may_be_null and isinstance(target.type, Real):
                        return TypedText(f"({name} != NULL ? {target.text} : EG_WIDE(0.0))", target.type)
                return TypedText(target.text, target.type)
            case c_ast.UnaryOp():
                return self._unary(node)
            case c_ast.BinaryOp():
                return self._binary(node)
            case c_ast.TernaryOp():
                return self._choice(node)
            case c_ast.Cast():
                return self._cast(node)
            case c_ast.FuncCall():
                return self.call(node)
        raise no_lanes(f"an expression {type(node).__name__}", node)

    def _value_of_name(self, node: Any) -> TypedText:
        name = node.name
        variable = self.find(name)
        if variable is not None:
            return TypedText(name, variable.type, variable.null)
        if name in self.source.tables:
            return TypedText(name, self.source.tables[name])
        if name in self.source.enumerators:
            return TypedText(name, UniformInteger())
        if name in {"HUGE_VAL", "NAN", "INFINITY"}:
            return TypedText(name, SharedNumber())
        if name == "NULL":
            return TypedText("NULL", Pointer(NoValue()), null=True)
        raise no_lanes(f"the name {name}", node)

    def _unary(self, node: Any) -> TypedText:
        """Return the C text for lanes of a unary expression; postfix increments are kept for the end of the
        statement."""
        if node.op == "sizeof":
            if isinstance(node.expr, c_ast.Typename):
                return TypedText(
                    f"sizeof({type_text(in_lanes(type_of(node.expr.type, self.source)))})", UniformInteger()
                )
            return TypedText(f"sizeof({self.place(node.expr).text})", UniformInteger())
        if node.op == "*":
            target = self.place(node)
            return TypedText(target.text, target.type)
        if node.op == "&":
            target = self.place(node.expr)
            if isinstance(target.type, UniformInteger) and isinstance(node.expr, c_ast.ID):
                self.routine.varying.add(node.expr.name)
                return TypedText(f"&{target.text}", Pointer(LaneIntegers()))
            return TypedText(f"&{target.text}", Pointer(target.type))
        if node.op in {"p++", "p--"}:
            self.behind.append(node)
            return self.value(node.expr)
        value = self.value(node.expr)
        if node.op == "!":
            if isinstance(value.type, LaneMask):
                return TypedText(f"(~{value.text})", LaneMask())
            if isinstance(value.type, LaneIntegers | Real):
                return TypedText(f"(~{self.truths(value)})", LaneMask())
            return TypedText(f"!({value.text})", UniformInteger())
        if node.op in "+-~" and not isinstance(value.type, LaneMask):
            return TypedText(f"({node.op}{value.text})", value.type)
        raise no_lanes(f"the operator {node.op} within an expression", node)

    def _binary(self, node: Any) -> TypedText:
        """Return the C text for lanes of a binary expression: a logical one, an address with an offset, a comparison or
        arithmetic."""
        if node.op in {"&&", "||"}:
            return self._logical(node)
        left_value, right_value = self.value(node.left), self.value(node.right)
        for value, counted in ((left_value, right_value), (right_value, left_value)):
            if (
                isinstance(value.type, Pointer | Array)
                and node.op in "+-"
                and isinstance(counted.type, UniformInteger | LaneIntegers)
            ):
                if isinstance(counted.type, LaneIntegers):
                    raise no_lanes(f"an address of its own in each lane: {expression_text(node)}", node)
                first = (
                    f"{value.text} {node.op} ({counted.text})"
                    if value is left_value
                    else f"{counted.text} + {value.text}"
                )
                return TypedText(f"({first})", Pointer(element(value.type)))
        if isinstance(left_value.type, Pointer) or isinstance(right_value.type, Pointer):
            if left_value.null and right_value.null:
                return TypedText("1" if node.op == "==" else "0", UniformInteger())
            return TypedText(f"({left_value.text} {node.op} {right_value.text})", UniformInteger())
        left, right, kind = self._common(left_value, right_value, node)
        if node.op in _COMPARISONS:
            text = f"({left} {node.op} {right})"
            if isinstance(kind, Real):
                return TypedText(f"((eg_wholes){text})", LaneMask())
            return TypedText(text, LaneMask() if isinstance(kind, LaneIntegers) else UniformInteger())
        if node.op in {"/", "%"} and isinstance(kind, LaneIntegers):
            return TypedText(
                f"eg_{'quotient' if node.op == '/' else 'remainder'}({self.mask()}, {left}, {right})", kind
            )
        return TypedText(f"({left} {node.op} {right})", kind)

    def _logical(self, node: Any) -> TypedText:
        """Return the C text for lanes of ``&&`` or ``||``. A second operand with calls is evaluated only for the lanes
        whose first operand does not decide."""
        left_value = self.value(node.left)
        joint = node.op == "&&"
        if left_value.known_truth is not None:
            return self.value(node.right) if left_value.known_truth is joint else left_value
        if not _has_calls(node.left) and not _has_calls(node.right):
            second = self.value(node.right)
            if second.known_truth is not None:
                return left_value if second.known_truth is joint else second
        if isinstance(left_value.type, UniformInteger | SharedNumber | Pointer):
            second = self.value(node.right)
            if isinstance(second.type, UniformInteger | SharedNumber | Pointer):
                return TypedText(f"({left_value.text} {node.op} {second.text})", UniformInteger())
            constant = "EG_WHOLES(0)" if joint else "EG_WHOLES(-1)"
            right = self.truths(second)
            return TypedText(
                f"({left_value.text} ? {right if joint else constant} : {constant if joint else right})", LaneMask()
            )
        left = self.truths(left_value)
        if not _has_calls(node.right):
            second = self._for_all(node.right)
            return TypedText(f"({left} {'&' if joint else '|'} {self.truths(second)})", LaneMask())
        first, here = self.fresh("first"), self.fresh("m")
        outer = self.region
        self.region = Region(here, outer)
        right = self.truths(self.value(node.right))
        self.region = outer
        asked = f"{outer.mask} & {first}" if joint else f"{outer.mask} & ~{first}"
        result = f"{first} & {right}" if joint else f"{first} | {right}"
        begin = f"const eg_wholes {first} = {left}; eg_wholes {here} = {asked};"
        return TypedText(f"({{ {begin} eg_any({here}) ? {result} : {first}; }})", LaneMask())

    def _for_all(self, node: Any) -> TypedText:
        """Return an operand that is evaluated in all lanes, even without its condition."""
        before, self._unasked = self._unasked, True
        value = self.value(node)
        self._unasked = before
        return value

    def _choice(self, node: Any) -> TypedText:
        """Return the C text for lanes of a conditional expression. A branch with calls is evaluated under the mask of
        its lanes, a branch without calls in all lanes."""
        condition = self.value(node.cond)
        if condition.known_truth is not None:
            return self.value(node.iftrue if condition.known_truth else node.iffalse)
        if isinstance(condition.type, UniformInteger | SharedNumber | Pointer):
            if_true, if_false, kind = self._common(self.argument(node.iftrue), self.argument(node.iffalse), node)
            return TypedText(f"({condition.text} ? {if_true} : {if_false})", kind)
        holds = self.fresh("holds")
        prelude = f"const eg_wholes {holds} = {self.truths(condition)}; "
        outer = self.region
        values = []
        for branch, mask in ((node.iftrue, holds), (node.iffalse, f"~{holds}")):
            if _has_calls(branch):
                here = self.fresh("m")
                prelude += f"eg_wholes {here} = {outer.mask} & {mask}; "
                self.region = Region(here, outer)
                values.append(self.value(branch))
                self.region = outer
            else:
                values.append(self._for_all(branch))
        if any(isinstance(value.type, Pointer | Array | LaneStructure) for value in values):
            raise no_lanes(f"an address of its own in each lane: {expression_text(node)}", node)
        if_true, if_false, kind = self._common(values[0], values[1], node)
        if isinstance(kind, UniformInteger | SharedNumber):
            kind = Real() if isinstance(kind, SharedNumber) else LaneIntegers()
            if_true, if_false = (self.to(value, kind, node) for value in values)
        return TypedText(f"({{ {prelude}{pick(holds, if_true, if_false, kind)}; }})", kind)

    def _cast(self, node: Any) -> TypedText:
        kind = type_of(node.to_type.type, self.source)
        value = self.value(node.expr)
        match kind, value.type:
            case Real(), _:
                return TypedText(self.to(value, kind, node), Real())
            case UniformInteger(), UniformInteger() | LaneIntegers():
                return value
            case UniformInteger(), Real():
                return TypedText(f"eg_wholes_of({value.text})", LaneIntegers())
        raise no_lanes(f"the cast {expression_text(node)}", node)

    # -- places --------------------------------------------------------------------------------------------------------

    def place(self, node: Any) -> AssignmentTarget:
        """Return the object that an expression names, as a target of assignments; other expressions as targets without
        region."""
        match node:
            case c_ast.ID():
                variable = self.find(node.name)
                if variable is None:
                    value = self._value_of_name(node)
                    return AssignmentTarget(value.text, value.type, None)
                return AssignmentTarget(node.name, variable.type, variable.region)
            case c_ast.UnaryOp() if node.op == "*":
                value = self.value(node.expr)
                return AssignmentTarget(f"(*{value.text})", element(value.type), None)
            case c_ast.StructRef():
                return self._member(node)
            case c_ast.ArrayRef():
                return self._element(node)
        value = self.value(node)
        return AssignmentTarget(value.text, value.type, None)

    def _member(self, node: Any) -> AssignmentTarget:
        if node.type == "->":
            value = self.value(node.name)
            kind, region, text = element(value.type), None, f"{value.text}->{node.field.name}"
        else:
            target = self.place(node.name)
            kind, region, text = target.type, target.region, f"{target.text}.{node.field.name}"
            if target.lanes and isinstance(kind, LaneStructure):
                member = self.source.structures[kind.name][node.field.name]
                return AssignmentTarget(text if isinstance(member, Array) else f"&{text}", member, None, target.lanes)
        if not isinstance(kind, LaneStructure):
            raise no_lanes(f"a member of {kind}", node)
        return AssignmentTarget(text, self.source.structures[kind.name][node.field.name], region)

    def _element(self, node: Any) -> AssignmentTarget:
        """Return an element of an array as a target, with an offset in each lane if the index differs between lanes.
        Elements of tables that lanes share become a look-up in place of a target."""
        target = self.place(node.name)
        is_routine = isinstance(node.name, c_ast.ID) and self._is_own(node.name.name)
        region = target.region if is_routine or isinstance(target.type, Array) else None
        index = self.value(node.subscript)
        kind = element(target.type)
        if target.lanes and isinstance(index.type, UniformInteger) and isinstance(kind, Real | LaneIntegers):
            return AssignmentTarget(f"{target.text} + {index.text}", kind, None, target.lanes)
        if isinstance(index.type, UniformInteger) and not target.lanes:
            return AssignmentTarget(f"{target.text}[{index.text}]", kind, region)
        if target.lanes or not isinstance(kind, Real | LaneIntegers | SharedNumber | UniformInteger | LaneStructure):
            raise no_lanes(f"an element of its own in each lane: {expression_text(node)}", node)
        lanes = self.to(index, LaneIntegers(), node)
        if isinstance(kind, LaneStructure):  # the distance of members is the number of vectors of the structure
            stride = f"(int64_t)(sizeof({type_text(kind)}) / sizeof(eg_wide))"
            return AssignmentTarget(f"{target.text}[0]", kind, None, f"({lanes} * {stride})")
        if isinstance(kind, SharedNumber | UniformInteger):
            looked = "table" if isinstance(kind, SharedNumber) else "counts"
            text = f"eg_look_up_{looked}({self.mask()}, {target.text}, {lanes})"
            return AssignmentTarget(text, Real() if isinstance(kind, SharedNumber) else LaneIntegers(), None)
        return AssignmentTarget(target.text, kind, region, lanes)

    # -- calls -------------------------------------------------------------------------------------------------------

    def call(self, node: Any) -> TypedText:
        """Return the C text of a function call for lanes: of a constant, a memory function, arithmetic, a routine of
        the stepper, a model function, or a function for single trajectories. Raises UntranslatableConstruct for
        others."""
        name = node.name.name if isinstance(node.name, c_ast.ID) else ""
        arguments = list(node.args.exprs) if node.args else []
        if name == "K":
            value = self.value(arguments[0])
            return value if isinstance(value.type, Real) else TypedText(f"EG_WIDE((double)({value.text}))", Real())
        if name in {"memcpy", "memset", "memmove", "memcmp"}:
            return self._memory(name, arguments, node)
        if name == "offsetof":
            return TypedText(expression_text(node), UniformInteger())
        if name.startswith("EG_") or name in _OF_A_NUMBER:
            return self._arithmetic(_OF_A_NUMBER.get(name, name), arguments, node)
        if name in self.source.routines:
            return self._routine(name, arguments, node)
        if name in self.outputs:
            return self._function(name, arguments, node)
        if name in self.source.foreign:
            return self._foreign(name, arguments, node)
        raise no_lanes(f"a call of {expression_text(node.name)}", node)

    def _foreign(self, name: str, arguments: list[Any], node: Any) -> TypedText:
        """Return the call of a function for a single trajectory, which its wrapper calls for one active lane after
        another. Arrays are followed by their sizes."""
        texts = []
        for item, kind in zip(arguments, self.source.foreign[name], strict=True):
            value = self.value(item)
            if isinstance(kind, Real):
                texts.append(self.to(value, kind, node))
            elif isinstance(value.type, Array) and isinstance(value.type.of, Real):
                texts.append(f"{value.text}, {value.type.size}")
            else:
                raise no_lanes(f"an array of unknown size: {expression_text(item)}", node)
        self.foreign.add(name)
        return TypedText(f"eg_each_{name}({', '.join([self.mask(), *texts])})", LaneIntegers())

    def _arithmetic(self, name: str, arguments: list[Any], node: Any) -> TypedText:
        """Return the call of an arithmetic function `name` of C for lanes. Pointers are to variables of these lanes;
        raises UntranslatableConstruct for others."""
        texts = []
        for item in arguments:
            value = self.value(item)
            if isinstance(value.type, Pointer):
                target = self.place(item.expr) if isinstance(item, c_ast.UnaryOp) else None
                if target is None or target.region is not self.region:
                    raise no_lanes(f"a result in memory with numbers of other lanes: {expression_text(item)}", node)
                texts.append(value.text)
            else:
                texts.append(self.to(value, Real(), node))
        return TypedText(f"{name}({', '.join(texts)})", Real())

    def _memory(self, name: str, arguments: list[Any], node: Any) -> TypedText:
        """Return the C text for memset, memcpy, memmove or memcmp, in which only active lanes are written."""
        target = self.value(arguments[0])
        size = self.value(arguments[2]).text
        if name == "memset":
            return TypedText(f"eg_clear({self.mask()}, {target.text}, {size})", NoValue())
        if isinstance(arguments[1], c_ast.TernaryOp):
            condition = self.value(arguments[1].cond)
            if not isinstance(condition.type, UniformInteger | SharedNumber | Pointer):
                holds = self.truths(condition)
                parts = [
                    f"eg_merge({self.mask()} & {mask}, {target.text}, {self.value(origin).text}, {size})"
                    for mask, origin in ((holds, arguments[1].iftrue), (f"~{holds}", arguments[1].iffalse))
                ]
                return TypedText(", ".join(parts), NoValue())
        origin = self.value(arguments[1])
        if name == "memcmp":
            return TypedText(f"eg_differs({target.text}, {origin.text}, {size})", LaneIntegers())
        return TypedText(f"eg_merge({self.mask()}, {target.text}, {origin.text}, {size})", NoValue())

    def _function(self, name: str, arguments: list[Any], node: Any) -> TypedText:
        self.functions.add(name)
        texts = [
            self.to(self.argument(item), kind, node)
            for item, kind in zip(arguments, self.source.functions[name], strict=True)
        ]
        return TypedText(f"eg_masked_{name}({', '.join([self.mask(), *texts])})", NoValue())

    def argument(self, node: Any) -> TypedText:
        """Return an expression, an array as the address of the first element."""
        value = self.value(node)
        return value.as_pointer() if isinstance(value.type, Array) else value

    def _routine(self, name: str, arguments: list[Any], node: Any) -> TypedText:
        """Return the call of another function of the stepper, with the mask of active lanes as first argument. Notes on
        that routine which parameters vary between lanes, are not null, or point to memory of other lanes, too."""
        routine = self.source.routines[name]
        if name not in self.called:
            self.called.append(name)
        texts = []
        for item, (parameter, kind) in zip(arguments, routine.parameters, strict=True):
            value = self.argument(item)
            if isinstance(kind, UniformInteger):
                if not isinstance(value.type, UniformInteger):
                    routine.varying.add(parameter)
                wanted: Type = LaneIntegers() if parameter in routine.varying else UniformInteger()
                texts.append(value.text if isinstance(wanted, UniformInteger) else self.to(value, wanted, node))
                continue
            if (
                isinstance(kind, Pointer)
                and isinstance(leaf(kind), UniformInteger | Real)
                and isinstance(value.type, Pointer)
            ):
                self._learn(routine, parameter, value.type.to, item)
            if isinstance(kind, Pointer) and not value.null:
                routine.given.add(parameter)
                if not self._is_private(item):
                    routine.outside.add(parameter)
            texts.append(self.to(value, kind, node) if not isinstance(kind, Pointer) else value.text)
        null = isinstance(routine.result, Pointer) and not routine.gives
        return TypedText(f"{name}({', '.join([self.mask(), *texts])})", in_lanes(routine.result), null)

    def _is_own(self, name: str) -> bool:
        """Return whether a name is a pointer among the parameters to memory of the active lanes alone."""
        return name not in self.routine.outside and any(name == each for each, _ in self.routine.parameters)

    def _is_private(self, node: Any) -> bool:
        """Return whether an argument is memory with numbers of the active lanes alone."""
        variable = self.find(node.name) if isinstance(node, c_ast.ID) else None
        if variable is None or variable.region is not self.region:
            return False
        return isinstance(variable.type, Array) or self._is_own(node.name)

    def _learn(self, routine: Routine, parameter: str, kind: Type, node: Any) -> None:
        known = routine.elements.get(parameter)
        if isinstance(kind, NoValue) or known == kind:
            return
        while isinstance(node, c_ast.ArrayRef):  # a row of a table
            node = node.name
        if known is not None and isinstance(leaf(known), Real) and isinstance(node, c_ast.ID):
            self.routine.widened.add(node.name)  # a table filled with numbers of each lane by called functions
            return
        if known is not None and not isinstance(leaf(known), SharedNumber):
            raise no_lanes(f"{parameter} of {routine.name} both the same for all lanes and not", node)
        routine.elements[parameter] = kind

    def initializer(self, node: Any, kind: Type) -> str:
        """Return the C text of an initializer list of a variable of the type `kind`, with members converted to their
        types."""
        members: list[Type]
        if isinstance(kind, LaneStructure):
            members = list(self.source.structures[kind.name].values())
        else:
            members = [element(kind)] * len(node.exprs)
        texts = [
            self.initializer(item, member)
            if isinstance(item, c_ast.InitList)
            else self.to(self.value(item), member, node)
            for item, member in zip(node.exprs, members, strict=False)
        ]
        return "{ " + ", ".join(texts) + " }"


def pick(mask: str, if_true: str, if_false: str, kind: Type) -> str:
    """Return the C text that chooses between two values in each lane.

    Parameters
    ----------
    mask : str
        Mask of the lanes that take ``if_true``.
    if_true, if_false : str
        Texts of the values.
    kind : Type
        Type of both values.
    """
    return f"{'eg_pick' if isinstance(kind, Real) else 'eg_pick_wholes'}({mask}, {if_true}, {if_false})"


def _walk(node: Any) -> Iterator[Any]:
    """Yield a node of the syntax tree, and all nodes below."""
    yield node
    for child in node:
        yield from _walk(child)


def _compared_with_null(node: Any) -> frozenset[str]:
    """Return the names of variables that a function's body compares with NULL by any operator."""
    operations = (each for each in _walk(node) if isinstance(each, c_ast.BinaryOp))
    pairs = ({side.name for side in (each.left, each.right) if isinstance(side, c_ast.ID)} for each in operations)
    return frozenset(name for names in pairs if "NULL" in names for name in names) - {"NULL"}


def _has_calls(node: Any) -> bool:
    """Return whether an expression calls any function but arithmetic ones of a number."""
    called = (each.name for each in _walk(node) if isinstance(each, c_ast.FuncCall))
    names = (name.name if isinstance(name, c_ast.ID) else "" for name in called)
    return any(name not in {"K", *_OF_A_NUMBER} and not name.startswith("EG_") for name in names)
