"""The whole table of families: under every solver each is right, or refused by name."""

from __future__ import annotations

import dataclasses
import functools
import json
import os
import pathlib
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numba import config

import evolvent
from evolvent import InputError
from evolvent.assembly import families, needs
from evolvent.compiled import jit
from evolvent.model.family import ENERGY, EVERY, EXPLICIT, IMPLICIT, MODES, SOLVERS, STATIC
from evolvent.model.registry import families as family_table
from evolvent.solvers import solve
from evolvent.solvers.modal.modes import Where, at_equilibrium, modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.methods import HHT, NAME
from evolvent.solvers.time.implicit.plan import solve_implicit
from families.case import CASES, Case
from families.plain import numbers, print_numbers
from families.rows import FAMILIES, Row, set_kinds

#: Ways to call the solvers: the solver's name in the table, and what motions may be off, of their size.
VARIANTS = {
    "rk4": (EXPLICIT, 1e-6),
    "dopri5": (EXPLICIT, 1e-6),
    "alpha-step": (IMPLICIT, 5e-4),
    "alpha-tolerance": (IMPLICIT, 1e-3),
    "hht-step": (IMPLICIT, 5e-4),
    "hht-tolerance": (IMPLICIT, 1e-3),
    "energy-step": (ENERGY, 5e-4),
    "energy-tolerance": (ENERGY, 1e-3),
    "static": (STATIC, 1e-6),
    "modes": (MODES, 1e-6),
}
#: Methods of variants whose messages name them.
METHODS = {"alpha-step": NAME, "alpha-tolerance": NAME, "hht-step": HHT, "hht-tolerance": HHT}
#: Variants whose steps are those of another with another method's coefficients, both of which faster tests hold.
LONG = ("hht-tolerance",)
CELLS = [
    pytest.param(row, name, id=f"{row.name}-{name}", marks=pytest.mark.release if name in LONG else ())
    for row in FAMILIES
    for name in VARIANTS
]


def solved(case: Case, variant: str) -> Any:
    """What a solver returns for a case."""
    assembly, samples = case.system().assemble(), case.times
    if variant == "rk4":
        return solve(assembly, samples=samples, method="rk4", step=case.step)
    if variant == "dopri5":
        return solve(assembly, samples=samples, method="dopri5")
    if variant in ("alpha-step", "hht-step"):
        method = METHODS[variant]
        return solve_implicit(assembly, samples=samples, method=method, step=case.end / 2000.0, spectral_radius=0.9)
    if variant in ("alpha-tolerance", "hht-tolerance"):
        return solve_implicit(assembly, samples=samples, method=METHODS[variant], tolerance=1e-7, spectral_radius=0.9)
    if variant == "energy-step":
        return solve_energy(assembly, samples=samples, step=case.end / 2000.0, spectral_radius=0.9)
    if variant == "energy-tolerance":
        return solve_energy(assembly, samples=samples, tolerance=1e-7, spectral_radius=0.9)
    if variant == "static":
        return solve_static(assembly, time=case.time, rotating=case.rotating)
    count = np.size(case.poles) if case.poles is not None else 1
    return modes(assembly, time=case.time, rotating=case.rotating, damped=case.damped, count=count)


#: Small functions that are called before a run.
BEFORE = {"move_along", "gear_geometry", "take_shape", "measure_nodes", "spread"}


@functools.cache
def reference(family: str) -> Any:
    """What RK4 returns for a case, at steps so small that Dormand-Prince's adaptive ones find the same."""
    return solved(CASES[family](), "rk4")


def check_motion(row: Row, case: Case, variant: str) -> None:
    """Hold a motion against its closed form, and against that of RK4."""
    allowed = VARIANTS[variant][1]
    solution = reference(row.name) if variant == "rk4" else solved(case, variant)
    assembly = solution.assembly
    assert solution.success, solution.message
    late = 1e-6 if VARIANTS[variant][0] == EXPLICIT else 0.05 * allowed  # of an event, by the error of the motion
    if VARIANTS[variant][0] == EXPLICIT:
        allowed = max(allowed, case.kink)
    assert solution.t[-1] == pytest.approx(case.end, abs=late)
    found, exact = case.seen(assembly, solution.y), case.motion(solution.t)
    size = (np.nanmax(exact, axis=0) - np.nanmin(exact, axis=0)).max()
    known = ~np.isnan(exact)
    assert known.sum() > 0.5 * known.size
    assert np.abs(found - exact)[known].max() < (case.theory + allowed) * size
    if EXPLICIT in row.solvers and variant != "rk4":
        by_rk4 = reference(row.name)
        other = case.seen(by_rk4.assembly, by_rk4.y)
        assert np.abs(found - other).max() < max(allowed, case.kink) * size


