"""Target language C99: identifiers, printer, files of a generated folder, interface of a library."""

__all__ = ["interface", "naming", "printer", "tape_code", "target", "templates"]
