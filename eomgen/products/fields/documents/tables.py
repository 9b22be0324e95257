"""Tables of files that documents hold as they are: defaults of runs and chains, and files of power spectra."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Finite, list_of

#: Least and largest tolerance of the adaptive steps of rk45.
TOLERANCES = (1e-14, 0.1)
NOT_NEGATIVE = WithJsonSchema({"type": "number", "minimum": 0})
Counter = Annotated[int, Field(ge=0)]
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


class Chains(Table):
    """The defaults of the arguments of ``sample``."""

    method: str = key("composition of a trajectory's steps", "minimum_norm2", example='method = "minimum_norm2"')
    step: Finite = key("length of steps; 0: found by the warm-up", 0.0, example="step = 0.0")
    duration: Finite = key("time of a trajectory", 1.5, example="duration = 1.5")
    first: Literal["random", "drift", "kick"] = key("first part of trajectories: random, drift or kick", "random")
    jitter: Finite = key("spread of steps, as a part of the step", 0.2, example="jitter = 0.2")
    guard: Annotated[float, Field(gt=0.0), NOT_NEGATIVE] = key(
        "largest step, as a part of the stability limit; inf: none", 0.9, example="guard = 0.9"
    )
    chains: Counter = key("number of chains", 2, example="chains = 2")
    start: str = key("mode, prior, zero, or a .npy file of white fields", "mode", example='start = "mode"')
    warm_up: Counter = key("trajectories before the samples", 50, example="warm_up = 50")
    samples: Counter = key("samples of each chain", 200, example="samples = 200")
    seed: Counter = key("seed of all random numbers", 0, example="seed = 0")
    field: str = key("the field whose samples are recorded; the first by default", "", example='field = "..."')
    watched: Counter = key("number of cells whose values are kept", 500, example="watched = 500")
    bins: Counter = key("number of bins of wave numbers", 8, example="bins = 8")
    transforms: Literal["scipy", "fftw"] = key("library of Fourier transforms: scipy, or fftw of pyfftw", "scipy")
    precision: Literal["double", "single"] = key("precision of gradients: double or single", "double")


class PowerTable(Table):
    """A file of two columns, wave numbers and values, each column given by name or by index."""

    file: str = key("k and P", example='file = "power.csv", a table of k and P')
    columns: Annotated[tuple[str, str], BeforeValidator(list_of(2))] = key(
        "columns of k and of P", ("", ""), example='columns = ["k", "P"]; the first two if nothing is said'
    )
