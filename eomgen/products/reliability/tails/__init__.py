"""Distributions of responses to standard normal variables: quadratic forms, most probable points, tails."""

from __future__ import annotations

from eomgen.products.reliability.tails.distribution import (
    INVERSIONS,
    Draws,
    Estimate,
    Tails,
    corrected_tail,
    far_branches,
    importance_sampling,
)
from eomgen.products.reliability.tails.most_probable_point import (
    JUMPING,
    MostProbablePoint,
    UnreachedThreshold,
    all_centres,
    breitung,
    descended,
    draws_about,
    first_order,
    further_design_points,
    hohenbichler_rackwitz,
    most_probable_points,
    points_on_curve,
    searched_points,
)
from eomgen.products.reliability.tails.quadratic_form import (
    Expansion,
    HessianProductResponse,
    ProjectedResponse,
    QuadraticForm,
    Response,
    hermite_projection,
    leading_directions,
    projected_hessian,
)

__all__ = [
    "INVERSIONS",
    "JUMPING",
    "Draws",
    "Estimate",
    "Expansion",
    "HessianProductResponse",
    "MostProbablePoint",
    "ProjectedResponse",
    "QuadraticForm",
    "Response",
    "Tails",
    "UnreachedThreshold",
    "all_centres",
    "breitung",
    "corrected_tail",
    "descended",
    "draws_about",
    "far_branches",
    "first_order",
    "further_design_points",
    "hermite_projection",
    "hohenbichler_rackwitz",
    "importance_sampling",
    "leading_directions",
    "most_probable_points",
    "points_on_curve",
    "projected_hessian",
    "searched_points",
]
