"""Dataclasses with methods compiled on first use are the dataclasses of the standard library in all else."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import subprocess
import sys
from collections.abc import Callable, Hashable, Iterator
from threading import Barrier, Thread
from typing import Any, ClassVar, Generic, TypeVar

import pytest

import eomgen.pipeline.model
import eomgen.pipeline.pipeline
import eomgen.simulation.simulate  # noqa: F401  # imports most rooms
from eomgen.base import data

T = TypeVar("T")
Decorator = Callable[..., Any]


def plain(dataclass: Decorator, **options: Any) -> type:
    @dataclass(**options)
    class Plain:
        """Point."""

        x: int
        names: tuple[str, ...] = ()
        more: dict[str, int] = dataclasses.field(default_factory=dict)
        hidden: int = dataclasses.field(default=3, repr=False, compare=False)
        shared: ClassVar[int] = 7

    return Plain


def derived(dataclass: Decorator, **options: Any) -> type:
    base: Any = plain(dataclass, **options)

    @dataclass(**options)
    class Derived(base):
        """Point with a number of its own."""

        y: float = 2.0

        def __post_init__(self) -> None:
            object.__setattr__(self, "y", 2 * self.y)

    return Derived


def with_own_constructor(dataclass: Decorator, **options: Any) -> type:
    base: Any = plain(dataclass, **options)

    class Derived(base):
        def __init__(self, x: int) -> None:
            super().__init__(x, ("inner",))

    return Derived


def with_own_equality(dataclass: Decorator, **options: Any) -> type:
    @dataclass(**options)
    class Own(Generic[T]):  # noqa: PLW1641  # the hash of a frozen class is made
        """Equal by its value modulo 10."""

        x: T

        def __eq__(self, other: object) -> bool:
            return bool(vars(self)["x"] % 10 == vars(other)["x"] % 10)

        def __repr__(self) -> str:
            return f"Own {self.x}"

    return Own


def facts(kind: Any) -> dict[str, Callable[[], object]]:
    """Return questions to a class whose constructor takes one number."""

    def setting() -> object:
        item = kind(4)
        item.x = 5
        return item.x

    def deleting() -> object:
        item = kind(4)
        del item.x
        return vars(item)

    return {
        "signature": lambda: inspect.signature(kind),
        "is one": lambda: dataclasses.is_dataclass(kind),
        "fields": lambda: [(item.name, item.type, item.default, item.compare) for item in dataclasses.fields(kind)],
        "match": lambda: kind.__match_args__,
        "values": lambda: vars(kind(4)),
        "repr": lambda: repr(kind(4)).partition(" at ")[0],
        "equal": lambda: (kind(4) == kind(4), kind(4) == kind(5), kind(4) == kind(14)),
        "hashable": lambda: isinstance(kind(4), Hashable),
        "hash": lambda: len({kind(4), kind(4)}),
        "less": lambda: kind(4) < kind(5),
        "setting": setting,
        "deleting": deleting,
        "replaced": lambda: vars(dataclasses.replace(kind(4), x=6)),
        "copied": lambda: vars(copy.deepcopy(kind(4))),
        "wrong call": kind,
        "text": lambda: kind.__doc__,
        "default": lambda: getattr(kind, "names", None),
    }


def answer(question: Callable[[], object]) -> str:
    """Return the answer to a question, or its error, as text."""
    try:
        return str(question())
    except Exception as error:  # errors of any type are compared
        return f"{type(error).__name__}: {error}"


@pytest.mark.parametrize(
    "options",
    [{}, {"frozen": True}, {"frozen": True, "eq": False}, {"repr": False}, {"eq": False}, {"kw_only": True}],
    ids=str,
)
@pytest.mark.parametrize("made", [plain, derived, with_own_constructor, with_own_equality])
def test_each_first_question_has_the_answer_of_the_standard_library(
    made: Callable[..., type], options: dict[str, Any]
) -> None:
    for name in facts(int):
        own, expected = (
            facts(made(decorator, **options))[name] for decorator in (data.dataclass, dataclasses.dataclass)
        )
        assert answer(own) == answer(expected), name
        assert answer(own) == answer(expected), f"{name}, asked again"


CALLS: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "by position": ((1, ("a",), {"b": 2}, 4), {}),
    "by name": ((), {"hidden": 5, "x": 1}),
    "both": ((1, ("a",)), {"more": {"c": 1}}),
    "defaults": ((1,), {}),
    "missing": ((), {"names": ("a",)}),
    "twice": ((1,), {"x": 2}),
    "unknown": ((1,), {"z": 2}),
    "too many": ((1, (), {}, 3, 4, 5), {}),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("made", [plain, derived, with_own_constructor])
@pytest.mark.parametrize("frozen", [True, False])
def test_instances_before_and_after_the_compilation_of_a_constructor_are_equal(
    made: Callable[..., type], frozen: bool, call: str
) -> None:
    values, named = CALLS[call]

    def asked(kind: Any) -> str:
        return answer(lambda: list(vars(kind(*values, **named)).items()))

    own, expected = (made(decorator, frozen=frozen) for decorator in (data.dataclass, dataclasses.dataclass))
    first = asked(own)
    dataclasses.fields(own)
    assert first == asked(own) == asked(expected)


def test_a_class_with_many_instances_gets_its_constructor_and_one_with_few_does_not() -> None:
    kind: Any = plain(data.dataclass, frozen=True)
    made = [kind(number) for number in range(data._MOST_FILLED)]
    assert isinstance(vars(kind)["__init__"], data._DeferredAttribute)
    made.append(kind(data._MOST_FILLED))
    assert not isinstance(vars(kind)["__init__"], data._DeferredAttribute)
    assert [item.x for item in made] == list(range(data._MOST_FILLED + 1))
    assert made[0].more is not made[1].more


def test_a_fault_in_a_class_is_an_error_at_its_first_instance() -> None:
    @data.dataclass
    class Unordered:
        x: int = 1
        y: int  # type: ignore[misc]  # the fault

    @data.dataclass
    class Shared:
        x: list[int] = []  # noqa: RUF012  # the fault

    with pytest.raises(TypeError, match="non-default argument 'y' follows default argument"):
        Unordered(1, 2)
    with pytest.raises(ValueError, match="mutable default"):
        Shared()


@data.dataclass(frozen=True)
class Sent:
    """Point of a module, so that it can be pickled."""

    x: int
    inner: tuple[Sent, ...] = ()


def test_a_pickle_is_read_without_compiling_methods() -> None:
    sent = pickle.dumps(Sent(1, (Sent(2),)))
    program = (
        "import pickle\nfrom eomgen.base.data import _DeferredAttribute\nfrom tests.test_dataclasses import Sent\n"
        f"item = pickle.loads({sent!r})\n"
        "print(item.inner[0].x, isinstance(vars(Sent)['__init__'], _DeferredAttribute))"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["2", "True"]


@pytest.fixture
def frequent_switches() -> Iterator[None]:
    """Let threads take turns after each few operations."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("frequent_switches")
def test_threads_that_ask_at_once_get_whole_classes() -> None:
    """One thread compiles; the others never meet a class without a constructor, or with another equality."""
    for _ in range(60):
        kind, start = plain(data.dataclass, frozen=True), Barrier(4)
        seen: set[str] = set()

        def ask(kind: Any = kind, start: Barrier = start, seen: set[str] = seen) -> None:
            start.wait()
            try:
                first = kind(4, more={})
                seen.add(repr(first) if first == kind(4) else "not equal")
            except TypeError as error:
                seen.add(str(error))

        threads = [Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert seen == {repr(kind(4))}


def test_all_classes_of_data_can_be_compiled() -> None:
    """A fault in a class, as a field without a default behind one with it, is met here and not at its import."""
    kinds = {
        value
        for name, module in sorted(sys.modules.items())
        if name.startswith("eomgen.")
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__.startswith("eomgen.") and dataclasses.is_dataclass(value)
    }
    assert len(kinds) > 100
    for kind in kinds:
        assert all(isinstance(item, dataclasses.Field) for item in dataclasses.fields(kind))
        assert not any(isinstance(value, data._DeferredAttribute) for value in vars(kind).values())
