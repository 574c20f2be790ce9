"""Fields of records at samples: one compiled pass keeps what sample after sample gives; kept values need no more."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import evolvent
from evolvent import results
from evolvent.analysis.runs import solve
from evolvent.equations.sampling import evaluate
from evolvent.model import RESULTS
from evolvent.results.observe.view import View
from evolvent.results.variables import get

CASES = {"solar-array": 3.0, "boom-slew": 0.5, "spinning-tether": 2.0}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_fields_are_those_of_the_samples_one_by_one(case: str) -> None:
    system = evolvent.load(case)
    solution, _, _ = solve(system.assemble(), until=CASES[case], every=CASES[case] / 20)
    view = View(solution)
    la = np.ascontiguousarray(solution.la) if view.model.joints.size else np.zeros((view.t.size, 0))
    found, model = view.fields, solution.model.copy()
    for k in range(view.t.size):
        evaluate(k, view.t, view.y[k], np.ascontiguousarray(view.s[k]), la[k], 1.0, model)
        for family, fields in RESULTS.items():
            kept = solution.forces.get(family, {}) if solution.kept is not None else {}
            for field in fields:
                rows = getattr(model, family)[field]
                assert found[family][field].shape == (view.t.size, *rows.shape)
                if field not in kept and (family, field) != ("contact_points", "force"):
                    assert np.asarray(rows).tobytes() == found[family][field][k].tobytes(), (family, field)


@pytest.mark.slow
def test_fields_of_some_families_are_those_of_all() -> None:
    """What is not among them is evaluated all the same where it is asked for."""
    solution, _, _ = solve(evolvent.load("solar-array").assemble(), until=1.0, every=0.1)
    whole, some = View(solution), View(solution, families={"coordinates"})
    for family in ("coordinates", "joints", "bodies"):
        assert some.fields[family].keys() == whole.fields[family].keys()
        for field, values in whole.fields[family].items():
            assert some.fields[family][field].tobytes() == values.tobytes(), (family, field)


@pytest.mark.slow
def test_reactions_do_not_depend_on_which_samples_there_are() -> None:
    settings: dict[str, Any] = {"until": 3.0, "every": 0.3}
    system = evolvent.load("solar-array")
    fine, coarse = (results.regular(system.simulate(fine=fine, **settings)) for fine in (True, False))
    for name in ("pivot 1.force", "pivot 2.moment"):
        np.testing.assert_array_equal(get(fine, name).values, get(coarse, name).values, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "names"),
    [
        ("solar-array", ["pivot 1.force.last", "pivot 2.moment.z.max", "hinge 1.torque.min", "panel 3.rate"]),
        ("solar-array", ["pivot 1.angle.last", "energy.last"]),
        ("boom-slew", ["boom.tip.position.x.last", "boom.curvature.max", "boom.bending_moment_z.abs_max"]),
        ("boom-slew", ["clamp.force.last", "boom.root.curvature.first"]),
    ],
)
def test_kept_values_are_those_of_the_tree(case: str, names: list[str]) -> None:
    """Of beams and of reactions too, which are evaluated at the samples that the values need."""
    settings: dict[str, Any] = {"until": CASES[case], "every": CASES[case] / 10}
    found = evolvent.load(case).simulate(keep=names, **settings)
    run = results.regular(evolvent.load(case).simulate(**settings))
    assert list(found) == names
    for name in names:
        variable, _, reduction = name.rpartition(".")
        plain = name if reduction == "rate" else variable
        values = get(run, plain).transpose("time", ...).values
        expected = {
            "last": lambda v: v[-1], "first": lambda v: v[0], "max": lambda v: np.fmax.reduce(v, axis=0),
            "min": lambda v: np.fmin.reduce(v, axis=0), "abs_max": lambda v: np.fmax.reduce(np.abs(v), axis=0),
            "rate": lambda v: v,
        }[reduction](values)  # fmt: skip
        np.testing.assert_array_equal(found[name], expected, err_msg=name)


@pytest.mark.slow
def test_runs_of_a_system_share_its_structure_until_a_part_changes() -> None:
    system, keep = evolvent.load("solar-array"), ["hinge 1.angle.last"]
    first = system.simulate(until=1.0, keep=keep)
    assert dict(system.simulate(until=1.0, keep=keep)) == dict(first)
    spring: Any = system.parts["hinge 1"]
    system.replace("hinge 1", spring.model_copy(update={"stiffness": 0.5}))
    changed = system.simulate(until=1.0, keep=keep)
    system.replace("hinge 1", spring)
    assert dict(system.simulate(until=1.0, keep=keep)) == dict(first)
    assert changed["hinge 1.angle.last"] < first["hinge 1.angle.last"]
    system.assemble().model.joints["stiffness"] = 1.0  # of the caller's own
    assert dict(system.simulate(until=1.0, keep=keep)) == dict(first)
