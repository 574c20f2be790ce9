"""A step 1 % above the stability limit never ends as a success (issue 2; thread.md: at 1.01 times, wrong results)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import evolvent
from evolvent import System, parts
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import solve
from evolvent_base.errors import InputError
from helpers import END, RHO, L, heliogyro


def paper(nodes: int = 20, out: float = 4.5) -> Assembly:
    """The paper's spring thread, c = 1e7, most of it out."""
    return heliogyro(nodes=nodes, segments="springs", stiffness=1e7, damping=1e-6, out=out, rate=1.0)


@pytest.mark.parametrize(("nodes", "limit"), [(20, 6.06e-6), (40, 4.29e-6)])
def test_stability_limit(nodes: int, limit: float) -> None:
    """RK4: step below 2.828 / (2 sqrt(c / m)): 6.06e-6 s at n = 20, 4.29e-6 s at n = 40 (thread.md)."""
    found = solve(paper(nodes), samples=[0.0, 1e-4], method="rk4").statistics["stability_limit"]
    assert 2.0 * math.sqrt(2.0) / (2.0 * math.sqrt(1e7 / (RHO * L / nodes))) == pytest.approx(limit, rel=1e-3)
    assert found == pytest.approx(limit, rel=2e-3)


@pytest.mark.parametrize("method", ["rk4", "heun"])
def test_unstable_step_is_refused(method: str) -> None:
    """1 % above the limit: refused before the run, with the limit in the sentence."""
    samples = [0.0, 0.5]
    limit = solve(paper(), samples=[*samples[:1], 0.001], method=method).statistics["stability_limit"]
    with pytest.raises(InputError, match="stability limit"):
        solve(paper(), samples=samples, method=method, step=1.01 * limit)


@pytest.mark.parametrize("out", [4.99, 4.5, 3.1])
def test_unstable_step_fails_where_it_is_taken(out: float) -> None:
    """Taken all the same, n = 20, c = 1e7: the energy balance stops the run within milliseconds, status 'failed'.

    At the limit itself the same run ends well.
    """
    limit = 2.0 * math.sqrt(2.0) / (2.0 * math.sqrt(1e7 / (RHO * L / 20)))
    failed = solve(paper(out=out), samples=np.linspace(0.0, 0.05, 6), method="rk4", step=1.01 * limit, unsafe_step=True)
    assert failed.status == "failed"
    assert "energy balance" in failed.message or "finite" in failed.message
    well = solve(paper(out=out), samples=[0.0, 0.05], method="rk4", step=limit, unsafe_step=True)
    assert well.status == "success"


@pytest.mark.slow
def test_unstable_step_over_the_whole_deployment() -> None:
    """From the all wound start, c = 1e4: the run goes well while few nodes are out, and fails by the end."""
    limit = 2.0 * math.sqrt(2.0) / (2.0 * math.sqrt(1e4 / (RHO * L / 20)))
    assembly = heliogyro(segments="springs", stiffness=1e4, damping=1e-6)
    failed = solve(assembly, samples=np.linspace(0.0, END, 101), method="rk4", step=1.01 * limit, unsafe_step=True)
    assert failed.status == "failed"
    assert 1 <= failed.t.size <= 101


@pytest.mark.parametrize("method", ["rk4", "heun", "dopri5"])
def test_damping_that_no_explicit_step_resolves_is_refused(method):
    """Of a damper c on a node of mass m the rate is about c/m: the bound of the step counts it."""
    with pytest.raises(InputError, match=r"stable with steps up to .* damping rate .*'blade"):
        evolvent.run("heliogyro", {"blade.damping": "1e9 N s/m", "solver.method": method})


def test_the_bound_of_the_step_counts_damping():
    """A mass on a damper alone: r = c/m, RK4 is stable up to 2.785/r."""
    system = System()
    system.add(parts.Point(mass=2.0, position=(1.0, 0.0, 0.0), velocity=(0.1, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", stiffness=0.0, damping=6.0, length=1.0))
    found = solve(
        system.assemble(), samples=[0.0, 1e4], method="rk4"
    )  # growth by a twentieth over all of it is allowed
    assert found.statistics["stability_limit"] == pytest.approx(2.7852935634 / 3.0, rel=1e-4)
    decayed = solve(system.assemble(), samples=[0.0, 1.0], method="rk4", step=0.01)
    assert decayed.y[-1, 3] == pytest.approx(0.1 * np.exp(-3.0), rel=1e-6)
