"""The energy of a cell, likelihood and prior as one formula of fields and data: checks, derivatives and C.

The formula is recorded once, for one cell; its derivatives are made on the tape. Loops over cells, several of them side
by side in vector registers, stand in the template ``c/fields/cells``.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import NAME_RULE, is_legal, shown
from eomgen.base.threads import share
from eomgen.codegen.program import NEST_LIMIT
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.codegen.targets.c.naming import local_names
from eomgen.codegen.targets.c.printer import Printer, indent_lines, wrap_text
from eomgen.codegen.targets.c.templates import environment
from eomgen.errors import DescriptionError, ModelError, Problem, UsageError
from eomgen.products.fields.documents.entries import cell_formula
from eomgen.products.fields.documents.recording import record_at
from eomgen.products.fields.posteriors.mesh import Complex, Reals, Spectrum, Symbol
from eomgen.scene.formula.definitions import named_expressions
from eomgen.symbolic.calculus.partials import gradient, jacobian_vector
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape
from eomgen.toolchain.builder import Builder

#: Names of the loops over cells in the template.
_TAKEN = {"n", "i", "f", "d", "j", "h", "r", "lane", "sum", "lost", "sums", "losses", "total", "both", "added"}


#: Size of arrays from which on threads share the work.
_SHARED = 2**19


@dataclass(frozen=True)
class CellEnergy:
    """The energy of a cell, minus the logarithm of a likelihood up to a constant.

    Attributes
    ----------
    formula : of names of fields, data, parameters, ``where`` and definitions; "0" for a prior alone
    where : named formulas, each of previous names
    parameters : numbers, folded into the C
    smallest : by name of data, the value below which the data have no meaning, such as 0 for counts
    definitions : named expressions of fields, data, parameters and other definitions, in any order; C has the names
    """

    formula: str
    where: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    smallest: Mapping[str, float] = field(default_factory=dict)
    definitions: Mapping[str, str] = field(default_factory=dict)


#: e is the logarithm of the mean number of objects that a cell with a response of 1 has.
_LOG_INTENSITY = {"e": "log_mean + bias*(s - variance/2) - bias*(bias - 1)*variance/2"}
#: Counts of unobserved cells (response 0) carry no information, for any value in the data.
_OBSERVED = {**_LOG_INTENSITY, "observed": "counts if response > 0 else 0"}


def poisson(mean: float, variance: float, bias: float = 1.0, response: bool = False) -> CellEnergy:
    """Return the energy of counts with a Poisson distribution about R mean (1 + delta)^bias/<(1 + delta)^bias>.

    1 + delta = exp(s - variance/2) is a lognormal field. Names: field ``s``, data ``counts`` and, with ``response``,
    ``response`` R from 0 to 1, the share of its objects that a cell is expected to show. Without terms that s does not
    change, the energy is R exp(e) - counts e, e the logarithm of the mean at R = 1; cells with R = 0 drop out. A
    ``FieldPosterior`` refuses data below 0 (ModelError), but neither R above 1 nor counts that are not whole numbers.

    Parameters
    ----------
    mean : float
        Mean number of objects in a cell with a response of 1, above 0.
    variance : float
        Variance of s in a cell, as of ``LinearOperator.variance``.
    bias : float
        Power of 1 + delta in the mean.
    response : bool
        Whether there are data ``response``; without such data R is 1 in all cells.

    Returns
    -------
    CellEnergy
        With the data ``counts`` and, if ``response`` is true, ``response``.

    Raises
    ------
    ModelError
        The mean is not above 0.
    """
    formulas = "exp(e) - counts*e", "response*exp(e) - observed*e"
    return _counts_energy(formulas, response, mean, variance, bias=bias)


def negative_binomial(
    mean: float, variance: float, beta: float, bias: float = 1.0, response: bool = False
) -> CellEnergy:
    """Return the energy of counts with a negative binomial distribution, whose variance is m + m^2/beta.

    m = R mean (1 + delta)^bias/<(1 + delta)^bias> is the mean; for names, checks of data, e and further parameters
    see ``poisson``. The energy is (counts + beta) ln(1 + m/beta) - counts e; cells with R = 0 drop out.

    Parameters
    ----------
    mean, variance : float
        As of ``poisson``.
    beta : float
        Number of failures, above 0; the distribution is Poisson's as beta grows.
    bias : float, optional
        As of ``poisson``.
    response : bool, optional
        As of ``poisson``.

    Returns
    -------
    CellEnergy
        With the data of ``poisson``.

    Raises
    ------
    ModelError, UsageError
        The mean, or beta, is not above 0.
    """
    plain = "(counts + beta)*log(1 + exp(e)/beta) - counts*e"
    partly_seen = "(observed + beta)*log(1 + response*exp(e)/beta) - observed*e"
    return _counts_energy((plain, partly_seen), response, mean, variance, bias=bias, beta=beta)


def gaussian(mean: float, variance: float, deviation: float, bias: float = 1.0, response: bool = False) -> CellEnergy:
    """Return the energy of ``counts`` with normal errors about R mean (1 + delta)^bias/<(1 + delta)^bias>.

    For names and the other parameters see ``poisson``. The energy is (m - counts)^2/(2 deviation^2) with this
    mean m; cells with R = 0 add a constant. Here ``counts`` may be below 0.

    Parameters
    ----------
    mean, variance : float
        As of ``poisson``.
    deviation : float
        Standard deviation of the errors, the same in all cells, in objects; above 0.
    bias : float, optional
        As of ``poisson``.
    response : bool, optional
        As of ``poisson``.

    Returns
    -------
    CellEnergy
        With the data of ``poisson``.

    Raises
    ------
    ModelError, UsageError
        The mean, or the deviation, is not above 0.
    """
    formulas = "(exp(e) - counts)**2/(2*deviation**2)", "(response*exp(e) - counts)**2/(2*deviation**2)"
    made = _counts_energy(formulas, response, mean, variance, bias=bias, deviation=deviation)
    return replace(made, where=_LOG_INTENSITY, smallest={"response": 0.0} if response else {})


def _counts_energy(
    formulas: tuple[str, str], response: bool, mean: float, variance: float, **more: float
) -> CellEnergy:
    """Return the energy of counts by the first of two formulas, or by the second with a ``response``; ``more`` are
    further parameters. Raises ModelError, UsageError."""
    if not mean > 0.0:
        fault = f"the mean of counts is {mean:.6g} [E0795]"
        raise ModelError(Problem("mean", fault, "the mean number of objects in a cell, above 0"))
    for name in ("beta", "deviation"):
        if not more.get(name, 1.0) > 0.0:
            raise UsageError(Problem(name, f"{more[name]:.6g} is invalid [E0819]", "a number above 0"))
    numbers = {"log_mean": math.log(mean), "variance": variance, **more}
    least = {"counts": 0.0, "response": 0.0} if response else {"counts": 0.0}
    return CellEnergy(formulas[response], _OBSERVED if response else _LOG_INTENSITY, numbers, least)


@dataclass(frozen=True)
class CellTape:
    """The energy of a cell on a tape, by references: ``energy``, its gradient by the fields (``residual``), and the
    product of the Hessian with a direction, the input block ``j`` (``curvature``), one for each field."""

    tape: Tape
    energy: Ref
    residual: tuple[Ref, ...]
    curvature: tuple[Ref, ...]

    @property
    def idle(self) -> bool:
        """Whether the energy is the same for all fields."""
        return all(self.tape.value(ref) == 0.0 for ref in self.residual)


def cell_tape(energy: CellEnergy, fields: Sequence[str], data: Sequence[str], masks: Sequence[str] = ()) -> CellTape:
    """Return the energy of a cell, recorded on a new tape, with gradient and Hessian-vector product.

    Parameters
    ----------
    fields, data : sequence of str
        Names in the formula, in the order of the inputs.
    masks : sequence of str
        Names of fields that stand for the product of the field and a mask, whose values follow the data.

    Raises
    ------
    DescriptionError, ModelError
        A formula or a name that cannot be taken.
    """
    tape = Tape()
    algebra = Algebra(tape)
    q, along = algebra.block("f", len(fields)), algebra.block("j", len(fields))
    inputs = algebra.block("d", len(data) + len(masks))
    known: dict[str, Scalar] = dict(zip(fields, q, strict=True))
    for name, value in zip(masks, inputs[len(data) :], strict=True):
        known[name] = known[name] * value
    names = [*fields, *data, *energy.parameters, *energy.where, *energy.definitions]
    for column, name in enumerate(names):
        if not is_legal(name):
            raise DescriptionError(Problem("cell energy", f"the name {shown(name)} is not legal [E0715]", NAME_RULE))
        if name in names[:column]:
            raise DescriptionError(Problem("cell energy", f"two things are called {name} [E0796]", "another name"))
    known |= dict(zip(data, inputs, strict=False))
    known |= {name: algebra.scalar(float(value)) for name, value in energy.parameters.items()}
    defined, of_where = named_expressions(energy.definitions), dict[str, Scalar]()

    def record(key: str, text: str) -> Scalar:
        return record_at(key, algebra, cell_formula(key, text, known, defined, of_where), {**known, **of_where})

    for name, text in energy.where.items():
        of_where[name] = record(f"cell energy (where.{name})", text)
    h = record("cell energy", energy.formula)
    slopes = gradient(tape, h.ref, [item.ref for item in q])
    products = jacobian_vector(tape, slopes, {item.ref: to.ref for item, to in zip(q, along, strict=True)})
    return CellTape(tape, h.ref, tuple(slopes), tuple(products))


def source(energy: CellEnergy, made: CellTape, fields: Sequence[str], data: Sequence[str], single: bool = False) -> str:
    """Return the text of the C of a cell's energy, gradient and curvature, and of operations on spectra; for an energy
    that does not depend on the fields, the operations alone.

    ``made`` is the recorded energy, ``fields`` and ``data`` are inputs by name. ``single`` adds gradients with fields
    and spectra in single precision; operations are in double.
    """
    inputs = {"f": "f[{}]", "d": "d[{}]", "j": "j[{}]"}

    def body(refs: Sequence[Ref], targets: Sequence[str]) -> str:
        plan = schedule(made.tape, [refs], ("f", "d", "j"), 10**9, NEST_LIMIT, fill=False, reroll=False)
        names = local_names(plan.parts[0].names, _TAKEN)
        return indent_lines(Printer(inputs, [list(targets)], names=names).lines(plan.parts[0].statements), 2)

    results = [f"r[{k}]" for k in range(len(fields))]
    text = environment().get_template("fields/cells.c.jinja")
    idle = made.idle
    return wrap_text(
        text.render(
            formula=energy.formula,
            single=single and not idle,
            fields=[] if idle else list(fields),
            data=[] if idle else list(data),
            energy="" if idle else body([made.energy], ["h"]),
            residual="" if idle else body(made.residual, results),
            curvature="" if idle else body(made.curvature, results),
        )
    )


class CellRoutines:
    """The compiled C of a cell's energy and of operations on spectra, for contiguous arrays. ``text`` is the C of
    ``source``. Several threads share elementwise operations; one thread computes sums, so that sums do not depend on
    the number of threads."""

    def __init__(self, text: str, threads: int = 1) -> None:
        self.ffi, self.lib = _compile(text)
        self.threads = threads

    def pointers(self, arrays: Sequence[Reals]) -> Any:
        """Return C's array of the addresses of arrays; at least one, which may be NULL."""
        single = bool(arrays) and arrays[0].dtype == np.float32
        made = self.ffi.new("float *[]" if single else "double *[]", max(len(arrays), 1))
        for number, array in enumerate(arrays):
            made[number] = self.address(array)
        return made

    def address(self, array: Reals | Spectrum | None) -> Any:
        """Return the address of a contiguous array as a pointer of cffi to float or double, NULL for None."""
        if array is None:
            return self.ffi.NULL
        single = array.dtype in (np.float32, np.complex64)
        return self.ffi.cast("float *" if single else "double *", array.ctypes.data)

    def filter(self, symbol: Symbol, x: Complex, y: Spectrum) -> None:
        """Write y = a x elementwise, in place of y, in double or single precision; ``symbol`` is a (None for 1)."""
        made = self.lib.eomgen_field_filter_single if y.dtype == np.complex64 else self.lib.eomgen_field_filter

        def part(a: Any, x: Any, y: Any) -> None:
            made(x.size, *self._symbol(a), self.address(x), self.address(y))

        self._share(part, symbol, x, y)

    def residual(self, fields: Sequence[Reals], data: Sequence[Array]) -> None:
        """Put the derivatives of the energy of each cell in place of the fields, in double or single precision."""
        single = fields[0].dtype == np.float32
        made = self.lib.eomgen_field_residual_single if single else self.lib.eomgen_field_residual

        def part(*arrays: Any) -> None:
            inputs, others = arrays[: len(fields)], arrays[len(fields) :]
            made(inputs[0].size, self.pointers(inputs), self.pointers(others))

        self._share(part, *fields, *data)

    def add(self, size: float, symbol: Symbol, x: Spectrum, y: Complex, beside: Complex | None = None) -> None:
        """Add size (beside + conj(a) x) to y in place; ``symbol`` is a (None for 1), ``beside`` None for 0, x in double
        or single precision."""
        made = self.lib.eomgen_field_add_single if x.dtype == np.complex64 else self.lib.eomgen_field_add

        def part(a: Any, x: Any, beside: Any, y: Any) -> None:
            turns, address = self._symbol(a)
            made(x.size, turns, size, address, self.address(x), self.address(beside), self.address(y))

        self._share(part, symbol, x, beside, y)

    def _share(self, part: Callable[..., None], *arrays: Reals | Spectrum | None) -> None:
        """Call ``part`` with arrays of one size, or, for large ones, with the same parts of each array in several
        threads."""
        size = next(array.size for array in arrays if array is not None)
        if self.threads == 1 or size < _SHARED:
            part(*arrays)
            return
        flat = [None if array is None else array.reshape(-1) for array in arrays]

        def some(begin: int, end: int) -> None:
            part(*(None if array is None else array[begin:end] for array in flat))

        length = 1024 * -(-size // (1024 * self.threads))  # whole vector registers
        share(some, [(begin, min(begin + length, size)) for begin in range(0, size, length)], self.threads)

    def norm(self, x: Complex, even: bool, weight: Array | None = None) -> float:
        """Return the sum of weight |x|^2 over the whole spectrum, of which x is the kept half; ``even`` is whether the
        number of cells along the last axis is even, ``weight`` 1 if None."""
        return float(self.lib.eomgen_field_norm(x.size, x.shape[-1], even, self.address(weight), self.address(x)))

    def _symbol(self, symbol: Symbol) -> tuple[int, Any]:
        return int(symbol is not None and np.iscomplexobj(symbol)), self.address(symbol)


@functools.lru_cache(maxsize=32)
def _compile(text: str) -> tuple[Any, Any]:
    exported = re.findall(r"^EG_SEEN (?:EG_LOOPS )?([^{]*\))", text, re.MULTILINE)
    return Builder(real="lanes").build_routine(text, "".join(f"{head};\n" for head in exported))
