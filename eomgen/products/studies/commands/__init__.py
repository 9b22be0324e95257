"""Commands of the studies."""

__all__ = []
