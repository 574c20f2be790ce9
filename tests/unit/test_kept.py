"""What is kept of a simulation: the values of its tree, and the same sentences for names that are not there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from evolvent import InputError, System, parts, results
from evolvent.results.kept import REDUCTIONS, is_local, split, stored_name, unit_of
from evolvent.results.variables import get


@pytest.fixture(scope="module")
def system() -> System:
    """A mass on a spring, a stone that is pushed, and a turning wheel."""
    found = System(gravity=(0.0, 0.0, -10.0), settings={"until": 0.5, "every": 0.01, "method": "dopri5"})
    found.add(parts.Point(mass=2.0, position=(0.1, 0.0, 0.0)), "bob")
    found.add(parts.Spring(a=(0.0, 0.0, 0.0), b="bob", stiffness=80.0, damping=0.1, length=0.1), "spring")
    found.add(parts.Point(mass=1.0, velocity=(1.0, 0.0, 0.0)), "stone")
    found.add(parts.Load(at="stone", direction=(0.0, 1.0, 0.0), profile=[[0.0, 0.0], [1.0, 2.0]]), "push")
    found.add(parts.RigidBody(motion="spin", inertia=0.1, rate=3.0), "wheel")
    return found


NAMES = ("bob.position", "bob.position.z", "spring.force", "spring[1].ends.x", "stone.velocity", "wheel.angle",
         "push.work", "energy_defect", "momentum.x", "push.force.y")  # fmt: skip


@pytest.fixture(scope="module")
def regular(system: System) -> Any:
    return results.regular(system.simulate())


@pytest.mark.slow
@pytest.mark.parametrize("reduction", ["", *REDUCTIONS])
@pytest.mark.parametrize("name", NAMES)
def test_values_are_those_of_the_tree(system: System, regular: Any, name: str, reduction: str) -> None:
    wanted = f"{name}.{reduction}" if reduction else name
    found, whole = system.simulate(keep=[wanted]), get(regular, name)
    values = whole.transpose("time", ...).values
    expected = REDUCTIONS[reduction](values, whole.time.values) if reduction else whole.values
    np.testing.assert_array_equal(found[wanted], expected)
    assert found.units(wanted) == unit_of(whole.attrs["units"], reduction)
    assert found.attrs["status"] == "success"


def test_values_at_a_time_and_integrals_are_their_closed_forms(system: System) -> None:
    """A wheel turns by 3 rad/s; a stone that a force of 2 t pushes from rest goes by t^3/3 across."""
    names = ["wheel.angle.at(0.255 s)", "wheel.rate.z.integral", "stone.position.y.at(250 ms)",
             "stone.velocity.y.integral", "stone.position.at(0.5)", "push.force.y.integral"]  # fmt: skip
    found = system.simulate(keep=names)
    assert found[names[0]] == pytest.approx(0.765, rel=1e-9)
    assert found[names[1]] == pytest.approx(1.5, rel=1e-9)
    assert found[names[2]] == pytest.approx(0.25**3 / 3.0, rel=1e-6)
    assert found[names[3]] == pytest.approx(0.5**3 / 3.0, rel=1e-3)  # trapezoids of 0.01 s
    np.testing.assert_allclose(found[names[4]][:2], [0.5, 0.5**3 / 3.0], rtol=1e-6)
    assert found[names[5]] == pytest.approx(0.25, rel=1e-9)
    assert [found.units(name) for name in names] == ["rad", "rad", "m", "m", "m", "N s"]
    assert found.variables[names[0]].attrs["long_name"].endswith(", at(0.255 s)")


def test_trapezoids_converge_with_the_second_order(system: System) -> None:
    exact, errors = 0.5**3 / 3.0, []
    for every in (0.05, 0.025):
        found = system.simulate(keep=["stone.velocity.y.integral", "stone.velocity.y.at(0.0875 s)"], every=every)
        errors.append((found["stone.velocity.y.integral"] - exact, found["stone.velocity.y.at(0.0875 s)"] - 0.0875**2))
    np.testing.assert_allclose(errors[0][0] / errors[1][0], 4.0, rtol=1e-3)
    np.testing.assert_allclose(errors[1][1], 0.0125**2, rtol=1e-3)  # of a straight line, in the middle


@pytest.mark.parametrize(
    ("unit", "integral"),
    [("1", "s"), ("rad s-1", "rad"), ("m s-2", "m s-1"), ("N m", "N m s"), ("s", "s2"), ("kg m2 s-1", "kg m2"),
     ("s-1", "1")],
)  # fmt: skip
def test_units_of_integrals(unit: str, integral: str) -> None:
    assert unit_of(unit, "integral") == integral
    assert unit_of(unit, "max") == unit


def test_names_with_a_time_are_split_and_stored() -> None:
    assert split("tip mass.position.x.at(2.5 s)") == ("tip mass.position.x", "at(2.5 s)")
    assert stored_name("tip mass.position.x.at(2.5 s)") == "tip_mass_position_x_at_2_5_s"
    assert split("hub.rate.z.integral") == ("hub.rate.z", "integral")
    assert split("hub.rate.z.at") == ("hub.rate.z.at", "")


def test_numbers_of_the_run_and_several_names(system: System) -> None:
    found = system.simulate(keep=["steps", "bob.position.last", "bob.position.z.min"])
    assert list(found) == ["steps", "bob.position.last", "bob.position.z.min"]
    assert found["steps"] == found.attrs["statistics"]["steps"]
    assert isinstance(found["bob.position.z.min"], float)
    assert found["bob.position.last"].shape == (3,)
    assert is_local(system.assemble(), ["bob.position.last", "spring.force.max"])
    assert not is_local(system.assemble(), ["push.work.last"])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("spring.forc.max", "keep holds 'spring.forc.max'; no variable is called 'spring.forc'; did you mean"),
        ("spring.force.mx", "keep holds 'spring.force.mx'; after the variable, did you mean 'max'?"),
        ("spring.force.integra", "keep holds 'spring.force.integra'; after the variable, did you mean 'integral'?"),
        ("spring.force.at(3 kg)", "keep holds 'spring.force.at(3 kg)'; at(3 kg) must hold a time, such as at(2.5 s)"),
        (
            "spring.force.at(9 s)",
            "keep holds 'spring.force.at(9 s)'; at(9 s) is outside the run",
        ),
        ("spring.force.at(-1 s)", "keep holds 'spring.force.at(-1 s)'; at(-1 s) is outside the run"),
        ("spring", "keep holds 'spring'; 'spring' is a part; give one of its variables: "),
        ("bob.position.q.last", "keep holds 'bob.position.q.last'; 'bob.position.q': the variable has no"),
        ("step_s", "keep holds 'step_s', which no run has; did you mean 'steps'?"),
    ],
)
def test_names_that_are_not_there(system: System, name: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        system.simulate(keep=[name])
    assert str(refused.value).startswith(sentence)
    with pytest.raises(InputError, match="it must be a list of variables"):
        system.simulate(keep="bob.position.last")


def test_other_values_give_the_same_bits_as_other_parts(system: System) -> None:
    keep = ["spring.force.max", "bob.position.z.min", "push.work.last", "stone.position.y.last"]
    values = {"spring.stiffness": "0.1 N/mm", "parts.bob.mass": 2.5, "push.profile.table.1.1": "3 N", "gravity.2": -9.0}
    varied: Any = system.with_values(values)
    built = System(gravity=(0.0, 0.0, -9.0), settings=system.settings)
    for name, part in varied.parts.items():
        built.add(part, name)
    assert varied.parts["spring"].stiffness == 100.0
    assert dict(varied.simulate(keep=keep)) == dict(built.simulate(keep=keep))
    assert system.to_yaml().count("mass: 2.0 kg") == 1


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"sprin.stiffness": 1.0}, "cannot set 'sprin.stiffness': no part is called 'sprin'; did you mean 'spring'?"),
        ({"spring.stifness": 1.0}, "unknown key 'parts.spring.stifness'; did you mean"),
        ({"spring.stiffness": "1 kg"}, "parts.spring.stiffness is '1 kg'"),
        ({"simulate.untill": 1.0}, "unknown key 'simulate.untill'; did you mean"),
    ],
)
def test_keys_that_are_not_there(system: System, values: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        system.with_values(values)
    assert str(refused.value).startswith(sentence)
