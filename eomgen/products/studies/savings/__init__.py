"""Costs of a scene as it is, against the same scene with more terms or freedoms: operations, C, builds and
steps."""

__all__ = ["study"]
