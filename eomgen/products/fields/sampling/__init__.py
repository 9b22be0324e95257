"""Sampling of fields that files describe: problems, runs that may be stopped and go on, diagnostics, pictures."""

from __future__ import annotations

from eomgen.products.fields.sampling.problem import FieldProblem, at_settings, field_problem, memory_of
from eomgen.products.fields.sampling.result import FieldSamples, Scale, draw
from eomgen.products.fields.sampling.run import sample

__all__ = ["FieldProblem", "FieldSamples", "Scale", "at_settings", "draw", "field_problem", "memory_of", "sample"]
