"""Facts of studies about methods: values to compare, ladders of extreme conditions, runs that serve as references."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from eomgen.base.data import dataclass, field, replace
from eomgen.base.extensions import extensions, load_row
from eomgen.integrators.families.register import is_built_in, row_of

#: Entry points of other distributions: the name of a method, with its ``MethodFacts``.
GROUP = "eomgen.method_facts"
#: Ladders of extreme conditions: few methods, all methods, or methods with numerical damping.
Ladders = Literal["few", "all", "damped"]
#: Refinement that makes runs of a method references: a tight tolerance, fine steps, or fine steps with other damping.
FineBy = Literal["", "tolerance", "steps", "damping"]


@dataclass(frozen=True)
class MethodFacts:
    """Facts of studies about one method.

    Attributes
    ----------
    compared : values of parameters in a study of speed against accuracy
    studied : whether such a study includes the method by default
    policies : other settings of the iteration in such a study, by label
    ladders : ladders of extreme conditions that include the method by default
    fine_by : refinement of the method in references of these ladders; empty: none
    """

    compared: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    studied: bool = True
    policies: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    ladders: tuple[Ladders, ...] = ()
    fine_by: FineBy = ""


def facts_of(name: str) -> MethodFacts:
    """Return the facts about a method by any of its names. Raises UsageError if the name or an entry point is wrong."""
    name = row_of(name)[1].name
    if not is_built_in(name):
        entry = next((entry for entry in extensions(GROUP) if entry.name == name), None)
        return load_row(entry, MethodFacts) if entry is not None else MethodFacts()
    return FACTS.get(name, MethodFacts())


_PAIR = {"tolerance": (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)}
_ALL: tuple[Ladders, ...] = ("all",)
_NEWTON = {
    **{f"rtol {x:g}": {"rtol": x, "atol": 1e-2 * x} for x in (1e-8, 1e-6, 1e-4)},
    "factors at every step": {"reuse": 0.0},
}
_ALPHA = MethodFacts(policies=_NEWTON)
_NOT_STUDIED = MethodFacts(studied=False)
#: Methods without a row have the defaults.
FACTS: Mapping[str, MethodFacts] = {
    "generalized_alpha": replace(
        _ALPHA, compared={"rho_inf": (0.0, 0.5, 0.8, 0.9, 1.0)}, ladders=("few", "damped"), fine_by="damping"
    ),
    "generalized_alpha_index3": replace(_ALPHA, compared={"rho_inf": (0.5, 0.8, 0.9)}, ladders=("all", "damped")),
    "generalized_alpha_adaptive": replace(
        _ALPHA, compared={"tolerance": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7), "rho_inf": (0.5, 0.8, 0.9)}, ladders=_ALL
    ),
    "generalized_alpha_spatial": _ALPHA,
    "wbz": replace(_ALPHA, ladders=("damped",)),
    **dict.fromkeys(("hht", "newmark", "trapezoidal"), _ALPHA),
    **dict.fromkeys(
        (
            *(f"generalized_alpha{form}_{variant}" for form in ("", "_index3") for variant in ("f1", "f2")),
            "generalized_alpha_index3_spatial",
            *(f"{case}_index3" for case in ("hht", "wbz", "newmark", "trapezoidal")),
            *(f"{case}_adaptive" for case in ("hht", "wbz", "trapezoidal")),
        ),
        replace(_ALPHA, studied=False),
    ),
    **dict.fromkeys(("rk4", "rk4_partitioned"), MethodFacts(ladders=("few",), fine_by="steps")),
    "rk45": MethodFacts(compared=_PAIR, ladders=_ALL),
    "rk45_partitioned": MethodFacts(compared=_PAIR),
    **dict.fromkeys(("rosenbrock", "lsrt2", "rattlie", "tdg1", "tdg2", "tdg3"), MethodFacts(ladders=_ALL)),
    "taylor": MethodFacts(
        compared={"tolerance": (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14)},
        ladders=_ALL,
        fine_by="tolerance",
    ),
    **dict.fromkeys(
        (
            *("corrected_predictor", "tdg1_star", "tdg2s", "leapfrog", "minimum_norm2", "bcss3", "yoshida4", "suzuki4"),
            *("omf4", "blanes_moan4", "yoshida6", "suzuki6", "blanes_moan6", "yoshida8", "kahan_li8"),
        ),
        _NOT_STUDIED,
    ),
}
