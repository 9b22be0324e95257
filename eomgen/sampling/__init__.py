"""Sampling of fields that files describe: problems, runs that may be stopped and go on, diagnostics, pictures."""

from __future__ import annotations

from eomgen.sampling.plots import draw
from eomgen.sampling.problem import FieldProblem, at_settings, field_problem, memory_of
from eomgen.sampling.result import FieldSamples, Scale
from eomgen.sampling.run import sample

__all__ = ["FieldProblem", "FieldSamples", "Scale", "at_settings", "draw", "field_problem", "memory_of", "sample"]
