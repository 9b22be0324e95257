"""The check of model descriptions, build descriptions and archives of FMUs by the rules of both standards."""

from tests.fmu.checks.rules import findings, findings_of_files

__all__ = ["findings", "findings_of_files"]
