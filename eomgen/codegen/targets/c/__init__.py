"""C99: legal names, the printer of expressions, the files of a generated folder, the interface of a library."""

__all__ = ["interface", "naming", "target"]
