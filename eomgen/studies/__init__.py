"""Studies of whole scenes: checks of all closed forms, speed against accuracy, tuning, savings, random vibration,
identification."""

from __future__ import annotations

from eomgen.studies.identification import Identification, identify
from eomgen.studies.ladders.register import LADDERS
from eomgen.studies.ladders.result import Extremes
from eomgen.studies.ladders.study import extremes
from eomgen.studies.ladders.verdicts import VERDICTS, Cell
from eomgen.studies.tuning.real_time import RealTime
from eomgen.studies.tuning.result import Tuned
from eomgen.studies.tuning.tune import tune
from eomgen.studies.verification.check import check
from eomgen.studies.verification.form_report import Disagreement, FormReport
from eomgen.studies.verification.report import CheckReport
from eomgen.studies.vibration import Distribution, RandomVibration, random_vibration
from eomgen.studies.work_precision.measured import DEMANDS, Point, Slope
from eomgen.studies.work_precision.result import Tradeoff
from eomgen.studies.work_precision.study import tradeoff

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
