"""Studies of whole scenes: so far, checks of all closed forms."""

from __future__ import annotations

from eomgen.studies.checking import check
from eomgen.studies.report import CheckReport, Disagreement, FormReport

__all__ = ["CheckReport", "Disagreement", "FormReport", "check"]
