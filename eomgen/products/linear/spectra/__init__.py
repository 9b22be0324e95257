"""Random vibration: spectra of roads and other excitations, power spectral densities, weightings of human response."""

from __future__ import annotations

from eomgen.products.linear.spectra.excitation import Excitation, InputSpectrum, RoadExcitation, check_excitation
from eomgen.products.linear.spectra.power_spectrum import (
    WEIGHTINGS,
    PowerSpectrum,
    RideTable,
    check_weighted,
    weighted_signal,
    weighting_response,
)
from eomgen.products.linear.spectra.road import MeasuredRoad, Road

__all__ = [
    "WEIGHTINGS",
    "Excitation",
    "InputSpectrum",
    "MeasuredRoad",
    "PowerSpectrum",
    "RideTable",
    "Road",
    "RoadExcitation",
    "check_excitation",
    "check_weighted",
    "weighted_signal",
    "weighting_response",
]
#: Open to the other parts of ``linear`` as well.
WITHIN = ["road"]
