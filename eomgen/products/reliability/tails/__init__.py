"""Distributions of responses to standard normal variables: quadratic forms, most probable points, tails."""

__all__ = []
#: Open to the other parts of ``products.reliability`` as well.
WITHIN = ["distribution", "most_probable_point", "quadratic_form"]
