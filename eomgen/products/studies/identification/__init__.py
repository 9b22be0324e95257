"""Identification: parameters and initial states by least squares of measured outputs, with confidence intervals."""

from __future__ import annotations

from eomgen.products.studies.identification.result import Identification
from eomgen.products.studies.identification.study import identify

__all__ = ["Identification", "identify"]
