"""Systems with other values: assembled from one that is there, they are what building them gives, to the last bit."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import InputError, System, cases, parts
from evolvent.assembly.assembled import Assembly
from evolvent_base.schema import Section
from families import plain  # noqa: F401  (it enters the cases)
from families.case import CASES

#: Most keys that are varied of one system, evenly spaced; of a built-in structure; in the longer variant of the test.
MOST, FEW, MANY = 12, 1, 60
#: Systems whose keys are varied: one for each family, and the built-in structures.
SYSTEMS = [*CASES, *(name for name in cases.built_in() if cases.content_of(name)["system"] == "structure")]


def numbers(value: Any, key: str) -> Iterator[tuple[str, float]]:
    """Keys of numbers that are not zero in a value of a part."""
    if isinstance(value, Section):
        for name in value.model_fields_set:
            yield from numbers(getattr(value, name), f"{key}.{name}")
    elif isinstance(value, tuple):
        for k, one in enumerate(value):
            yield from numbers(one, f"{key}.{k}")
    elif isinstance(value, float) and value != 0.0 and np.isfinite(value):
        yield key, value


def arrays(assembly: Assembly) -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of a model and of its start, by name."""
    yield "y", assembly.y
    yield "s", assembly.s
    for name, value in assembly.model._asdict().items():
        rows = np.asarray(value)
        for field in rows.dtype.names or ():
            yield f"{name}.{field}", np.ascontiguousarray(rows[field])
        if rows.dtype.names is None and name != "addresses":
            yield name, rows


def outcome(system: System) -> Assembly | str:
    """The assembly of a system, or why it is refused."""
    try:
        return system.assemble()
    except InputError as error:
        return str(error)


def rebuilt(system: System) -> System:
    """A system of the same parts and storage, put together part by part."""
    found = System(gravity=system._gravity.tolist(), sections=system.sections)
    for name, part in system.parts.items():
        found.add(part, name)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("most", [MOST, pytest.param(MANY, marks=pytest.mark.release)])
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_number_may_vary(name: str, most: int) -> None:
    system = CASES[name]().system() if name in CASES else evolvent.load(name)
    first = dict(arrays(system.with_values({}).assemble()))  # the one that is there
    keys = [found for part in system.parts for found in numbers(system.parts[part], part)]
    if name not in CASES and most == MOST:  # families have all parts of the structures
        most = FEW
    for key, value in keys[:: 1 + len(keys) // most]:
        for factor in (1.01, -1.0):
            try:
                varied = system.with_values({key: factor * value})
            except InputError:  # beside the parts' schema there is nothing to compare
                continue
            fast, whole = outcome(varied), outcome(rebuilt(varied))
            if isinstance(whole, str) or isinstance(fast, str):
                assert fast == whole
                continue
            assert fast.names == whole.names
            assert fast.row_parts == whole.row_parts
            assert fast.laws.keys() == whole.laws.keys()
            assert fast.expressions.keys() == whole.expressions.keys()
            assert fast.parts == whole.parts
            for (field, a), (_, b) in zip(arrays(fast), arrays(whole), strict=True):
                assert a.tobytes() == b.tobytes(), f"{key} * {factor}: {field}"
                if fast.touched is not None and field.partition(".")[0] not in fast.touched:
                    assert a.tobytes() == first[field].tobytes(), f"{key} * {factor} touches {field}"


#: Keys whose values go into the model that is there, and keys that the whole assembly takes.
FAST = {
    "solar-array": ["hinge 1.stiffness", "hinge 2.damping", "hinge 3.rest", "hinge 1.latch_stiffness", "panel 1.mass",
                    "satellite.inertia.0"],
}  # fmt: skip
WHOLE = {"solar-array": ["hinge 3.start"]}


@pytest.mark.parametrize(
    ("name", "key", "counts"),
    [(name, key, (1, 1)) for name, keys in FAST.items() for key in keys]
    + [(name, key, (0, 2)) for name, keys in WHOLE.items() for key in keys],
)
def test_what_is_assembled_from_the_model_that_is_there(name: str, key: str, counts: tuple[int, int]) -> None:
    system = evolvent.load(name)
    first = system.with_values({})
    first.assemble()
    value = next(value for part in system.parts for found, value in numbers(system.parts[part], part) if found == key)
    outcome(system.with_values({key: 1.01 * value}))
    variants = first._variants
    assert variants is not None
    assert (variants.fast, variants.whole) == counts


@pytest.mark.parametrize(
    "values",
    [{"arm.material.young_modulus": 8e10}, {"arm.section.tube.radius": 0.021}, {"tip.mass": 0.3}, {"gravity.2": -9.7}],
    ids=str,
)
def test_a_rod_a_point_on_it_and_the_gravity_vary_in_the_model_that_is_there(values: dict[str, float]) -> None:
    """To the last bit, with the masses of rows of constraint that explicit methods solve for."""
    system = System(gravity=(0.0, 0.0, -9.81))
    tube = {"tube": {"radius": 0.02, "thickness": 0.001}}
    metal = {"young_modulus": 7e10, "poisson_ratio": 0.3, "density": 1600.0}
    system.add(parts.Rod(length=1.0, section=tube, material=metal, elements=3), "arm")
    system.add(parts.Point(mass=0.2, at="arm.tip"), "tip")
    first = system.with_values({})
    first.assemble()
    varied = system.with_values(values)
    found, whole = (dict(arrays(one.assemble())) for one in (varied, rebuilt(varied)))
    assert first._variants is not None
    assert (first._variants.fast, first._variants.whole) == (1, 1)
    for name, value in whole.items():
        assert found[name].tobytes() == value.tobytes(), name


def test_a_point_mass_varies_in_the_model_that_is_there() -> None:
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "stone")
    first = system.with_values({})
    first.assemble()
    heavier = system.with_values({"stone.mass": 2.0})
    found = heavier.assemble()
    assert first._variants is not None
    assert (first._variants.fast, first._variants.whole) == (1, 1)
    assert found.touched == frozenset({"points", "blocks", "G"})
    assert dict(arrays(found))["G"].tobytes() == dict(arrays(rebuilt(heavier).assemble()))["G"].tobytes()


