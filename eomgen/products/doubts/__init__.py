"""Doubts: notes on scenes, warnings of states and checks of runs that doubt a result and fail none."""

from eomgen.base.products import LateRow, Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "doubts",
                behind="completion",
                parts={
                    "simulate": "eomgen.products.doubts.command:DoubtsOfRuns",
                    "equilibrium": "eomgen.products.doubts.command:DoubtsOfRests",
                },
            ),
        ),
        "eomgen.sections": (LateRow("doubts", "eomgen.products.doubts.section:DOUBTS", behind="shapes"),),
        "eomgen.doubt_settings": (LateRow("doubts", "eomgen.products.doubts.settings:settings_of"),),
        "eomgen.notes": ("eomgen.products.doubts.notes:NOTES",),
        "eomgen.checks": tuple(
            f"eomgen.products.doubts.{module}:ROWS" for module in ("accuracy", "remarks", "start_checks")
        ),
        "eomgen.state_warnings": ("eomgen.products.doubts.rests:ROWS",),
        "eomgen.unseen_laws": (LateRow("laws", "eomgen.products.doubts.unseen_laws:unseen_law"),),
        "eomgen.unresolved_motions": (LateRow("motions", "eomgen.products.doubts.fast_motions:unresolved_motion"),),
        "eomgen.searches": (LateRow("searches", "eomgen.products.doubts.fast_motions:searches_left_out"),),
        "eomgen.causes": (LateRow("values", "eomgen.products.doubts.causes:cause_of"),),
        "eomgen.starts": (LateRow("tyres", "eomgen.products.doubts.start_checks:deep_tyres"),),
    },
    moved={
        "scene.document.doubtful_elements": "eomgen.products.doubts.doubtful_elements",
        "scene.document.out_of_scale": "eomgen.products.doubts.out_of_scale",
        "simulation.accuracy.unseen_events": "eomgen.products.doubts.unseen_events",
        "simulation.accuracy.unseen_laws": "eomgen.products.doubts.unseen_laws",
        "simulation.judgement.fast_motions": "eomgen.products.doubts.fast_motions",
        "simulation.judgement.remarks": "eomgen.products.doubts.remarks",
        "simulation.judgement.start_checks": "eomgen.products.doubts.start_checks",
    },
)
