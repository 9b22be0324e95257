"""The potential of a white field, U = |xi|^2/2 + sum over cells of h(s), s = A xi, its derivatives and its minimum.

State and derivatives are spectra. The gradient is xi + sum over fields of A^T h'(s): for each field one transform to
the cells, with h' in place of s, and one back. Python makes no array on the way: SciPy allocates the results of
transforms, and everything else is written into buffers that are made once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import listed, nearest
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.fields.posteriors.cells import CellEnergy, CellRoutines, cell_tape, source
from eomgen.products.fields.posteriors.mesh import Complex, Mesh, Reals, Transforms, check_transforms, numbers_of_cells
from eomgen.products.fields.posteriors.mesh import transforms as make_transforms
from eomgen.products.fields.posteriors.operators import LinearOperator

#: Remedy for an energy without a lower bound.
BOUNDED = "an energy that grows on both sides: cell.energy is the negative logarithm of a density"


@dataclass(frozen=True)
class Mode:
    """The most probable field, the minimum of U, with the work of the search.

    Attributes
    ----------
    spectrum : of the white field, shape ``mesh.half``
    energy : U there
    iterations, products : iterations of Newton's method, and products with the Hessian in them
    gradient : length of the gradient with the inverse mass as metric, divided by the square root of the number of cells
    """

    spectrum: Complex
    energy: float
    iterations: int
    products: int
    gradient: float


@checked_calls()
class FieldPosterior:
    """Fields on a periodic mesh by a Gaussian prior and by the energy of cells.

    Parameters
    ----------
    mesh : Mesh
        The mesh of all fields.
    energy : CellEnergy or str
        A formula of the fields' names and of data.
    fields : mapping of names to linear operators
        Operators by which white noise becomes the fields of cells.
    data : mapping, optional
        Arrays of the shape ``mesh.cells`` by name, or numbers for all cells.
    transforms : {"scipy", "fftw"}
        Library of the transforms; ``fftw`` needs the package pyfftw, and takes a third to a half of the time.
    precision : {"double", "single"}
        Of the transforms and fields of ``add_gradient``. State, energies, all other derivatives, and sums are doubles.

    Raises
    ------
    DescriptionError, ModelError, UsageError
        Formulas, data and operators that do not go together, or a mesh that does not fit the memory.
    """

    def __init__(
        self,
        mesh: Mesh,
        energy: CellEnergy | str,
        fields: Mapping[str, LinearOperator],
        data: Mapping[str, ArrayLike] | None = None,
        *,
        transforms: str = "scipy",
        precision: str = "double",
    ) -> None:
        """Check energy, operators and data on the mesh, and compile the energy of a cell. Raises the errors of the
        class."""
        check_transforms(transforms, precision)
        self.mesh = mesh
        self.energy_of_cell = energy if isinstance(energy, CellEnergy) else CellEnergy(energy)
        self.operators = dict(fields)
        for name, operator in self.operators.items():
            if operator.mesh != mesh:
                fault = "the operator has another mesh [E0809]"
                raise UsageError(Problem(f"fields.{name}", fault, "operators of one mesh"))
        #: Bytes of the arrays of a trajectory: state, previous state, momenta, gradient, buffer, SciPy's, and fields.
        self.memory = mesh.require_memory(7, len(fields) + len(data or {}) + 2, "a trajectory")
        self.data = {}
        for name, values in (data or {}).items():
            array = np.asarray(values, dtype=float)
            if array.ndim and array.shape != mesh.cells:
                fault = f"the array has the shape {array.shape}, and the mesh {mesh.cells} [E0810]"
                raise UsageError(Problem(f"data.{name}", fault, f"an array of {mesh.cells}, or one number"))
            least = self.energy_of_cell.smallest.get(name, -math.inf)
            self.data[name] = numbers_of_cells(mesh, array, least, f"data.{name}")
        masked = {name: operator.mask for name, operator in self.operators.items() if operator.mask is not None}
        made = cell_tape(self.energy_of_cell, list(self.operators), list(self.data), list(masked))
        #: Whether there is no energy of cells: fields follow the prior.
        self.prior_alone = made.idle
        columns = [*self.data, *(f"mask of {name}" for name in masked)]
        #: The C text.
        single = precision == "single" and not made.idle
        self.source = source(self.energy_of_cell, made, list(self.operators), columns, single)
        self._routines = CellRoutines(self.source, mesh.threads)
        self._columns = [*self.data.values(), *(np.ascontiguousarray(values) for values in masked.values())]
        self._data = self._routines.pointers(self._columns)
        self._transforms = make_transforms(mesh, transforms, len(self.operators))
        #: Buffers of ``add_gradient``.
        self._fast = make_transforms(mesh, transforms, len(self.operators), single=True) if single else self._transforms
        scale = self._transforms.scale
        #: Filters with the scale of transforms; None for 1.
        self._symbols: list[Array | Complex | None] = [
            None if operator.symbol is None and scale == 1.0 else scale * _symbol(operator)
            for operator in self.operators.values()
        ]
        self._even = mesh.cells[-1] % 2 == 0
        #: Evaluations of the gradient so far, of the energy, and products with the Hessian.
        self.gradients, self.energies, self.products = 0, 0, 0

    def _spectrum(self, name: str, values: Array | Complex, kind: type = complex, *, changed: bool = False) -> Any:
        """Return an array of the shape ``mesh.half``, contiguous and of a type, as C takes it. Raises UsageError for
        another shape and, if the array is to be changed in place (``changed``), for one that is not like this."""
        made: Any = np.ascontiguousarray(values, kind)
        if made.shape != self.mesh.half or (changed and made is not values):
            fault = f"{np.asarray(values).dtype} of the shape {np.shape(values)} are not a half spectrum [E2239]"
            hint = f"{made.dtype} of the shape {self.mesh.half}, contiguous in C order"
            raise UsageError(Problem(name, fault, hint))
        return made

    # -- energy and derivatives --------------------------------------------------------------------------------------

    def energy(self, spectrum: Complex) -> float:
        """Return U of a white field, summed with compensation; infinite or NaN on overflow.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.

        Returns
        -------
        float
            Minus the logarithm of the posterior, up to a constant.
        """
        self.energies += 1
        spectrum = self._spectrum("spectrum", spectrum)
        return self._energy(spectrum, [] if self.prior_alone else self._to_cells(spectrum))

    def _energy(self, spectrum: Complex, fields: list[Array]) -> float:
        total = 0.5 * self._routines.norm(spectrum, self._even)
        if fields:
            pointers = self._routines.pointers(fields)
            total += float(self._routines.lib.eomgen_field_energy(self.mesh.size, pointers, self._data))
        return total

    def energy_and_gradient(self, spectrum: Complex, to: Complex) -> float:
        """Return U of a white field, and write the gradient into an existing spectrum.

        One transform to the cells and one back are made for each field, in double precision for any ``precision``; none
        without an energy of cells. Counts in ``gradients`` alone.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.
        to : complex ndarray
            Half spectrum, another array; overwritten with the gradient, as of ``gradient``.

        Returns
        -------
        float
            Minus the logarithm of the posterior, up to a constant; infinite or NaN on overflow.
        """
        self.gradients += 1
        spectrum, to = self._spectrum("spectrum", spectrum), self._spectrum("to", to, changed=True)
        if self.prior_alone:
            to[...] = spectrum
            return self._energy(spectrum, [])
        fields = self._to_cells(spectrum)
        energy = self._energy(spectrum, fields)
        self._routines.residual(fields, self._columns)
        to[...] = 0.0
        self._from_cells(self._transforms, 1.0, fields, to, spectrum)
        return energy

    def add(self, size: float, spectrum: Complex, to: Complex) -> None:
        """Add ``size`` times a spectrum to another one.

        Parameters
        ----------
        size : float
            The factor.
        spectrum : complex ndarray
            Half spectrum, shape ``mesh.half``.
        to : complex ndarray
            Half spectrum, changed in place.
        """
        self._routines.add(size, None, self._spectrum("spectrum", spectrum), self._spectrum("to", to, changed=True))

    def add_gradient(self, size: float, spectrum: Complex, to: Complex) -> None:
        """Add ``size`` times the gradient of U at a white field to a spectrum, in the precision that was asked for.

        Parameters
        ----------
        size : float
            The factor.
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.
        to : complex ndarray
            Half spectrum, changed in place.
        """
        to = self._spectrum("to", to, changed=True)
        self._add_gradient(self._fast, size, self._spectrum("spectrum", spectrum), to)

    def _add_gradient(self, by: Transforms, size: float, spectrum: Complex, to: Complex) -> None:
        self.gradients += 1
        if self.prior_alone:
            self._routines.add(size, None, spectrum, to)
            return
        fields = self._cells_of(by, spectrum)
        self._routines.residual(fields, self._columns)
        self._from_cells(by, size, fields, to, spectrum)

    def gradient(self, spectrum: Complex) -> Complex:
        """Return the gradient of U at a white field as a spectrum.

        U(xi + e) - U(xi) is ``mesh.product`` of the gradient and e for small e.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.

        Returns
        -------
        complex ndarray
            Half spectrum, shape ``mesh.half``.
        """
        result = np.zeros(self.mesh.half, complex)
        self._add_gradient(self._transforms, 1.0, self._spectrum("spectrum", spectrum), result)
        return result

    def hessian(self, spectrum: Complex) -> Callable[[Complex], Complex]:
        """Return the product with the Hessian of U at a white field, a function of directions.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.

        Returns
        -------
        callable
            From a direction to the product, a new array, both half spectra. Each call adds 1 to ``products``.
        """
        fields = [] if self.prior_alone else self._to_cells(self._spectrum("spectrum", spectrum))
        if self._transforms.scale != 1.0:  # arrays of the plans, which products write to
            fields = [field.copy() for field in fields]

        def product(direction: Complex) -> Complex:
            self.products += 1
            direction = self._spectrum("direction", direction)
            result = direction.copy()
            if fields:
                along = self._to_cells(direction)
                self._curve(fields, along)
                self._from_cells(self._transforms, 1.0, along, result)
            return result

        return product

    def white(self, generator: np.random.Generator, to: Complex) -> None:
        """Write the spectrum of independent standard normal numbers in all cells into one that is there.

        Parameters
        ----------
        generator : numpy.random.Generator
            Source of the numbers.
        to : complex ndarray
            Half spectrum, overwritten.
        """
        self._transforms.white(generator, to)

    def value(self, name: str, spectrum: Complex) -> Array:
        """Return one field of cells of a white field, after filter and mask of the field, in double precision.

        Parameters
        ----------
        name : str
            Name of the field.
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.

        Returns
        -------
        ndarray
            Shape ``mesh.cells``.
        """
        if name not in self.operators:
            raise UsageError(Problem("value", f"there is no field {name!r} [E0827]", nearest(name, self.operators)))
        operator, number = self.operators[name], list(self.operators).index(name)
        self._routines.filter(self._symbols[number], self._spectrum("spectrum", spectrum), self._transforms.buffer)
        field = np.array(self._transforms.field(number), float)
        return field if operator.mask is None else operator.mask * field

    def values(self, spectrum: Complex) -> dict[str, Array]:
        """Return the fields of cells of a white field, by name.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.

        Returns
        -------
        dict
            Arrays of the shape ``mesh.cells`` by name.
        """
        return {name: operator.apply(spectrum) for name, operator in self.operators.items()}

    def norm(self, spectrum: Complex, weight: Array | None = None) -> float:
        """Return the sum of weight(k) |amplitude|^2 over the whole spectrum, with compensation.

        Parameters
        ----------
        spectrum : complex ndarray
            Half spectrum, shape ``mesh.half``.
        weight : ndarray, optional
            Weights by wave number, shape ``mesh.half``; 1 if not given.

        Returns
        -------
        float
            The sum.
        """
        weight = None if weight is None else self._spectrum("weight", weight, float)
        return self._routines.norm(self._spectrum("spectrum", spectrum), self._even, weight)

    def drift(self, size: float, inverse_mass: Array | None, momenta: Complex, spectrum: Complex) -> None:
        """Add ``size`` times the momenta divided by the masses to a white field.

        Parameters
        ----------
        size : float
            Time.
        inverse_mass : ndarray or None
            One over the masses by wave number, shape ``mesh.half``; None: 1.
        momenta : complex ndarray
            Momenta as a half spectrum.
        spectrum : complex ndarray
            White field as a half spectrum, changed in place.
        """
        inverse = None if inverse_mass is None else self._spectrum("inverse_mass", inverse_mass, float)
        momenta, spectrum = self._spectrum("momenta", momenta), self._spectrum("spectrum", spectrum, changed=True)
        self._routines.add(size, inverse, momenta, spectrum)

    def _to_cells(self, spectrum: Complex) -> list[Array]:
        return cast(list[Array], self._cells_of(self._transforms, spectrum))

    def _cells_of(self, by: Transforms, spectrum: Complex) -> Sequence[Reals]:
        fields = []
        for number, symbol in enumerate(self._symbols):
            self._routines.filter(symbol, spectrum, by.buffer)
            fields.append(by.field(number))
        return fields

    def _from_cells(
        self, by: Transforms, size: float, fields: Sequence[Reals], to: Complex, beside: Complex | None = None
    ) -> None:
        """Add size (beside + sum over fields of the adjoint of each field) to the spectrum ``to`` in place, by the
        transforms ``by``. Memory of the fields is undefined afterwards."""
        for number, (symbol, field) in enumerate(zip(self._symbols, fields, strict=True)):
            self._routines.add(size, symbol, by.spectrum(number, field), to, beside)
            beside = None

    def _curve(self, fields: Sequence[Reals], along: Sequence[Reals]) -> None:
        """Replace a direction, in place, by the product of the Hessian of each cell's energy and the direction;
        ``fields`` and ``along`` have one array of cells for each field."""
        pointers = self._routines.pointers
        self._routines.lib.eomgen_field_curvature(self.mesh.size, pointers(fields), self._data, pointers(along))

    # -- scales ------------------------------------------------------------------------------------------------------

    def mass(self, choice: str = "fisher") -> Array | None:
        """Return masses by wave number, shape ``mesh.half``; None stands for masses of 1.

        Parameters
        ----------
        choice : {"fisher", "prior", "unit"}
            ``fisher``: 1 + sum over fields of mean(h'') |a(k)|^2, with the mean of the curvature over cells and over
            the prior (``mean_curvature``), 0 in place of a negative mean. ``prior``: 1, which is the inverse of the
            prior's covariance in terms of fields. ``unit``: |a(k)|^2 of the single field, which is 1 for the field
            after the filter.

        Returns
        -------
        ndarray or None
            Shape ``mesh.half``; None for ``prior``, and for ``fisher`` if there is no energy of cells.

        Raises
        ------
        UsageError
            An unknown choice.
        ModelError
            ``fisher`` with a mean curvature that is not finite; ``unit`` with several fields or none, or with a filter
            that is 0 somewhere.
        """
        known = ("fisher", "prior", "unit")
        if choice not in known:
            fault = f"there is no mass {choice!r} [E0753]"
            raise UsageError(Problem("mass", fault, nearest(choice, known) or listed(known)))
        if choice == "prior" or (choice == "fisher" and self.prior_alone):
            return None
        squares = [np.abs(_symbol(operator)) ** 2 for operator in self.operators.values()]
        if choice == "unit":
            if len(squares) != 1 or float(squares[0].min()) <= 0.0:
                fault = "a unit mass of the field needs one field whose filter is 0 at no wave number [E0812]"
                raise ModelError(Problem("mass", fault, '"fisher" or "prior"'))
            return np.ascontiguousarray(squares[0])
        masses = np.ones(self.mesh.half)
        for square, curvature in zip(squares, self.mean_curvature(), strict=True):
            masses += max(curvature, 0.0) * square
        return masses

    def mean_curvature(self) -> list[float]:
        """Return the mean second derivative of the energy of a cell by each field.

        Averaged over cells and, by Gauss-Hermite quadrature with 12 nodes for each field, over the normal distributions
        of the fields by the prior, taken as independent; the mask of a field is a part of the energy. Raises ModelError
        for a mean that is not finite.

        Returns
        -------
        list of float
            One for each field, in the order of ``fields``; may be negative; 0 if there is no energy of cells.
        """
        nodes, weights = np.polynomial.hermite_e.hermegauss(12)
        weights = weights / weights.sum()
        operators = self.operators.values()  # a mask is in the energy already
        if self.prior_alone:
            return [0.0] * len(self.operators)
        deviations = [math.sqrt(replace(operator, mask=None).variance) for operator in operators]
        count = len(deviations)
        means = [0.0] * count
        for node in np.ndindex(*(len(nodes),) * count):
            fields = [np.full(self.mesh.cells, d * nodes[k]) for d, k in zip(deviations, node, strict=True)]
            weight = math.prod(float(weights[k]) for k in node)
            for number in range(count):
                along = [np.full(self.mesh.cells, float(number == index)) for index in range(count)]
                self._curve(fields, along)
                means[number] += weight * float(np.mean(along[number]))
        if not all(map(math.isfinite, means)):
            fault = "the curvature of the energy of a cell has no finite mean under the prior [E0813]"
            raise ModelError(Problem("mass", fault, 'mass = "prior"'))
        return means

    def largest_frequency(
        self, spectrum: Complex, mass: Array | None = None, *, seed: int = 0, products: int = 40
    ) -> float:
        """Return the largest angular frequency of small motions about a white field, by power iteration.

        This is the square root of the largest magnitude of an eigenvalue, also if the eigenvalue is negative. The
        iteration converges from below, by 40 products usually within a few per cent, which is not checked. Steps of a
        composition are stable up to ``stability_limit`` divided by this frequency.

        Parameters
        ----------
        spectrum : complex ndarray
            White field as a half spectrum, shape ``mesh.half``.
        mass : ndarray, optional
            Masses by wave number, as of ``mass``; 1 if not given.
        seed : int, optional
            Of the first direction.
        products : int, optional
            Number of products with the Hessian.

        Returns
        -------
        float
            In radians per unit of the trajectories' time.

        Raises
        ------
        NumericalError
            Second derivatives are not finite.
        UsageError
            The seed is not a whole number from 0 on.
        """
        hessian = self.hessian(spectrum)
        root = 1.0 if mass is None else 1.0 / np.sqrt(mass)
        direction = self.mesh.white(np.random.Generator(np.random.Philox(count_of("seed", seed, 0))))
        value = 0.0
        for _ in range(products):
            direction = direction / math.sqrt(self.mesh.product(direction, direction))
            product = root * hessian(root * direction)
            value = math.sqrt(self.mesh.product(product, product))
            if not math.isfinite(value):
                fault = "second derivatives of U are not finite here [E0814]"
                raise NumericalError(Problem("largest_frequency", fault, "a field nearer to the mode"))
            direction = product
        return math.sqrt(value)

    @np.errstate(over="ignore", invalid="ignore")  # of an energy without a lower bound, which is reported
    def mode(self, start: Complex | None = None, *, tolerance: float = 1e-8, iterations: int = 60) -> Mode:
        """Return a local minimum of U, found by Newton's method with conjugate gradients from a start.

        If the descent ends at a saddle, the search continues below the saddle, if power iterations find a lower place
        there; if not, the saddle is returned. Of several minima the first reached is returned.

        Parameters
        ----------
        start : complex ndarray, optional
            White field as a half spectrum from which the search starts; 0 by default.
        tolerance : float, optional
            Largest ``Mode.gradient`` at which the search ends: the length of the gradient, with the inverse mass as
            metric, divided by the square root of the number of cells.
        iterations : int, optional
            Largest number of iterations of Newton's method.

        Returns
        -------
        Mode
            The white field as a half spectrum (``spectrum``), the energy there, and the work.

        Raises
        ------
        NumericalError
            The gradient has not reached the tolerance, U is not finite at the start, or U has no lower bound.
        ModelError
            The energy of a cell has no finite mean curvature (``mean_curvature``).
        """
        x = np.zeros(self.mesh.half, complex) if start is None else self._spectrum("start", start).copy()
        mass = self.mass("fisher")
        inverse = 1.0 if mass is None else 1.0 / mass
        before, value = self.products, self.energy(x)
        if not math.isfinite(value):
            hint = "another start, or an energy that is finite there"
            raise NumericalError(Problem("mode", f"U is {value} at the start [E0815]", hint))
        slope, highest = math.inf, value
        for iteration in range(iterations + 1):
            gradient = self.gradient(x)
            slope = math.sqrt(self.mesh.product(gradient, inverse * gradient) / self.mesh.size)
            if slope <= tolerance:
                below = self._below_a_saddle(x, value, inverse)
                if below is None:
                    return Mode(x, value, iteration, self.products - before, slope)
                x, value = below
                continue
            direction = self._newton_direction(x, gradient, inverse, min(0.1, math.sqrt(slope)))
            descent, size = self.mesh.product(gradient, direction), 1.0
            rounding = 1e-13 * abs(value)
            for _ in range(40):
                energy = self.energy(x + size * direction)
                if energy <= value + 1e-4 * size * descent + rounding:
                    break
                size /= 2
            else:
                break
            x, value = x + size * direction, energy
        if value < highest - 1e12 * self.mesh.size:
            fault = f"Newton's method has come down to U = {value:.3g}: the energy of a cell has no lower bound [E0817]"
            raise NumericalError(Problem("mode", fault, BOUNDED))
        fault = f"Newton's method has left a gradient of {slope:.3g}, above {tolerance:.3g} [E0816]"
        raise NumericalError(Problem("mode", fault, "more iterations, or a larger tolerance"))

    def _below_a_saddle(self, x: Complex, value: float, inverse: Array | float) -> tuple[Complex, float] | None:
        """Return a white field with less U than ``value``, and U there, next to the stationary field x; None if x is a
        minimum, or no such field is found.

        The Hessian is 1 + sum of A^T h'' A. For one field the Hessian is positive if no cell has h'' below 0; else
        power iterations look for the least eigenvalue with the inverse mass (``inverse``) as metric, starting from the
        largest.
        """
        fields = [] if self.prior_alone else self._to_cells(x)
        if not fields:
            return None
        if len(fields) == 1:
            bent = np.ones(self.mesh.cells)
            self._curve(fields, [bent])
            if float(bent.min()) >= 0.0:
                return None
        hessian, root, product = self.hessian(x), np.sqrt(inverse), self.mesh.product
        shift, least, along = 0.0, 0.0, x
        for _ in range(2):  # the eigenvalue of largest magnitude, then the opposite end of the spectrum
            along = self.mesh.white(np.random.Generator(np.random.Philox(0)))
            for _ in range(40):
                along = along / math.sqrt(product(along, along))
                turned = root * hessian(root * along)
                least = product(along, turned)
                if shift > 0.0 and least < 0.0:
                    break
                along = turned - shift * along
            if least < 0.0:
                break
            shift = least
        if not least < 0.0:
            return None
        along = root * along
        size = math.sqrt(self.mesh.size / product(along, along))
        for _ in range(40):
            for sign in (size, -size):
                result = self.energy(x + sign * along)
                if result < value - 1e-13 * abs(value):
                    return x + sign * along, result
            size /= 2
        return None

    def _newton_direction(self, x: Complex, gradient: Complex, inverse: Array | float, accuracy: float) -> Complex:
        """Return a descent direction of U at the white field x, shape ``mesh.half``: the Newton step by preconditioned
        conjugate gradients, stopped at negative curvature; the preconditioned steepest descent if the first direction
        has no positive curvature.

        Parameters
        ----------
        gradient : of U at x
        inverse : preconditioner, an approximate inverse of the Hessian, entry by entry
        accuracy : norm of the residual at which the iteration ends, relative to the gradient's norm
        """
        product = self.mesh.product
        hessian, result = self.hessian(x), np.zeros_like(x)
        left = -gradient
        ahead = inverse * left
        along, size = ahead, product(left, ahead)
        end = accuracy**2 * size
        for _ in range(500):
            changed = hessian(along)
            curvature = product(along, changed)
            if not curvature > 0.0:
                return along if not np.any(result) else result
            part = size / curvature
            result, left = result + part * along, left - part * changed
            ahead = inverse * left
            size, last = product(left, ahead), size
            if size <= end:
                break
            along = ahead + (size / last) * along
        return result


def _symbol(operator: LinearOperator) -> Array | Complex:
    return np.ones(operator.mesh.half) if operator.symbol is None else operator.symbol
