"""``Family``: facts, settings, statistics and stepper data of a family of methods; an instance is one method.

Names, terms, the state of the stepper, settings, statistics and statuses are rows here; C and Python read the same
rows.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

from eomgen.base.data import dataclass, field

if TYPE_CHECKING:
    from eomgen.integrators.families.needs import SystemRequirement
    from eomgen.integrators.step_work import Work
    from eomgen.system.system import System

#: Interpretation of inputs by a stepper: rows within a step, linear in between; the first row held over the step, with
#: the scene's formulas in place of NaN; the same, with the formulas expanded in series of time.
InputDemand = Literal["sampled", "held", "series"]
#: States between recorded rows: q of order 5 and v as its derivative, or v of order 3 through v and a; steps of the
#: method; none.
DenseOutput = Literal["hermite_5", "hermite_3", "steps", "none"]
#: Functions on the Lie groups of the configuration that a stepper may call.
GroupFunction = Literal["update", "tangent", "cotangent", "bracket", "transport", "rate"]

#: Facts of a scene by which methods differ: rows of constraints, or coordinates that are rotations.
SceneFact = Literal["constraints", "rotations"]

SMALLER_STEP = "a step smaller than {step:.3g} s"


@dataclass(frozen=True)
class MethodName:
    """Public name of a method.

    Attributes
    ----------
    make : function from the parameters, as keywords, to the method
    parameters : names of the parameters that ``simulate`` and scenes may give
    aliases : other names of the same method
    idle : parameters without effect, which are not a mistake
    differs : facts of a scene without each of which another method of the family does the same
    by_tolerance : name of the method for a given tolerance; empty: this method
    fixed_steps : reason for which the steps cannot follow a tolerance, and a remedy; empty for methods with a tolerance
    compiled_with : parameters that a stepper is compiled with if the scene gives no valid ones; runs set parameters of
        the run
    """

    name: str
    make: Callable[..., Family]
    parameters: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    differs: tuple[SceneFact, ...] = ()
    by_tolerance: str = ""
    fixed_steps: tuple[str, str] | tuple[()] = ()
    compiled_with: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Sizes:
    """Numbers of q, v, z, u, tunable parameters, multipliers, and holonomic multipliers."""

    q: int
    v: int
    z: int
    u: int
    p: int
    lam: int
    holonomic: int


@dataclass(frozen=True)
class Field:
    """A member of the stepper's state or statistics.

    Attributes
    ----------
    name : in Python
    comment : meaning, for the C header
    size : of an array; 0: a number alone
    kind : ``real``, ``long``, or ``parameters`` for the struct of tunable parameters
    group : the struct within the state that has the field as a member, if any
    member : name in C if different from ``name``
    """

    name: str
    comment: str = ""
    size: int = 0
    kind: Literal["real", "long", "parameters"] = "real"
    group: str = ""
    member: str = ""


@dataclass(frozen=True)
class Setting:
    """A number that a caller may set per run.

    Attributes
    ----------
    default : value without a caller's value
    comment : meaning, for the C header
    whole : the least and the largest of a whole number; None: any number that is not negative
    single : least value in single precision
    """

    name: str
    default: float
    comment: str
    whole: tuple[int, int] | None = None
    single: float = 0.0


@dataclass(frozen=True)
class Bound:
    """A condition on settings: a name, or a sum of names with plus signs, compared with a name or a number."""

    left: str
    relation: Literal["<", "<=", ">", ">=", "finite"]
    right: str | float = 0.0


@dataclass(frozen=True)
class Status:
    """A way in which a call of the stepper may end.

    Attributes
    ----------
    number, name : of the enumeration in C; 0 is ``OK``
    text : the event
    advice : remedy, with places for settings as ``{step:.3g}``
    """

    number: int
    name: str
    text: str
    advice: str


class LinearStep(NamedTuple):
    """Coefficients of generalized-alpha steps, as floats, for derivatives of runs; ``rate_alpha_m`` and ``rate_gamma``
    belong to internal states, equations of first order."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    rate_alpha_m: float
    rate_gamma: float


class LinearTransitions(NamedTuple):
    """Steps that are maps of q, v and z, whose derivatives follow from the equations of the step.

    Attributes
    ----------
    A, b, c : of explicit stages; empty for an implicit step
    """

    A: Sequence[Sequence[float]] = ()
    b: Sequence[float] = ()
    c: Sequence[float] = ()


