"""Tables of files that documents hold as they are: defaults of runs, and files of power spectra."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field, WithJsonSchema

from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Finite, list_of

#: Least and largest tolerance of the adaptive steps of rk45.
TOLERANCES = (1e-14, 0.1)
NOT_NEGATIVE = WithJsonSchema({"type": "number", "minimum": 0})
Positive = Annotated[Finite, Field(gt=0.0), NOT_NEGATIVE]


class RunDefaults(Table):
    """The defaults of ``simulate``."""

    duration: Positive = key("time from t = 0 to the end", 10.0, example="duration = 10.0")
    step: Positive = key("length of equal steps", 0.01, example="step = 0.01")
    method: str = key("a composition, implicit_midpoint, gauss<order>, rk4 or rk45", "", example='method = "..."')
    record_every: Annotated[int, Field(ge=1)] = key("steps between recorded rows", 1, example="record_every = 1")
    compensated: bool = key("carry rounding errors of sums over to the next ones", False, example="compensated = false")
    tolerance: Annotated[Positive, Field(ge=TOLERANCES[0], le=TOLERANCES[1])] = key(
        "tolerance of rk45", 1e-8, example="tolerance = 1e-08"
    )


class PowerTable(Table):
    """A file of two columns, wave numbers and values, each column given by name or by index."""

    file: str = key("k and P", example='file = "power.csv", a table of k and P')
    columns: Annotated[tuple[str, str], BeforeValidator(list_of(2))] = key(
        "columns of k and of P", ("", ""), example='columns = ["k", "P"]; the first two if nothing is said'
    )
