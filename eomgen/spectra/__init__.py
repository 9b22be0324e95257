"""Random vibration: spectra of roads and other excitations, power spectral densities, weightings of human response."""

from __future__ import annotations

from eomgen.spectra.excitation import Excitation, InputSpectrum, check_excitation
from eomgen.spectra.measured_road import MeasuredRoad
from eomgen.spectra.power_spectrum import PowerSpectrum
from eomgen.spectra.ride_table import RideTable
from eomgen.spectra.road import Road
from eomgen.spectra.road_excitation import RoadExcitation
from eomgen.spectra.weighting import WEIGHTINGS, weighting_response

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
    "weighting_response",
]
