"""Studies of whole scenes: checks of all closed forms, speed against accuracy, tuning, savings, random vibration,
identification."""

from __future__ import annotations

from eomgen.products.reliability.vibration import Distribution, RandomVibration, random_vibration
from eomgen.products.studies.identification import Identification, identify
from eomgen.products.studies.ladders.register import LADDERS
from eomgen.products.studies.ladders.result import Extremes
from eomgen.products.studies.ladders.study import extremes
from eomgen.products.studies.ladders.verdicts import VERDICTS, Cell
from eomgen.products.studies.tuning.real_time import RealTime
from eomgen.products.studies.tuning.result import Tuned
from eomgen.products.studies.tuning.tune import tune
from eomgen.products.studies.verification.check import check
from eomgen.products.studies.verification.form_report import Disagreement, FormReport
from eomgen.products.studies.verification.report import CheckReport
from eomgen.products.studies.work_precision.measured import DEMANDS, Point, Slope
from eomgen.products.studies.work_precision.result import Tradeoff
from eomgen.products.studies.work_precision.study import tradeoff

__all__ = [
    "DEMANDS",
    "LADDERS",
    "VERDICTS",
    "Cell",
    "CheckReport",
    "Disagreement",
    "Distribution",
    "Extremes",
    "FormReport",
    "Identification",
    "Point",
    "RandomVibration",
    "RealTime",
    "Slope",
    "Tradeoff",
    "Tuned",
    "check",
    "extremes",
    "identify",
    "random_vibration",
    "savings",
    "tradeoff",
    "tune",
    "verification",
]
