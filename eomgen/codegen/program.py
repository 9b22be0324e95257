"""Program: the complete model in one target-independent form, plain data that can be dumped to JSON.

Expressions are nested tuples over leaves: an integer ``n`` is local value n of the function (``-n`` its negative),
``("K", number)`` a constant, ``("in", block, index)`` an input component, ``("w", slot)`` a value that an earlier part
left in the workspace, ``("neg", x)`` a negative; every other tuple is an operation named as in ``symbolic.tape.Op``.
This module does not know C, and the templates do not know mechanics.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Union

from eomgen.base.data import dataclass, field
from eomgen.system.signals import PythonFunction
from eomgen.system.system import Quantity

#: Operations per part at most; a function this long compiles in about a second.
PART_LIMIT = 1500
#: Largest number of operations in one statement; longer statements are harder to read, not faster.
NEST_LIMIT = 6

#: Numbers in the widest vector of processors.
WIDEST = 8

Expression = Union[int, tuple[Any, ...]]  # noqa: UP007  # evaluated at run time by readers of the type


@dataclass(frozen=True)
class Statement:
    """One statement of a part.

    ``kind`` and ``data``: ``label`` (text); ``let`` (local number, expression); ``sincos`` (sine's and cosine's local
    number, expression); ``angles`` (a tuple of such triples, taken together); ``out`` (output number, component,
    expression); ``fill`` (output number, size): zeros everywhere; ``save`` (slot, expression): into the workspace;
    ``loop`` (number in ``Program.loops``, slot of the first gathered value, slot of the first result); ``call`` (number
    in ``Program.external``, slot of the first operand, slot of the first result); ``share`` (number in
    ``Program.shared``, slots of the values that the statements read, slots of their results and components of the
    outputs, in this order, output numbers, numbers), of several calls one after the other if these are computed
    together: none reads a result of another; ``add`` (number
    in ``Program.loops``, slot of the first gathered value, output numbers): a loop that adds to these; ``gather``
    (slot, step, block or "w", index, step, length): equally spaced places into the workspace; ``spread`` (output
    number, component, step, slot, step, length, sign): equally spaced slots into an output; ``circular`` (slot of the
    first sine, slot of the first cosine, block, index, step, length): sines and cosines of equally spaced inputs into
    the workspace; ``repeat`` (number of iterations, statements, inputs, outputs): a loop over k; whose statements read
    components of block ``read`` and fill output 0; with a fifth number, within this loop a loop over j of this length.

    ``read`` and ``given`` are expressions of k: ``("row", block, start, step)`` is component start + step k of a block,
    of the workspace ``"w"``, or, by number, of an output, ``("row", block, places)`` component places[k], ``("numbers",
    values)`` constant values[k], ``("choice", block, (end, start, step), ...)`` or ``("choice", "numbers", (end,
    value), ...)`` the value of the first range with k < end. Expressions of j and k are ``("cell", block, start, inner,
    step)``: start + inner j + step k, ``("cell", block, places, step)``: places[j] + step k, and ``("cells", values)``:
    values[j]. Other expressions are constant.
    """

    kind: str
    data: tuple[Any, ...]


@dataclass(frozen=True)
class FunctionPart:
    """A chunk of a function that is compiled separately.

    ``inputs`` names the input blocks that the statements read, ``outputs`` numbers the outputs of the function that the
    statements fill, ``workspace`` says whether the statements read or write the workspace, and ``operations`` counts
    the operations. ``names`` are names of local values in mechanics, (number, text); a target makes names legal.
    """

    statements: tuple[Statement, ...]
    inputs: tuple[str, ...]
    outputs: tuple[int, ...]
    workspace: bool
    operations: int
    names: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class OutputArray:
    """An output of a function, row-major. ``argument`` is the name of the output in C, different from names of inputs
    and words of C."""

    name: str
    argument: str
    shape: tuple[int, ...]
    size: int
    description: str


@dataclass(frozen=True)
class ProgramFunction:
    """A function of the generated code: inputs in the order of INPUT_BLOCKS, then outputs, and parts.

    ``parts`` run one after another; ``workspace`` is the number of values on the stack that pass from part to part.
    ``operations`` are the operations in the text, ``counts`` the counts of ``System.counts`` by kind. ``same_as`` names
    an earlier function with the same results, which is called to avoid a second computation; then the part is empty.
    """

    name: str
    description: str
    inputs: tuple[str, ...]
    outputs: tuple[OutputArray, ...]
    parts: tuple[FunctionPart, ...]
    workspace: int
    operations: int
    counts: Mapping[str, int]
    same_as: str = ""


@dataclass(frozen=True)
class Addition:
    """Additions of loop elements ``first <= element < end`` to an output of the function. For each j, ``sign`` times
    column ``columns[j]`` of the element's row is added to component ``places[j] + step (element - first)`` of output
    number ``output``, or to ``places[j] + starts[element]`` if ``starts`` is not empty."""

    first: int
    end: int
    output: int
    sign: int
    step: int
    columns: tuple[int, ...]
    places: tuple[int, ...]
    starts: tuple[int, ...] = ()


@dataclass(frozen=True)
class ProgramLoop:
    """A loop over elements with the same operations; see ``symbolic.map`` for the meaning.

    Attributes
    ----------
    gathered, results : int
        Numbers of values that the loop reads from, and leaves in, the workspace.
    lanes : number of elements evaluated side by side; partial sum ``lane`` adds every lanes-th element, and the partial
        sums are added after the loop.
    constants : numbers of the elements, (columns, count).
    index : for each gathered slot, the places of the gathered values: ranges (end, start, step), start + step element
        up to an end, or empty if the places are in a column of ``places``, (count, number of such slots).
    shared, initial : places among the gathered values, of values that all elements share and of the first carries.
    sums, stacked : number of sums over the elements, and number of values in the row of each element.
    statements : outputs 0, 1 and 2 are the terms of the sums, the next carries and the element's rows; ``reads`` names
        the blocks among ``element, shared, gather, carry`` that the statements read.
    additions : targets of the rows that are added to outputs of the function that runs the loop, instead of left in the
        workspace.
    outputs : number of outputs to which the loop adds; ``Addition.output`` counts these outputs from 0.
    """

    label: str
    count: int
    lanes: int
    gathered: int
    results: int
    constants: tuple[tuple[float, ...], ...]
    index: tuple[tuple[tuple[int, int, int], ...], ...]
    places: tuple[tuple[int, ...], ...]
    shared: tuple[int, ...]
    initial: tuple[int, ...]
    sums: int
    stacked: int
    statements: tuple[Statement, ...]
    reads: tuple[str, ...]
    additions: tuple[Addition, ...] = ()
    outputs: int = 0


@dataclass(frozen=True)
class ProgramShared:
    """Operations that occur several times in functions, with other operands and numbers, and become one C function.

    Attributes
    ----------
    labels : labels of the paragraphs in which the operations occur
    calls : number of occurrences
    reads, numbers : how many values the statements read from the workspace, and numbers from a table
    results : how many values they leave in the workspace, and in each output of the calling function
    operations : number of operations in ``statements``
    statements : read blocks ``read`` and ``number``; output 0 is the workspace, the others are the caller's
    """

    labels: tuple[str, ...]
    calls: int
    reads: int
    numbers: int
    results: tuple[int, ...]
    operations: int
    statements: tuple[Statement, ...]

    @property
    def places(self) -> int:
        """Number of slots and components of one call in a ``share`` statement."""
        return self.reads + sum(self.results)

    def single_calls(
        self, places: Sequence[int], numbers: Sequence[float]
    ) -> Iterator[tuple[Sequence[int], Sequence[float]]]:
        """Yield the places and numbers of each call of a ``share`` statement."""
        for k in range(len(places) // self.places):
            yield places[k * self.places :][: self.places], numbers[k * self.numbers :][: self.numbers]


@dataclass(frozen=True)
class ProgramCurve:
    """A function of one number as polynomials between breaks.

    Attributes
    ----------
    rows : (pieces + 1, degree + 2)
        The start of a piece, then the coefficients in powers of the distance from the start, lowest first; the last row
        is the end.
    outside : ``error``, ``hold`` or ``periodic``; ``first`` and ``last`` are the held values.
    """

    name: str
    rows: tuple[tuple[float, ...], ...]
    outside: str
    first: float
    last: float


@dataclass(frozen=True)
class SceneSource:
    """A C file that the scene brings along.

    Attributes
    ----------
    name : of the file in the folder of the C
    written : of the file that the user wrote
    text : contents of the file
    functions : called functions of the file
    prototypes : declarations of called functions
    python : the function in Python that the file calls, of a prototype
    """

    name: str
    written: str
    text: str
    functions: tuple[str, ...]
    prototypes: tuple[str, ...]
    python: PythonFunction | None = None


@dataclass(frozen=True)
class ProgramExternal:
    """An external function that functions call, or its slopes.

    Attributes
    ----------
    label : of the function
    columns : for each derivative, the operands along which slopes are taken
    arguments, parameters, results : numbers of the function itself
    scales : typical size of each operand, for differences
    function, slopes : names of the C functions of values and of exact slopes; no name: slopes by differences
    real : number type of these C functions
    """

    label: str
    columns: tuple[tuple[int, ...], ...]
    arguments: int
    parameters: int
    results: int
    scales: tuple[float, ...]
    function: str
    slopes: str
    real: str


@dataclass(frozen=True)
class Program:
    """The complete input of the templates.

    Fields without a line here are fields of ``System``; ``initial_z`` belongs to the initial state, and ``version`` is
    the version of eomgen.

    Attributes
    ----------
    prefix : str
        Of every exported symbol; a legal identifier.
    sizes : mapping
        ``q, v, z, u, p, lam, bodies``, ``base``, and of the blocks of derivatives that functions ask for.
    factors : tuple of mappings
        group, name, q_start, q_size, v_start, v_size.
    base_zeros : tuple of int
        Components of the base struct that are zero at all times, so that no function reads them.
    base_read, base_of_step : tuple of int, Part
        Components of the base struct that the equations of a step read, and the statements that give these alone, as
        one output. No statements if tables or loops give these components.
    angles : tuple of str
        Numbers of q after the factors: references of angles that are counted over turns.
    base_fields : tuple of (name, size, meaning)
    functions : tuple of ProgramFunction
    loops : tuple of ProgramLoop
    shared : tuple of ProgramShared
    curves : tuple of ProgramCurve
    series : tuple of ProgramFunction
        Of a Taylor stepper: order 0, and coefficient k + 1; see ``codegen.series.recurrence`` for the blocks of these
        functions.
    constants : tuple of Quantity
        Numbers in the functions that have a name.
    method : mapping
        Filled by the integrators; empty when the model is functions only.
    warnings : tuple of str
        Warnings repeated by every run.
    left_out : tuple of str
        Constraint rows that follow from other rows at the default parameters, and may not at other parameters.
    row_units : tuple of str
        Of the constraint rows: m, 1 or m/s.
    frames : tuple of str
        Bodies and named frames that the functions of frames give, in order.
    sources : tuple of SceneSource
        C files that the scene brings along.
    external : tuple of ProgramExternal
        Functions of these files, and their slopes, that functions call.
    start : str
        A note on the initial state, unless it consists of the initial values of joints.
    patterns : mapping from str to str
        Positions of the nonzeros of ``iteration`` and of derivatives in all arguments, by the names of the outputs;
        see ``system.sparsity``.
    coordinates, velocities : tuples of Quantity
        Components of q and v with the values at the start, for the manifest; empty if no description gives units.
    controller : mapping
        Clocks and rows of samples of a controller alone, see ``integrators.events.controller_data``; empty for models.
    bounds : mapping from str to (lower, upper)
        Ends of the ranges of parameters and coordinates, by name; None for a side without an end.
    uniform : bool
        Whether the folder has all functions with one signature, too.
    later : tuple of str
        Functions that no run calls, so that a library may be used before these are compiled.
    """

    prefix: str
    description: str
    sizes: Mapping[str, int]
    factors: tuple[Mapping[str, Any], ...]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    states: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    bodies: tuple[str, ...]
    multipliers: tuple[str, ...]
    base_fields: tuple[tuple[str, int, str], ...]
    functions: tuple[ProgramFunction, ...]
    loops: tuple[ProgramLoop, ...]
    initial_q: tuple[float, ...]
    initial_v: tuple[float, ...]
    initial_z: tuple[float, ...]
    dof_parent: tuple[int, ...]
    discontinuities: tuple[Mapping[str, float], ...]
    facts: Mapping[str, bool]
    defaults: Mapping[str, Any]
    kept: tuple[str, ...]
    dropped: tuple[str, ...]
    notes: tuple[str, ...]
    version: str
    asked_q: tuple[float, ...] = ()
    asked_v: tuple[float, ...] = ()
    constants: tuple[Quantity, ...] = ()
    beams: tuple[str, ...] = ()
    slopes: tuple[Mapping[str, Any], ...] = ()
    axes: tuple[Mapping[str, Any], ...] = ()
    method: Mapping[str, Any] = field(default_factory=dict)
    curves: tuple[ProgramCurve, ...] = ()
    series: tuple[ProgramFunction, ...] = ()
    validity: tuple[Mapping[str, Any], ...] = ()
    start: str = ""
    angles: tuple[str, ...] = ()
    base_zeros: tuple[int, ...] = ()
    base_read: tuple[int, ...] = ()
    base_of_step: FunctionPart | None = None
    warnings: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    sampled: tuple[Mapping[str, float], ...] = ()
    row_units: tuple[str, ...] = ()
    frames: tuple[str, ...] = ()
    sources: tuple[SceneSource, ...] = ()
    external: tuple[ProgramExternal, ...] = ()
    patterns: Mapping[str, str] = field(default_factory=dict)
    coordinates: tuple[Quantity, ...] = ()
    velocities: tuple[Quantity, ...] = ()
    controller: Mapping[str, Any] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    shared: tuple[ProgramShared, ...] = ()
    uniform: bool = False
    later: tuple[str, ...] = ()

    def function(self, name: str) -> ProgramFunction:
        """Return a function by name. Raises KeyError with the known names."""
        for function in self.functions:
            if function.name == name:
                return function
        raise KeyError(f"no function {name!r}; there are {', '.join(self.function_names)}")

    @property
    def function_names(self) -> tuple[str, ...]:
        return tuple(function.name for function in self.functions)

    def input_size(self, block: str) -> int:
        """Return the number of reals in an input block of functions, by the name of the block: 1 for ``t``. Blocks of
        rates and directions have the size of v (``a, j, s``) or of u (``u_dot, u_ddot``). Raises KeyError."""
        if block == "t":
            return 1
        return self.sizes[{"a": "v", "j": "v", "s": "v", "u_dot": "u", "u_ddot": "u"}.get(block, block)]

    @property
    def has_base(self) -> bool:
        """Whether a function takes the state of a moving base as input, or the function ``base`` fills this state."""
        return any("base" in function.inputs or function.name == "base" for function in self.functions)
