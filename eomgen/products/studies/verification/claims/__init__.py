"""Claims of the closed forms: value, differentiated function, second derivation."""

__all__ = []
#: Open to the other parts of ``studies.verification`` as well.
WITHIN = ["beams", "claim", "frames", "linear_models", "motion", "partials", "rates"]
