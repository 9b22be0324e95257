"""Schema of random processes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.scene.formula.scope import FIXED_PARAMETERS, TRANSLATION
from eomgen.scene.reading.key_metadata import ANY_UNIT, Table, key, label_of, of_fixed_parameters, optional
from eomgen.scene.reading.kinds import Description, Finite, Pair, Unit, Value
from eomgen.scene.signals.curve_schema import RoadClass, Seed, TableFile

#: Default of the share of the variance that is kept.
SHARE = 0.99


def _form(value: object) -> str:
    """Return the form of a coherence that is meant, so that messages concern this form alone."""
    return "#points" if isinstance(value, list | tuple) else "#decay"


_Coherence = Annotated[
    Annotated[Finite, Tag("#decay")] | Annotated[tuple[Pair, ...], Field(strict=False), Tag("#points")],
    Discriminator(_form),
]


class RandomProcess(Table):
    """A stationary random process g(t), or a random constant, and its translation; formulas use it by name."""

    type: (
        Literal[
            "constant",
            "squared_exponential",
            "exponential",
            "damped_cosine",
            "oscillator",
            "kanai_tajimi",
            "band",
            "road",
            "covariance",
            "spectrum",
        ]
        | None
    ) = optional("see below; required unless it follows another")
    correlation: dict[str, Finite] | None = optional(
        "correlation coefficients with other processes; it has their covariance, times the square of its own"
        " `standard_deviation` over theirs",
        refers="random",
        kind="numbers by process",
    )
    coherence: dict[str, _Coherence] | None = optional(
        "root of the magnitude-squared coherence with other processes over the frequency f: the decay a, s or m, of"
        " exp(-a f), or points [frequency, coherence], linear between them and 0 beyond; it has their spectrum, times"
        " the square of its own `standard_deviation` over theirs",
        refers="random",
        kind="decays, or lists of points, by process",
    )
    follows: str | None = optional(
        "the process that this one repeats, later by `delay`, or farther back by `offset`", refers="random"
    )
    mean: Value = key("mean of g", 0.0, unit=ANY_UNIT, names=FIXED_PARAMETERS)
    standard_deviation: Value | None = of_fixed_parameters(
        "standard deviation of g, positive; not for types that say it themselves (`road`, `covariance`, `spectrum`)",
        unit=ANY_UNIT,
        shown_default="1",
    )
    correlation_time: Value | None = of_fixed_parameters("time scale of `squared_exponential`, `exponential`", unit="s")
    correlation_length: Value | None = of_fixed_parameters("length scale of the same over distance", unit="m")
    decay: Value | None = of_fixed_parameters("rate of decay of `damped_cosine`", unit="1/s")
    frequency: Value | None = of_fixed_parameters(
        "frequency of `damped_cosine`, or natural frequency of `oscillator` and `kanai_tajimi`", unit="rad/s"
    )
    damping: Value | None = of_fixed_parameters("damping ratio of `oscillator` and `kanai_tajimi`, between 0 and 1")
    band: Pair | None = of_fixed_parameters(
        "lowest and highest frequency of `band`", unit="Hz", kind="[lowest, highest], Hz"
    )
    road_class: RoadClass | None = optional(
        "class of a `road`, as of roads of [inputs](inputs.md)", alias="class", kind="`A` to `H`"
    )
    points: Annotated[tuple[Pair, ...], Field(strict=False)] | None = of_fixed_parameters(
        "points of `covariance`: lags from 0 on, and the covariance there; points of `spectrum`: frequencies in Hz"
        " (over distance in cycles/m), and the one-sided power spectral density there",
        unit=ANY_UNIT,
        column=("argument", "value"),
        kind="list of [lag or frequency, value], any unit that fits",
    )
    table: TableFile | None = optional("the same from a CSV file")
    duration: Value | None = of_fixed_parameters(
        "time from t = 0 on in which the process is known", unit="s", shown_default="`simulation.duration`"
    )
    speed: Value | None = of_fixed_parameters("speed of the vehicle, for a process over distance", unit="m/s")
    offset: Value | None = of_fixed_parameters("distance by which the process follows another over distance", unit="m")
    delay: Value | None = of_fixed_parameters("time by which the process follows another over time", unit="s")
    share: Finite | None = optional("share of the variance that the modes capture, below 1", shown_default=f"{SHARE:g}")
    modes: Annotated[int, Field(ge=1)] | None = optional("number of modes, in place of `share`")
    seed: Seed = key("seed of the standard normal variables", 0, kind="whole number from 0")
    translation: Value | None = optional("the process as a formula of g", names=TRANSLATION, shown_default="`g`")
    distribution: str | None = optional(
        "marginal distribution in place of `translation` or `quantiles`, as of [ensembles](../ensembles.md), in the"
        " scene's units: `normal(mean, deviation)`, `lognormal(mean, deviation)`, `uniform(low, high)`,"
        " `gumbel(location, scale)`, `exponential(mean)`, `weibull(scale, shape)`, ...",
        kind="text",
    )
    quantiles: Annotated[tuple[Pair, ...], Field(strict=False)] | None = of_fixed_parameters(
        "probabilities between 0 and 1, and the values that are not exceeded with them; in place of `translation`",
        kind="list of [probability, value]",
    )
    covariance_of: Literal["gaussian", "translated"] = key(
        "process with the covariance of `type`: g, or, but for its size, the translation of g", "gaussian"
    )
    covariance_repair: Literal["nearest"] | None = optional(
        "repair of a covariance, or of correlations, that no process has: the nearest ones that some process has take"
        " their place, which is noted; without it they are refused"
    )
    unit: Unit = key("label", "")
    description: Description = key("text of one line for tables", "")

    labels_values: ClassVar[bool] = False

    @classmethod
    def column_labels(cls, data: Mapping[str, Any]) -> tuple[str, str] | None:
        over_distance = data.get("speed") is not None
        translated = data.get("translation") is not None or data.get("quantiles") is not None
        translated = translated or data.get("distribution") is not None
        variance = "" if translated and data.get("covariance_of") != "translated" else _square_of_unit(data.get("unit"))
        if data.get("type") == "spectrum":
            return ("1/m", variance and f"{variance} m") if over_distance else ("Hz", variance and f"{variance}/Hz")
        return "m" if over_distance else "s", variance


def _square_of_unit(label: object) -> str:
    """Return the square of a unit; empty for a label that is not a unit."""
    try:
        return " ".join(f"{name}^{2 * exponent}" for name, exponent in read_unit(label_of(label)))
    except UnitError:
        return ""


#: Keys that a following process takes from the process it follows.
OWN = tuple(
    word
    for word in RandomProcess.model_fields
    if word not in ("follows", "offset", "delay", "translation", "quantiles", "distribution", "unit", "description")
)
#: Keys that a correlated or coherent process takes from the other process of the pair.
SHARED = tuple(word for word in OWN if word not in ("correlation", "coherence", "mean", "standard_deviation", "seed"))
