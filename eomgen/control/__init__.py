"""Feedback design for second-order models M q'' + C q' + K q = B u from matrices alone (NumPy and SciPy)."""

__all__ = ["modal", "placement", "plant", "riccati", "weights"]
