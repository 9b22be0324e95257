"""The C that is translated: its declarations and functions with the results of their analysis, types of values common
to all lanes or per lane, and regions of statements that the same lanes come to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pycparser import c_ast
from pycparser.c_generator import CGenerator

from eomgen.base.data import dataclass, field


class Type:
    """A type of an expression or of a variable."""


@dataclass(frozen=True)
class NoValue(Type):
    """No value."""


@dataclass(frozen=True)
class Real(Type):
    """A number in each lane."""


@dataclass(frozen=True)
class SharedNumber(Type):
    """A number that all lanes have in common: literals, and tables of a method's coefficients."""


@dataclass(frozen=True)
class UniformInteger(Type):
    """A whole number that all lanes have in common: counters of loops, sizes, places."""


@dataclass(frozen=True)
class LaneIntegers(Type):
    """A whole number in each lane."""


@dataclass(frozen=True)
class LaneMask(Type):
    """The result of a comparison in each lane: all bits set, or none."""


@dataclass(frozen=True)
class LaneStructure(Type):
    """A structure, by name, with values per lane in all members."""

    name: str


@dataclass(frozen=True)
class Pointer(Type):
    """An address common to all lanes, of values per lane."""

    to: Type


@dataclass(frozen=True)
class Array(Type):
    """An array; ``size`` is the text of the dimension."""

    of: Type
    size: str


@dataclass(frozen=True)
class Other(Type):
    """Values passed through unchanged, such as members that are characters or functions."""

    text: str


def type_text(kind: Type) -> str:
    """Return the C text of a type for lanes; arrays occur as targets of pointers only. Raises TypeError for others."""
    match kind:
        case Real():
            return "real"
        case SharedNumber():
            return "double"
        case UniformInteger():
            return "long"
        case LaneIntegers() | LaneMask():
            return "eg_wholes"
        case LaneStructure(name) | Other(name):
            return name
        case Pointer(Array(of, size)):
            return f"{type_text(of)} (*)[{size}]"
        case Pointer(to):
            return f"{type_text(to)} *"
        case NoValue():
            return "void"
    raise TypeError(f"no C text of {kind}")


def element(kind: Type) -> Type:
    """Return the type of the elements of a pointer or an array."""
    if isinstance(kind, Array):
        return kind.of
    if isinstance(kind, Pointer):
        return kind.to
    raise TypeError(f"{kind} has no elements")


def leaf(kind: Type) -> Type:
    """Return the innermost element type of an address, or of an array of arrays."""
    while isinstance(kind, Pointer | Array):
        kind = element(kind)
    return kind


@dataclass
class Region:
    """Statements that the same lanes execute, and the mask variable of these lanes; ``outer`` is the enclosing
    region."""

    mask: str
    outer: Region | None = None
    #: The loop whose body is this region.
    loop: Loop | None = None
    #: Whether some lanes left from within a block of the region.
    left: bool = False


@dataclass
class Loop:
    """A loop of the source.

    Attributes
    ----------
    region : of the loop's body; of a loop that is not parted the region around the loop
    run : variable for the lanes that take another iteration; empty if not parted
    parted : whether lanes may leave the loop, or an iteration, at different times
    """

    region: Region
    run: str = ""
    parted: bool = False


@dataclass
class LaneVariable:
    """A variable of the function, and the region of its declaration."""

    type: Type
    region: Region
    null: bool = False


_WHOLE = {"int", "long", "long int", "unsigned", "unsigned int", "size_t"}
#: Of tables; texts are not translated.
_SMALL = {"signed char", "unsigned char", "short", "unsigned short"}


class UntranslatableConstruct(Exception):
    """A construct that cannot be translated, with the position."""


def no_lanes(construct: str, node: Any) -> UntranslatableConstruct:
    """Return the error for a construct."""
    where = f" ({node.coord})" if getattr(node, "coord", None) else ""
    return UntranslatableConstruct(f"{construct}{where}")


@dataclass
class Routine:
    """A function of the source.

    Attributes
    ----------
    varying : names of whole numbers, parameters or variables, with a value per lane
    elements : types of the targets of pointers among the parameters, from the callers
    widened : tables with a copy per lane, because a function takes these tables and tables of lanes
    given : pointers among the parameters that some caller passes; other pointers are null
    outside : pointers among the parameters to memory with numbers of lanes that are not active, too
    counters : whole numbers that are only counters of loops
    gives : the pointer that is returned, if one is, may be other than null
    """

    node: Any
    parameters: list[tuple[str, Type]]
    result: Type
    varying: set[str] = field(default_factory=set)
    elements: dict[str, Type] = field(default_factory=dict)
    widened: set[str] = field(default_factory=set)
    given: set[str] = field(default_factory=set)
    outside: set[str] = field(default_factory=set)
    counters: frozenset[str] = frozenset()
    gives: bool = False

    @property
    def name(self) -> str:
        return str(self.node.decl.name)


