"""Target languages: names, printer and files of each."""

__all__ = ["c", "register", "target"]
