"""Feedback design from matrices alone (NumPy and SciPy): of second-order models M q'' + C q' + K q = B u, and of whole
linear models of first order, in continuous time and sampled."""

from eomgen.linear.augmentation import delay, delay_line, driven_by, shaping_filter
from eomgen.linear.control.margins import Margins
from eomgen.linear.control.observer import Observer, kalman, place_observer
from eomgen.linear.control.output_feedback import OutputFeedback
from eomgen.linear.control.regulator import Regulator, lqr, place
from eomgen.linear.control.stationary import root_mean_squares, stationary_covariance
from eomgen.linear.sampling import discretized

__all__ = [
    "Margins",
    "Observer",
    "OutputFeedback",
    "Regulator",
    "cost",
    "delay",
    "delay_line",
    "discretized",
    "driven_by",
    "kalman",
    "lqr",
    "output_feedback",
    "place",
    "place_observer",
    "plant",
    "regulator",
    "root_mean_squares",
    "second_order",
    "shaping_filter",
    "stationary_covariance",
    "weights",
]
