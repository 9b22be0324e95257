"""Feedback design from matrices alone (NumPy and SciPy): of second-order models M q'' + C q' + K q = B u, and of whole
linear models of first order, in continuous time and sampled."""

from eomgen.control.observer import Observer, kalman, place_observer
from eomgen.control.output_feedback import OutputFeedback
from eomgen.control.regulator import Regulator, lqr, place

__all__ = [
    "Observer",
    "OutputFeedback",
    "Regulator",
    "kalman",
    "lqr",
    "margins",
    "modal",
    "observer",
    "output_feedback",
    "place",
    "place_observer",
    "placement",
    "plant",
    "regulator",
    "riccati",
    "weights",
    "white_noise",
]
