"""Studies of whole scenes: checks of all closed forms."""

from __future__ import annotations

from eomgen.studies.verification.check import check
from eomgen.studies.verification.report import CheckReport, Disagreement, FormReport

__all__ = ["CheckReport", "Disagreement", "FormReport", "check", "verification"]
