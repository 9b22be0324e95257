"""Model: a compiled scene with its analyses and runs, each imported on first use."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

from numpy.typing import ArrayLike

from eomgen.calls import checked_calls, none_to_set
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Inputs, Parameters, States

if TYPE_CHECKING:
    from eomgen.analysis.base_parameters import BaseParameters
    from eomgen.analysis.buckling import BucklingLoads
    from eomgen.analysis.equilibrium import Equilibrium
    from eomgen.analysis.equilibrium_path import EquilibriumPath
    from eomgen.analysis.operating_point import EquilibriumState
    from eomgen.analysis.steady_motion import SteadyMotion
    from eomgen.ensembles import Distribution, Ensemble
    from eomgen.linear.campbell import Campbell
    from eomgen.linear.linearization import Linearization
    from eomgen.linear.root_locus import RootLocus
    from eomgen.progress import Progress
    from eomgen.results.solution import Solution
    from eomgen.simulation.motions import Target
    from eomgen.simulation.option_types import (
        EnsembleOptions,
        MethodOptions,
        ResumeOptions,
        RunOptions,
        SensitivityOptions,
    )
    from eomgen.simulation.sensitivities.run_sensitivities import Sensitivities
    from eomgen.simulation.simulator import Simulator
    from eomgen.spectra import Road, RoadExcitation


@checked_calls(
    'eomgen.build("scene.toml") or eomgen.build(scene), which make one', inputs="u", tau="u", states="z", time="t"
)
class Model(CompiledModel):
    """A compiled scene.

    All functions take arrays whose last axis holds the components; leading axes are a batch and broadcast. SI units,
    twists angular first, quaternions (w, x, y, z). ``t`` defaults to 0, ``u`` to the scene's formulas at ``t`` (or 0),
    ``parameters`` (a mapping from names to values, or an array) to the scene's values, ``z`` (likewise) to the internal
    states' initial values, ``base`` to the scene's prescribed motion at ``t``.
    A term that the model was built without raises UsageError, and so does an argument of the wrong shape.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if "initial_z" in vars(self) and not (name.startswith("_") or name in vars(self) or hasattr(type(self), name)):
            from eomgen.simulation.option_types import RunOptions  # noqa: PLC0415  # for a mistake only

            raise none_to_set(self, name, ("t_end", "step", *RunOptions.__annotations__), self.parameters)
        super().__setattr__(name, value)

    def simulate(
        self, t_end: float | None = None, step: float | None = None, **options: Unpack[RunOptions]
    ) -> Solution:
        """Integrate the equations of motion on a grid of equal steps.

        What is not given is the scene's; the method is the one that the model was built with. A numerical failure and
        Ctrl-C end the run with the last good state: the Solution then has ``success`` False and a message; nothing is
        raised. So it has where the motion has grown because the method is unstable at this step: see
        ``simulation.judgement.instability``.

        Parameters
        ----------
        t_end : float
            End of the run, s. A last step that would pass it is shortened to end there; tables of inputs have a point
            for its whole.
        step : float
            Step size, s.
        method : str
            The model's own by default. ``auto``: chosen once, before the run, from the eigenvalues of the equations at
            its start, the constraints, and whether forces are smooth; the message and ``metadata["method"]`` name the
            choice.

            - Generalized-alpha, implicit, order 2: ``generalized_alpha`` (also ``chung_hulbert``); with other updates
              of rotations ``generalized_alpha_f1``, ``generalized_alpha_f2``, ``generalized_alpha_spatial``; its cases
              ``hht``, ``wbz``, ``newmark`` and ``trapezoidal`` (also ``average_acceleration``); with steps by a
              tolerance ``generalized_alpha_adaptive``, ``hht_adaptive``, ``wbz_adaptive`` and ``trapezoidal_adaptive``.
              For constraints of index 3 ``generalized_alpha_index3``, ``generalized_alpha_index3_f1``,
              ``generalized_alpha_index3_f2``, ``generalized_alpha_index3_spatial``, ``hht_index3``, ``wbz_index3``,
              ``newmark_index3`` and ``trapezoidal_index3``.
            - Runge-Kutta, explicit: ``rk4`` (also ``rkmk4``, ``runge_kutta``), of order 4; ``rk45`` (also
              ``dormand_prince``, ``dopri5``), of order 5 with steps of its own between rows that are ``step`` apart; by
              coordinate partitioning of constrained scenes ``rk4_partitioned`` (also ``partitioned``) and
              ``rk45_partitioned``.
            - ``hermite``, of order 4 from accelerations and their rates, and ``taylor``, series of any order, whose
              steps are its own and ``step`` the spacing of the time grid on which it gives states.
            - For real time, of order 2, with one factorization a step and no iteration, on trees and loops:
              ``rosenbrock`` and ``lsrt2``; ``corrected_predictor`` where forces are measured.
            - For long conservative motions, of order 2, on trees and constraints: ``rattlie``, which is variational.
              Where inertia is constant and no force depends on velocities, symplectic compositions of kicks and drifts:
              ``leapfrog``, ``minimum_norm2`` and ``bcss3`` of order 2, ``yoshida4``, ``suzuki4``, ``omf4`` and
              ``blanes_moan4`` of order 4, ``yoshida6``, ``suzuki6`` and ``blanes_moan6`` of order 6, ``yoshida8`` and
              ``kahan_li8`` of order 8.
            - For stiff motions at high accuracy, with one factorization a step and no iteration, time-discontinuous
              Galerkin methods in passes: ``tdg1`` and ``tdg1_star`` of order 3, ``tdg2s`` of order 4, ``tdg2`` of order
              5, ``tdg3`` of order 7; with steps by a tolerance ``tdg1_adaptive``, ``tdg1_star_adaptive``,
              ``tdg2_adaptive`` and ``tdg3_adaptive``.
        rho_inf : float
            Spectral radius of generalized-alpha at infinite frequency, 0 to 1; of ``hht`` 1/2 to 1, of ``wbz`` 0 to 1.
        alpha : float
            Numerical damping of ``hht`` (0 to 1/3), ``wbz`` or ``newmark`` (0 to 1), in place of ``rho_inf``.
        beta, gamma : float
            Of ``newmark``; 1/4 and 1/2 by default.
        order : int
            Of ``taylor``, 2 to 40; the one that suits its tolerance by default.
        tolerance : float
            Of the local error, relative to what the motion moves within a step: ``generalized_alpha``, ``hht``, ``wbz``
            and ``trapezoidal`` then choose their steps between rows that are ``step`` apart, and so does ``rk45``, by
            1e-8 by default, and so do the ``tdg`` methods but ``tdg2s``, by 1e-6. Of ``taylor``, relative to what
            lengths and angles move within a step, or to a hundredth of the machine and of 1 rad; of z relative to the
            largest, or to 1; 1e-12 by default. 0: each step of the time grid is one step, of the order that is given.
        initial : mapping
            ``q`` and ``v`` as arrays, or joints by name: ``{"hinge": 0.3}``, ``{"hinge": {"position": 0.3, "velocity":
            1.0}}``. Internal states: all as ``z`` (an array, or a mapping from names), or by name: ``{"filtered":
            0.2}``.
        parameters : mapping or array
        inputs : mapping
            Name -> number, function of t, or array on the step grid (steps + 1 values, linear in between).
        controllers : mapping
            Name -> function of the sampled controllers that the scene leaves to the caller: ``f(t, signals)``, with
            declared memory ``f(t, signals, memory)``, gives what is held until the next sample. A class is made anew
            for each run that the error estimate takes; a function that may keep something by itself is called in one
            run only.
        record_every : int
            Steps between recorded rows; the first and the last state are always recorded.
        t_start : float
            Time of the initial state, s.
        settings : mapping
            The stepper's own, by name. Of generalized-alpha: ``rtol`` and ``atol`` of its Newton iteration,
            ``max_iterations``, ``max_halvings`` of a step that fails, ``reuse`` of its matrix (0 or 1), and
            ``perturb`` of a start in index 3 (0 or 1). Of ``rosenbrock``: ``damped_start`` (0 or 1). Of
            ``corrected_predictor``: ``matrix_every`` so many steps, 0 for one matrix. Of these, ``lsrt2`` and
            ``tdg1`` to ``tdg3``: ``stop_at_growth`` (0 or 1) that a step would damp. Of ``rosenbrock`` and ``lsrt2`` on
            loops: the largest ``drift`` off the constraints, a share. Of ``rattlie``: ``rtol``, ``max_iterations``, and
            which ``multipliers`` rows have (0 to 3). Of methods that choose their steps: their ``largest_step``, s; 0
            for 64 steps of the time grid (``taylor``: 256).
        progress : callable or True
            Called with (steps done, all steps) some ten times a second; the steps of the error estimate are counted
            too. True shows a bar, in notebooks and on terminals.
        checkpoint : path
            File from which ``model.resume`` goes on with the same bits: written at the start, at the end, at Ctrl-C and
            meanwhile.
        checkpoint_every : int
            Steps between two checkpoints; one a minute where it is not given.
        start : str
            ``initial``: the initial state; ``equilibrium``: static equilibrium near it, with its velocities. The
            scene's where neither this nor ``initial`` is given.
        error_estimate : bool
            Whether the discretisation error is estimated, by runs at other steps or tolerances: ``Solution.error``.

        Raises
        ------
        UsageError
            Anything that is wrong before the run starts, by name; a controller's function that fails.
        """
        from eomgen.simulation.simulate import simulate  # noqa: PLC0415  # the model is used without it too

        return simulate(self, t_end, step, **options)

    def simulate_many(
        self,
        t_end: float | None = None,
        step: float | None = None,
        *,
        vary: Mapping[str, str | Distribution] | None = None,
        table: Mapping[str, ArrayLike] | None = None,
        samples: int = 256,
        design: str = "",
        seed: int = 0,
        columns: Sequence[str] | None = None,
        points: int = 301,
        keep: Sequence[int] = (),
        keep_as: str = "npz",
        folder: str | os.PathLike[str] | None = None,
        resume: bool = False,
        workers: int | None = None,
        cluster: object = None,
        progress: Progress | bool | None = None,
        **options: Unpack[EnsembleOptions],
    ) -> Ensemble:
        """Run samples of what varies, reduced as they come: statistics over time, extremes of each sample.

        What is not varied is as in ``simulate``, whose options these are. A sample that fails is kept with its reason
        and its values, and enters no statistics. The numbers have the same bits with any number of workers, and after
        any interruption; sample k of ``monte_carlo``, ``sobol`` and ``halton`` is the same in a larger ensemble.
        Memory does not grow with the number of samples where there is a folder, but for reading ``values`` and
        ``results`` back.

        Parameters
        ----------
        t_end, step : as of ``simulate``
        vary : mapping
            Name -> distribution: tunable parameters, inputs (constant over a run), ``seed.road`` and ``scale.road`` of
            the law that the scene gives an input, ``q.hinge``, ``v.hinge`` and internal states of the initial state.
            Distributions as texts with numbers in the scene's units or with units of their own: ``normal(mean,
            deviation)``, ``truncated_normal(mean, deviation, low, high)``, ``lognormal(mean, deviation)`` of the number
            itself, ``uniform(low, high)``, ``loguniform(low, high)``, ``triangular(low, mode, high)``,
            ``exponential(mean)``, ``weibull(scale, shape)``, ``gumbel(location, scale)``, ``integers(low, high)``; a
            deviation may be a percentage of the mean. Lists: ``values(1, 2, 4)``, ``linspace(low, high, count)``,
            ``logspace(low, high, count)``.
        table : mapping or DataFrame
            Name -> column (samples,), in place of ``vary`` and a design.
        samples : int
            Of random designs; of ``saltelli`` those of each of its parts, (2 + varied) times as many in all.
        design : str
            ``monte_carlo`` (the default), ``latin_hypercube``, ``sobol``, ``halton``, ``saltelli`` for Sobol' indices,
            or ``grid`` (the default of lists): all combinations of lists.
        seed : int
        columns : sequence of str
            Outputs or columns of ``Solution.columns()`` that are looked at; all outputs by default, or coordinates
            where there are none.
        points : int
            Times that statistics are made for, at most.
        keep : sequence of int
            Numbers of samples whose solutions are written to the folder, ``runs``.
        keep_as : str
            ``npz``, or ``parquet`` for their columns alone.
        folder : path
            Where samples and statistics are kept as they come.
        resume : bool
            Go on with what the folder holds.
        workers : int
            Threads, or processes of the cluster ``dask``; one for each processor by default.
        cluster : str, path or object
            Dask's, to run samples on, with the same bits: ``dask`` for processes of this machine, the address of a
            scheduler, its file, or a ``distributed.Client`` or cluster object.
        progress : callable or True
            As of ``simulate``, called with samples.

        Raises
        ------
        UsageError
            Anything that is wrong before the first sample, by name; of a cluster also later.
        FileError
            The folder holds another ensemble, or one that is not to be gone on with; a cluster is lost.
        """
        from eomgen.ensembles import simulate_many  # noqa: PLC0415

        return simulate_many(
            self,
            t_end,
            step,
            vary=vary,
            table=table,
            samples=samples,
            design=design,
            seed=seed,
            columns=columns,
            points=points,
            keep=keep,
            keep_as=keep_as,
            folder=folder,
            resume=resume,
            workers=workers,
            cluster=cluster,
            progress=progress,
            **options,
        )

    def sensitivities(
        self,
        t_end: float | None = None,
        step: float | None = None,
        *,
        by: Sequence[str] | None = None,
        of: Sequence[str] | None = None,
        **options: Unpack[SensitivityOptions],
    ) -> Sensitivities:
        """Return derivatives of a run's outputs in parameters and the initial state, exact for its discrete steps.

        The run is that of ``simulate`` with the same options. What Newton's iteration leaves of its steps is in the
        derivatives, too: ``settings={"rtol": 1e-16, "atol": 1e-18}`` for derivatives to rounding.

        Parameters
        ----------
        t_end, step : as of ``simulate``; whole steps
        by : sequence of str
            Tunable parameters, all of them by default; ``q.hinge``, ``v.hinge`` and internal states, ``z.filtered``,
            of the initial state. ``q.ball[0]`` of a rotating joint turns it about its own axis x, rad. What the run
            starts from is in the derivatives: static equilibrium of the scene's start, steps onto constraints.
        of : sequence of str
            Outputs; all by default.
        method : str
            ``generalized_alpha``, ``hht``, ``wbz``, ``newmark``, ``trapezoidal``; ``tdg1``, ``tdg1_star``, ``tdg2``,
            ``tdg2s`` or ``tdg3``.
        rho_inf, alpha, beta, gamma, initial, parameters, inputs, record_every, t_start, settings : as of ``simulate``

        Returns
        -------
        Sensitivities
            ``derivatives`` of outputs over time, by tangents; ``gradient`` of a number of the whole run, by adjoints,
            and its ``hessian``.

        Raises
        ------
        UsageError
            Names that are none, a parameter that is fixed, a method without derivatives, a scene with events, sampled
            states or jumps of forces within the run.
        NumericalError
            The run fails, or its linear equations have no solution.
        """
        from eomgen.simulation.sensitivities.linearise import sensitivities  # noqa: PLC0415

        return sensitivities(self, t_end, step, by=by, of=of, **options)

    def start(
        self,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        method: str | None = None,
        step: float | None = None,
        *,
        motions: Mapping[str, Target] | None = None,
        **options: Unpack[MethodOptions],
    ) -> Simulator:
        """Return a simulator at an initial state, to be stepped by the caller.

        What is not given is the scene's, as in ``simulate``, whose options these are. A simulator makes none of the
        checks of a whole run: energies, growth and the discretisation error are left to the caller.

        Parameters
        ----------
        initial, parameters, method, step : as in ``simulate``
        rho_inf, alpha, beta, gamma, order, tolerance, t_start, settings, start : likewise
        inputs : mapping
            Name -> number or function of t: what inputs are in steps that are given none.
        controllers : as in ``simulate``; copies and ``restore`` need functions whose memory the scene declares
        motions : mapping
            Name -> position, rate and acceleration at the start, or a function of t that gives these three.

        Raises
        ------
        UsageError
            Anything that is wrong, by name.
        ModelError
            The method cannot run on this scene; constraints cannot be met.
        NumericalError
            The initial state has no finite accelerations.
        """
        from eomgen.simulation.start import start  # noqa: PLC0415

        return start(self, initial, parameters, method, step, motions=motions, **options)

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

    def equilibrium_path(
        self,
        parameter: str,
        to: float,
        start: float = 0.0,
        *,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        t: float = 0.0,
        u: Inputs = None,
        max_step: float = 0.3,
        max_points: int = 500,
        stability: bool = True,
        progress: Progress | bool | None = None,
    ) -> EquilibriumPath:
        """Return equilibria along a parameter: a load path, past limit points, with bifurcations marked.

        The path starts at the equilibrium to which load steps lead from the initial state at ``start``, and is followed
        by steps of arc length until the parameter is ``to``, however often it turns round on the way (Riks 1972, Keller
        1977).

        Parameters
        ----------
        parameter : str
            A tunable parameter, an input, or ``t``, the time in formulas: loads and drives are then followed as slowly
            as rest asks for.
        to, start : float
            Its values at the end and at the start, in SI units.
        initial, parameters, t, u
            As of ``equilibrium``, for all that is not varied.
        max_step : float
            Largest displacement of a step, rad or lengths of the scene.
        max_points : int
            Equilibria at most.
        stability : bool
            Whether stiffnesses next to zero are looked at, and limit points and bifurcations located.
        progress : function of (steps done, all steps), or True for a bar

        Returns
        -------
        EquilibriumPath
            With ``success`` and ``message``: where it ends, and why; after Ctrl-C as far as it came.

        Raises
        ------
        NumericalError
            There is no equilibrium at ``start``.
        UsageError
            There is no such parameter, or terms are missing.
        """
        from eomgen.analysis.path_following import equilibrium_path  # noqa: PLC0415

        return equilibrium_path(
            self,
            parameter,
            to,
            start,
            initial=initial,
            parameters=parameters,
            t=t,
            u=u,
            max_step=max_step,
            max_points=max_points,
            stability=stability,
            progress=progress,
        )

    def buckling_loads(
        self,
        parameter: str,
        at: float = 0.0,
        count: int = 4,
        *,
        initial: Mapping[str, Any] | None = None,
        parameters: Parameters = None,
        t: float = 0.0,
        u: Inputs = None,
    ) -> BucklingLoads:
        """Return linear buckling loads: where the stiffness, extrapolated along the path of a preload, is singular.

        They are as good as the structure is straight up to there; ``equilibrium_path`` finds the bifurcations and limit
        points themselves.

        Parameters
        ----------
        parameter : str
            What loads the scene: a tunable parameter, an input, or ``t``.
        at : float
            Its value of the preload, SI.
        count : int
            Loads wanted, those nearest to the preload.
        initial, parameters, t, u
            As of ``equilibrium``, for all that is not varied.

        Raises
        ------
        NumericalError
            There is no equilibrium under the preload, or its stiffness is singular.
        UsageError
            There is no such parameter, or terms are missing.
        """
        from eomgen.analysis.buckling import buckling_loads  # noqa: PLC0415

        return buckling_loads(self, parameter, at, count, initial=initial, parameters=parameters, t=t, u=u)

    def base_parameters(self, parameters: Parameters = None, *, seed: int = 0) -> BaseParameters:
        """Return the least number of combinations of the regressor's parameters that decide inverse dynamics.

        Found at random motions, and held to others. What cannot be told apart is counted with the body nearer to the
        base. Coefficients are in SI units.

        Parameters
        ----------
        parameters : mapping or array
            As of ``simulate``; lengths decide the combinations.
        seed : int
            Of the random motions.

        Raises
        ------
        UsageError
            Constraints, absolute coordinates, bodies that deform.
        NumericalError
            Rounding does not let it be told whether some columns are independent.
        """
        from eomgen.analysis.base_parameters import base_parameters  # noqa: PLC0415

        return base_parameters(self, parameters, seed=seed)

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

    def campbell(
        self,
        speed: str,
        values: Sequence[float],
        *,
        orders: Sequence[float] | None = None,
        whirl: Sequence[tuple[str, str]] = (),
        velocities: Mapping[str, float] | None = None,
        coordinates: Mapping[str, ArrayLike] | None = None,
        progress: Progress | bool | None = None,
        **options: Any,
    ) -> Campbell:
        """Return the frequencies of oscillations over the speed of a rotor, their whirl, and the critical speeds.

        Parameters
        ----------
        speed : str
            A tunable parameter, or a component of the velocity (``spin``) that a steady motion is found for.
        values : (n,)
            Increasing; rad/s of a speed.
        orders : sequence of float
            Excitations of these multiples of the speed, whose crossings with modes are found to round-off; 1 where
            none are given and the unit is rad/s.
        whirl : sequence of pairs of str
            Outputs or coordinates that are deflections along two axes that do not turn with the rotor, the second a
            quarter turn from the first in the sense of the spin: ``[("x", "y")]``. Where they orbit in the sense of the
            spin, a mode whirls forward.
        velocities, coordinates : mappings
            What else is given of the steady motion, as of ``steady_motion``.
        progress : function of (steps done, all steps), or True for a bar
        options : ``at``, ``initial``, ``parameters``, ``t``, ``u``, ``any_kind`` of ``linearize``

        Returns
        -------
        Campbell
            After Ctrl-C, which ``interrupted`` tells, with the values and crossings found so far.

        Raises
        ------
        UsageError
            A name that is neither, values that do not increase, pairs that are none.
        EomgenError
            As of ``linearize`` and ``steady_motion``, with the value at which it was raised. Values without a linear
            model are left out with a warning as long as two are kept.
        """
        from eomgen.analysis.campbell import campbell_over  # noqa: PLC0415

        moving, held = velocities or {}, coordinates or {}
        return campbell_over(self, speed, values, orders, whirl, moving, held, progress, **options)

    def road_excitation(self, road: Road | None = None, speed: float | None = None) -> RoadExcitation:
        """Return the random or measured roads of the scene's inputs as an excitation of its linear models.

        Wheels of the same seed, or on the same profile, run in the same track, each by its offset behind the first;
        different tracks are independent. A profile has its spectrum by Welch's method, see ``MeasuredRoad``; speeds are
        those at the default parameters.

        Parameters
        ----------
        road, speed : Road of ``eomgen.spectra``, m/s
            Others than those of the scene.

        Raises
        ------
        UsageError
            No input is a road, or they differ in class, profile or speed where none is given.
        """
        from eomgen.analysis.road_excitation import road_excitation  # noqa: PLC0415

        return road_excitation(self, road, speed)

    def resume(
        self, path: str | os.PathLike[str], t_end: float | None = None, **options: Unpack[ResumeOptions]
    ) -> Solution:
        """Go on with a run from its checkpoint: same method, step, settings, parameters, inputs and time grid,
        to the same bits.

        Parameters
        ----------
        path : path
            File of ``simulate(checkpoint=...)``.
        t_end : float
            End of the run, s; that of the first part by default, and it may be later.
        parameters : mapping or array
            Not needed; refused where they are not those of the first part.
        inputs : mapping
            Functions of t must be given again; numbers and tables are in the file, and refused where they differ.
        controllers : mapping
            The functions again, whose memory the scene has to declare: a checkpoint holds nothing else.
        progress, checkpoint, checkpoint_every
            As in ``simulate``; checkpoints go to ``path`` by default.
        error_estimate : bool
            As in ``simulate``; the estimate takes the state of the checkpoint for exact.

        Returns
        -------
        Solution
            From the checkpoint on; ``first.followed_by(second)`` puts both parts together.

        Raises
        ------
        FileError
            The file cannot be read or is no checkpoint.
        ModelError
            It belongs to another model, or to another compilation of it.
        UsageError
            Other parameters or inputs; an end that is behind; a controller's function whose memory is not declared.
        """
        from eomgen.simulation.resume import resume  # noqa: PLC0415

        return resume(self, path, t_end, **options)

    def attach(self, solution: Solution, inputs: Mapping[str, Any] | None = None) -> Solution:
        """Return a stored solution of this model with the model at hand; see ``eomgen.simulation.run_model.attach``."""
        from eomgen.simulation.run_model import attach  # noqa: PLC0415

        return attach(self, solution, inputs)
