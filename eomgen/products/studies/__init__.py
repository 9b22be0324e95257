"""Studies of whole scenes: checks of all closed forms, speed against accuracy, tuning, savings, identification."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eomgen.base.products import Product, import_target
from eomgen.base.verbs import Verb

if TYPE_CHECKING:
    from eomgen.products.studies.identification import Identification, identify
    from eomgen.products.studies.ladders.register import LADDERS
    from eomgen.products.studies.ladders.result import VERDICTS, Cell, Extremes
    from eomgen.products.studies.ladders.study import extremes
    from eomgen.products.studies.tuning.result import Tuned
    from eomgen.products.studies.tuning.tune import tune
    from eomgen.products.studies.verification.check import check
    from eomgen.products.studies.verification.report import CheckReport, Disagreement, FormReport
    from eomgen.products.studies.work_precision.result import DEMANDS, Point, Slope, Tradeoff
    from eomgen.products.studies.work_precision.study import tradeoff

__all__ = [
    "DEMANDS",
    "LADDERS",
    "VERDICTS",
    "Cell",
    "CheckReport",
    "Disagreement",
    "Extremes",
    "FormReport",
    "Identification",
    "Point",
    "Slope",
    "Tradeoff",
    "Tuned",
    "check",
    "extremes",
    "identify",
    "tradeoff",
    "tune",
]

_HOMES = {
    **dict.fromkeys(("Identification", "identify"), "identification"),
    "LADDERS": "ladders.register",
    "extremes": "ladders.study",
    **dict.fromkeys(("VERDICTS", "Cell", "Extremes"), "ladders.result"),
    "Tuned": "tuning.result",
    "tune": "tuning.tune",
    "check": "verification.check",
    **dict.fromkeys(("CheckReport", "Disagreement", "FormReport"), "verification.report"),
    **dict.fromkeys(("DEMANDS", "Point", "Slope", "Tradeoff"), "work_precision.result"),
    "tradeoff": "work_precision.study",
}
#: Commands: name, line in the list of commands, module, and the command before it.
_COMMANDS = (
    ("savings", "Costs of a scene with the terms that it needs, and with more.", "model_commands", "generate"),
    ("check", "Hold every closed form against differences and complex steps.", "model_commands", "savings"),
    ("identify", "Unknown parameters of a scene from measured runs, with intervals.", "model_commands", "random"),
    ("tradeoff", "Measure speed against accuracy: methods, formulations, steps.", "run_commands", "animate"),
    ("tune", "Find the cheapest settings that meet a demand on the error.", "run_commands", "tradeoff"),
    ("extremes", "Runs under extreme conditions: their failures and warnings.", "run_commands", "tune"),
)
_NO_CYCLES = "a demand on the error; eomgen simulate --timing measures steps"
_OF_EOMGEN = ("Extremes", "Identification", "Tradeoff", "Tuned", "extremes", "identify", "tradeoff", "tune")

PRODUCT = Product(
    modules={"studies": "eomgen.products.studies"},
    names={name: f"eomgen.products.studies.{_HOMES[name]}:{name}" for name in _OF_EOMGEN}
    | {"savings": "eomgen.products.studies.savings:savings"},
    rows={
        "eomgen.removed": (
            {
                "argument": dict.fromkeys(("tune(real_time)", "tune(iterations)"), _NO_CYCLES),
                "option": dict.fromkeys(("tune --real-time", "tune --iterations"), _NO_CYCLES),
                "name": {"RealTime": "Tuned, of a demand on the error"},
            },
        ),
        "eomgen.verbs": tuple(
            Verb(name, line, f"eomgen.products.studies.{module}:{name}", behind=behind, heading="Studies")
            for name, line, module, behind in _COMMANDS
        ),
    },
    needs=("derivatives",),
)


def __getattr__(name: str) -> object:
    if name in _HOMES:
        return import_target(f"{__name__}.{_HOMES[name]}:{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


#: Open to the other parts of ``products`` as well.
WITHIN = ["identification", "ladders", "savings", "tuning", "work_precision"]
