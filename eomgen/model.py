"""Model: a compiled scene with its analyses and runs, each imported on first use."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from eomgen.calls import checked_calls
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Inputs, Parameters, States

if TYPE_CHECKING:
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.analysis.linearize import EquilibriumState
    from eomgen.analysis.steady_motion import SteadyMotion
    from eomgen.linear.linearization import Linearization
    from eomgen.linear.root_locus import RootLocus
    from eomgen.results.solution import Solution
    from eomgen.simulation.simulator import Simulator


@checked_calls('eomgen.build("scene.toml") or eomgen.build(scene), which make one', inputs="u", states="z", time="t")
class Model(CompiledModel):
    """A compiled scene.

    All functions take arrays whose last axis holds the components; leading axes are a batch and broadcast. SI units,
    twists angular first, quaternions (w, x, y, z). ``t`` defaults to 0, ``u`` to the scene's formulas at ``t`` (or 0),
    ``parameters`` (a mapping from names to values, or an array) to the scene's values, ``z`` (likewise) to the internal
    states' initial values, ``base`` to the scene's prescribed motion at ``t``.
    A term that the model was built without raises UsageError, and so does an argument of the wrong shape.
    """

    def simulate(self, t_end: float | None = None, step: float | None = None, **options: Any) -> Solution:
        """Integrate from the initial state; see ``eomgen.simulation.simulate`` for all options."""
        from eomgen.simulation.simulate import simulate  # noqa: PLC0415  # the model is used without it too

        return simulate(self, t_end, step, **options)

    def start(
        self,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        method: str | None = None,
        step: float | None = None,
        **options: Any,
    ) -> Simulator:
        """Return a simulator at an initial state, whose steps the caller takes; see ``eomgen.simulation.start``."""
        from eomgen.simulation.start import start  # noqa: PLC0415

        return start(self, initial, parameters, method, step, **options)

    def equilibrium(
        self,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        t: float = 0.0,
        u: Inputs = None,
        *,
        any_kind: bool = False,
    ) -> Equilibrium:
        """Return a state of rest near the initial one; see ``eomgen.analysis.equilibrium``."""
        from eomgen.analysis.equilibrium import equilibrium  # noqa: PLC0415

        return equilibrium(self, initial, parameters, t, u, any_kind=any_kind)

    def steady_motion(
        self,
        velocities: Mapping[str, float] | None = None,
        coordinates: Mapping[str, ArrayLike] | None = None,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        t: float = 0.0,
        u: Inputs = None,
    ) -> SteadyMotion:
        """Return a motion with constant velocities near the initial state; see ``eomgen.analysis.steady_motion``."""
        from eomgen.analysis.steady_motion import steady_motion  # noqa: PLC0415

        return steady_motion(self, velocities, coordinates, initial, parameters, t, u)

    def linearize(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        a: ArrayLike | None = None,
        t: float = 0.0,
        u: Inputs = None,
        *,
        z: States = None,
        multipliers: ArrayLike | None = None,
        parameters: Parameters = None,
        base: ArrayLike | None = None,
        at: str | EquilibriumState | None = None,
        initial: Mapping[str, Any] | None = None,
        any_kind: bool = False,
        independent: Sequence[str] = (),
    ) -> Linearization:
        """Return the linear model about a state: second order, state space, modes, frequency responses.

        Without a state: about the static equilibrium near the initial state at ``t``, with the base held; on a base
        that moves at t about rest relative to it, where that lasts; where there is neither, about the initial state
        itself. What depends on time is frozen at ``t``.

        Parameters
        ----------
        q, v, a : (nq,), (nv,), (nv,)
            A state; v is 0 and a is that of forward dynamics where they are not given.
        t, u, z, parameters, base : as of the model's functions
        multipliers : (rows,)
            Those of the state where they are not given.
        at : str, or a result of ``equilibrium`` or ``steady_motion``
            ``equilibrium`` or ``steady`` (an error where there is none), or ``initial``. What was found with other
            inputs and parameters than the scene's needs them here again.
        initial : mapping
            As of ``simulate``: where to start, or to look for equilibrium.
        any_kind : bool
            Whether an unstable equilibrium will do: the nearest.
        independent : sequence of str
            Components (``hinge``, ``ball[2]``) to be independent coordinates, where constraints leave a choice.

        Raises
        ------
        UsageError
            Arguments that cannot be taken; a state that does not meet the constraints.
        ModelError
            Constraints depend on each other in this state.
        NumericalError
            No equilibrium was found where one was asked for, or partials are not finite.
        """
        from eomgen.analysis.linearize import linearize  # noqa: PLC0415

        given = {"q": q, "v": v, "a": a, "z": z, "multipliers": multipliers}
        return linearize(
            self,
            given,
            t,
            u,
            parameters=parameters,
            base=base,
            at=at,
            initial=initial,
            any_kind=any_kind,
            independent=independent,
        )

    def root_locus(
        self, parameter: str, values: Sequence[float], *, parameters: Mapping[str, float] | None = None, **options: Any
    ) -> RootLocus:
        """Return the eigenvalues of linear models over values of a tunable parameter, each root followed.

        Parameters
        ----------
        values : (n,)
        parameters : mapping
            Other values of other parameters.
        options : ``at``, ``initial``, ``t``, ``u``, ``any_kind`` of ``linearize``
            Equilibria and steady motions are looked for where the last one was.

        Raises
        ------
        EomgenError
            As of ``linearize``, with the value at which it was raised.
        """
        from eomgen.analysis.root_locus import roots_over  # noqa: PLC0415

        return roots_over(self.linearize, parameter, values, parameters, **options)

    def resume(self, path: str | os.PathLike[str], t_end: float | None = None, **options: Any) -> Solution:
        """Go on with a run from its checkpoint, to the same bits; see ``eomgen.simulation.resume`` for all options."""
        from eomgen.simulation.resume import resume  # noqa: PLC0415

        return resume(self, path, t_end, **options)

    def attach(self, solution: Solution, inputs: Mapping[str, Any] | None = None) -> Solution:
        """Return a stored solution of this model with the model at hand; see ``eomgen.simulation.run_model.attach``."""
        from eomgen.simulation.run_model import attach  # noqa: PLC0415

        return attach(self, solution, inputs)