def test_a_lighter_body_is_checked_against_its_spool() -> None:
    """A reel, which has no records, states an inertia that its body includes."""
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1)), "hub")
    system.add(parts.Reel(body="hub", radius=0.1, drive=parts.FreeSpool(inertia=0.01)), "reel")
    system.with_values({}).assemble()
    with pytest.raises(InputError, match=r"reel.drive.inertia is 0.01 kg m2; the inertia of 'hub' includes it"):
        system.with_values({"hub.inertia": (0.001, 0.001, 0.001)}).assemble()


def test_a_varied_system_goes_to_another_process_without_the_shared_model() -> None:
    """A system with a field, whose builder holds functions."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)), "stone")
    system.add(parts.Field(type="orbit", rate=0.01), "orbit")
    varied = system.with_values({"stone.mass": 2.0})
    varied.assemble()
    found = pickle.loads(pickle.dumps(varied))
    assert found.parts == varied.parts
    assert dict(arrays(found.assemble()))["y"].tobytes() == varied.assemble().y.tobytes()


def test_a_default_that_follows_from_all_masses_follows_a_variant() -> None:
    """The bristle of a bearing has a stiffness by the weight of all bodies."""
    system = System()
    for name, y in (("arm", 0.0), ("other", 3.0)):
        system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.2), position=(0.5, y, 0.0)), name)
    system.add(parts.Joint(type="revolute", a=(0.0, 0.0, 0.0), b=("arm", (-0.5, 0.0, 0.0))), "pivot")
    system.add(parts.Bearing(joint="pivot", coefficient=0.1, journal_radius=0.01), "bearing")
    system.with_values({}).assemble()
    heavier = system.with_values({"other.mass": 4.0})
    assert heavier.assemble().model.bearings["stick"] == rebuilt(heavier).assemble().model.bearings["stick"]