@dataclass
class LaneSource:
    """The declarations of a C file by name: structures with types of members, type names, enumerators, constant tables,
    functions to be translated, functions of the model, and functions for single trajectories."""

    structures: dict[str, dict[str, Type]] = field(default_factory=dict)
    names: dict[str, Type] = field(default_factory=dict)
    enumerators: set[str] = field(default_factory=set)
    tables: dict[str, Type] = field(default_factory=dict)
    routines: dict[str, Routine] = field(default_factory=dict)
    #: Functions of the model, compiled for lanes from a separate text: types of the parameters.
    functions: dict[str, list[Type]] = field(default_factory=dict)
    #: Functions for a single trajectory, called lane by lane: types of the parameters.
    foreign: dict[str, list[Type]] = field(default_factory=dict)
    #: Texts of declarations, in order.
    texts: list[str] = field(default_factory=list)


def read(tree: Any, outputs: Mapping[str, list[int]]) -> LaneSource:
    """Return types, tables and functions of a parsed C file, with texts of its declarations for lanes; ``outputs`` has
    the names of the model's functions."""
    source = LaneSource(names={"real": Real(), "eomgen_real": Real()})
    for item in tree.ext:
        if isinstance(item, c_ast.Typedef):
            _read_type(item, source)
        elif isinstance(item, c_ast.FuncDef):
            _read_routine(item, source)
        elif isinstance(item, c_ast.Decl) and isinstance(item.type, c_ast.FuncDecl):
            if item.name in outputs:
                source.functions[item.name] = [kind for _, kind in _parameters(item.type, source)]
            else:
                _read_foreign(item, source)
        elif isinstance(item, c_ast.Decl):
            _read_table(item, source)
    return source


def type_of(node: Any, source: LaneSource) -> Type:
    """Return the type of a declarator of the syntax tree, with whole numbers that all lanes share. `source` has the
    known type names. Raises UntranslatableConstruct."""
    match node:
        case c_ast.TypeDecl():
            return type_of(node.type, source)
        case c_ast.PtrDecl():
            if isinstance(node.type, c_ast.FuncDecl):
                return Other("void *")
            return Pointer(type_of(node.type, source))
        case c_ast.ArrayDecl():
            return Array(type_of(node.type, source), expression_text(node.dim))
        case c_ast.IdentifierType():
            name = " ".join(node.names)
            if name in source.names:
                return source.names[name]
            if name == "void":
                return NoValue()
            if name == "double":
                return Real()
            if name in _WHOLE or name in _SMALL:
                return UniformInteger()
            return Other(name)
    raise no_lanes(f"a declaration of {type(node).__name__}", node)


def in_lanes(kind: Type) -> Type:
    """Return a type with a whole number in each lane in place of shared ones, also within arrays and pointers."""
    match kind:
        case UniformInteger():
            return LaneIntegers()
        case Array(of, size):
            return Array(in_lanes(of), size)
        case Pointer(to):
            return Pointer(in_lanes(to))
    return kind


def expression_text(node: Any) -> str:
    """Return an expression as C text."""
    return str(CGenerator().visit(node))


def _read_type(item: Any, source: LaneSource) -> None:
    """Add a typedef to the names of the source: an enumeration, a structure with members per lane, or another type.
    Members of settings stay common to all lanes. Texts of enumerations and structures are appended to
    ``source.texts``."""
    kind = item.type.type if isinstance(item.type, c_ast.TypeDecl) else None
    if isinstance(kind, c_ast.Enum):
        source.texts.append(expression_text(item) + ";")
        source.names[item.name] = UniformInteger()
        source.enumerators |= {each.name for each in kind.values.enumerators}
    elif isinstance(kind, c_ast.Struct) and kind.decls is not None:
        members = {each.name: type_of(each.type, source) for each in kind.decls}
        if not item.name.endswith("_settings"):  # whole numbers of settings belong to the method
            members = {name: in_lanes(member) for name, member in members.items()}
        source.structures[item.name] = members
        source.names[item.name] = LaneStructure(item.name)
        lines = [f"    {declaration(name, member)};" for name, member in members.items()]
        tag = kind.name or ""
        source.texts.append("\n".join([f"typedef struct {tag} {{", *lines, f"}} {item.name};"]))
    elif item.name not in source.names:
        source.names[item.name] = type_of(item.type, source)


def _parameters(node: Any, source: LaneSource) -> list[tuple[str, Type]]:
    result = []
    for parameter in node.args.params if node.args else []:
        kind = type_of(parameter.type, source)
        if isinstance(kind, NoValue):
            continue
        if isinstance(kind, Array):
            kind = Pointer(kind.of)
        result.append((parameter.name or "", kind))
    return result


