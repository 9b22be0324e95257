"""Signals of a system: parameters, inputs (also as series of standard normal variables), internal states, outputs,
named expressions; sampled states and the C functions of sampled controllers."""

from __future__ import annotations

import math
from collections.abc import Callable

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Formula, Symbol

#: Prefix of the number of a variable in the name of the variable's parameter.
_VARIABLE = "z"


def variables_of(name: str, count: int) -> tuple[str, ...]:
    """Return the names of the tunable parameters of an entry, which are standard normal variables."""
    return tuple(f"{name}_{_VARIABLE}{k}" for k in range(1, count + 1))


@dataclass(frozen=True)
class NormalSeries:
    """A stationary process by its Karhunen-Loeve expansion: X(t) = T(g(x(t))), g(x) = mean + sum w_i z_i
    m_i(x).

    Attributes
    ----------
    name : of the input
    kind : of the covariance, by the name in scenes
    mean : of g
    variables : names of the tunable parameters that the z_i are
    weights : w_i
    modes : m_i = sqrt(lambda_i) phi_i, phi_i orthonormal over the window, the largest lambda first
    eigenvalues : w_i^2 lambda_i
    total : the sum of all eigenvalues, also of those left out: variance of g times length of the window
    seed : of the default values of the process's independent variables
    speed, lag : x(t) = speed t - lag, m/s and m; over time, with speed 0, x(t) = t - lag, s
    follows : the repeated process; empty if none
    correlation : correlation coefficients with other processes, which have variables in common with this process
    coherent_with : processes coherent with this process over frequencies, of which one holds the variables
    translation : T, a formula of the symbol of kind ``gaussian``, which is g; None if X is g
    covariance : R at lags of x, of g with all modes and weights of 1; None if the covariance of the modes depends
        on more than the lag: for coherent processes and repaired covariances
    """

    name: str
    kind: str
    mean: float
    variables: tuple[str, ...]
    weights: tuple[float, ...]
    modes: tuple[Curve, ...]
    eigenvalues: tuple[float, ...]
    total: float
    seed: int = 0
    speed: float = 0.0
    lag: float = 0.0
    follows: str = ""
    correlation: tuple[tuple[str, float], ...] = ()
    coherent_with: tuple[str, ...] = ()
    translation: Formula | None = None
    covariance: Callable[[Array], Array] | None = field(default=None, compare=False, repr=False)

    @property
    def own_variables(self) -> tuple[str, ...]:
        """Independent standard normal variables of this process; none if the process follows or is correlated with
        another process."""
        process_variables = variables_of(self.name, len(self.modes))
        return tuple(variable for variable in self.variables if variable in process_variables)

    @property
    def window(self) -> tuple[float, float]:
        """Range of x with known values of the process, s or m."""
        return self.modes[0].start, self.modes[0].end

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of g, including the part of the modes that are left out."""
        start, end = self.window
        return math.sqrt(self.total / (end - start))

    @property
    def captured(self) -> tuple[float, ...]:
        """Shares of the variance of g that the first mode has, the first two modes together, and so on."""
        sums, value = [], 0.0
        for eigenvalue in self.eigenvalues:
            value += eigenvalue
            sums.append(value / self.total)
        return tuple(sums)


@dataclass(frozen=True)
class Parameter:
    """A named number. Tunable parameters are arguments of every call; fixed parameters are folded into the code.

    Attributes
    ----------
    standard_normal : whether the parameter is a standard normal variable, of which runs by default have one draw
    """

    name: str
    value: float
    tunable: bool = False
    unit: str = ""
    description: str = ""
    standard_normal: bool = False


@dataclass(frozen=True)
class RoadUnderWheel:
    """A random road as an input: ISO 8608 class, speed, m/s, distance from the first wheel of the track back to this
    wheel, m, and seed of the track."""

    road_class: str
    speed: float
    offset: float
    seed: int


@dataclass(frozen=True)
class Input:
    """A named input u_k; the default value is a formula plus a sum of harmonics.

    Attributes
    ----------
    formula : formula of t and parameters, or None
    harmonics : tuples (amplitude, angular frequency, phase), each adding amplitude cos(angular frequency t + phase)
    road : the road described by the harmonics, if any
    series : the random process described by the formula, if any, as a series in standard normal variables
    """

    name: str
    formula: Formula | None = None
    unit: str = ""
    description: str = ""
    harmonics: tuple[tuple[float, float, float], ...] = ()
    road: RoadUnderWheel | None = None
    series: NormalSeries | None = None

    @property
    def given(self) -> bool:
        """Whether the scene specifies the input."""
        return self.formula is not None or bool(self.harmonics)


@dataclass(frozen=True)
class Sampling:
    """When and how an internal state takes new values.

    Attributes
    ----------
    formula : of everything but accelerations
    period, offset : s; samples are at offset + k period, k = 0, 1, ...
    quantum : values are rounded to whole multiples of the quantum; 0: no rounding
    register : whether the state takes values of other states from before samples at the same time
    place : file and line, for messages
    controller : the sampled controller that gives the value in place of the formula; empty: none
    """

    formula: Formula
    period: float
    offset: float = 0.0
    quantum: float = 0.0
    register: bool = False
    place: str = ""
    controller: str = ""


@dataclass(frozen=True)
class State:
    """An internal state z_k: zdot_k = ``rate``, a formula of everything but accelerations, from ``initial`` on.

    A sampled state has rate 0 and is constant between samples.
    """

    name: str
    rate: Formula
    initial: float = 0.0
    unit: str = ""
    description: str = ""
    sampling: Sampling | None = None


@dataclass(frozen=True)
class Definition:
    """A named expression: ``text`` as written in the scene, ``formula`` with other definitions written out."""

    name: str
    text: str
    formula: Formula
    unit: str = ""
    description: str = ""


@dataclass(frozen=True)
class Output:
    """A named output: ``values`` are formulas of all quantities (positions, accelerations and energies included).
    Energies are symbols of the kind ``energy`` with the name kinetic, potential, total, base_power or power."""

    name: str
    values: tuple[Formula, ...]
    unit: str = ""
    description: str = ""

    @property
    def quantity(self) -> str:
        """``position``, ``velocity`` or ``acceleration`` if the values are exactly this quantity, else empty."""
        kinds = {value.kind if isinstance(value, Symbol) else "" for value in self.values}
        kind = kinds.pop() if len(kinds) == 1 else ""
        return kind if kind in ("position", "velocity", "acceleration") else ""


@dataclass(frozen=True)
class SampleRow:
    """One sampled state of a System, in the order of the term ``samples``, which gives the values.

    Attributes
    ----------
    state : index in z
    period, offset : s; samples are at offset + k period, k = 0, 1, ...
    quantum : values are rounded to whole multiples of the quantum; 0: no rounding
    level : of states sampled at the same time, lower levels are set first
    controller : number of the controller that returns the value in place of the term; -1: none
    """

    state: int
    period: float
    offset: float = 0.0
    quantum: float = 0.0
    level: int = 0
    controller: int = -1


@dataclass(frozen=True)
class PythonFunction:
    """A function in a Python file, which C calls through a pointer.

    Attributes
    ----------
    label : in messages
    file, text : path and contents of the Python file
    function, partials : names in that file; no partials: by complex steps or differences
    complex_step : whether the function takes complex numbers
    sizes : numbers of arguments, parameters and results
    setter : name of the C function that sets the pointers to values and slopes
    """

    label: str
    file: str
    text: str
    function: str
    partials: str
    complex_step: bool
    sizes: tuple[int, int, int]
    setter: str


@dataclass(frozen=True)
class CSource:
    """A C file that a scene brings along.

    Attributes
    ----------
    name : of the file, without the folder
    text : contents of the file
    python : the function in Python that the file calls, of a prototype
    """

    name: str
    text: str
    python: PythonFunction | None = None


#: Arguments of the C function of a sampled controller.
CONTROLLER_ARGUMENTS = "double t, const double *signals, double *values, double *memory"


@dataclass(frozen=True)
class SampledController:
    """A function called at samples: maps signals and private memory to values that are held.

    Attributes
    ----------
    name : of the entry
    signals, outputs : names in the scene
    signal_states, value_states, memory_states : names of the internal states for signals, outputs and memory; all are
        sampled together
    declared : whether the declared memory is the whole memory of the function
    function : name of the C function; empty: the caller gives a function
    source : the file with that
    """

    name: str
    signals: tuple[str, ...]
    outputs: tuple[str, ...]
    signal_states: tuple[str, ...]
    value_states: tuple[str, ...]
    memory_states: tuple[str, ...] = ()
    declared: bool = True
    function: str = ""
    source: CSource | None = None
