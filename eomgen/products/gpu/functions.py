"""Functions of a model on a card, for arrays of CuPy, PyTorch and NumPy, and all arrays with the DLPack protocol."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from eomgen.base.calls import NamedResults, checked_call, checked_calls
from eomgen.compiled.arguments import numbers
from eomgen.compiled.model import CompiledModel
from eomgen.errors import ModelError, Problem, UsageError
from eomgen.pipeline.pipeline import build
from eomgen.pipeline.requests import check_real
from eomgen.products.gpu.arrays import ArrayPackage, CopiedArrays, package_of
from eomgen.products.gpu.calls import ARGUMENTS, TYPES, Call
from eomgen.products.gpu.driver import Device, Memory, Module, driver
from eomgen.products.gpu.kernels import Term, load_kernel
from eomgen.system.system import INPUT_BLOCKS
from eomgen.system.terms import TERMS

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described
    from eomgen.pipeline.model import Model

Array = Any
#: Prepared calls that are kept, of all threads.
_KEPT = 1000
_NAMES = (*(block for block in INPUT_BLOCKS if block not in ARGUMENTS), *ARGUMENTS.values(), "out", "stream")
_KNOWN = frozenset(_NAMES)


class Options(TypedDict, total=False):
    """Further arguments of functions, see ``forward_dynamics``."""

    z: Array
    parameters: Array
    multipliers: Array
    base: Array
    out: Array
    stream: int | None


@checked_call("a model, a scene or the path of one")
def gpu(scene: Model | Described, *, real: str = "double", fused: bool = False, device: int = 0) -> GpuFunctions:
    """Return the functions of a model for arrays on a card of NVIDIA, compiled at first use.

    A call is one kernel, a thread for each state, on the stream of the caller's package. NVRTC compiles the text:
    nvcc is not needed. Bits are equal to the bits of the processor (profile ``reproducible``) unless ``fused`` is
    chosen.

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
    """
    check_real(real)
    model = scene if isinstance(scene, CompiledModel) else build(scene)
    return GpuFunctions(model, real or "double", fused=fused, device=device)


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
        if not isinstance(model, CompiledModel):
            fault = f"a model is needed, not {type(model).__name__} [E2193]"
            raise UsageError(Problem("gpu", fault, "eomgen.build(scene) of a mechanical scene"))
        if model.library.layout.get("python"):
            fault = f"{model.name} has force laws in Python, which no card can run [E2287]"
            raise ModelError(Problem("gpu", fault, "the laws in C, [laws] source"))
        self._model, self._real, self._fused = model, real, fused
        self._device = driver().device(device)
        self._type = np.dtype(TYPES[real])
        self._lacking = [block for block, size in (("u", model.nu), ("z", model.nz)) if not size]
        self._terms: dict[str, Term] = {}
        self._calls: dict[tuple[Hashable, ...], Call] = {}
        self._lock = threading.Lock()
        self._constants: dict[tuple[str, int], Memory] = {}
        self._kernels: dict[tuple[str, int], tuple[Module, Term]] = {}
        self._warned = False

    def __repr__(self) -> str:
        return f"<GpuFunctions {self._model.name}: {self._real}, {self._device.name}>"

    def forward_dynamics(
        self, q: Array, v: Array, t: Array = 0.0, u: Array = None, **options: Unpack[Options]
    ) -> Array:
        """Return the acceleration vdot = M^-1 (Q - h - b), (..., nv), rad/s^2 and m/s^2.

        Parameters
        ----------
        q, v : (..., nq) and (..., nv) arrays
            Configuration, and left-trivialised velocity.
        t : (...) array, optional
            Time, s.
        u : (..., nu) array, optional
            Inputs, SI units; by default by the scene's formulas at t, else zero.
        **options
            ``z`` (..., nz), internal states, initial ones by default; ``parameters`` (..., np), tunable ones, or a
            mapping of numbers, values of the scene by default; ``base`` (..., 19), by default by the scene's law at t;
            ``multipliers`` (..., rows), zero by default; ``out``, an array that takes the result, or several if there
            are several results, so that no memory is allocated; ``stream``, the handle of a stream, by default the
            current one of the caller's package.

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
        """
        if self._model.multipliers:
            fault = f"{self._model.name} has constraints: accelerations need a solver, and kernels have none [E2288]"
            raise ModelError(
                Problem("gpu", fault, "inverse_dynamics, evaluate('residual', ...), model.forward_dynamics")
            )
        return self._call("forward_dynamics", {"q": q, "v": v, "t": t, "u": u, **options})[0]

    def inverse_dynamics(
        self, q: Array, v: Array, a: Array, t: Array = 0.0, u: Array = None, **options: Unpack[Options]
    ) -> Array:
        """Return the generalized forces that a motion needs, tau = M a + h + b - Q, (..., nv), N m and N.

        Parameters
        ----------
        q, v, a : (..., nq), (..., nv) and (..., nv) arrays
            Configuration, and left-trivialised velocity and acceleration.
        t, u : arrays, optional
            As in ``forward_dynamics``.
        **options
            As in ``forward_dynamics``.

        Returns
        -------
        (..., nv) array
            ``out`` if given.

        Raises
        ------
        UsageError
            As in ``forward_dynamics``; scenes with constraints are not refused.
        """
        return self._call("inverse_dynamics", {"q": q, "v": v, "a": a, "t": t, "u": u, **options})[0]

    def mass(self, q: Array, **options: Unpack[Options]) -> Array:
        """Return the mass matrix M, (..., nv, nv).

        Parameters
        ----------
        q : (..., nq) array
            Configuration.
        **options
            As in ``forward_dynamics``.

        Returns
        -------
        (..., nv, nv) array
            ``out`` if given.
        """
        return self._call("mass", {"q": q, **options})[0]

    def partials(
        self, q: Array, v: Array, a: Array, t: Array = 0.0, u: Array = None, **options: Unpack[Options]
    ) -> tuple[Array, Array, Array]:
        """Return the partials of the residual M a + h + b - Q: K in q, C in v and M in a, (..., nv, nv) each.

        Parameters
        ----------
        q, v, a : (..., nq), (..., nv) and (..., nv) arrays
            Configuration, and left-trivialised velocity and acceleration.
        t, u : arrays, optional
            As in ``forward_dynamics``.
        **options
            As in ``forward_dynamics``.

        Returns
        -------
        K, C, M : (..., nv, nv) arrays
            K left-trivialised.
        """
        stiffness, damping, mass = self._call("partials", {"q": q, "v": v, "a": a, "t": t, "u": u, **options})
        return stiffness, damping, mass

    def evaluate(
        self,
        term: str,
        q: Array = None,
        v: Array = None,
        a: Array = None,
        t: Array = 0.0,
        u: Array = None,
        **more: Array,
    ) -> dict[str, Array]:
        """Return the outputs of any term, by the names of the C code.

        Parameters
        ----------
        term : str
            As of ``Model.evaluate``, such as ``poses`` or ``frame_jacobians``.
        q, v, a, t, u : arrays, optional
            As in ``inverse_dynamics``. Accelerations that a term needs and that are not given are the result of
            ``forward_dynamics``.
        **more : arrays
            Options of ``forward_dynamics``, and weights and time derivatives that some terms take, by the names of the
            C code.

        Returns
        -------
        dict
            (..., shape of the output) arrays.

        Raises
        ------
        UsageError
            As in ``forward_dynamics``; a term that the scene does not have; an unknown argument.
        """
        if not isinstance(term, str):
            raise self._model.evaluator.functions.missing(str(term))
        results = self._call(term, {"q": q, "v": v, "a": a, "t": t, "u": u, **more})
        return NamedResults("output", dict(zip(self._terms[term].names, results, strict=True)))

    # -- a call ------------------------------------------------------------------------------------------------------

    def _call(self, term: str, given: dict[str, Any]) -> Sequence[Array]:
        """Return the outputs of a term for arguments and options by name; None and t = 0.0 are values of the scene."""
        out, stream = given.pop("out", None), given.pop("stream", None)
        if stream is not None and not isinstance(stream, int):
            fault = f"the handle of a stream is needed, not {type(stream).__name__} [E2305]"
            raise UsageError(Problem("stream", fault, "stream.ptr of CuPy, stream.cuda_stream of PyTorch"))
        if not given.keys() <= _KNOWN:
            fault = f"there is no argument {min(given.keys() - _KNOWN)} [E2293]"
            raise UsageError(Problem(term, fault, f"one of {', '.join(_NAMES)}"))
        for block, name in ARGUMENTS.items():
            if name in given:
                given[block] = given.pop(name)
        for block in self._lacking:
            if (value := given.get(block)) is not None:  # refused as by the processor, unless it is empty
                reader = package_of(value)
                self._numbers(block, value if reader is None else np.zeros(reader.view(value).shape), {})
        for value in given.values():
            if (package := package_of(value)) is not None:
                return self._launch(term, given, package, value, out, stream)
        return self._with_copies(term, given, out, stream)

    def _launch(
        self, term: str, given: dict[str, Any], package: ArrayPackage, first: Any, out: Any, stream: int | None
    ) -> Sequence[Array]:
        """Start the kernel of a term, with results of a package; ``first`` is an array on the card."""
        plan = self._terms.get(term) or self._load(term, package.view(first).device)[1]
        key: list[Hashable] = [threading.get_ident(), term]
        values = []
        for block in plan.blocks:
            value = given.get(block)
            reader = package_of(value)
            if reader is None:
                if value is None or (block == "t" and type(value) is float and value == 0.0):
                    value = self._by_default(term, block, given, package, first, stream)
                else:
                    value = given[block] = self._upload(block, given, package, first)
                reader = package_of(value)
            key.append(None if reader is None else reader.signature(value))
            values.append(value)
        outputs = () if out is None else out if isinstance(out, list | tuple) else (out,)
        if outputs and [package_of(array) for array in outputs] != [package] * len(plan.names):
            fault = f"an array of the package of the arguments is needed for {', '.join(plan.names)} each [E2306]"
            raise UsageError(Problem("out", fault, "arrays like the first argument, in a list if there are several"))
        key.extend(map(package.signature, outputs))
        if all(value is None for value in values):
            key += [id(type(package)), package.view(first).device]
        call = self._calls.get(signature := tuple(key))
        if call is None:
            if len(self._calls) > _KEPT:
                self._calls.clear()
            call = self._calls[signature] = self._prepare(term, values, package, first, outputs)
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

    def _upload(self, block: str, given: Mapping[str, Any], package: ArrayPackage, first: Any) -> Any:
        """Return an argument of numbers of the processor as an array on the card of the first array."""
        array = self._numbers(block, given[block], given).astype(self._type)
        return package.upload(array, package.view(first).device)

    def _numbers(self, block: str, value: Any, given: Mapping[str, Any]) -> Any:
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
            fault = "the arrays are NumPy's, whose copies take most of the time; try: arrays on the card [W0309]"
            warnings.warn(fault, RuntimeWarning, stacklevel=5)
        if out is not None:
            fault = "results for NumPy arrays are new arrays [E2290]"
            raise UsageError(Problem("out", fault, "no out, or arrays of CuPy or PyTorch"))
        package = CopiedArrays()
        first = package.upload(np.zeros(1), self._device.index)
        return [result.numpy() for result in self._launch(term, given, package, first, None, stream)]

    # -- preparation -------------------------------------------------------------------------------------------------

    def _load(self, term: str, place: int) -> tuple[Module, Term]:
        """Return the kernels of a term on a device, and their arguments. Raises UsageError if the scene has no such
        term, or for the processor in place of a device."""
        evaluator = self._model.evaluator
        if term not in evaluator.functions and (term not in TERMS or not evaluator.existing((term,))):
            raise evaluator.functions.missing(term)
        if place < 0:
            fault = "the arrays are in memory of the processor [E2291]"
            raise UsageError(Problem(term, fault, "arrays on the card, or NumPy arrays"))
        with self._lock:
            if (term, place) not in self._kernels:
                device = driver().device(place)
                self._kernels[term, place] = load_kernel(self._model, term, self._real, device, fused=self._fused)
            module, self._terms[term] = self._kernels[term, place]
        return module, self._terms[term]

    def _prepare(self, term: str, values: Sequence[Any], package: ArrayPackage, first: Any, out: Sequence[Any]) -> Call:
        """Return a call for arrays of this form, checked."""
        module, plan = self._load(term, package.view(first).device)
        constants = [
            self._constant(block, module.device) if value is None else 0
            for block, value in zip(plan.blocks, values, strict=True)
        ]
        return Call(plan, module, package, self._type.name, values, constants, out)

    def _constant(self, block: str, device: Device) -> int:
        """Return the address of an argument with the values of the scene, which no other thread replaces."""
        key = block, device.index
        with self._lock:
            if key not in self._constants:
                terms = self._model.evaluator
                values = {"p": terms.parameters(None), "z": terms.internal(None)}
                array = values.get(block, np.zeros(terms.functions.sizes.get(block, 1))).astype(self._type)
                self._constants[key] = device.upload(array)
            return self._constants[key].pointer
