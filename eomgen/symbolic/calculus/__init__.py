"""Calculus from tape to tape: partials, gradients, jets in time."""

__all__ = ["configuration", "cuts", "jets", "loops", "partials", "tangents"]
