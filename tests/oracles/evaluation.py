"""Evaluation of model functions for oracles."""

from tests.oracles.states import Array, Evaluate, relative_error, tape_evaluator

__all__ = ["Array", "Evaluate", "relative_error", "tape_evaluator"]
