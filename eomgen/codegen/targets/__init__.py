"""Target languages, one room each: names, printer, files."""

__all__ = ["c"]
