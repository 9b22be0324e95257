"""Calculus from tape to tape: partials, gradients, jets in time."""

__all__ = ["configuration", "jets", "loops", "partials"]
