"""Public names of products, for type checkers, by ``python -m tests.model_stub``."""

from eomgen.products import studies
from eomgen.products.comparison.compare import compare
from eomgen.products.comparison.report import Comparison
from eomgen.products.fields import posteriors as fields
from eomgen.products.fields import sampling
from eomgen.products.fmu.export import fmu
from eomgen.products.gpu.functions import gpu
from eomgen.products.linear import control, spectra
from eomgen.products.linear.controllers import with_controller
from eomgen.products.optimisers.casadi_functions import casadi
from eomgen.products.optimisers.jax_functions import jax
from eomgen.products.optimisers.torch_functions import torch
from eomgen.products.reliability.vibration import RandomVibration, random_vibration
from eomgen.products.studies.identification import Identification, identify
from eomgen.products.studies.ladders.result import Extremes
from eomgen.products.studies.ladders.study import extremes
from eomgen.products.studies.savings import savings
from eomgen.products.studies.tuning.result import Tuned
from eomgen.products.studies.tuning.tune import tune
from eomgen.products.studies.work_precision.result import Tradeoff
from eomgen.products.studies.work_precision.study import tradeoff
from eomgen.products.suspension.result import SuspensionCurves
from eomgen.products.suspension.study import suspension
from eomgen.products.sympy_mechanics.reading import from_sympy
from eomgen.products.testing import contracts as testing
from eomgen.products.waves import second_order as waves

__all__ = [
    "Comparison",
    "Extremes",
    "Identification",
    "RandomVibration",
    "SuspensionCurves",
    "Tradeoff",
    "Tuned",
    "casadi",
    "compare",
    "control",
    "extremes",
    "fields",
    "fmu",
    "from_sympy",
    "gpu",
    "identify",
    "jax",
    "random_vibration",
    "sampling",
    "savings",
    "spectra",
    "studies",
    "suspension",
    "testing",
    "torch",
    "tradeoff",
    "tune",
    "waves",
    "with_controller",
]
