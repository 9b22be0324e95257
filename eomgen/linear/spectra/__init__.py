"""Random vibration: spectra of roads and other excitations, power spectral densities, weightings of human response."""

from __future__ import annotations

from eomgen.linear.spectra.excitation import Excitation, InputSpectrum, check_excitation
from eomgen.linear.spectra.measured_road import MeasuredRoad
from eomgen.linear.spectra.power_spectrum import PowerSpectrum
from eomgen.linear.spectra.ride_table import RideTable
from eomgen.linear.spectra.road import Road
from eomgen.linear.spectra.road_excitation import RoadExcitation
from eomgen.linear.spectra.weighting import WEIGHTINGS, weighting_response

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
