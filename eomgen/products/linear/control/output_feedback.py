"""Output feedback: a regulator that works with the estimate of an observer (LQG if both are optimal).

The closed loop has the eigenvalues of regulator and observer (separation), and the margins of neither.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from eomgen.base.arrays import Complex
from eomgen.base.calls import checked_calls, with_article
from eomgen.base.data import dataclass, replace
from eomgen.base.html import page, paragraph
from eomgen.errors import Problem, UsageError
from eomgen.products.linear.control.margins import Margins, margins_of
from eomgen.products.linear.control.notebook import eigenvalues_html, margins_html, plot_margins
from eomgen.products.linear.control.observer import Observer
from eomgen.products.linear.control.regulator import Regulator
from eomgen.products.linear.state_space import StateSpace, labels, signal_labels, with_more


@checked_calls()
@dataclass(frozen=True, repr=False)
class OutputFeedback:
    """A regulator and an observer of the same model.

    For sampled feedback, the estimate at a sample contains the measurement of this sample, and the inputs follow from
    this estimate.

    Attributes
    ----------
    regulator : Regulator
        Feedback of the state.
    observer : Observer
        Estimate of the state, of the same model.

    Raises
    ------
    UsageError
        Other objects than a regulator and an observer, in this order; a regulator and an observer of different models.
    """

    regulator: Regulator
    observer: Observer

    def __post_init__(self) -> None:
        for name, kind in (("first", Regulator), ("second", Observer)):
            part = self.regulator if kind is Regulator else self.observer
            if not isinstance(part, kind):
                fault = f"{with_article(kind.__name__)} comes {name}, not {with_article(type(part).__name__)} [E0390]"
                hint = "OutputFeedback(regulator, observer), of lqr or place, and of kalman or place_observer"
                raise UsageError(Problem("OutputFeedback", fault, hint))
        first, second = self.regulator.space, self.observer.space
        same = (first.states, first.inputs, first.sample) == (second.states, second.inputs, second.sample)
        if not same or not (np.array_equal(first.A, second.A) and np.array_equal(first.B, second.B)):
            fault = f"the regulator is of {first!r} and the observer of {second!r} [E0389]"
            raise UsageError(Problem("OutputFeedback", fault, "the same model, inputs, sample and delay for both"))

    def __repr__(self) -> str:
        of = f"{', '.join(self.space.inputs)} from {', '.join(self.observer.measured)}"
        return f"<OutputFeedback{self.space.when}: {of}; {self.closed_loop.stability}>"

    def _repr_html_(self) -> str:
        signals = paragraph(f"{', '.join(self.space.inputs)} from {', '.join(self.observer.measured)}")
        of_loop = eigenvalues_html("closed loop", self.closed_loop)
        return page(f"Output feedback{self.space.when}", signals, margins_html(self.margins), of_loop)

    @property
    def space(self) -> StateSpace:
        """The model that is controlled."""
        return self.regulator.space

    @property
    def eigenvalues(self) -> Complex:
        """(2 ns,) of the closed loop; see ``StateSpace.eigenvalues``."""
        return self.closed_loop.eigenvalues

    @cached_property
    def controller(self) -> StateSpace:
        """The controller as a model, from measurements to the inputs of the plant; the state is the estimate.

        Sampled, the state is the prediction of the estimate for a sample, before that sample's measurement.
        """
        space, K, C, L = self.space, self.regulator.gains, self.observer.C, self.observer.gains
        closed = space.A - space.B @ K
        if space.sample is None:
            A, B, through, direct = closed - L @ (C - self.observer.D @ K), L, -K, np.zeros((len(K), L.shape[1]))
        else:
            kept = np.eye(len(closed)) - L @ C
            A, B, through, direct = closed @ kept, closed @ L, -K @ kept, -K @ L
        of = {"states": labels(space, "states"), "inputs": self._measured_labels, "disturbances": ()}
        of |= {"outputs": labels(space, "inputs")}
        estimates = tuple(f"estimate.{name}" for name in space.states)
        matrices = (A, B, np.zeros((len(A), 0)), through, direct, np.zeros((len(K), 0)))
        names = (estimates, self.observer.measured, (), space.inputs)
        return StateSpace(*matrices, *names, **signal_labels(of), sample=space.sample)

    @cached_property
    def closed_loop(self) -> StateSpace:
        """Model and controller as one model, with the states of both. Its inputs add to the controller's, which are
        among the outputs; the noise of measurements, ``noise.NAME``, is among the disturbances."""
        space, C, D = self.space, self.observer.C, self.observer.D
        n, m, ny, nw = len(space.states), len(space.inputs), len(self.observer.measured), len(space.disturbances)
        known, every = (*space.outputs, *space.states), np.vstack([space.F, np.zeros_like(space.E)])
        noise = np.hstack([every[[known.index(name) for name in self.observer.measured]], np.eye(ny)])
        # from [state, estimate, inputs, disturbances and noise]: to inputs, to measurements; no D if `direct` is
        matrix = np.hstack([self.controller.D @ C, self.controller.C, np.eye(m), self.controller.D @ noise])
        measured = np.hstack([C, np.zeros((ny, n + m)), noise]) + D @ matrix
        disturbed = np.hstack([np.zeros((n, m)), space.E, np.zeros((n, ny))])
        moved = np.hstack([space.A, np.zeros((n, n)), disturbed]) + space.B @ matrix
        estimated = np.hstack([np.zeros((n, n)), self.controller.A, np.zeros((n, m + nw + ny))])
        estimated = estimated + self.controller.B @ measured
        seen = np.hstack([space.C, np.zeros((len(space.C), n + m)), space.F, np.zeros((len(space.C), ny))])
        fed_back = [name for name in space.inputs if name not in space.outputs]
        rates = np.vstack([moved, estimated])
        outputs = np.vstack([seen + space.D @ matrix, matrix[[space.inputs.index(name) for name in fed_back]]])
        of_state, of_inputs, of_noise = slice(0, 2 * n), slice(2 * n, 2 * n + m), slice(2 * n + m, None)
        more = {
            "states": labels(space, "states"),
            "disturbances": [(unit, 0.0) for unit, _ in self._measured_labels],
            "outputs": labels(space, "inputs", fed_back),
        }
        columns = (of_state, of_inputs, of_noise)
        matrices: dict[str, Any] = {name: rates[:, part] for name, part in zip("ABE", columns, strict=True)}
        matrices |= {name: outputs[:, part] for name, part in zip("CDF", columns, strict=True)}
        return replace(
            space,
            **matrices,
            states=(*space.states, *self.controller.states),
            disturbances=(*space.disturbances, *(f"noise.{name}" for name in self.observer.measured)),
            outputs=(*space.outputs, *fed_back),
            **with_more(space, more),
        )

    @property
    def _measured_labels(self) -> list[tuple[str, float]]:
        """Unit and reference of each measured signal."""
        of = [("outputs" if name in self.space.outputs else "states", name) for name in self.observer.measured]
        return [label for kind, name in of for label in labels(self.space, kind, [name])]

    @cached_property
    def margins(self) -> dict[str, Margins]:
        """Gain, phase, delay and modulus margins at each input, with the other loops closed, by the input's name."""
        space, controller, C = self.space, self.controller, self.observer.C
        n = len(space.states)
        # the loop is opened at an input of the model: the observer uses the input asked by the controller
        A = np.block([[space.A, np.zeros((n, n))], [controller.B @ C, controller.A]])
        B = np.vstack([space.B, controller.B @ self.observer.D])
        asked = -np.hstack([controller.D @ C, controller.C])
        return margins_of(A, B, asked, space.inputs, space.sample)

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the open loop at each input in the complex plane, with margins; see ``Regulator.plot``.

        Parameters
        ----------
        axes : sequence of matplotlib Axes, optional
            One for each input; a new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One for each input.
        """
        return plot_margins(self.margins, axes)
