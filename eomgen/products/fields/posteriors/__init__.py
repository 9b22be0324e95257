"""Fields on a periodic mesh as Hamiltonian systems: posteriors by a formula of a cell, sampled along trajectories."""

from __future__ import annotations

from eomgen.products.fields.posteriors.cells import CellEnergy, gaussian, negative_binomial, poisson
from eomgen.products.fields.posteriors.mesh import Mesh, check_transforms
from eomgen.products.fields.posteriors.operators import (
    OPERATORS,
    LinearOperator,
    amplitude,
    difference,
    lognormal_amplitude,
    mask,
    smoothing,
    white,
)
from eomgen.products.fields.posteriors.posterior import FieldPosterior, Mode
from eomgen.products.fields.posteriors.record import (
    Outcome,
    Record,
    Samples,
    autocorrelation_error,
    autocorrelation_time,
    split_r_hat,
)
from eomgen.products.fields.posteriors.sampling import Sampler, follow

__all__ = [
    "OPERATORS",
    "CellEnergy",
    "FieldPosterior",
    "LinearOperator",
    "Mesh",
    "Mode",
    "Outcome",
    "Record",
    "Sampler",
    "Samples",
    "amplitude",
    "autocorrelation_error",
    "autocorrelation_time",
    "check_transforms",
    "difference",
    "follow",
    "gaussian",
    "lognormal_amplitude",
    "mask",
    "negative_binomial",
    "poisson",
    "smoothing",
    "split_r_hat",
    "white",
]
#: Open to the other parts of ``products.fields`` as well.
WITHIN = ["mesh", "record"]
