"""One Solution of all solvers: energy and momentum balance, plans that run, models that are left as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import config
from numpy.testing import assert_allclose, assert_array_equal

from evolvent import elements, law, parts
from evolvent.analysis.system import System
from evolvent.assembly import needs
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import solve
from evolvent.solvers.common import balance as eb
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import loop as implicit_loop, plan as implicit
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.methods import ENERGY_MOMENTUM, METHODS, NAME
from evolvent.solvers.time.implicit.plan import solve_implicit
from evolvent_base.errors import InputError

SAMPLES = np.linspace(0.0, 0.5, 11)


def pair() -> Assembly:
    """Two free masses on a damped spring, with a drift and a turn."""
    system = System()
    system.add(parts.Point(mass=2.0, position=(0.0, 0.0, 0.0), velocity=(0.1, 0.4, 0.0)), "a")
    system.add(parts.Point(mass=1.0, position=(1.1, 0.0, 0.0), velocity=(0.0, -0.5, 0.3)), "b")
    system.add(parts.Spring(a="a", b="b", stiffness=50.0, damping=0.5, length=1.0), "spring")
    return system.assemble()


def hung_beam() -> Assembly:
    """A cable on a penalty hinge under gravity, with a load at its tip and a cylinder below."""
    system = System(gravity=(0.0, -9.81, 0.0))
    section, material = (
        elements.Rectangle(thickness=0.01, width=0.01),
        elements.Material(young_modulus=1e7, poisson_ratio=0.0, density=1000.0),
    )
    beam = parts.Beam(length=1.0, section=section, material=material, elements=6, formulation="cable", mass_damping=1.0)
    system.add(beam, "beam")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root", type="spherical", stiffness=1e5, damping=1.0), "pin")
    system.add(parts.Load(at="beam.tip", force=(0.0, 0.1, 0.0), ramp=0.2), "load")
    system.add(
        parts.Contact(a="beam", b=(0.5, -0.35, 0.0), shape=parts.Cylinder(radius=0.3), stiffness=1e4),
        "pole",
    )
    return system.assemble()


def data_of(assembly: Assembly) -> dict[str, Any]:
    """All arrays of a model."""
    return {name: np.array(value) for name, value in assembly.model._asdict().items()}


def explicit_run(assembly: Assembly) -> Any:
    return solve(assembly, samples=SAMPLES, method="rk4")


def implicit_run(assembly: Assembly) -> Any:
    return solve_implicit(assembly, samples=SAMPLES, tolerance=2e-8, spectral_radius=0.9)


@pytest.mark.parametrize("run", [explicit_run, implicit_run])
@pytest.mark.parametrize("build", [pair, hung_beam])
def test_energy_balances(run: Any, build: Any) -> None:
    """Energy less work plus losses stays at that of the start, and the statistics name its largest defect."""
    found = run(build())
    assert found.success, found.message
    rows, scale = found.balance, found.energy.max()
    assert_allclose(found.energy, rows.kinetic + rows.elastic + rows.coupled, rtol=1e-15)
    assert_allclose(eb.energy(rows) - eb.work(rows) + eb.dissipated(rows), eb.energy(rows)[0], atol=2e-3 * scale)
    assert_allclose(found.energy_defect, eb.defect(rows, eb.energy(rows)[0]), atol=1e-12 * scale)
    assert 0.0 <= found.statistics["energy_defect"] < 2e-3
    assert eb.dissipated(rows)[-1] > 1e-3 * scale


@pytest.mark.slow
@pytest.mark.parametrize("build", [pair, hung_beam])
def test_explicit_and_implicit_solutions_agree(build: Any) -> None:
    """States, every entry of the balance, wrenches and multipliers, by two independent methods.

    Over 0.25 s: the cable touches the pole from 0.1 s on, and what bounces there differs later on.
    """
    assembly, early = build(), SAMPLES <= 0.26
    one, two = explicit_run(assembly).chosen(early), implicit_run(assembly).chosen(early)
    scale = max(one.energy.max(), np.abs(eb.work(one.balance)).max())
    for name in eb.BALANCE.names or ():
        assert_allclose(one.balance[name], two.balance[name], atol=5e-3 * scale, err_msg=name)
    assert_allclose(one.y[:, : assembly.model.info.nq], two.y[:, : assembly.model.info.nq], atol=2e-3)
    assert_allclose(one.la, two.la, atol=0.05 * max(np.abs(two.la).max(initial=0.0), 1e-300))
    assert_allclose(one.wrenches, two.wrenches, atol=0.05 * max(np.abs(two.wrenches).max(initial=0.0), 1e-300))
    assert_allclose(
        one.forces["contact_surfaces"]["normal"],
        two.forces["contact_surfaces"]["normal"],
        atol=0.1 + 0.05 * two.forces["contact_surfaces"]["normal"].max(initial=0.0),
    )


@pytest.mark.parametrize("run", [explicit_run, implicit_run])
def test_momentum_of_a_free_pair(run: Any) -> None:
    """m v and x x m v of both masses, constant."""
    assembly = pair()
    found = run(assembly)
    x, v, m = found.y[:, :6].reshape(-1, 2, 3), found.y[:, 6:12].reshape(-1, 2, 3), np.array([2.0, 1.0])
    assert_allclose(found.momentum.linear, np.einsum("p,tpc->tc", m, v), atol=1e-14)
    # between the ends of implicit steps momenta lie on straight lines, states on cubics
    near = {"rtol": 2e-5, "atol": 1e-5} if run is implicit_run else {"atol": 1e-14}
    assert_allclose(found.momentum.angular, np.einsum("p,tpc->tc", m, np.cross(x, v)), **near)
    assert np.abs(found.momentum.drift_linear).max() < 1e-12
    assert np.abs(found.momentum.drift_angular[-1]).max() < 1e-6
    assert np.abs(found.momentum.drift_angular).max() < 1e-5  # between steps, too


def test_a_static_solution() -> None:
    """It has energies and a path, and no work over time."""
    found = solve_static(hung_beam(), time=1.0)
    assert found.success, found.message
    assert found.method == "static"
    assert found.path is not None
    assert found.path.factor[-1] == 1.0
    assert_array_equal(found.t, 1.0)
    assert np.all(found.balance.kinetic == 0.0)
    assert found.balance.elastic[-1] > 0.0
    assert np.all(np.isnan(found.energy_defect))


@pytest.mark.slow
def test_solvers_leave_the_model_as_it_is() -> None:
    """Every array of an assembled model has the same bits after each solver."""
    assembly = hung_beam()
    before = data_of(assembly)
    explicit_run(assembly)
    implicit_run(assembly)
    held = solve_static(assembly)
    modes(assembly, count=2, equilibrium=held)
    for name, values in data_of(assembly).items():
        assert values.tobytes() == before[name].tobytes(), name


@pytest.mark.parametrize("method", ["rk4", "dopri5", "generalized-alpha"])
def test_a_plan_runs_again_as_before(method: str) -> None:
    """The second run of a plan has the bits of the first."""
    assembly = hung_beam() if method != "dopri5" else pair()
    if method == "generalized-alpha":
        plan: Any = implicit.plan(assembly, samples=SAMPLES, step=1e-3)
    else:
        plan = explicit_plan.plan(assembly, samples=SAMPLES, method=method)
    first, second = plan.run(), plan.run()
    assert_array_equal(first.y, second.y)
    for name in ("steps", "rejected_steps", "events"):
        assert first.statistics[name] == second.statistics[name], name


def test_energy_momentum_takes_the_options_of_all_implicit_steps() -> None:
    """The longest step bounds the steps of an adaptive run."""
    found = solve_energy(pair(), samples=SAMPLES, tolerance=1e-2, longest_step=0.01)
    assert found.success, found.message
    assert found.statistics["steps"] >= 50
    with pytest.raises(InputError, match=r"^largest_gain is -1.0; it must be"):
        solve_energy(pair(), samples=SAMPLES, largest_gain=-1.0)


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")
@pytest.mark.parametrize(
    ("without", "own", "others"),
    [
        (
            METHODS[ENERGY_MOMENTUM].modules,
            "evolvent.solvers.time.implicit.alpha",
            "evolvent.solvers.time.implicit.energy_step",
        ),
        (METHODS[NAME].modules, "evolvent.solvers.time.implicit.energy_step", "evolvent.solvers.time.implicit.alpha"),
    ],
)
def test_a_run_needs_no_function_of_the_other_method(without: frozenset[str], own: str, others: str) -> None:
    model = hung_beam().model
    found = needs.needed(model, (implicit_loop.begin, implicit_loop.advance), needs.absent(model) | without)
    modules = {function.py_func.__module__ for function in found}
    assert own in modules
    assert others not in modules
    assert ("evolvent.equations.energy_momentum" in modules) == (own == "evolvent.solvers.time.implicit.energy_step")


def test_chosen_samples() -> None:
    """Some of the samples, of an explicit and of an implicit run."""
    for run in (explicit_run, implicit_run):
        whole = run(pair())
        part = whole.chosen([0, 5, 10])
        assert_array_equal(part.t, SAMPLES[[0, 5, 10]])
        assert_array_equal(part.y, whole.y[[0, 5, 10]])
        assert_allclose(part.energy, whole.energy[[0, 5, 10]], rtol=1e-14)


def test_modes_refuse_a_motion() -> None:
    """The equilibrium of modes is a static solution."""
    assembly = hung_beam()
    with pytest.raises(InputError, match="equilibrium is a motion by rk4; it must be a solution of solve_static"):
        modes(assembly, equilibrium=explicit_run(assembly))


@law
def linear(extension: float, rate: float, t: float, p: Any) -> float:
    """A spring of stiffness p[0]."""
    return p[0] * extension  # type: ignore[no-any-return]


def pulled() -> Assembly:
    """A body on a spring with a law."""
    system = System()
    system.add(parts.RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), motion="free", position=(1.5, 0.0, 0.0)), "body")
    for k, at in enumerate(((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (1.5, 2.0, 0.0), (1.5, 0.0, 2.0))):
        system.add(parts.Spring(a=at, b="body", length=1.0, law=linear, parameters=(5.0,)), f"spring {k}")
    return system.assemble()


def test_statics_with_a_law_leave_the_model_as_it_is() -> None:
    """A law is tried on a copy of the model, too."""
    assembly = pulled()
    before = data_of(assembly)
    solve_static(assembly)
    for name, values in data_of(assembly).items():
        assert values.tobytes() == before[name].tobytes(), name


def test_a_solution_without_samples() -> None:
    """Its start stands in for it; what was not computed is NaN."""
    for run in (explicit_run, implicit_run):
        none = run(pair()).chosen([])
        assert none.energy_defect.shape == (0,)
        assert none.momentum.drift_linear.shape == (0, 3)
        start = none.or_start(0.0)
        assert start.t.tolist() == [0.0]
        assert_array_equal(start.y[0], start.assembly.y)
        assert np.isnan(start.acceleration).all() == (start.kept is not None)


def test_an_interrupted_equilibrium_keeps_its_start() -> None:
    """Where nothing was reached yet."""

    def interrupt(factor: float) -> None:
        raise KeyboardInterrupt

    found = solve_static(hung_beam(), progress=interrupt)
    assert found.status == "interrupted"
    assert found.t.size == 1
    assert found.chosen([0]).path is not None


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda a: solve(a, samples=SAMPLES, step=0.0, unsafe_step=True), "step is 0.0"),
        (lambda a: solve_implicit(a, samples=SAMPLES, newton=-1.0), "newton is -1.0"),
        (lambda a: solve_implicit(a, samples=SAMPLES, longest_step=0.0), "longest_step is 0.0"),
        (lambda a: solve_implicit(a, samples=SAMPLES, largest_gain=float("nan")), "largest_gain is nan"),
        (lambda a: solve_static(a, most_steps=-3), "most_steps is -3; it must be a whole number from 1"),
        (lambda a: modes(a, equilibrium=solve_static(hung_beam()), time=1.0), "not both"),
    ],
)
def test_arguments_are_checked(call: Any, said: str) -> None:
    """By name, before anything is computed."""
    with pytest.raises(InputError, match=said):
        call(hung_beam())
