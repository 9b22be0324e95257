"""Evaluation of model functions, as ``eomgen.testing`` has it."""

from eomgen.products.testing.states import Array, Evaluate, relative_error, tape_evaluator

__all__ = ["Array", "Evaluate", "relative_error", "tape_evaluator"]
