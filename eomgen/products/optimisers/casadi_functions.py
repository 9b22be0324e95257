"""Functions of a scene as ``casadi.Function``, compiled at first use: values and derivatives in C."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.calls import NamedResults, checked_call
from eomgen.base.products import optional_package
from eomgen.codegen.folder import MANIFEST
from eomgen.errors import Problem
from eomgen.pipeline.content import library_content
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.generation import generate
from eomgen.pipeline.requests import checked_terms
from eomgen.products.optimisers.casadi_code import CASADI
from eomgen.products.optimisers.discrete_steps import RUNGE_KUTTA
from eomgen.system.terms import Selection
from eomgen.toolchain.builder import SHARED, Builder
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.pipeline.documents import Described
    from eomgen.pipeline.model import Model


@checked_call("a model, a scene or the path of one")
def casadi(
    scene: Model | Described,
    terms: Sequence[str] | None = None,
    *,
    method: str | None = None,
    profile: str = STANDARD_PROFILE,
) -> NamedResults[Any]:
    """Return functions of a scene for CasADi, with exact sparse Jacobians and Hessians in C.

    ``forward_dynamics``: (q, v, z, u, p, t) -> vdot; ``inverse_dynamics``: (q, v, a, z, u, p, t) -> tau; with
    constraints ``residual``: (q, v, a, z, lam, u, p, t) -> r, ``constraint``: (q, p, t) -> Phi,
    ``constraint_velocity``: (q, v, p, t) -> w, ``constraint_acceleration``: (q, v, a, p, t) -> w_dot and ``momenta``:
    (q, v, z, u, p, t) -> (dT/dv, dT/dq + Q); ``internal_rate``: (q, v, z, u, p, t) -> zdot; ``outputs``: (q, v, a, z,
    lam, u, p, t) -> y, all outputs in a vector; ``step``, one step of a method: (x, u, p, t, h) -> x_next, x = (q, v,
    z). By name alone ``frame_poses``: (q, p, t) -> quaternion and position of each frame.
    Arguments on which a function does not depend are left out: see ``name_in()``. Inputs u are passed, also if the
    scene gives formulas; a moving base follows its law at t. CasADi differentiates these functions like expressions;
    the Hessian of a Lagrangian is one call in C.

    Parameters
    ----------
    scene : Model, Scene, path, or mapping
        As in ``build``. Derivatives in quaternions are exact on the unit sphere: a change of the length does not count.
    terms : sequence of str, optional
        Functions among these without ``step``; all that the scene has by default, but ``frame_poses``. ``step`` comes
        with the functions of its method; scenes with sampled states or counted turns have none.
    method : str, optional
        Of ``step``: ``rk4``, a symplectic composition as ``leapfrog`` or ``yoshida4``, ``generalized_alpha``, ``hht``,
        ``wbz``, ``newmark`` or ``trapezoidal``; with constraints the last five or ``rattlie``. By default ``rk4``, of
        scenes with constraints ``rattlie``, and ``trapezoidal`` if some are on velocities alone.
    profile : str
        Profile of the compiler, as in ``build``.

    Returns
    -------
    mapping
        ``casadi.Function`` by name, SI units. A request for an absent name raises UsageError with the reason.

    Raises
    ------
    UsageError
        The package casadi is not installed; laws in Python; a term without derivatives in all arguments, a method
        without such steps, or ``terms`` without the functions of a named method.
    ModelError
        A named method, but the scene has no ``step``, or velocities change the accelerations of a composition.
    ToolchainError
        There is no compiler.

    Examples
    --------
    >>> functions = eomgen.casadi("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> functions["forward_dynamics"].name_in()
    ['q', 'v', 'p', 't']
    """
    missing = Problem("casadi", "the package casadi is not installed [E0940]", "pip install 'eomgen[casadi]'")
    package = optional_package("casadi", missing)
    described: Any = getattr(scene, "scene", scene)
    document, front_end = as_document(described)
    terms = checked_terms(terms)
    wanted = CASADI.terms(terms)
    content = library_content(document, front_end, Selection(tuple(wanted or ())), RUNGE_KUTTA)

    def write(folder: Path) -> None:
        generate(document, folder, terms, method, target=CASADI.name)

    entry = Builder(profile=profile).build_folder(f"casadi {method}".encode() + content, write)
    written = json.loads(entry.text(MANIFEST))
    library = str(entry.file(SHARED))
    functions = {
        item["symbol"].partition("_casadi_")[2]: package.external(item["symbol"], library, item["options"])
        for item in written["casadi"]
    }
    return NamedResults("CasADi function", functions, written["absent"])
