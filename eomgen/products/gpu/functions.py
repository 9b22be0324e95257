"""Functions of a model on a card, for arrays of CuPy, PyTorch and NumPy, and all arrays with the DLPack protocol."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.calls import NamedResults, checked_call, checked_calls
from eomgen.compiled.arguments import numbers
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.pipeline.model import Model
from eomgen.pipeline.pipeline import build
from eomgen.pipeline.requests import check_real
from eomgen.products.gpu.arrays import ArrayPackage, CopiedArrays, package_of
from eomgen.products.gpu.calls import Call, Term
from eomgen.products.gpu.driver import Device, Function, Memory, driver
from eomgen.products.gpu.kernels import load_kernel
from eomgen.system.terms import TERMS

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described

Array = Any
#: Prepared calls that are kept, of all threads.
_KEPT = 1000
_TYPES = {"double": "float64", "float": "float32"}


@checked_call("a model, a scene or the path of one")
def gpu(scene: Model | Described, *, real: str = "double", fused: bool = False, device: int = 0) -> GpuFunctions:
    """Return the functions of a model for arrays on a card of NVIDIA, compiled at first use.

    A call is one kernel, a thread for each state, on the stream of the caller's package. NVRTC compiles it: nvcc is not
    needed. Bits are equal to the bits of the processor (profile ``reproducible``) unless ``fused`` is chosen.

    Parameters
    ----------
    scene : Model, Scene, path, or mapping
        A compiled model, or a scene as in ``build``.
    real : str
        Number type: ``double`` or ``float``, of all arrays of a call.
    fused : bool
        Whether products are fused with sums, which is faster and changes the last digits.
    device : int
        Number of the card for NumPy arrays; arrays of other packages stay on their own.

    Returns
    -------
    GpuFunctions
        ``forward_dynamics``, ``inverse_dynamics``, ``mass``, ``partials``, and ``evaluate`` for all other terms.

    Raises
    ------
    UsageError
        An unknown number type.
    ModelError
        A model with force laws in Python.
    ToolchainError
        There is no card, driver or NVRTC; the message names the remedy.

    Examples
    --------
    >>> import cupy  # doctest: +SKIP
    >>> functions = eomgen.gpu("panda.urdf")  # doctest: +SKIP
    >>> q = cupy.zeros((1_000_000, 7))  # doctest: +SKIP
    >>> functions.inverse_dynamics(q, q, q).shape  # doctest: +SKIP
    (1000000, 7)
    """
    check_real(real)
    return GpuFunctions(scene if isinstance(scene, Model) else build(scene), real, fused=fused, device=device)


@checked_calls("eomgen.gpu(model), which makes one")
class GpuFunctions:
    """The functions of a model for arrays on a card.

    Arrays are (..., size) with leading axes that broadcast, of one number type, on one card. Rows, columns and other
    equally spaced numbers are read in place. Results are of the caller's package, and lie in columns if the first
    argument does. Arguments that are not given are the values of the scene, as of ``Model``. Values are not checked.

    NumPy arrays and numbers are copied to the card, and NumPy results back: for single functions the copies take longer
    than the processor takes for the results.

    Parameters
    ----------
    model : Model
        A compiled model without force laws in Python.
    real : str
        ``double`` or ``float``.
    fused : bool
        Whether products are fused with sums.
    device : int
        Number of the card for NumPy arrays.
    """

    def __init__(self, model: Model, real: str = "double", *, fused: bool = False, device: int = 0) -> None:
        if model.library.layout.get("python"):
            fault = f"{model.name} has force laws in Python, which no card can run [E2287]"
            raise ModelError(Problem("gpu", fault, "the laws in C, [laws] source"))
        self._model, self._real, self._fused = model, real, fused
        self._device = driver().device(device)
        self._type = np.dtype(_TYPES[real])
        self._terms: dict[str, Term] = {}
        self._calls: dict[tuple[Hashable, ...], Call] = {}
        self._lock = threading.Lock()
        self._constants: dict[tuple[str, int], Memory] = {}
        self._kernels: dict[tuple[str, int], Function] = {}
        self._warned = False

    def __repr__(self) -> str:
        return f"<GpuFunctions {self._model.name}: {self._real}, {self._device.name}>"

    def forward_dynamics(
        self,
        q: Array,
        v: Array,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        parameters: Array | Mapping[str, float] | None = None,
        out: Array | None = None,
        stream: int | None = None,
    ) -> Array:
        """Return the acceleration vdot = M^-1 (Q - h - b), (..., nv), rad/s^2 and m/s^2.

        Parameters
        ----------
        q, v : (..., nq) and (..., nv) arrays
            Configuration, and left-trivialised velocity.
        t : (...) array, optional
            Time, s.
        u, z : (..., nu) and (..., nz) arrays, optional
            Inputs and internal states, SI units; by default inputs by the scene's formulas at t, else zero, and initial
            internal states.
        parameters : (..., np) array, or mapping of numbers, optional
            Tunable parameters, all in order or some by name, SI units; else values of the scene.
        out : array, optional
            Takes the result; no memory is allocated then, as CUDA graphs ask for.
        stream : int, optional
            Handle of a stream; the current stream of the caller's package by default.

        Returns
        -------
        (..., nv) array
            ``out`` if given.

        Raises
        ------
        UsageError
            A wrong shape, number type or device.
        ModelError
            A scene with constraints.

        Examples
        --------
        >>> functions.forward_dynamics(q, v, u=efforts)  # doctest: +SKIP
        """
        if self._model.multipliers:
            fault = (
                f"{self._model.name} has constraints: its accelerations need a solver, and kernels have none [E2288]"
            )
            raise ModelError(Problem("gpu", fault, "inverse_dynamics, residual; model.forward_dynamics"))
        given = {"q": q, "v": v, "t": t, "u": u, "z": z, "p": parameters}
        return self._call("forward_dynamics", given, out, stream)[0]

    def inverse_dynamics(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        parameters: Array | Mapping[str, float] | None = None,
        out: Array | None = None,
        stream: int | None = None,
    ) -> Array:
        """Return the generalized forces that a motion needs, tau = M a + h + b - Q, (..., nv), N m and N.

        Parameters
        ----------
        q, v, a : (..., nq), (..., nv) and (..., nv) arrays
            Configuration, and left-trivialised velocity and acceleration.
        t, u, z, parameters, out, stream
            As in ``forward_dynamics``.

        Returns
        -------
        (..., nv) array
            ``out`` if given.

        Raises
        ------
        UsageError
            As in ``forward_dynamics``; scenes with constraints are not refused.

        Examples
        --------
        >>> functions.inverse_dynamics(q, v, a)  # doctest: +SKIP
        """
        given = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "p": parameters}
        return self._call("inverse_dynamics", given, out, stream)[0]

    def mass(
        self,
        q: Array,
        *,
        parameters: Array | Mapping[str, float] | None = None,
        out: Array | None = None,
        stream: int | None = None,
    ) -> Array:
        """Return the mass matrix M, (..., nv, nv).

        Parameters
        ----------
        q : (..., nq) array
            Configuration.
        parameters, out, stream
            As in ``forward_dynamics``.

        Returns
        -------
        (..., nv, nv) array
            ``out`` if given.

        Examples
        --------
        >>> functions.mass(q)  # doctest: +SKIP
        """
        return self._call("mass", {"q": q, "p": parameters}, out, stream)[0]

    def partials(
        self,
        q: Array,
        v: Array,
        a: Array,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        parameters: Array | Mapping[str, float] | None = None,
        out: Sequence[Array] | None = None,
        stream: int | None = None,
    ) -> tuple[Array, Array, Array]:
        """Return the partials of the residual M a + h + b - Q: K in q, C in v and M in a, (..., nv, nv) each.

        Parameters
        ----------
        q, v, a : (..., nq), (..., nv) and (..., nv) arrays
            Configuration, and left-trivialised velocity and acceleration.
        t, u, z, parameters, stream
            As in ``forward_dynamics``.
        out : sequence of arrays, optional
            Take the results.

        Returns
        -------
        K, C, M : (..., nv, nv) arrays
            K left-trivialised.

        Examples
        --------
        >>> K, C, M = functions.partials(q, v, a)  # doctest: +SKIP
        """
        given = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "p": parameters}
        stiffness, damping, mass = self._call("partials", given, out, stream)
        return stiffness, damping, mass

    def evaluate(
        self,
        term: str,
        q: Array | None = None,
        v: Array | None = None,
        a: Array | None = None,
        t: Array = 0.0,
        u: Array | None = None,
        *,
        z: Array | None = None,
        multipliers: Array | None = None,
        parameters: Array | Mapping[str, float] | None = None,
        base: Array | None = None,
        out: Sequence[Array] | None = None,
        stream: int | None = None,
        **further: Array,
    ) -> dict[str, Array]:
        """Return the outputs of any term, by the names of the C code.

        Parameters
        ----------
        term : str
            As of ``Model.evaluate``, such as ``poses`` or ``frame_jacobians``.
        q, v, a, t, u, z, parameters, stream
            As in ``inverse_dynamics``. Accelerations that a term needs and that are not given are those of
            ``forward_dynamics``.
        multipliers : (..., rows) array, optional
            Multipliers of the constraints; zero by default.
        base : (..., 19) array, optional
            State of the base; the scene's law at t by default.
        out : sequence of arrays, optional
            Take the results.
        **further : arrays
            Weights and time derivatives that some terms take, by the names of the C code.

        Returns
        -------
        dict
            (..., shape of the output) arrays.

        Raises
        ------
        UsageError
            As in ``forward_dynamics``; a term that the scene does not have.

        Examples
        --------
        >>> functions.evaluate("poses", q)["poses"].shape  # doctest: +SKIP
        """
        given = {"q": q, "v": v, "a": a, "t": t, "u": u, "z": z, "lam": multipliers, "p": parameters, "base": base}
        results = self._call(term, {**given, **further}, out, stream)
        return NamedResults("output", dict(zip(self._term(term).names, results, strict=True)))

    # -- a call ------------------------------------------------------------------------------------------------------

    def _call(self, term: str, given: dict[str, Any], out: Any, stream: int | None) -> Sequence[Array]:
        """Return the outputs of a term for arguments by block; None and t = 0.0 are the values of the scene."""
        for value in given.values():
            if value is not None and (package := package_of(value)) is not None:
                return self._launch(term, given, package, value, out, stream)
        return self._with_copies(term, given, out, stream)

    def _launch(
        self, term: str, given: dict[str, Any], package: ArrayPackage, first: Any, out: Any, stream: int | None
    ) -> Sequence[Array]:
        """Start the kernel of a term, with results of a package; ``first`` is an array on the card."""
        plan = self._terms.get(term) or self._term(term)
        key: list[Hashable] = [threading.get_ident(), term]
        values = []
        for block in plan.blocks:
            value = given.get(block)
            reader = package_of(value)
            if reader is None:
                if value is None or (block == "t" and type(value) is float and value == 0.0):
                    value = self._by_default(term, block, given, package, first, stream)
                else:
                    value = given[block] = self._uploaded(block, given, package, first)
                reader = package_of(value)
            key.append(None if reader is None else reader.signature(value))
            values.append(value)
        outputs = () if out is None else out if isinstance(out, list | tuple) else (out,)
        key.extend(map(package.signature, outputs))
        call = self._calls.get(signature := tuple(key))
        if call is None:
            if len(self._calls) > _KEPT:
                self._calls.clear()
            call = self._calls[signature] = self._prepare(plan, values, package, first, outputs)
        return call(values, outputs, stream)

    def _by_default(
        self, term: str, block: str, given: dict[str, Any], package: ArrayPackage, first: Any, stream: int | None
    ) -> Any:
        """Return an argument that the caller does not give: None for a constant of the scene, else an array that is
        computed on the card. Raises UsageError for an argument that the scene does not have."""
        functions = self._model.functions
        if block == "a" and "forward_dynamics" in functions:
            source = "forward_dynamics"
        elif block == "base" or (block == "u" and "inputs" in functions):
            source = "inputs" if block == "u" else "base"
        elif block in ("t", "p", "z", "lam", "u"):
            return None
        else:
            raise UsageError(Problem(block, f"the term {term} needs {block} [E2289]", f"{block}=..."))
        given[block] = self._launch(source, given, package, first, None, stream)[0]
        return given[block]

    def _uploaded(self, block: str, given: Mapping[str, Any], package: ArrayPackage, first: Any) -> Any:
        """Return an argument of numbers of the processor as an array on the card of the first array."""
        array = self._checked(block, given[block], given).astype(self._type)
        return package.upload(array, package.view(first).device)

    def _checked(self, block: str, value: Any, given: Mapping[str, Any]) -> Any:
        """Return an argument as an array of the processor, checked as arguments of the model are."""
        terms = self._model.evaluator
        if block == "u":
            return terms.inputs(value, {"t": numbers("t", given.get("t", 0.0)), "p": terms.parameters(given.get("p"))})
        checks = {"p": terms.parameters, "z": terms.internal, "q": terms.configuration, "base": terms.base}
        return checks[block](value) if block in checks else numbers(block, value)

    def _with_copies(self, term: str, given: dict[str, Any], out: Any, stream: int | None) -> Sequence[Array]:
        """Return the outputs of a term for numbers of the processor."""
        if not self._warned:
            self._warned = True
            message = (
                "the arrays are NumPy's: their copies to the card and back take most of the time of a call [W0309]"
            )
            warnings.warn(f"{message}; try: arrays of CuPy, PyTorch or JAX on the card", RuntimeWarning, stacklevel=5)
        if out is not None:
            fault = "results for NumPy arrays are new arrays [E2290]"
            raise UsageError(Problem("out", fault, "no out, or arrays of CuPy or PyTorch"))
        package = CopiedArrays()
        first = package.upload(np.zeros(1), self._device.index)
        return [result.numpy() for result in self._launch(term, given, package, first, None, stream)]

    # -- preparation -------------------------------------------------------------------------------------------------

    def _term(self, term: str) -> Term:
        """Return the arguments and outputs of a term. Raises UsageError if the scene does not have the term."""
        if term not in self._terms:
            functions = self._model.functions
            if term in TERMS and term not in functions:
                functions = self._model.having((term,)).functions
            functions.inputs(term)  # says that the term is missing
            self._terms[term] = Term(next(f for f in functions.library.layout["functions"] if f["name"] == term))
        return self._terms[term]

    def _prepare(
        self, term: Term, values: Sequence[Any], package: ArrayPackage, first: Any, out: Sequence[Any]
    ) -> Call:
        """Return a call for arrays of this form, checked."""
        place = package.view(first).device
        if place < 0:
            fault = "the arrays are in memory of the processor [E2291]"
            raise UsageError(Problem(term.name, fault, "arrays on the card, or NumPy arrays"))
        device = driver().device(place)
        key = term.name, place
        with self._lock:
            if key not in self._kernels:
                self._kernels[key] = load_kernel(self._model, term.name, self._real, device, fused=self._fused)
        constants = [
            self._constant(block, device) if value is None else 0
            for block, value in zip(term.blocks, values, strict=True)
        ]
        return Call(term, self._kernels[key], package, self._type.name, values, constants, out)

    def _constant(self, block: str, device: Device) -> int:
        """Return the address of an argument with the values of the scene."""
        key = block, device.index
        if key not in self._constants:
            terms = self._model.evaluator
            values = {"p": terms.parameters(None), "z": terms.internal(None)}
            array = values.get(block, np.zeros(terms.functions.sizes.get(block, 1))).astype(self._type)
            self._constants[key] = device.upload(array)
        return self._constants[key].pointer
