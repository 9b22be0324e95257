"""What a scene costs as it is asked, against the same scene with more than it asks for: operations, C, builds and
steps."""

__all__ = ["study"]
