"""Feedback design from matrices alone (NumPy and SciPy): of second-order models M q'' + C q' + K q = B u, and of whole
linear models of first order, in continuous time and sampled."""

from eomgen.products.linear.augmentation import delay, delay_line, driven_by, shaping_filter
from eomgen.products.linear.control.margins import Margins
from eomgen.products.linear.control.observer import Observer, kalman, place_observer
from eomgen.products.linear.control.output_feedback import OutputFeedback
from eomgen.products.linear.control.regulator import Regulator, lqr, place
from eomgen.products.linear.control.stationary import root_mean_squares, stationary_covariance
from eomgen.products.linear.sampling import discretized

__all__ = [
    "Margins",
    "Observer",
    "OutputFeedback",
    "Regulator",
    "delay",
    "delay_line",
    "discretized",
    "driven_by",
    "kalman",
    "lqr",
    "place",
    "place_observer",
    "root_mean_squares",
    "shaping_filter",
    "stationary_covariance",
]
#: Open to the other parts of ``linear`` as well.
WITHIN = ["output_feedback", "regulator", "second_order", "weights"]