def check_equilibrium(case: Case) -> None:
    """Hold an equilibrium against its closed form."""
    solution, assembly = solved(case, "static"), case.system().assemble()
    assert solution.success, solution.message
    assert not solution.path.free
    seen = np.array([case.still, case.seen(assembly, assembly.y), *case.motion(case.times)])
    size = (np.nanmax(seen, axis=0) - np.nanmin(seen, axis=0)).max()
    assert np.abs(case.seen(assembly, solution.y[-1]) - case.still).max() < (case.theory + VARIANTS["static"][1]) * size


def check_poles(case: Case) -> None:
    """Hold the slowest modes against closed forms."""
    found, wanted = solved(case, "modes").pole, np.array(case.poles)
    order, exact = np.argsort(np.abs(found)), wanted[np.argsort(np.abs(wanted))]
    assert found[order] == pytest.approx(exact, rel=case.theory + VARIANTS["modes"][1])


@pytest.mark.slow
@pytest.mark.parametrize(("row", "variant"), CELLS)
def test_cell(row: Row, variant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case, solver = CASES[row.name](), VARIANTS[variant][0]
    needs.unload()
    if solver in row.solvers:
        if solver == STATIC:
            check_equilibrium(case)
        elif solver == MODES:
            check_poles(case)
        else:
            check_motion(row, case, variant)
        late = {function.__name__ for function in jit.loaded_late}
        assert late <= BEFORE, "loaded in the midst of a run"
        return
    called = METHODS.get(variant, SOLVERS[solver])
    with pytest.raises(InputError, match=f"{called} do(es)? not support"):
        solved(case, variant)
    # by its own name, whatever the families say that it needs
    kept = row.solvers
    able = {True: kept, False: EVERY}
    rows = [Row(one.records, dataclasses.replace(one.kind, solvers=able[one is row])) for one in FAMILIES]
    set_kinds(monkeypatch, rows)
    with pytest.raises(InputError) as refused:
        solved(case, variant)
    for words in (repr(case.part), row.name, called, row.advice):
        assert words in str(refused.value)


def test_every_row_has_a_case() -> None:
    assert sorted(CASES) == sorted(row.name for row in FAMILIES)
    for row in FAMILIES:
        assert np.any(row.mask(CASES[row.name]().system().assemble().model)), row.name
        assert row.solvers <= set(SOLVERS)


def test_every_family_of_records_has_a_row() -> None:
    every = family_table()
    assert {row.records for row in FAMILIES} == {name for name, family in every.items() if not family.of}
    assert {family.of for family in every.values()} - {""} <= set(every)


@pytest.mark.slow
@pytest.mark.parametrize("row", FAMILIES, ids=lambda row: row.name)
def test_what_no_row_covers_is_refused(row: Row, monkeypatch: pytest.MonkeyPatch) -> None:
    set_kinds(monkeypatch, [other for other in FAMILIES if other is not row], solvers=EVERY)
    case = CASES[row.name]()
    part = "ground" if row.name == "a driven body" else case.part  # which is one
    for solver, name in SOLVERS.items():
        with pytest.raises(InputError) as refused:
            families.check(case.system().assemble(), solver)
        alone, several = f"{part!r} is one of the {row.records}, which {name} ", f"{name} .*{part!r}.* [(]one of the"
        assert re.match(f"{alone}|{several} {row.records}", str(refused.value))


@pytest.mark.slow
@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")
def test_without_compilation() -> None:
    """Rates, residuals, energies and a step or two of every case are the same in plain Python."""
    paths = [pathlib.Path(evolvent.__file__).parents[1], pathlib.Path(__file__).parents[1]]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths)), "NUMBA_DISABLE_JIT": "1"}
    script = f"from {print_numbers.__module__} import print_numbers; print_numbers()"
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    plain = json.loads(done.stdout.splitlines()[-1])
    for row in FAMILIES:
        compiled = numbers(row.name)
        assert compiled.keys() == plain[row.name].keys()
        for key, values in compiled.items():
            assert np.all(np.isfinite(values)), (row.name, key)
            size = np.abs(values).max()
            assert plain[row.name][key] == pytest.approx(values, rel=1e-9, abs=1e-9 * size), (row.name, key)


STILL = [row.name for row in FAMILIES if CASES[row.name]().still is not None and {STATIC, MODES} <= row.solvers]


@pytest.mark.slow
@pytest.mark.parametrize("name", STILL)
def test_a_stiffness_that_the_table_calls_symmetric_is(name: str) -> None:
    """K at the equilibrium of every case; multipliers of gears and angles about loaded axes included."""
    case = CASES[name]()
    where = Where(None, None, case.time, case.rotating, None)
    assembly, _, _, (_, _, K, _) = at_equilibrium(case.system().assemble(), where, damped=False)
    if families.has_symmetric_stiffness(assembly.model):
        assert abs(K - K.T).max() <= 1e-9 * abs(K).max()
