"""``HamiltonianSolution``: a recorded motion of a Hamiltonian system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls, not_unpacked, unknown_attribute
from eomgen.base.files import write_arrays, write_table
from eomgen.errors import Problem, UsageError
from eomgen.products.fields.hamiltonian.step_errors import StepErrors


@checked_calls("model.simulate(...), which makes one", filename="path", file="path")
@dataclass(frozen=True)
class HamiltonianSolution:
    """A motion with its diagnostics.

    Attributes
    ----------
    t : (rows,)
    q, p : (rows, n)
        Coordinates and momenta.
    energy : mapping
        ``kinetic`` (of momenta alone), ``potential`` (of coordinates alone), ``coupled`` if there is such a part,
        and ``total``, their sum H; (rows,) each.
    outputs : mapping
        By name, (rows,) each.
    stats : mapping
        ``steps``, ``gradients`` (evaluations of forces), ``iterations`` (of implicit steps), ``products`` (of the
        Hessian of H, in Newton's method), ``wall_time`` in s.
    success : bool
        Whether the motion reached its end.
    message : str
        Its end, and doubts.
    metadata : mapping
        Names, units, method, step, parameters.
    error_estimate : StepErrors
        Discretisation errors of coordinates and momenta; printed in words.
    """

    t: Array
    q: Array
    p: Array
    energy: Mapping[str, Array]
    outputs: Mapping[str, Array]
    stats: Mapping[str, float]
    success: bool
    message: str
    metadata: Mapping[str, Any] = field(default_factory=dict)
    error_estimate: StepErrors = field(default_factory=StepErrors)

    def __repr__(self) -> str:
        return f"HamiltonianSolution({self.metadata['name']}: {self.message}, {len(self.t)} rows)"

    if not TYPE_CHECKING:  # a checker knows the attributes by itself

        def __getattr__(self, name: str) -> object:
            raise unknown_attribute(self, name)

        def __iter__(self) -> object:
            raise not_unpacked(self, "run = model.simulate(...), and run.t, run.q, run.p")

    @property
    def energy_error(self) -> float:
        """The largest change of H, as a share of |H| at the start; of the largest part of it if H is 0 there."""
        total = self.energy["total"]
        scale = abs(total[0]) or max(float(np.abs(part).max()) for part in self.energy.values()) or 1.0
        return float(np.abs(total - total[0]).max() / scale)

    def columns(self) -> dict[str, Array]:
        """Return all recorded quantities as columns by name: time, coordinates, momenta, outputs, energies."""
        names = self.metadata["names"]
        columns = {"t": self.t}
        columns |= {name: self.q[:, k] for k, name in enumerate(names["q"])}
        columns |= {name: self.p[:, k] for k, name in enumerate(names["p"])}
        columns |= {f"outputs.{name}": column for name, column in self.outputs.items()}
        return columns | {f"energy.{name}": column for name, column in self.energy.items()}

    def save(self, path: str | Path) -> Path:
        """Write all of it as ``.npz``, or its columns as ``.csv``; a file of that name is replaced.

        Raises
        ------
        UsageError
            Another suffix.
        FileError
            The path cannot be written.
        """
        path = Path(path)
        columns = self.columns()
        if path.suffix == ".csv":
            write_table(path, list(columns), np.column_stack(list(columns.values())))
        elif path.suffix == ".npz":
            data = {
                "message": self.message,
                "success": self.success,
                "stats": dict(self.stats),
                **self.metadata,
                "error_estimate": self.error_estimate.summary(),
            }
            write_arrays(path, columns, data)
        else:
            kind = path.suffix or "a file without a suffix"
            fault = f"a motion of a Hamiltonian system cannot be saved as {kind}"
            raise UsageError(Problem(str(path), fault, ".npz or .csv"))
        return path
