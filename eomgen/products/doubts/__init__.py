"""Doubts: notes on scenes, warnings of states and checks of runs that doubt a result and fail none."""

from eomgen.base.products import LateRow, Product

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.notes": ("eomgen.products.doubts.notes:NOTES",),
        "eomgen.checks": tuple(
            f"eomgen.products.doubts.{module}:ROWS" for module in ("accuracy", "remarks", "start_checks")
        ),
        "eomgen.state_warnings": ("eomgen.products.doubts.rests:ROWS",),
        "eomgen.unseen_laws": (LateRow("laws", "eomgen.products.doubts.examinations:law_between_steps"),),
        "eomgen.unresolved_motions": (LateRow("motions", "eomgen.products.doubts.examinations:unresolved_motion"),),
        "eomgen.searches": (LateRow("searches", "eomgen.products.doubts.examinations:searches_left_out"),),
        "eomgen.starts": (LateRow("tyres", "eomgen.products.doubts.start_checks:deep_tyres"),),
    },
)
