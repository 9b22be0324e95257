"""The check of model descriptions, build descriptions and archives of FMUs by the rules of both standards."""

from eomgen.products.fmu.checks.rules import findings

__all__ = ["findings"]
