"""Claims of the closed forms: value, the function it is a derivative of, second derivation."""

__all__ = []
#: Open to the other parts of ``studies.verification`` as well.
WITHIN = ["beams", "claim", "frames", "linear_models", "motion", "partials", "rates"]
