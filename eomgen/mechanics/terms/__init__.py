"""Recorders of the terms: forward dynamics, implicit steps, linear models, rates."""

__all__: list[str] = []
#: Open to the other parts of ``mechanics``.
WITHIN = ["argument_derivatives", "events", "rates", "recorders"]
