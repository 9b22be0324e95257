"""Linear models of scenes: modes, responses, feedback, random roads, loci of eigenvalues, Floquet multipliers."""

from eomgen.base.products import Product
from eomgen.base.verbs import Verb

__all__ = []

PRODUCT = Product(
    modules={"control": "eomgen.products.linear.control", "spectra": "eomgen.products.linear.spectra"},
    names={"with_controller": "eomgen.products.linear.controllers:with_controller"},
    rows={
        "eomgen.attributes": ("eomgen.products.linear.other_words:ATTRIBUTES",),
        "eomgen.verbs": (
            Verb(
                "linearize",
                "Modes, stability and responses of the linear model.",
                "eomgen.products.linear.command:linearize",
                (
                    "eomgen.products.linear.analyses.linearize:linearize",
                    "eomgen.products.linear.analyses.parameter_sweeps:root_locus",
                    "eomgen.products.linear.analyses.parameter_sweeps:campbell",
                    "eomgen.products.linear.analyses.road_excitation:road_excitation",
                ),
                solution_methods=(
                    "eomgen.products.linear.analyses.solutions:linearize",
                    "eomgen.products.linear.analyses.solutions:psd",
                    "eomgen.products.linear.analyses.solutions:rms",
                ),
                behind="equilibrium",
                heading="Build and run",
            ),
            Verb(
                "floquet", methods=("eomgen.products.linear.analyses.periodic_motions:floquet",), behind="steady_motion"
            ),
        ),
        "eomgen.preparations": ("eomgen.products.linear.calibration:CALIBRATION",),
    },
    needs=("statics",),
    moved={
        "linear": "eomgen.products.linear",
        "simulation.floquet": "eomgen.products.linear.analyses.periodic_motions",
    },
)
#: Open to the other parts of ``products`` as well.
WITHIN = ["analyses", "control", "controllers", "spectra"]