class Family(ABC):
    """Family of integration methods; instances are methods."""

    #: Name of the family and of the folder of its templates.
    family: ClassVar[str]
    #: The folder of the templates, ``stepper.c.jinja`` and its includes; None: eomgen's own folder of the family's
    #: name.
    templates: ClassVar[Path | None] = None
    inputs: ClassVar[InputDemand] = "sampled"
    dense_output: ClassVar[DenseOutput]
    #: Whether a step solves equations.
    implicit: ClassVar[bool] = False
    #: Whether rows may have multipliers.
    holds_constraints: ClassVar[bool] = False
    #: Whether the method passes positions with singular constraints.
    passes_singularities: ClassVar[bool] = False
    #: Whether the state alone, without the workspace, determines all later bits.
    state_is_all: ClassVar[bool] = False
    #: Behaviour of a step with inputs or parameters that differ from the end of the last step.
    renewal: ClassVar[str] = "evaluates accelerations anew"
    #: How q and v of a start are brought onto constraints.
    projection: ClassVar[str] = ""
    #: Structs within the state, and their descriptions.
    groups: ClassVar[tuple[tuple[str, str], ...]] = ()

    order: int
    source: str
    needs: tuple[SystemRequirement, ...] = ()

    @classmethod
    @abstractmethod
    def names(cls) -> tuple[MethodName, ...]:
        """Return the names of the family's methods."""

    @classmethod
    @abstractmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        """Return the functions of a model that a stepper calls, or that bring a state onto the constraints.

        Functions of z alone are not among them.

        Parameters
        ----------
        constrained : bool
            Whether the scene has constraints.
        internal : bool
            Whether the scene has internal states.
        mass : bool
            Whether the system has the inertia matrix, which long trees leave out, with sufficient digits.
        """

    def calls(self, system: System) -> set[str]:
        """Return the functions without which a system has no stepper of this method; by default the functions of
        ``terms``.

        Steps may call further functions: explicit methods return an empty set for a system that has
        ``forward_dynamics``. ``internal_rate`` is never included.

        Parameters
        ----------
        system : System
            The equations.

        Returns
        -------
        set of str
            Names of functions, which the system may lack: then the method has no stepper.
        """
        mass = "mass" in system.functions and not system.facts.ill_scaled
        return set(self.terms(bool(system.multipliers), system.facts.internal_states, mass))

    def prepared(self, system: System) -> System:
        """Return a system with functions of the method in addition to the functions of its terms.

        Parameters
        ----------
        system : System
            The equations.

        Returns
        -------
        System
            The same, or one with further functions.
        """
        return system

    @abstractmethod
    def title(self, constrained: bool) -> str:
        """Return the description of the method for the head of the C file.

        Parameters
        ----------
        constrained : bool
            Whether the scene has constraints.
        """

    @property
    def group_functions(self) -> tuple[GroupFunction, ...]:
        """Lie group functions that the templates call."""
        return ("update", "bracket")

    @property
    def instead(self) -> str:
        """Alternative methods for scenes on which this method cannot run."""
        return "generalized_alpha"

    @property
    def more_stable(self) -> str:
        """Alternative methods with better stability, other than smaller steps."""
        return "generalized_alpha, which is stable at larger ones"

    @property
    def parameters(self) -> Mapping[str, Fraction]:
        """Parameters of the method that are settings of the compiled stepper."""
        return {}

    @property
    def keywords(self) -> Mapping[str, float]:
        """Keyword arguments of ``methods.method_named`` that construct the method."""
        return {}

    @property
    def chooses_steps(self) -> bool:
        """Whether the method controls its step size; growth by too large steps is then not checked."""
        return False

    @property
    def real_stability(self) -> float:
        """Largest stable step times rate of decay of an explicit step, for a warning; 0 if not checked."""
        return 0.0

    @property
    def discontinuity_order(self) -> int:
        """Derivatives of forces from this order on may jump within a step."""
        return self.order

    @property
    def linear_step(self) -> LinearStep | LinearTransitions | None:
        """Return the coefficients of a step made linear; None if runs have no derivatives."""
        return None

    def warnings(self, constrained: bool) -> tuple[str, ...]:
        """Return warnings about these settings, one sentence each.

        Parameters
        ----------
        constrained : bool
            Whether the scene has constraints.

        Returns
        -------
        tuple of str
            One sentence each.
        """
        return ()

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        """Return the members of the state beyond t, q, v, vdot, lam, z, zdot and the common counters.

        Parameters
        ----------
        sizes : Sizes
            Numbers of coordinates, multipliers and parameters.

        Returns
        -------
        tuple of Field
            In the order of the struct in C.
        """
        return ()

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        """Return the settings other than the step.

        Parameters
        ----------
        sizes : Sizes
            Numbers of coordinates, multipliers and parameters.

        Returns
        -------
        tuple of Setting
            In the order of the struct in C.
        """
        return ()

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        """Return the conditions on settings in C, in the order of the tests; ``good_settings`` of the templates.

        Parameters
        ----------
        sizes : Sizes
            Numbers of coordinates, multipliers and parameters.

        Returns
        -------
        tuple of Bound
            One for each condition.
        """
        return ()

    def choices(self, sizes: Sizes) -> Mapping[str, bool]:
        """Return the facts by which the templates of the family choose, by name.

        ``offset`` of implicit families: whether the increment of a step has parts other than the unknown mean velocity.

        Parameters
        ----------
        sizes : Sizes
            Numbers of coordinates, multipliers and parameters.

        Returns
        -------
        mapping
            True or false by name.
        """
        return {}

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        """Return the statistics beyond the common ones.

        Parameters
        ----------
        sizes : Sizes
            Numbers of coordinates, multipliers and parameters.

        Returns
        -------
        tuple of Field
            In the order of the struct in C.
        """
        return ()

    @abstractmethod
    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        """Return the possible failures of a call.

        Parameters
        ----------
        constrained : bool
            Whether there are constraints.
        angles : bool
            Whether angles are counted over turns.
        """

    @abstractmethod
    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        """Return the data of the templates of the family, JSON types only.

        The common templates read ``input_times``, the shares of a step with a row of inputs; ``hooks``, if any:
        functions of the template by the moment of their call: ``row`` (before a row is given), ``recorded`` (after a
        row), ``end`` (of a run), and ``row_notes``, lines on rows for the header; true
        ``starts_with_rates_of_inputs``, if a start depends on the last row of inputs of the first step.

        Parameters
        ----------
        system : System
            The equations, with the functions of the method.
        step : float
            Size of a step, s.
        samples : object
            Numbers by which pivots are chosen; None: the system's own.
        """

    def work(self, system: System, method: Mapping[str, Any]) -> tuple[Work, ...]:
        """Return the work of every step; empty without a count, as for steps that iterations or errors decide.

        Parameters
        ----------
        system : System
            The equations.
        method : mapping
            The data of the method, ``Program.method``.

        Returns
        -------
        tuple of Work
            Calls of each function, factorizations and solutions of a step.
        """
        return ()


