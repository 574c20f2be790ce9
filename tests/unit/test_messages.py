"""Messages name Python arguments to Python callers, and keys to the authors of case files."""

from __future__ import annotations

import contextlib
import io
import re

import numpy as np
import pytest

import evolvent
from evolvent import InputError, RunFailed, Stepper, System, law, parts
from evolvent.solvers import solve
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.static.static import solve_static
from evolvent.solvers.time.implicit.plan import solve_implicit
from evolvent_base.errors import in_keys, naming_keys

KEYS = {"step": "solver.step", "method": "solver.method"}


def oscillator(**load: object) -> System:
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.5, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, stiffness=100.0), "spring")
    return system


def test_arguments_become_keys():
    assert in_keys("step is 3.0; use a smaller `step`, or None", KEYS) == (
        "solver.step is 3.0; use a smaller solver.step, or auto"
    )
    assert in_keys("step is None, but", KEYS) == "solver.step is auto, but"
    assert in_keys("the step is long; give a `stiffness`", KEYS) == "the step is long; give a `stiffness`"
    assert in_keys("or None", {}) == "or None"
    with pytest.raises(RunFailed, match=r"^solver.method is 'x'") as failed, naming_keys(KEYS):
        raise RunFailed("method is 'x'", 5)
    assert failed.value.run == 5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"step": -1.0}, r"^step is -1.0; it must be a finite time above 0, or None$"),
        ({"step": "x"}, r"^step is 'x'; it must be a finite time"),
        ({"step": 1.0}, r"^step is 1 s, above the stability limit .* use a smaller one, or None$"),
        ({"method": "rk5"}, r"^method is 'rk5'; did you mean 'rk4'"),
        ({"method": 4}, r"^method is 4; "),
        ({"method": "dopri5", "rtol": "tight"}, r"^rtol is 'tight'; it must be a finite number above 0$"),
        ({"method": "dopri5", "atol": 0.0}, r"^atol is 0.0; it must be"),
        ({"samples": [0.0, 0.0]}, r"^samples is \[0.0, 0.0\]; it must be two or more finite times that increase"),
        ({"samples": "now"}, r"^samples is 'now'; it must be"),
        ({"samples": [0.0, np.nan]}, r"^samples is .*nan"),
    ],
)
def test_solve_names_arguments(options, words):
    with pytest.raises(InputError, match=words):
        solve(oscillator().assemble(), **{"samples": [0.0, 1.0], **options})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"step": 0.0}, r"^step is 0.0; it must be a finite time above 0, or None$"),
        ({"tolerance": "x"}, r"^tolerance is 'x'"),
        ({"spectral_radius": 2.0}, r"^spectral_radius is 2.0; it must be from 0 to 1$"),
        ({"samples": 3}, r"^samples is 3; it must be"),
    ],
)
def test_solve_implicit_names_arguments(options, words):
    with pytest.raises(InputError, match=words):
        solve_implicit(oscillator().assemble(), **{"samples": [0.0, 1.0], **options})


def test_nothing_of_the_solvers_names_a_key():
    """Neither their sources nor the stepper's."""
    import pathlib

    package = pathlib.Path(evolvent.__file__).parent
    for path in [*(package / "solvers").glob("*.py"), package / "analysis" / "stepping.py"]:
        text = path.read_text()
        assert not re.search(
            r"[\"' ](solver|contact|damping)\.[a-z_]+[^a-z_(.]", re.sub(r"import .*|from .*", "", text)
        ), path


def test_a_case_names_keys():
    quick = {"solver.method": "rk4", "solver.duration": "1 s"}
    with pytest.raises(InputError, match=r"^solver.step is 1 s, above the stability limit .*smaller one, or auto$"):
        evolvent.run("heliogyro", quick | {"solver.step": 1.0})
    with pytest.raises(InputError, match=r"^solver.step is 1 s, above the stability limit"):
        Stepper.of_case("heliogyro", quick | {"solver.step": 1.0})


@law
def jumping(extension, rate, t, p):
    return p[0] if extension > 0.0 else -p[0]


def test_a_law_that_jumps_is_named_beside_the_step():
    """The account is off because the force jumps; no step is blamed alone."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.01, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=jumping, parameters=(100.0,)), "switch")
    found = solve(system.assemble(), samples=[0.0, 5.0], method="rk4", step=5e-3, unsafe_step=True)
    assert found.status == "failed"
    assert re.search(
        r"energy balance is off by .* do not resolve the motion, or a law of the user's jumps", found.message
    )
    assert "'switch'" in found.message
    assert "`step`" in found.message


def free(*, start: float = 0.0, stop: float = 1.0) -> System:
    system = System()
    system.add(parts.RigidBody(mass=2.0, inertia=(1.0, 1.0, 1.0)), "hub")
    system.add(parts.Load(at="hub", torque=(0.0, 0.0, 0.1), start=start, until=stop), "motor")
    system.add(parts.Load(at="hub", force=(1.0, 0.0, 0.0), start=5.0), "thruster")
    return system


def test_modes_name_the_load_that_acts_on_what_nothing_holds():
    with pytest.raises(RunFailed, match=r"nothing holds 'hub' .*on which 'motor' acts at t = 0 s"):
        modes(free().assemble())
    assert "'motor'" in solve_static(free().assemble()).message
    assert "'thruster'" in solve_static(free().assemble(), time=6.0).message
    np.testing.assert_allclose(modes(free().assemble(), time=2.0).frequency, 0.0, atol=1e-9)
    np.testing.assert_allclose(modes(free(start=1.0, stop=2.0).assemble()).frequency, 0.0, atol=1e-9)


def test_a_notebook_shows_the_sentence_alone() -> None:
    """IPython asks an error for what it shows in place of a traceback."""
    shell = pytest.importorskip("IPython.core.interactiveshell").InteractiveShell()
    with contextlib.redirect_stdout(io.StringIO()) as shown, contextlib.redirect_stderr(shown):
        shell.run_cell("import evolvent\nevolvent.parts.Point(mass=-1)")
    lines = [line for line in re.sub(r"\x1b\[[\d;]*m", "", shown.getvalue()).splitlines() if line]
    assert len(lines) == 1, lines
    assert lines[0].startswith("InputError: Point.mass is -1; it must be a mass above 0"), lines