def _read_foreign(item: Any, source: LaneSource) -> None:
    """Register a function of numbers and arrays of numbers that returns a whole number."""
    kinds = [kind for _, kind in _parameters(item.type, source)]
    if type_of(item.type.type, source) == UniformInteger() and all(kind in (Real(), Pointer(Real())) for kind in kinds):
        source.foreign[item.name] = kinds


def _read_routine(item: Any, source: LaneSource) -> None:
    signature = item.decl.type
    result = type_of(signature.type, source)
    if isinstance(result, Pointer) and isinstance(result.to, Other):  # texts of messages
        return
    routine = Routine(item, _parameters(signature, source), result)
    routine.counters = _counters(item)
    source.routines[item.decl.name] = routine


def _read_table(item: Any, source: LaneSource) -> None:
    if item.name is None:  # a structure without a name for the type
        return
    kind = type_of(item.type, source)
    if isinstance(kind, Array) and isinstance(kind.of, Pointer):  # names, which no lane asks for
        return
    if "const" not in item.quals and "const" not in qualifiers(item.type):
        raise no_lanes(f"the variable {item.name} of the whole file", item)
    source.tables[item.name] = shared_type(kind)
    source.texts.append(table_text(item, source.tables[item.name]))


def shared_type(kind: Type) -> Type:
    """Return the type of a constant table, in which numbers are shared by all lanes."""
    match kind:
        case Real():
            return SharedNumber()
        case Other("char"):
            return UniformInteger()
        case Array(of, size):
            return Array(shared_type(of), size)
    return kind


def table_text(item: Any, kind: Type) -> str:
    """Return the declaration of a table that all lanes have in common."""
    text = "0" if item.init is None else expression_text(item.init).replace("K(", "(")
    return f"static const {declaration(item.name, kind)} = {f'{{ {text} }}' if isinstance(kind, Array) else text};"


def qualifiers(node: Any) -> list[str]:
    """Return the qualifiers of the innermost type of a declarator."""
    while not isinstance(node, c_ast.TypeDecl):
        node = node.type
    return list(node.quals)


def declaration(name: str, kind: Type, *, constant: bool = False) -> str:
    """Return the C declaration of a variable of a type, without initial value and semicolon."""
    if isinstance(kind, Pointer) and isinstance(kind.to, Array):
        return declaration(f"(*{name})", kind.to)
    sizes = ""
    while isinstance(kind, Array):
        sizes += f"[{kind.size}]"
        kind = kind.of
    text = type_text(kind)
    return f"{'const ' if constant else ''}{text}{'' if text.endswith('*') else ' '}{name}{sizes}"


class _UseCounts(c_ast.NodeVisitor):  # type: ignore[misc]
    """Visitor that counts the uses of names in a function, and their uses as counters within loops.

    Attributes
    ----------
    everywhere, in_loops : counts by name
    set_in_bodies : names that are set elsewhere than in the head of their loop
    """

    def __init__(self) -> None:
        self.everywhere: dict[str, int] = {}
        self.in_loops: dict[str, int] = {}
        self.set_in_bodies: set[str] = set()
        self._counted: list[str] = []

    def visit_ID(self, node: Any) -> None:
        self.everywhere[node.name] = self.everywhere.get(node.name, 0) + 1
        if node.name in self._counted:
            self.in_loops[node.name] = self.in_loops.get(node.name, 0) + 1

    def visit_Assignment(self, node: Any) -> None:
        if isinstance(node.lvalue, c_ast.ID) and node.lvalue.name in self._counted:
            self.set_in_bodies.add(node.lvalue.name)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: Any) -> None:
        if node.op in {"++", "--", "p++", "p--", "&"} and isinstance(node.expr, c_ast.ID):
            self.set_in_bodies.add(node.expr.name)
        self.generic_visit(node)

    def visit_For(self, node: Any) -> None:
        """Count the uses in a for loop; assignments to the counter in the head of the loop do not count as settings."""
        counted = isinstance(node.init, c_ast.Assignment) and isinstance(node.init.lvalue, c_ast.ID)
        names = [node.init.lvalue.name] if counted else []
        self._counted += names
        for part in (node.init, node.next):  # these may set the counter
            before = set(self.set_in_bodies)
            if part is not None:
                self.visit(part)
            self.set_in_bodies = before
        for part in (node.cond, node.stmt):
            if part is not None:
                self.visit(part)
        del self._counted[len(self._counted) - len(names) :]


def _counters(item: Any) -> frozenset[str]:
    result = _UseCounts()
    result.visit(item.body)
    return frozenset(
        name
        for name, count in result.in_loops.items()
        if count == result.everywhere[name] and name not in result.set_in_bodies
    )