def velocities(factors: Sequence[Any]) -> int:
    """Return the number of velocity components of factors."""
    return sum(factor.v_size for factor in factors)


#: Terms of constraints that steppers call, or that bring a state onto the constraints.
KINEMATIC = ("constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size")
#: Counters of ``newton/step_matrix.c.jinja`` for families that include this template.
EXCHANGES = Field(
    "exchanges", "factorizations with pivots chosen by size, because the planned pivots were too small", kind="long"
)
#: Statuses of most steppers.
NOT_FINITE = Status(
    3,
    "NOT_FINITE",
    "a value became infinite or not a number",
    f"{SMALLER_STEP}; then the forces and formulas near that time",
)
BAD_ARGUMENT = Status(
    4,
    "BAD_ARGUMENT",
    "a setting is out of its range, a step does not move time on, or an input has neither a formula nor a table",
    "the settings and inputs of the run",
)
SINGULAR_ADVICE = "the inertia of the bodies and, near special configurations, other initial angles"
SINGULAR_MASS = Status(2, "SINGULAR", "the mass matrix is singular", SINGULAR_ADVICE)
NOT_CONSISTENT = Status(
    6,
    "NOT_CONSISTENT",
    "the initial configuration cannot be brought onto the constraints",
    "initial coordinates that meet them more closely; angles without their whole turns, which cost digits",
)


def rotation_too_large(angles: bool) -> Status:
    """Return the status of a step with too large a rotation of a body, or of an angle counted over revolutions."""
    who = "a body or a joint" if angles else "a body"
    text = f"{who} turns by more than 0.9 of a full turn within one step; reduce the step"
    return Status(5, "ROTATION_TOO_LARGE", text, SMALLER_STEP)
