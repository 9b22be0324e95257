"""Parts of calls of compiled models on arrays by hand: loads of sections, strains of elements, sparse partials, closed
loops, names of components, and what is told of a search for rest that fails."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import issparse

import eomgen
from eomgen.base.data import replace
from eomgen.compiled import initial_state, prescribed
from eomgen.compiled.base_parameters import _text
from eomgen.compiled.beams import SectionLoads
from eomgen.compiled.constraints import acceleration_partials, accelerations
from eomgen.compiled.equations import _warn_of_broken_loop
from eomgen.compiled.rest import driven_rest, loaded_statics
from eomgen.compiled.rest.driven_rest import where_driven
from eomgen.compiled.rest.equilibrium import _failure
from eomgen.compiled.rest.loaded_statics import ElementStrains
from eomgen.compiled.rest.sparse_partials import sparse_partials
from eomgen.compiled.rest.state_warnings import _smallest
from eomgen.compiled.terms import Terms
from eomgen.errors import NumericalError, UsageError
from eomgen.lie import numeric
from eomgen.lie.few_poses import differences
from eomgen.lie.groups import SE3
from eomgen.lie.product import Factor, update
from eomgen.solvers.bordered_newton import whole
from eomgen.solvers.consistency import Assembly
from eomgen.solvers.statics import Search
from eomgen.system.description import WrittenStart
from eomgen.system.sparsity import packed_places
from tests.oracles.evaluation import Array


def test_loads_are_linear_between_the_ends_of_elements_and_jump_at_nodes() -> None:
    """Elements from 0 to 1, to 3 and to 4 m; ends of element e have the loads 10 e + (0, 6) plus the component."""
    ends = 10.0 * np.arange(3)[:, np.newaxis, np.newaxis] + np.array([0.0, 6.0])[:, np.newaxis] + np.arange(3)
    batch = np.stack([ends, -ends])
    none = np.zeros((2, 3, 3))
    loads = SectionLoads(np.array([0.5, 2.0, 3.5]), none, none, none, none, batch, 100.0 * batch)
    assert loads.nodes.tolist() == [0.0, 1.0, 3.0, 4.0]
    for x, value in ((0.0, 0.0), (0.25, 1.5), (1.0, 10.0), (2.5, 14.5), (3.0, 20.0), (3.5, 23.0), (4.0, 26.0)):
        moment, force = loads.at(x)
        np.testing.assert_allclose(moment, [value + np.arange(3), -value - np.arange(3)], rtol=1e-12)
        np.testing.assert_allclose(force, 100.0 * moment, rtol=1e-12)
    np.testing.assert_allclose(loads.at(4.0 * (1.0 + 1e-10))[0][0], 26.0 + np.arange(3), rtol=1e-9)
    for x in (-1e-3, 4.001, np.nan):
        with pytest.raises(UsageError, match="is not on the beam, which goes from 0 m to 4 m"):
            loads.at(x)


def chain(rng: np.random.Generator) -> tuple[Any, ElementStrains, Array]:
    """Return a model of two free nodes and a node that the second carries, with its elements, and a configuration."""
    carried = numeric.exp(SE3, 0.4 * rng.normal(size=6))
    factors = [Factor("SE3", "one", 0, 7, 0, 6), Factor("SE3", "two", 7, 7, 6, 6)]

    def evaluate(term: str, q: Array, *_: object, **__: object) -> dict[str, Array]:
        assert term == "poses"
        nodes = [q[..., :7], q[..., 7:], numeric.compose(SE3, q[..., 7:], np.broadcast_to(carried, q[..., 7:].shape))]
        return {"pose": np.stack(nodes, axis=-2)}

    model: Any = SimpleNamespace(functions=("poses",), factors=factors, nv=12, evaluate=evaluate, bodies=list("abc"))
    elements = object.__new__(ElementStrains)
    vars(elements).update(
        model=model,
        stiffness=np.zeros((2, 6, 6)),
        _given={},
        _at=lambda term, q: (evaluate(term, q)["pose"],),
        _first=np.array([0, 1]),
        _second=np.array([1, 2]),
        _nodes=[0, 1, 2],
        _ends=[np.array([0, 1]), np.array([1, 2])],
        _free=[(0, 0), (1, 6)],
        _carried=[(2, 2)],
        _last=None,
        _by_d=None,
    )
    return model, elements, np.concatenate([numeric.exp(SE3, 0.4 * rng.normal(size=6)) for _ in range(2)])


@pytest.mark.parametrize("limit", [100, 0], ids=["whole", "sparse"])
def test_strains_change_with_velocities_as_differences_say(
    limit: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loaded_statics, "WHOLE", limit)
    model, elements, q = chain(rng)
    d = elements.values(q)
    found = elements.derivative(q, d)
    assert issparse(found) == (limit == 0)
    columns = []
    for way in np.eye(12):
        ahead, behind = (elements.values(update(model.factors, q, sign * 1e-6 * way)) for sign in (1.0, -1.0))
        columns.append((ahead - behind).ravel() / 2e-6)
    np.testing.assert_allclose(whole(found), np.stack(columns, axis=1), atol=1e-8)
    forces = rng.normal(size=(2, 6))
    geometric = whole(elements.geometric(q, d, found, forces))
    expected = []
    for way in np.eye(12):  # d changes, and the bodies that carry nodes stay
        change = (whole(found) @ way).reshape(2, 6)
        sides = [
            whole(elements._times_twists(elements._along(d + s * change)[0], q)).T @ forces.ravel()
            for s in (1e-6, -1e-6)
        ]
        expected.append((sides[0] - sides[1]) / 2e-6)
    np.testing.assert_allclose(geometric, np.stack(expected, axis=1), atol=1e-7)


def test_twists_of_carried_nodes_are_those_of_the_term_or_of_differences(rng: np.random.Generator) -> None:
    model, elements, q = chain(rng)
    found = elements._twists_of([2, 0], q)
    np.testing.assert_allclose(found[:, 1], np.eye(12, 6), atol=1e-9)
    moved = numeric.exp(SE3, 1e-5 * rng.normal(size=6))
    pose = elements._at("poses", q)[0][2]
    other = elements._at("poses", np.concatenate([q[:7], numeric.compose(SE3, q[7:], moved)]))[0][2]
    twist = differences(pose[np.newaxis], other[np.newaxis])[0]
    np.testing.assert_allclose(numeric.log(SE3, moved) @ found[6:, 0], twist, atol=1e-9)
    drift, tall = rng.normal(size=(3, 6)), found.copy()
    model.functions = ("poses", "twists")
    model.evaluate = lambda term, q, v, **_: {
        "twist": np.einsum("...k,kni->...ni", v, np.stack([tall[:, 1], tall[:, 1], tall[:, 0]], axis=1)) + drift
    }
    np.testing.assert_allclose(elements._twists_of([2, 0], q), found, atol=1e-12)
    assert elements.doubt(np.array([[3.0, 0.5, 0.0, 9.0, 0.0, 0.0], [0.0, 0.0, 3.05, 0.0, 0.0, 0.0]])) == ""
    said = elements.doubt(np.array([[0.0, 3.12, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -3.14, 0.0, 0.0, 0.0]]))
    assert said.startswith("the element between b and c turns by half a turn")


@pytest.mark.parametrize("inner", [0, 3])
def test_sparse_partials_are_whole_ones_without_the_recursion(inner: int, rng: np.random.Generator) -> None:
    """Forces r(x, s) and rates f(x, s) under rows g(x, s) = 0: the derivatives along g = 0."""
    nv, nz, rows = 4, 2, 1
    shapes = {"K": (nv + inner, nv), "C": (nv + inner, nv), "M": (nv + inner, nv), "Rz": (nv + inner, nz)}
    shapes |= {"B": (rows, nv), "Z": (rows, nv), "Fq": (nz, nv), "Fv": (nz, nv), "Fz": (nz, nz)}
    shapes |= {"X": (nv + inner, inner), "Fx": (nz, inner)} if inner else {}
    parts = {name: rng.normal(size=shape) for name, shape in shapes.items()}
    values, patterns = {}, {}
    for name, part in parts.items():
        places = [(int(i), int(j)) for i, j in np.argwhere(part < 1.5)]
        part[part >= 1.5] = 0.0
        places.append(places[0])  # entries at one place are summed
        values[name] = np.array([part[place] for place in places])
        values[name][0] = values[name][-1] = 0.5 * values[name][0]
        patterns[name] = packed_places(places)
    if inner:
        diagonal = parts["X"][nv:]
        assert abs(np.linalg.det(diagonal)) > 1e-2
    model: Any = SimpleNamespace(
        nv=nv,
        nz=nz,
        multipliers=["row"],
        functions=("iteration",),
        library=SimpleNamespace(layout={"patterns": patterns}),
        evaluate=lambda term, **state: values,
    )
    state = np.zeros(nv), np.zeros(nv), np.zeros(nv), np.zeros(nz), np.zeros(rows)
    found = sparse_partials(model, *state, {})
    for name, of_rates in (("K", "Fq"), ("C", "Fv"), ("M", ""), ("Rz", "Fz")):
        change = np.linalg.solve(parts["X"][nv:], parts[name][nv:]) if inner else np.zeros((0, shapes[name][1]))
        expected = parts[name][:nv] - (parts["X"][:nv] @ change if inner else 0.0)
        np.testing.assert_allclose(whole(getattr(found, name)), expected, rtol=1e-9, atol=1e-12, err_msg=name)
        if of_rates:
            expected = parts[of_rates] - (parts["Fx"] @ change if inner else 0.0)
            np.testing.assert_allclose(whole(getattr(found, of_rates)), expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(whole(found.B), parts["B"], rtol=1e-12)
    still = sparse_partials(model, *state, {}, of_velocities=False)
    assert not whole(still.C).any() and not whole(still.Z).any() and whole(still.C).shape == (nv, nv)
    np.testing.assert_array_equal(whole(still.K), whole(found.K))


def test_accelerations_change_with_the_state_as_their_differences() -> None:
    """Two coordinates on x^2 + 2 y^2 = const with forces: against differences of the accelerations themselves."""
    M = np.array([[2.0, 0.5], [0.5, 1.0]])

    def functions(name: str, values: dict[str, Array]) -> tuple[Array, ...]:
        q, v = values["q"], values["v"]
        B = np.array([[2.0 * q[0], 4.0 * q[1]]])
        if name == "residual":
            force = np.array([np.sin(q[1]) - v[0], q[0] * v[1]])
            return (M @ values["a"] - force + B.T @ values["lam"],)
        return {
            "mass": (M,),
            "constraint_jacobian": (B,),
            "constraint_bias": (np.array([2.0 * v[0] ** 2 + 4.0 * v[1] ** 2]),),
        }[name]

    functions.sizes = {"v": 2, "lam": 1}  # type: ignore[attr-defined]
    at: dict[str, Array] = {"q": np.array([0.8, -0.6]), "v": np.array([0.3, 0.2]), "z": np.zeros(0)}
    moves = []
    for block in ("q", "v"):
        for way in 1e-5 * np.eye(2):
            moves.append(({**at, block: at[block] + way}, {**at, block: at[block] - way}, 2e-5))
    found = acceleration_partials(functions, at, moves)  # type: ignore[arg-type]
    for k, (ahead, behind, distance) in enumerate(moves):
        sides = [accelerations(functions, side)[0] for side in (ahead, behind)]  # type: ignore[arg-type]
        np.testing.assert_allclose(found[:, k], (sides[0] - sides[1]) / distance, rtol=1e-7, atol=1e-8)
    a, multipliers = accelerations(functions, at)  # type: ignore[arg-type]
    np.testing.assert_allclose(functions("residual", at | {"a": a, "lam": multipliers})[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(2.0 * at["q"] * [1.0, 2.0] @ a + 2.0 * 0.09 + 4.0 * 0.04, 0.0, atol=1e-12)


@pytest.mark.parametrize(("a", "told"), [([1.0, -3.0], ""), ([1.0, 2.0], "second is off by 10"), (None, "")])
def test_accelerations_that_a_loop_does_not_allow_are_told(a: list[float] | None, told: str) -> None:
    terms = {"constraint_jacobian": np.array([[1.0, 0.0], [0.0, 2.0]]), "constraint_bias": np.array([-1.0, 6.0])}
    evaluator = SimpleNamespace(
        call=lambda name, **_: (terms[name],), velocity=lambda name, a: np.array(a), multipliers=["first", "second"]
    )
    model: Any = SimpleNamespace(evaluator=evaluator)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _warn_of_broken_loop(model, [0.0], [0.0], a, {})  # type: ignore[arg-type]
    assert [told in str(item.message) for item in caught] == ([True] if told else [])


def test_a_component_of_a_joint_is_named_by_its_index() -> None:
    factors = {"blade": Factor("R", "blade", 3, 2, 2, 2), "ball": Factor("SO3", "ball", 5, 4, 4, 3)}
    assert initial_state._component(factors, "blade[0]") == (slice(3, 4), slice(2, 3))
    assert initial_state._component(factors, "blade[1]") == (slice(4, 5), slice(3, 4))
    for name in ("blade[2]", "blade", "blade[-1]", "blade[x]", "ball[0]", "arm[0]"):
        assert initial_state._component(factors, name) is None


def test_known_times_are_all_within_an_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single jump, waves without a beginning, and samples from an offset on."""
    listed = [(0.35, 0.0, -np.inf), (0.1, 0.5, -np.inf), (0.2, 0.25, 0.0), (9.0, 0.0, -np.inf)]
    monkeypatch.setattr(prescribed, "_jumps", lambda model, order: listed)
    model: Any = None
    found = prescribed.discontinuity_times(model, -0.95, 1.1)
    assert found == pytest.approx([-0.9, -0.4, 0.1, 0.2, 0.35, 0.45, 0.6, 0.7, 0.95, 1.1])
    assert prescribed.discontinuity_times(model, 0.35, 0.35).tolist() == [0.35]
    with pytest.raises(UsageError, match="the end 0 s lies before the start 1 s"):
        prescribed.discontinuity_times(model, 1.0, 0.0)
    listed.append((0.0, 1e-9, 0.0))
    with pytest.raises(UsageError, match="such times from 0 s to 1 s, in waves of 1e-09 s"):
        prescribed.discontinuity_times(model, 0.0, 1.0)


