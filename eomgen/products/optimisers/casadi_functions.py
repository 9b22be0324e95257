"""Functions of a scene as ``casadi.Function``, compiled at first use: values and derivatives in C."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.calls import NamedResults, checked_call
from eomgen.codegen.folder import MANIFEST
from eomgen.errors import Problem, UsageError
from eomgen.pipeline.content import library_content
from eomgen.pipeline.pipeline import as_document, generate
from eomgen.products.optimisers.casadi_code import CASADI, METHOD
from eomgen.system.terms import Selection
from eomgen.toolchain.builder import SHARED, Builder
from eomgen.toolchain.profiles import STANDARD_PROFILE

if TYPE_CHECKING:
    from eomgen.pipeline.model import Model
    from eomgen.pipeline.pipeline import Described


@checked_call("a model, a scene or the path of one")
def casadi(
    scene: Model | Described, terms: Sequence[str] | None = None, *, profile: str = STANDARD_PROFILE
) -> NamedResults[Any]:
    """Return functions of a scene for CasADi, with exact sparse Jacobians and Hessians in C.

    ``forward_dynamics``: (q, v, z, u, p, t) -> vdot; ``inverse_dynamics``: (q, v, a, z, u, p, t) -> tau; with
    constraints ``residual``: (q, v, a, z, lam, u, p, t) -> r, ``constraint``: (q, p, t) -> Phi and
    ``constraint_velocity``: (q, v, p, t) -> w; ``internal_rate`` and ``outputs``; ``step``, one step of the method
    ``rk4``: (x, u, p, t, h) -> x_next, x = (q, v, z), of scenes without rotations. By name alone ``frame_poses``:
    (q, p, t) -> quaternion and position of each frame, and ``constraint_acceleration``: (q, v, a, p, t) -> w_dot.
    Inputs that the scene does not have are left out: see ``name_in()``. CasADi differentiates these functions like
    expressions; the Hessian of a Lagrangian is one call in C.

    Parameters
    ----------
    scene : Model, Scene, path, or mapping
        As in ``build``. Derivatives in quaternions are exact on the unit sphere: a change of the length does not count.
    terms : sequence of str, optional
        Functions among these; all that the scene has by default. ``step`` comes with ``forward_dynamics``.
    profile : str
        Profile of the compiler, as in ``build``.

    Returns
    -------
    mapping
        ``casadi.Function`` by name, SI units.

    Raises
    ------
    UsageError
        The package casadi is not installed; a term without derivatives in all arguments.
    ToolchainError
        There is no compiler.

    Examples
    --------
    >>> functions = eomgen.casadi("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> functions["forward_dynamics"].name_in()
    ['q', 'v', 'p', 't']
    """
    try:
        package: Any = import_module("casadi")
    except ImportError:
        raise UsageError(
            Problem("casadi", "the package casadi is not installed", "pip install 'eomgen[casadi]'")
        ) from None
    described: Any = getattr(scene, "scene", scene)
    document, front_end = as_document(described)
    wanted = CASADI.terms(terms)
    content = library_content(document, front_end, Selection(tuple(wanted or ())), METHOD)

    def write(folder: Path) -> None:
        generate(document, folder, terms, target=CASADI.name)

    entry = Builder(profile=profile).build_folder(b"casadi\0" + content, write)
    symbols = [item["symbol"] for item in json.loads(entry.text(MANIFEST))["casadi"]]
    library = str(entry.file(SHARED))
    functions = {symbol.partition("_casadi_")[2]: package.external(symbol, library) for symbol in symbols}
    return NamedResults("function of CasADi", functions)
