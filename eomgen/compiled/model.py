"""A compiled scene whose terms are called on NumPy arrays, one state or a batch along leading axes."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import Defaults, NamedAttributes
from eomgen.base.data import replace
from eomgen.base.messages import counted
from eomgen.compiled import (
    actuators,
    bodies,
    centroidal,
    configurations,
    equations,
    parameter_derivatives,
    prescribed,
    time_derivatives,
)
from eomgen.compiled import beams as exact_beams
from eomgen.compiled.arguments import check_name, components, read_only
from eomgen.compiled.beams import beams_at
from eomgen.compiled.coordinates import configuration_rate, with_unit_quaternions
from eomgen.compiled.functions import DRIVERS, Functions, compiled_or_same
from eomgen.compiled.terms import Inputs, Parameters, Terms
from eomgen.errors import Message, ModelError, Problem, UsageError
from eomgen.system import notebook
from eomgen.system.description import Description
from eomgen.system.terms import PURPOSES, Selection
from eomgen.toolchain.builder import LaneFiles
from eomgen.toolchain.library import LaneLibrary, Library

if TYPE_CHECKING:
    from eomgen.solvers.consistency import Assembly, KeptComponents
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.branches import Branches

Gains = Callable[[Mapping[str, float]], dict[str, float]]
Start = Callable[[Mapping[str, float]], tuple[Sequence[float], Sequence[float]]]

#: Attributes for other rooms, hidden from a user's completion.
_INTERNALS = frozenset(
    {
        "branches",
        "description",
        "evaluator",
        "factors",
        "functions",
        "having",
        "in_complex",
        "library",
        "record",
        "stepper",
    }
)

_OTHER_PARAMETERS = "simulate(..., parameters={...}), or set_parameter of the simulator of start(...)"


class Source:
    """All that a model asks for after it was built; None: a model that was made by hand has none.

    Attributes
    ----------
    initial_at : returns q and v of the scene's initial state at other parameters, if the state depends on parameters
    with_terms : builds a model of the same scene with other terms
    gains : finds the parameters that calibrations fill, at values of the remaining parameters
    every_row : evaluates the constraints with the rows that were left out as redundant, at parameters (np,)
    scene : the front end's object from which the model was made, as a scene
    again : the call that makes the model, from the cache if the library is there, which is pickled in place of the
        model
    in_lanes : returns the stepper of a library for several trajectories side by side, or why there is none
    in_complex : builds the library of functions of some terms in complex numbers
    branches : derives the equations once more, and returns the conditions of the branches in these equations
    record : returns scene and description as JSON types, for a file of the model
    """

    initial_at: Start | None = None
    with_terms: Callable[[Sequence[str]], Any] | None = None
    gains: Gains | None = None
    every_row: EveryRow | None = None
    scene: Any = None
    again: functools.partial[Any] | None = None
    in_lanes: Callable[[Library, str, LaneFiles], LaneLibrary | str] | None = None
    in_complex: Callable[[Sequence[str]], Library] | None = None
    branches: Callable[[], Branches] | None = None
    record: Callable[[], Sequence[object]] | None = None


class CompiledModel(NamedAttributes):
    """The functions of a compiled scene on arrays; ``eomgen.pipeline.model.Model`` has analyses and runs as well.

    Functions of ``equations``, ``time_derivatives``, ``prescribed`` and ``bodies`` are methods of this class, and need
    the attribute ``evaluator`` alone.

    Parameters
    ----------
    description : Description
        Names, units and meaning of the arguments and results of the functions.
    library : Library
        Functions, and the stepper of the default method.
    stepper : callable
        Returns the library with the stepper of a method, and with the functions of a ``Selection`` if one is given;
        called once for each method and selection.
    source : Source
        All else that the model asks for later.
    """

    def __init__(
        self, description: Description, library: Library, stepper: Callable[..., Library], source: Source | None = None
    ) -> None:
        """Take names, sizes and initial values from the library's layout; this evaluates no function."""
        layout = library.layout
        self.description = description
        self._source = source = Source() if source is None else source
        self._steppers = functools.cache(stepper)
        self.initial_at, self.branches, self.record = source.initial_at, source.branches, source.record
        self._others: list[Self] = []
        self._complex: dict[tuple[str, ...], Functions] = {}
        defaults = {item["name"]: float(item["value"]) for item in layout["parameters"]}
        self._parameters = Defaults("parameter", defaults, _OTHER_PARAMETERS)
        self.evaluator = Terms(library, description)
        self.functions, self.factors, self.inputs = (
            self.evaluator.functions,
            self.evaluator.factors,
            self.evaluator.input_names,
        )
        self.q_names, self.v_names = self.evaluator.q_names, self.evaluator.v_names
        self.q_units, self.v_units = self.evaluator.q_units, self.evaluator.v_units
        self.angles = self.evaluator.angles
        self.z_names = [f"z.{name}" for name in self.states]
        self.input_units = {str(item["name"]): str(item["unit"]) for item in layout["inputs"]}
        self.z_units = [str(item["unit"]) for item in layout["states"]]
        self.bodies, self.beams = self.evaluator.bodies, self.evaluator.beams
        self.frames = self.evaluator.frames
        self.initial_q = self.evaluator.initial_q
        self.initial_v = read_only(layout["initial_v"])
        self.initial_z = read_only(layout["initial_z"])

    #: The library of the functions and of the default method's stepper: on the tape engine until the compiler is done,
    #: then the compiled one. Each run reads the library some ten times, so no Python function stands between.
    library: Library = cast("Library", property(operator.attrgetter("functions.library")))

    def stepper(self, method: str, selection: Selection | None = None) -> Library:
        """Return the library with the stepper of a method, made on the first request.

        Parameters
        ----------
        selection : functions of the library; by default the functions that the method calls
        """
        library: Library = self._steppers(method) if selection is None else self._steppers(method, selection)
        return compiled_or_same(library)

    def finish_compilation(self) -> None:
        """Wait for the compiler that works in the background, compile functions that no run calls, and take the library
        with all functions.

        Compilers work in the background for ``profile="instant"``. The call returns at once if all functions are
        compiled. Steppers of other methods, and functions that the model was built without, are not waited for. During
        a run the library is not replaced.

        Raises
        ------
        ToolchainError
            Functions that no run calls cannot be compiled.

        Warns
        -----
        RuntimeWarning
            The compiler has failed, so the tape engine stays.
        """
        if self.library.successor is not None:
            self.library.whole()
            self.library.successor.wait()
            self.functions.renew()

    def stepper_in_lanes(self, library: Library, cdef: str, files_of: LaneFiles) -> LaneLibrary | str:
        """Return the stepper of a library for several trajectories side by side, or why there is none.

        Parameters
        ----------
        library : Library
            With the stepper of a method.
        cdef : str
            Declarations of the functions of the lanes.
        files_of : callable
            Gives the files of the lanes.

        Returns
        -------
        LaneLibrary or str
            The library, or a sentence that says why there is none.
        """
        if "in lanes" not in library.kept:
            in_lanes = self._source.in_lanes
            made = "the model was made by hand" if in_lanes is None else in_lanes(library, cdef, files_of)
            library.kept["in lanes"] = made
        result: LaneLibrary | str = library.kept["in lanes"]
        return result

    @functools.cached_property
    def scene(self) -> Any:
        """The front end's object from which the model was made, such as a scene; None without one."""
        return self._source.scene

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if name not in _INTERNALS]

    def __repr__(self) -> str:
        notes = f"; {counted(len(self.notes), 'note')}" if self.notes else ""
        return f"<Model {self.name}: nq {self.nq}, nv {self.nv}, nu {self.nu}; {', '.join(self.terms)}{notes}>"

    def _repr_html_(self) -> str:
        start = zip(self.q_names, self.q_units, (f"{value:.6g}" for value in self.initial_q), strict=True)
        layout = self.library.layout
        return notebook.model_page(self.name, layout, notebook.latex_of(layout), start, self.terms)

    def _repr_latex_(self) -> str:
        return f"$\\displaystyle {notebook.latex_of(self.library.layout)}$"

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the call that makes the model in another process, since machine code is not sent."""
        if self._source.again is None:
            fault = "this model was made by hand and cannot be sent to another process [E0265]"
            raise UsageError(Problem("pickle", fault, "eomgen.build(scene), whose models can"))
        return self._source.again, ()

    # -- functions of the model ----------------------------------------------------------------------------------------

    mass, coupling, force, base_motion = equations.mass, equations.coupling, equations.force, equations.base_motion
    mass_matrix, bias = equations.mass, equations.bias  # as other packages call M and h + b - Q
    inverse_dynamics, forward_dynamics = equations.inverse_dynamics, equations.forward_dynamics
    constrained_dynamics, partials = equations.constrained_dynamics, equations.partials
    evaluate, energy, outputs = equations.evaluate, equations.energy, equations.outputs
    internal_rates, internal_partials = equations.internal_rates, equations.internal_partials
    output_parameter_partials = parameter_derivatives.output_parameter_partials
    parameter_partials = parameter_derivatives.parameter_partials
    regressor_parameters = parameter_derivatives.regressor_parameters
    regressor = parameter_derivatives.regressor
    rates, forward_rates, coriolis = time_derivatives.rates, time_derivatives.forward_rates, time_derivatives.coriolis
    mass_rates, coupling_rates = time_derivatives.mass_rates, time_derivatives.coupling_rates
    force_rates, base_motion_rates = time_derivatives.force_rates, time_derivatives.base_motion_rates
    base, input_values = prescribed.base, prescribed.input_values
    discontinuity_times, jumps_between = prescribed.discontinuity_times, prescribed.jumps_between
    pose, twist, point = bodies.pose, bodies.twist, bodies.point
    body_jacobian, point_jacobian = bodies.body_jacobian, bodies.point_jacobian
    jacobian, jacobian_rate, drift = bodies.jacobian, bodies.jacobian_rate, bodies.drift
    operational_inertia = bodies.operational_inertia
    section_loads = exact_beams.section_loads
    actuator_efforts = actuators.actuator_efforts
    integrate, difference = configurations.integrate, configurations.difference
    neutral, random = configurations.neutral, configurations.random
    center_of_mass, total_mass = centroidal.center_of_mass, centroidal.total_mass
    center_of_mass_jacobian = centroidal.center_of_mass_jacobian
    center_of_mass_drift = centroidal.center_of_mass_drift
    centroidal_momentum = centroidal.centroidal_momentum
    centroidal_momentum_rate, centroidal_drift = centroidal.centroidal_momentum_rate, centroidal.centroidal_drift

    # -- sizes and names -----------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        return self.description.name

    @property
    def nq(self) -> int:
        """Numbers in the configuration q."""
        return self.functions.sizes["q"]

    @property
    def nv(self) -> int:
        """Degrees of freedom: numbers in v and a."""
        return self.functions.sizes["v"]

    @property
    def nu(self) -> int:
        """Inputs."""
        return self.functions.sizes["u"]

    @property
    def nz(self) -> int:
        """Internal states."""
        return self.functions.sizes["z"]

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the constraints' multipliers, row by row."""
        return self.evaluator.multipliers

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the internal states, in the order of z."""
        return self.evaluator.state_names

    @property
    def parameters(self) -> Mapping[str, float]:
        """Tunable parameters: names, in the order of the array form, and default values."""
        return self._parameters

    @property
    def notes(self) -> tuple[Message, ...]:
        """Notes of importers on omissions, on redundant constraint rows, and on corrections of the initial state."""
        return tuple(map(Message, self.library.layout["notes"]))

    @property
    def terms(self) -> tuple[str, ...]:
        """Terms that the model was built with."""
        return tuple(name for name in self.functions.names if name not in DRIVERS)

    def having(self, terms: Sequence[str]) -> Self:
        """Return a model of this scene that has all given terms, if the scene has such terms.

        Parameters
        ----------
        terms : sequence of str
            Names of terms; terms that the scene does not have are ignored.

        Returns
        -------
        CompiledModel
            This model, or another, compiled at first use. A model that was made by hand is returned as it is.
        """
        names = self.evaluator.existing(terms)
        if all(name in self.functions for name in names) or self._source.with_terms is None:
            return self
        for model in self._others:
            if all(name in model.functions for name in names):
                return model
        self._others.append(self._source.with_terms(names))
        return self._others[-1]

    def in_complex(self, terms: Sequence[str]) -> Functions:
        """Return complex functions of some terms, of those the scene has, compiled at first use: analytic, so that
        imaginary increments give derivatives.

        Parameters
        ----------
        terms : sequence of str
            Names of terms.

        Returns
        -------
        Functions
            Of complex arrays.

        Raises
        ------
        UsageError
            A model that was made by hand.
        """
        wanted = self.evaluator.existing(terms)
        if wanted not in self._complex:
            if self._source.in_complex is None:
                fault = "this model was made by hand and has no functions in complex numbers [E0266]"
                raise UsageError(Problem("in_complex", fault, "eomgen.build(scene), whose models can"))
            self._complex[wanted] = Functions(self._source.in_complex(wanted))
        return self._complex[wanted]

    def calibrate(self, *, parameters: Mapping[str, float] | None = None) -> dict[str, float]:
        """Return gains and references of the scene's calibrated controllers, at other values of tunable parameters.

        Gains and references are parameters themselves: ``simulate(parameters={**parameters,
        **model.calibrate(parameters=parameters)})``. The model keeps its defaults.

        Parameters
        ----------
        parameters : mapping, optional
            Values of other tunable parameters, SI units, defaults of the scene for the rest; values of gains and
            references that are calibrated are ignored.

        Returns
        -------
        dict
            Values by the names of parameters; empty if the scene gives all gains of its state feedback.

        Raises
        ------
        UsageError
            Unknown parameters, or values that are not finite; a scene without state feedback.
        DescriptionError, ModelError, NumericalError, ToolchainError
            A controller that cannot be calibrated, with the controller's place in the scene; ToolchainError without a
            compiler, if the cache lacks the functions that calibration calls.

        Examples
        --------
        >>> model = eomgen.build("examples/active_quarter_car/scene.toml")
        >>> sorted(model.calibrate())[:2]
        ['ride_gain_body', 'ride_gain_deflection']
        """
        self.parameter_array(parameters)
        if self._source.gains is None and getattr(self.scene, "feedback", None) == ():
            fault = "the scene has no state_feedback, so there are no gains to be found [E0267]"
            raise UsageError(Problem("calibrate", fault, 'type = "state_feedback" of an entry of [controllers]'))
        return {} if self._source.gains is None else self._source.gains(dict(parameters or {}))

    def consistent(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        t: float = 0.0,
        *,
        parameters: Parameters = None,
        hold: str | Sequence[str] = (),
    ) -> Assembly:
        """Return the state nearest to a guess that meets the constraints, and the violations of rows by the guess.

        Corrections are of least kinetic size, by the inertia matrix; beams are strained only if a loop cannot close
        otherwise.

        Parameters
        ----------
        q, v : array_like
            Guess of configuration (nq,) and velocity (nv,); at rest without v.
        t : float, optional
            Time, s.
        parameters : mapping or array_like, optional
            Tunable parameters (np,), SI units; defaults of the scene if not given.
        hold : str or sequence of str, optional
            Joints whose coordinates and velocities stay as given, or components, ``slot[0]``; the others close the
            loops.

        Returns
        -------
        Assembly
            ``q`` (nq,), ``v`` (nv,), and by name of a row, SI units, ``violations`` by the guess and
            ``rate_violations`` by its velocities at the position found, without rows that are met up to round-off.
            ``deviations`` has a sentence for each row that the state does not meet exactly.

        Raises
        ------
        ModelError
            The constraints contradict each other or the held coordinates from there, or rows that were left out because
            they follow from others at the default parameters do not follow at these; names the rows.
        UsageError
            A scene without constraints, an unknown name in ``hold``, arrays or parameters that cannot be taken, or a
            model that was built without the terms of the constraints and cannot be built again.

        Examples
        --------
        >>> model = eomgen.build("examples/four_bar/scene.toml")
        >>> state = model.consistent(model.initial_q + 0.01, np.zeros(3))
        >>> state.q.shape, len(state.violations)
        ((3,), 2)
        >>> model.consistent(model.initial_q + 0.01, [30.0, 0.0, 0.0], hold="drive").v[:1]
        array([30.])
        """
        p = self.evaluator.one_set(parameters, "consistent(...) for each set")
        held = held_components(self, hold)
        v = np.zeros(self.nv) if v is None else v
        try:
            return consistent(self, self.evaluator.configuration(q), self.evaluator.velocity("v", v), t, p, held)
        except ModelError as error:
            if held is None:
                raise
            problem = error.problems[0]
            raise ModelError(replace(problem, hint=f"fewer names in hold, {problem.hint}")) from None

    def check_left_out(self, q: Array, v: Array, t: float, p: Array) -> list[str]:
        """Check that constraint rows left out as redundant follow from the remaining rows at other parameters.

        Parameters
        ----------
        q, v : (nq,), (nv,) ndarray
            State that meets the remaining rows.
        t : float
            Time, s.
        p : (np,) ndarray
            Tunable parameters.

        Returns
        -------
        list of str
            A sentence for each row that follows but for a small deviation; empty, without a check, at the default
            parameters.

        Raises
        ------
        ModelError
            A row does not follow; names the row.
        """
        left_out = self.library.layout["left_out"]
        pairs = zip(self.parameters.items(), p.tolist(), strict=True)
        changed = [f"{name} = {new:.6g}" for (name, old), new in pairs if new != old]
        if left_out and changed and self._source.every_row is not None:
            from eomgen.solvers.redundancy import check_left_out  # noqa: PLC0415  # few constraints follow from others

            return check_left_out(self._source.every_row(p), left_out, q, v, t, at=", ".join(changed))
        return []

    # -- solvers of others ---------------------------------------------------------------------------------------------

    def rhs(self, t: ArrayLike, y: ArrayLike, u: Inputs = None, *, parameters: Parameters = None) -> Array:
        """Return dy/dt of the state y = [q, v, z], as ``scipy.integrate.solve_ivp(model.rhs, ...)`` calls it.

        Quaternions are brought to unit length before the dynamics are evaluated; rates of quaternions belong to the
        quaternions as given. Constraints hold at the level of accelerations alone, so q and v drift off. Events,
        samples and discontinuities are left to the caller: sampled states have zero rates, continuous states of
        controllers have the rates of their laws. Raises UsageError for ``rhs(y, t)`` or another size of y, and the
        errors of ``forward_dynamics``.

        Parameters
        ----------
        t : array_like
            Time (...), s.
        y : array_like
            State (..., nq + nv + nz): q, v and internal states z.
        u, parameters : mapping or array_like, optional
            Inputs (..., nu) and tunable parameters (..., np), SI units; values of the scene if not given.

        Returns
        -------
        (..., nq + nv + nz) ndarray
            Rates of q (not of increments: four numbers for a quaternion), v and z.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> y = np.concatenate([model.initial_q, model.initial_v])
        >>> model.rhs(0.2, y).round(3)
        array([  0.   ,   0.   , -15.359,  23.743])
        """
        if np.ndim(y) == 0 and np.ndim(t) > 0:
            hint = "rhs(t, y), as solve_ivp calls it; for odeint tfirst=True"
            raise UsageError(Problem("rhs", "the time comes first, and then the state [E0268]", hint))
        y = components("y", y, self.nq + self.nv + self.nz)
        q, v, z = np.split(y, [self.nq, self.nq + self.nv], axis=-1)
        turned = with_unit_quaternions(self.factors, q)
        of_q = configuration_rate(self.factors, q, v)
        if self.angles:
            p = self.parameter_array(parameters)
            of_q[..., -len(self.angles) :] = self.evaluator.angle_motion(turned, v, t, p)[1]
        rates = [of_q, self.forward_dynamics(turned, v, t, u, z=z, parameters=parameters)]
        if self.nz:
            rates.append(self.internal_rates(turned, v, z, t, u, parameters=parameters))
        return np.concatenate(rates, axis=-1)

    # -- arguments -----------------------------------------------------------------------------------------------------

    def parameter_array(self, parameters: Parameters = None) -> Array:
        """Return tunable parameters as an array.

        Parameters
        ----------
        parameters : mapping or array_like, optional
            Values by name, (...) each, or an array of all values (..., np); defaults of the scene if not given.

        Returns
        -------
        (..., np) ndarray
            SI units, in the order of ``model.parameters``.

        Raises
        ------
        UsageError
            Unknown names, wrong shapes, values that are not finite, or values that the scene would refuse as its own.

        Examples
        --------
        >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
        >>> model.parameter_array({"m2": [0.5, 0.7]})
        array([[0.5],
               [0.7]])
        """
        return self.evaluator.parameters(parameters)


def held_components(model: CompiledModel, names: str | Sequence[str]) -> NDArray[np.bool_] | None:
    """Return a mask of the velocity components of joints, or of single components, (nv,); None without names. Raises
    UsageError for an unknown name.
    """
    places: dict[str, list[int]] = {}
    for factor in model.factors:
        for k in range(factor.v.start, factor.v.stop):
            places.setdefault(factor.name, []).append(k)
            if factor.group == "R":
                places[model.v_names[k].removeprefix("v.")] = [k]
    held = np.zeros(len(model.v_names), dtype=bool)
    for name in (names,) if isinstance(names, str) else names:
        plain = name.removeprefix("q.").removeprefix("v.")
        check_name("coordinate", plain, list(places))
        held[places[plain]] = True
    return held if held.any() else None


def consistent(
    model: CompiledModel,
    q: Array,
    v: Array,
    t: float,
    parameters: Array,
    held: NDArray[np.bool_] | None = None,
    kept: KeptComponents | None = None,
) -> Assembly:
    """Return the state nearest to a guess q (nq,), v (nv,) that meets the constraints at t in s, and the violations
    before.

    Parameters
    ----------
    parameters : (np,)
    held : components of v, (nv,), that stay as given, with the coordinates that they change
    kept : components that are kept as far as constraints allow, as written values are

    Raises
    ------
    ModelError
        The constraints contradict each other there, or rows that were left out do not follow; names the rows.
    UsageError
        The model was built without the terms that constraints need.
    """
    from eomgen.solvers.consistency import assemble  # noqa: PLC0415  # most models have no constraints
    from eomgen.solvers.constraint_rows import ConstrainedSystem, elastic_components, split_sizes  # noqa: PLC0415

    needed = PURPOSES["initial_assembly"]
    beams = beams_at(model, t, parameters)
    able = model.having(needed)
    missing = [name for name in needed if name not in able.functions]
    if missing:
        raise UsageError(
            f"the terms {', '.join(missing)} are needed to make an initial state consistent [E0269]", "build with them"
        )

    def at(name: str, **state: Array | float) -> Array:
        return next(iter(able.evaluate(name, t=t, parameters=parameters, **state).values()))

    holonomic = model.functions.sizes["holonomic"]

    def sizes(q: Array, _: float) -> tuple[Array, Array]:
        result = able.evaluate("constraint_size", q, t=t, parameters=parameters)
        return split_sizes(np.concatenate(list(result.values())))

    equations = ConstrainedSystem(
        factors=model.factors,
        names=model.multipliers,
        units=model.library.layout["row_units"],
        angular=np.array([unit == "rad/s" for unit in model.v_units]),
        holonomic=holonomic,
        constraint=lambda q, _: at("constraint", q=q) if holonomic else np.zeros(0),
        velocity=lambda q, v, _: at("constraint_velocity", q=q, v=v),
        jacobian=lambda q, _: at("constraint_jacobian", q=q),
        mass=lambda q: able.mass(q, parameters=parameters),
        sizes=sizes,
        elastic=elastic_components(model.factors, [item["name"] for item in model.library.layout["slopes"]]),
        beams=beams,
    )
    result = assemble(equations if held is None else equations.holding(held), q, v, t, kept)
    deviations = (*result.deviations, *model.check_left_out(result.q, result.v, t, parameters))
    return replace(result, q=model.evaluator.follow_angles(result.q, t, parameters), deviations=deviations)
