"""Keys of many copies that are evaluated together: columns of numbers, and the bits of single runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from evolvent import System, elements, parts
from evolvent.analysis.varied_numbers import VariedNumbers
from evolvent.assembly.builder import Builder
from evolvent_base import dense
from evolvent_base.columns import Column, UndecidedError, columns_of, each, has_columns, stacked
from evolvent_base.errors import InputError

COUNT = 5
IMPLICIT = {"method": "generalized-alpha", "step": 1e-3}
SPREAD = np.linspace(0.9, 1.15, COUNT)


def rod(section: Any = None) -> System:
    """A rod that hangs on a joint beside a body, with a spring between them."""
    system = System(gravity=(0.0, -9.81, 0.0))
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0)
    section = elements.Circle(radius=0.01) if section is None else section
    system.add(parts.Rod(length=1.0, section=section, material=material, elements=3), "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(1.0, -1.0, 0.0)), "body")
    system.add(parts.Spring(a="body", b="rod.tip", stiffness=10.0, length=0.5), "spring")
    return system


KEYS = {
    "rod.material.density": 7200.0,
    "body.mass": 2.0,
    "rod.material.young_modulus": 2e7,
    "spring.length": 0.5,
    "rod.section.circle.radius": 0.01,
    "spring.stiffness": 10.0,
}


def check_blocks(batch: Any, system: System, values: dict[str, np.ndarray], method: dict[str, Any]) -> None:
    """Refuse copies whose models and workspaces are not, bit by bit, those of single runs.

    Models of explicit methods hold what their plan has left in scratch; the states that follow are compared.
    """
    explicit = method["method"] == "rk4"
    if explicit:
        batch.run()
    for k in range(batch.count):
        one = system.with_values({key: float(own[k]) for key, own in values.items()}).batch(1, workers=1, **method)
        if explicit:
            one.run()
            assert batch.states[k].tobytes() == one.states[0].tobytes(), k
            continue
        alone = one._copies
        for path in alone.memory.places:
            own = batch._copies.memory.values(batch._copies.blocks, *path)[k]
            assert own.tobytes() == alone.memory.values(alone.blocks, *path)[0].tobytes(), (k, path)


@pytest.mark.parametrize(
    "method",
    [{"method": "generalized-alpha", "step": 1e-3}, {"method": "rk4", "step": 5e-5}, {"method": "rk4"}],
    ids=["implicit", "explicit", "its own step"],
)
def test_copies_are_bit_by_bit_those_of_single_runs(method: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """One key after another, all of them evaluated together."""
    system, method, seen = rod(), {"until": 0.01, **method}, list[bool]()
    before = VariedNumbers.together

    def together(self: VariedNumbers, points: Any, alone: Any) -> Any:
        found = before(self, points, alone)
        if points and points[0]:
            seen.append(found is not None)
        return found

    monkeypatch.setattr(VariedNumbers, "together", together)
    batch, values = system.batch(COUNT, workers=1, **method), dict[str, np.ndarray]()
    for n, (key, value) in enumerate(KEYS.items()):
        values[key] = value * np.roll(SPREAD, n)
        batch.expand(key, values[key])
        if n % 2:
            check_blocks(batch, system, values, method)
    assert seen
    assert all(seen)
    batch.expand("rod.material.density", [7100.0, 7300.0], [1, 3])  # one by one
    values["rod.material.density"][[1, 3]] = 7100.0, 7300.0
    check_blocks(batch, system, values, method)
    values["rod.material.density"] = 7200.0 * SPREAD
    batch.expand("rod.material.density", values["rod.material.density"])
    check_blocks(batch, system, values, method)
    batch.close()


@pytest.mark.parametrize("key", ["rod.section.rectangle.width", "rod.section.rectangle.thickness"])
def test_a_side_that_is_once_the_shorter_one(key: str) -> None:
    """Of a rectangle that is nominally a square."""
    system, method = rod(elements.Rectangle(width=0.02, thickness=0.02)), dict[str, Any](IMPLICIT)
    batch = system.batch(COUNT, workers=1, **method)
    batch.expand(key, 0.02 * SPREAD)
    check_blocks(batch, system, {key: 0.02 * SPREAD}, method)
    batch.close()


@pytest.mark.parametrize("hidden", ["comparison", "float"])
def test_a_part_that_does_something_else_between_two_values(monkeypatch: pytest.MonkeyPatch, hidden: str) -> None:
    """Whose copies are evaluated one by one then."""
    before = parts.Rod.write

    def write(self: Any, builder: Builder, name: str) -> None:
        density = self.material.density
        within = 7000.0 < density < 7300.0 if hidden == "comparison" else abs(float(density) - 7200.0) < 200.0
        other = self.material.model_copy(update={"young_modulus": 2.2e7})
        before(self.model_copy(update={"material": other}) if within else self, builder, name)

    monkeypatch.setattr(parts.Rod, "write", write)
    system, method = rod(), dict[str, Any](IMPLICIT)
    batch, values = system.batch(COUNT, workers=1, **method), {"rod.material.density": 7200.0 * SPREAD}
    batch.expand("rod.material.density", values["rod.material.density"])
    check_blocks(batch, system, values, method)
    batch.close()


def test_a_value_that_its_part_refuses_is_named() -> None:
    """With the number of the copy, whatever the others are."""
    batch = rod().batch(COUNT, method="generalized-alpha", step=1e-3, workers=1)
    with pytest.raises(InputError, match=r"copy 2: .*density"):
        batch.expand("rod.material.density", [7000.0, 7100.0, -1.0, 7300.0, 7400.0])
    batch.close()


def test_columns_have_the_bits_of_their_numbers() -> None:
    """In arithmetic, products, inverses and lengths."""
    rng = np.random.default_rng(1)
    a = rng.standard_normal((7, 6, 6))
    a = a @ np.swapaxes(a, 1, 2) + 6.0 * np.eye(6)
    B, v, x = rng.standard_normal((6, 6)), rng.standard_normal(6), rng.random(7) + 0.5
    A, X = columns_of(a), Column(x)
    assert has_columns(A)
    for k in range(7):
        assert np.array_equal(stacked(dense.product(B.T, A, B))[k], dense.product(B.T, a[k], B))
        assert np.array_equal(stacked(dense.product(A, v))[k], dense.product(a[k], v))
        assert np.array_equal(stacked(dense.inverse(A))[k], dense.inverse(a[k]))
        assert stacked(dense.norm(A[0]))[k] == dense.norm(a[k, 0])
        one = float(x[k])
        assert stacked(3.0 / X**3 - 2.0 * X + each(math.tanh, X) * X.sqrt())[k] == (
            3.0 / one**3 - 2.0 * one + math.tanh(one) * math.sqrt(one)
        )


def test_a_column_answers_what_is_so_for_all_of_its_values() -> None:
    """And nothing else."""
    column = Column(np.array([1.0, 2.0, 3.0]))
    assert column > 0.5
    assert not column < 1.0
    assert column != 4.0
    number: Any = column
    for act in (lambda: number > 2.0, lambda: number == 2.0, lambda: float(number), lambda: 1.0 / (number - 2.0)):
        with pytest.raises(UndecidedError):
            act()
    with pytest.raises(UndecidedError):
        np.array([column, 1.0], dtype=float)
    with pytest.raises(UndecidedError):
        math.sin(number)
