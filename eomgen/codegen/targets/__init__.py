"""Target languages, a room or a distribution each: names, printer, files."""

__all__ = ["c", "register", "target"]