def test_references_of_angles_stand_behind_the_poses() -> None:
    terms: Any = SimpleNamespace(
        angles=("door", "wheel"),
        functions=SimpleNamespace(sizes={"q": 5, "v": 3}, inputs=lambda name: ("q", "v", "t", "p")),
        _first_angles=np.array([8.0, 9.0]),
        angle_motion=lambda q, v, t, p, base: (10.0 * q[..., :2], None),
    )
    assert np.asarray(Terms.with_references(terms, "q", [1.0, 2.0, 3.0])).tolist() == [1.0, 2.0, 3.0, 8.0, 9.0]
    batch = np.asarray(Terms.with_references(terms, "q", [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    assert batch.tolist() == [[1.0, 2.0, 3.0, 8.0, 9.0], [4.0, 5.0, 6.0, 8.0, 9.0]]
    whole_q = [1.0, 2.0, 3.0, 4.0, 5.0]
    assert np.asarray(Terms.with_references(terms, "q", whole_q)).tolist() == whole_q
    assert Terms.follow_angles(terms, np.array(whole_q), 0.0, np.zeros(0)).tolist() == [1.0, 2.0, 3.0, 10.0, 20.0]
    terms.angles = ()
    assert Terms.with_references(terms, "q", [1.0, 2.0, 3.0]) == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(("M", "smallest"), [(np.diag([3.0, 2.0]), 2.0), (np.diag([3.0, 0.0]), 3.0)])
def test_the_smallest_inertia_counts_held_coordinates(M: Array, smallest: float) -> None:
    """A massless coordinate has the inertia of its row, which is scaled to the largest."""
    model: Any = SimpleNamespace(
        functions=("mass", "constraint_jacobian"),
        multipliers=["row"],
        nv=2,
        mass=lambda q, parameters: M,
        evaluate=lambda *_, **__: {"B": np.array([[0.0, 0.5]])},
    )
    assert _smallest(model, np.zeros(2), np.zeros(0)) == pytest.approx(smallest, rel=1e-12)
    model.functions = ("mass",)
    assert _smallest(model, np.zeros(2), np.zeros(0)) == pytest.approx(float(M[1, 1]), abs=1e-12)
    model.functions = ()
    assert _smallest(model, np.zeros(2), np.zeros(0)) is None


def test_base_parameters_are_written_as_sums() -> None:
    names = ("m", "l", "J", "d")
    assert _text(np.array([1.0, -0.5, 1.0, 0.0]), names, 0) == "m - 0.5 l + J"
    assert _text(np.array([2.0, 1.0, -1.0, 0.0]), names, 1) == "l + 2 m - J"


@pytest.mark.parametrize("start", [[1.1, 0.9], [-2.0, 5.0]])
def test_a_driven_configuration_lies_on_the_rows(start: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    """A circle of radius 2: the corrections are those of least length by Newton's method."""
    model: Any = SimpleNamespace(
        functions=SimpleNamespace(sizes={"holonomic": 1}),
        evaluate=lambda term, q, **_: {
            "row": np.array([q @ q - 4.0]) if term == "constraint" else np.array([2.0 * q, [9.0, 9.0]])
        },
    )
    monkeypatch.setattr(driven_rest, "_arguments", lambda measures: {})
    monkeypatch.setattr(driven_rest, "_extents", lambda model, measures, q: np.ones(2))
    monkeypatch.setattr(driven_rest, "_move", lambda model, measures, q, step, seconds: q + seconds * step)
    measures: Any = None
    found, q = where_driven(model, measures, np.array(start)), np.array(start)
    np.testing.assert_allclose(np.linalg.norm(found), 2.0, rtol=1e-12)
    np.testing.assert_allclose(found / 2.0, q / np.linalg.norm(q), rtol=1e-12)
    near = np.array([0.3, 0.2])  # from where a whole step goes farther off
    assert where_driven(model, measures, near) is near
    model.functions.sizes["holonomic"] = 0
    assert where_driven(model, measures, q) is q


MODEL: Any = SimpleNamespace(
    v_units=["m/s", "rad/s"], v_names=["v.cart", "v.arm"], states=["level", "charge"], z_units=["m", "1"]
)


def failed(stiffness: Array, along: Array | None = None, **parts: Any) -> NumericalError:
    """Return the error of a search that ended with an imbalance of 3 and -8 along the coordinates."""
    point: Any = SimpleNamespace(
        stiffness=stiffness,
        largest_stiffness=float(np.abs(stiffness).max()),
        basis=np.eye(2),
        imbalance=np.array([3.0, -8.0]),
        acceleration=np.array([-3.0, 8.0]),
        finite=True,
        violation=np.zeros(1),
        row_sizes=np.ones(1),
        rates=np.array([0.5, -0.25]),
        rate_noise=np.array([1.0, 1e-3]),
    )
    vars(point).update(parts)
    statics: Any = SimpleNamespace(gravity=9.81, length=1.0)
    search = Search(point, False, 17, states_alone=bool(parts.get("states_alone")))
    return _failure(MODEL, statics, search, "load steps end", along)


def test_what_keeps_a_search_from_rest_is_told() -> None:
    held, soft = np.diag([5.0, 4.0]), np.diag([0.0, 4.0])
    assert "in 17 steps: v.arm still accelerates with 8 rad/s^2; load steps end" in str(failed(held))
    text = str(failed(soft))
    assert "nothing holds v.cart: it accelerates with -3 m/s^2, and no stiffness opposes it" in text
    assert "rolls along" not in text
    assert 'steady_motion({"cart": 2.5}), in Python' in str(failed(soft, np.array([2.5, 0.0])))
    assert "nothing holds v.arm: it accelerates with 8 rad/s^2" in str(failed(np.diag([5.0, 0.0])))
    assert "constraints are off by 0.2 after 17 steps" in str(failed(held, violation=np.array([-0.2])))
    assert "accelerates" in str(failed(held, violation=np.array([0.9e-8])))
    text = str(failed(held, states_alone=True))
    assert "the state charge does not rest: it changes at -0.25 per s" in text
    text = str(failed(held, states_alone=True, rate_noise=np.ones(2)))
    assert "the state level does not rest: it changes at 0.5 m per s" in text


def test_starts_of_a_call_are_joined_with_those_of_the_scene() -> None:
    door, wheel = WrittenStart("door", True, False, True), WrittenStart("wheel", False, True)
    factors = [Factor("R", name, k, 1, k, 1) for k, name in enumerate(("door", "wheel", "arm"))]
    model: Any = SimpleNamespace(description=SimpleNamespace(starts=(door, wheel)), factors=factors, states=())
    assert initial_state.starts_of(model, None) == (door, wheel)
    for block in "qv":
        assert initial_state.starts_of(model, {block: [0.0] * 3}) == ()
    given = {"door": {"velocity": 2.0}, "wheel": {"velocity": 1.0, "hold": True}, "arm": 0.3}
    joined = replace(door, velocity=True), replace(wheel, held=True), WrittenStart("arm", True, False)
    assert initial_state.starts_of(model, given) == joined


@pytest.mark.parametrize(("freedoms", "order"), [(2, ["q.a", "q.b", "v.b"]), (0, ["v.b", "q.a", "q.b"])])
def test_changes_of_a_start_are_told_by_their_size_and_asked_ones_first(freedoms: int, order: list[str]) -> None:
    """q.a by half of the extent of 4 m, q.b by 0.1 rad, and v.b, which was not given, by as much as the fastest."""
    names, units = (("q.a", "q.b"), ("v.a", "v.b")), (("m", "rad"), ("m/s", "rad/s"))
    consistent = Assembly(np.array([3.0, 0.4]), np.array([1.0, 1.0]), 3, {"row": 0.1}, {}, extent=4.0)
    guess = np.array([1.0, 0.5]), np.array([1.0, 0.0])
    (told,) = initial_state.corrected_start(consistent, guess, names, units, freedoms=freedoms)
    changes = {"q.a": "q.a 1 -> 3 m", "q.b": "q.b 0.5 -> 0.4 rad", "v.b": "v.b 0 -> 1 rad/s"}
    assert ", ".join(changes[name] for name in order) in str(told)
    assert ("try: hold = true to keep q.a, q.b" in str(told)) == bool(freedoms)
    for none in (replace(consistent, q=guess[0], v=guess[1]), replace(consistent, violations={})):
        assert initial_state.corrected_start(none, guess, names, units, freedoms=2) == []


@pytest.mark.slow
def test_rest_on_a_turning_arm_balances_its_spring_and_centrifugal_force() -> None:
    """k (0.5 - angle) = m w^2 r l sin(angle), for a drive of constant rate and forces that turn with it alone."""
    builder = eomgen.SceneBuilder("carousel", gravity=[0, 0, 0]).body("arm", 1.0, inertia=[1, 1, 1])
    for name, value in (("w", 3.0), ("c", 0.0), ("wind", 0.0)):
        builder.parameter(name, value, tunable=True)
    builder.body("bob", 2.0, center_of_mass=[0.2, 0, 0], inertia=[0.1, 0.1, 0.1])
    builder.joint("spin", "revolute", "base", "arm", axis=[0, 0, 1], drive="w * t + c * t**2")
    swing = {"position": [0.5, 0, 0], "stiffness": 4.0, "rest": 0.5}
    builder.joint("swing", "revolute", "arm", "bob", axis=[0, 0, 1], **swing)
    builder.force("gust", "bob", point=[0.2, 0, 0], force=["wind", 0, 0])
    model = eomgen.build(builder.build(), profile="instant")
    rest = model.equilibrium()
    angle = brentq(lambda x: 4.0 * (0.5 - x) - 2.0 * 9.0 * 0.5 * 0.2 * np.sin(x), 0.0, 0.5)
    assert (rest.q[1], rest.v.tolist()) == (pytest.approx(angle, rel=1e-9), pytest.approx([3.0, 0.0]))
    for changed, text in (
        ({"c": 0.5}, "for v.spin changes along it: 3 rad/s at t = 0 s, "),
        ({"wind": 1.0}, "for forces change as it moves: at t = "),
    ):
        with pytest.raises(NumericalError, match=f"no rest relative to the drive of spin at 3 rad/s, {text}"):
            model.equilibrium(parameters=changed)
