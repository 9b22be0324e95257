"""Runs of a model with outputs and gradients by adjoints, as arrays nested by q, v, parameters and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.errors import Problem, UsageError

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model


class Runs:
    """Runs of one model with the same options.

    Parameters
    ----------
    model : Model
    options : of ``sensitivities``
    given : nested arrays in which derivatives are taken, None if a part is not given

    Attributes
    ----------
    columns : output -> places of the components in a row of the table, and the shape of the output
    shape : rows and columns of the table
    factors : of the configuration
    """

    def __init__(self, model: Model, options: Mapping[str, Any], nest: Mapping[str, Any]) -> None:
        """Check the shapes of the arguments, and name the quantities by which runs are differentiated; no run is made
        yet. Raises UsageError for wrong shapes."""
        self._model, self._options = model, options
        self.factors = model.evaluator.factors
        by = list(nest["parameters"])
        by += [f"q{name[1:]}" for name in model.v_names] if nest["q"] is not None else []
        by += list(model.v_names) if nest["v"] is not None else []
        self._inputs = list(nest["inputs"])
        sizes = {"q": (model.nq,), "v": (model.nv,)}
        for name, array, expected in (
            *((block, nest[block], size) for block, size in sizes.items() if nest[block] is not None),
            *((name, array, ()) for name, array in nest["parameters"].items()),
        ):
            if tuple(array.shape) != expected:
                fault = f"{name} has the shape {tuple(array.shape)}, and simulate takes {expected} [E2199]"
                raise UsageError(Problem(name, fault, "one state, one set of parameters; vmap for several runs"))
        by += [f"inputs.{name}[:]" for name in self._inputs]
        self._names = {block: list(part) for block, part in nest.items() if isinstance(part, Mapping)}
        self._taken = [block for block, part in nest.items() if part is not None and block not in self._names]
        self._by = by or [f"q{model.v_names[0][1:]}"]
        self._last: tuple[bytes, Any] = b"", None
        self.columns: dict[str, tuple[slice, tuple[int, ...]]] = {}
        self.shape = (0, 0)

    def flat(self, nest: Mapping[str, Any]) -> list[Any]:
        """Return the arrays of a nest in order."""
        parts = [nest[block] for block in self._taken]
        return parts + [nest[block][name] for block, names in self._names.items() for name in names]

    def nest(self, values: Sequence[Any]) -> dict[str, Any]:
        """Return arrays in the form of a nest, the inverse of ``flat``."""
        remaining = iter(values)
        result: dict[str, Any] = {"q": None, "v": None} | {block: next(remaining) for block in self._taken}
        return result | {block: {name: next(remaining) for name in names} for block, names in self._names.items()}

    def learn_shapes(self, values: Mapping[str, Any]) -> None:
        """Make the run of some nested values, and set ``columns`` and ``shape`` of its table."""
        run, first = self._run(values), 0
        for name, array in run.outputs.items():
            size = int(np.prod(array.shape[1:], dtype=int))
            self.columns[name] = slice(first, first + size), array.shape[1:]
            first += size
        self.shape = len(run.t), first

    def _run(self, values: Mapping[str, Any]) -> Any:
        """Return the run with derivatives, of ``sensitivities``, for nested values; the last one is kept for its
        adjoint."""
        parts = [values["q"], values["v"], *values["parameters"].values(), *values["inputs"].values()]
        key = b"".join(np.asarray(part).tobytes() for part in parts if part is not None)
        if self._last[1] is None or self._last[0] != key:
            initial = {block: np.array(values[block]) for block in ("q", "v") if values[block] is not None}
            parameters = {name: float(value) for name, value in values["parameters"].items()}
            inputs = {name: np.array(value) for name, value in values["inputs"].items()}
            run = self._model.sensitivities(
                by=self._by,
                initial=initial or None,
                parameters=parameters or None,
                inputs=inputs or None,
                **self._options,
            )
            self._last = key, run
        return self._last[1]

    def outputs(self, values: Mapping[str, Any]) -> Any:
        """Return the outputs at all rows, (rows, components)."""
        run = self._run(values).outputs.values()
        return np.concatenate([array.reshape(len(array), -1) for array in run], axis=1)

    def gradient(self, values: Mapping[str, Any], weights: Any) -> dict[str, Any]:
        """Return the gradient of the sum of weights (rows, components) times outputs, by one adjoint, nested as the
        values. In q the gradient is left-trivialised, (nv,)."""
        run, table = self._run(values), np.asarray(weights)
        entries = dict(zip(run.by, run.gradients([self.by_output(table)])[0], strict=True))
        by_input = {
            name: np.array([entries[f"inputs.{name}[{k}]"] for k in range(len(values["inputs"][name]))])
            for name in self._inputs
        }
        names = self._model.v_names
        return {
            "q": None if values["q"] is None else np.array([entries[f"q{name[1:]}"] for name in names]),
            "v": None if values["v"] is None else np.array([entries[name] for name in names]),
            "parameters": {name: np.float64(entries[name]) for name in values["parameters"]},
            "inputs": by_input,
        }

    def by_output(self, table: Any) -> dict[str, Any]:
        """Return the outputs of a table (rows, components) by name."""
        return {name: table[:, places].reshape(len(table), *shape) for name, (places, shape) in self.columns.items()}
