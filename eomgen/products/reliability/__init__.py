"""Random processes of scenes, and distributions of responses to them: random vibration, tails, reliability."""

from eomgen.base.products import LateRow, Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    names={name: f"eomgen.products.reliability.vibration:{name}" for name in ("RandomVibration", "random_vibration")},
    rows={
        "eomgen.sections": (LateRow("random", "eomgen.products.reliability.section.reading:RANDOM", behind="inputs"),),
        "eomgen.ensemble_notes": (
            LateRow("truncation", "eomgen.products.reliability.vibration.study:judge_truncated_outputs"),
        ),
        "eomgen.info": ("eomgen.products.reliability.command:PROCESSES",),
        "eomgen.verbs": (
            Verb(
                "random",
                "Distribution of an output under random processes, and its tails.",
                "eomgen.products.reliability.command:random",
                behind="ensemble",
                heading="Studies",
            ),
        ),
    },
    needs=("derivatives", "ensembles"),
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["vibration"]
