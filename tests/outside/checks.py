"""The rotary damper, a family from outside, under every method, in margins, sensitivities, graph, samples, refusals.

`tests/families/test_outside_family.py` runs this module in a process in which its entry point is found.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import tie_case  # noqa: F401  (each family outside has a case)
from damper_case import DAMPING, case, wheels
from rotary_damper import RotaryDamper

import evolvent
import margin_cases
from evolvent import System, parts
from evolvent.assembly import families as table
from evolvent.equations.implicit import is_isolated
from evolvent.model.family import ENERGY, EVERY, IMPLICIT, Kind
from evolvent.model.registry import families
from evolvent.solvers.common.graph import pattern_of
from evolvent.view import show
from evolvent_base.errors import InputError
from families.rows import Row
from families.test_families import LONG, VARIANTS, check_equilibrium, check_motion, check_poles


@pytest.mark.parametrize("variant", [name for name in VARIANTS if name not in LONG])
def test_every_method_agrees_with_the_closed_form(variant: str) -> None:
    row = Row("rotary_dampers", families()["rotary_dampers"].kinds[0])
    if variant == "static":
        check_equilibrium(case())
    elif variant == "modes":
        check_poles(case())
    else:
        check_motion(row, case(), variant)


def pair(**given: Any) -> System:
    """Two free bodies that turn about different axes, with a damper between them."""
    found = System()
    shape: dict[str, Any] = {"mass": 1.0, "inertia": (0.5, 0.7, 0.9)}
    found.add(parts.RigidBody(**shape, angular_velocity=(0.3, -0.2, 0.9)), "a")
    found.add(parts.RigidBody(**shape, position=(1.0, 0.0, 0.0), angular_velocity=(-0.4, 0.5, 0.1)), "b")
    found.add(RotaryDamper(a="a", b=given.get("b", "b"), axis=(0.3, 0.5, 0.8), damping=0.3), "damper")
    return found


@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha", "energy-momentum"])
def test_momentum_and_energy_in_three_dimensions(method: str) -> None:
    run = pair().simulate(until=4.0, every=0.1, method=method, **({"step": 5e-3} if method != "dopri5" else {}))
    momentum, energy = run["angular_momentum"].values, run["energy_balance"].values if "energy_balance" in run else None
    assert np.ptp(momentum, axis=0).max() < 2e-6 * np.abs(momentum).max()
    taken = np.trapezoid(run["damper"]["dissipation"].values, run["time"].values)
    kinetic = run["energy_kinetic"].values
    assert kinetic[0] - kinetic[-1] == pytest.approx(taken, rel=2e-3)
    assert run["damper"]["torque"].attrs["units"] == "N m"
    assert energy is None or np.abs(energy).max() < 1e-4 * kinetic[0]


def test_what_follows_from_its_ends() -> None:
    """Isolation, graph of the matrix and refusals, without a line that names the family."""
    free, held = pair().assemble(), pair(b="ground").assemble()
    assert is_isolated(0.0, free.model)
    assert not is_isolated(0.0, held.model)
    apart = System()
    for name in "ab":
        apart.add(parts.RigidBody(mass=1.0, inertia=(0.5, 0.7, 0.9)), name)
    assert len(pattern_of(free.model).pairs) == len(pattern_of(apart.assemble().model).pairs) + 1


def test_what_it_does_not_support_is_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    family = families()["rotary_dampers"]
    monkeypatch.setitem(family.__dict__, "kinds", (Kind("a rotary damper", EVERY - {ENERGY}, "use generalized-alpha"),))
    table.check(wheels().assemble(), IMPLICIT)
    with pytest.raises(InputError, match="'damper' is a rotary damper, which energy-momentum does not support; use"):
        table.check(wheels().assemble(), ENERGY)


def test_margins_count_its_torque() -> None:
    """A damper beside a hinge is that hinge with more damping."""
    beside, within = margin_cases.case(), margin_cases.case()
    beside["parts"]["damper"] = {"kind": "rotary-damper", "a": "ground", "b": "arm", "damping": 0.03}
    within["parts"]["hinge"]["damping"] += 0.03
    one, two = (evolvent.load(given).margin() for given in (beside, within))
    wanted = two.motion("hinge").margin("motorization")
    assert one.motion("hinge").margin("motorization") == pytest.approx(wanted, rel=1e-6)
    assert np.ptp(wanted) > 0.1


@pytest.mark.parametrize("mode", ["forward", "adjoint"])
def test_sensitivities(mode: str) -> None:
    value, key = "hinge 0.angle.last", "damper.damping"
    settings: dict[str, Any] = {"until": 1.0, "method": "generalized-alpha", "step": 5e-3}
    found = wheels().sensitivity(value, [key], mode=mode, fine=False, **settings).dataset
    ends = [wheels(damping=DAMPING + d).simulate(keep=[value], **settings)[value] for d in (-1e-4, 1e-4)]
    assert float(found.derivative[0, 0]) == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-5)


def test_it_is_drawn_as_the_symbol_that_it_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disc at the first body, across the axis, which is fixed to it."""
    run = pair().simulate(until=0.2, every=0.1)
    (disc,) = show.motion(run).symbols
    assert (disc.name, len(disc.solids)) == ("damper", 1)
    assert disc.origin == pytest.approx(run["a"].position.values)
    assert disc.solids[0].axis == pytest.approx(np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8]))
    assert RotaryDamper.group == "springs and resistances"
    monkeypatch.setattr(RotaryDamper, "symbol", "disk")
    with pytest.raises(InputError, match="the symbol of 'damper' is 'disk'; did you mean 'disc'"):
        show.motion(pair().simulate(until=0.2))


def test_a_case_file_takes_it(tmp_path: Any) -> None:
    (tmp_path / "case.yaml").write_text(
        "system: structure\n"
        "parts:\n"
        "  wheel: {kind: rigid-body, motion: spin, inertia: 0.4 kg m2}\n"
        "  damper: {kind: rotary-damper, a: ground, b: wheel, damping: 0.2 N m s/rad}\n"
    )
    assert "damper" in evolvent.load(tmp_path / "case.yaml").assemble().names
