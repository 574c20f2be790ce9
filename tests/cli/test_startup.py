"""What a process of the command line loads: nothing that the command does not need."""

import os
import subprocess
import sys

import numpy as np
import pytest

import evolvent
from evolvent_base import startup, units
from evolvent_base.figures import spline

#: Runs the command line, then prints what was loaded; what a run says begins with whether drawing was loaded by then.
PROGRAM = """
import sys
from evolvent_base import cli
sys.argv[0] = "evolvent"
def loaded():
    return " ".join(name for name, module in sys.modules.items() if module is not None)
if "--no-figures" not in sys.argv and "-o" in sys.argv:
    from evolvent.commands import run
    say, draw = run.say, run.draw
    run.say = lambda text, **rest: say(f"{'matplotlib' in sys.modules} {text}", **rest)
    def draw_later(*words):
        print("loaded before figures:", loaded())
        return draw(*words)
    run.draw = draw_later
try:
    cli.main()
finally:
    if "matplotlib" in sys.modules:
        from matplotlib import artist, lines
        print("tables:", "antialiased" in (lines.Line2D.set.__doc__ or ""), "antialiased" in artist.kwdoc(lines.Line2D))
    print("loaded:", loaded())
"""
#: What no command here needs.
NEVER = {"IPython", "dask", "distributed", "nicegui", "pandas.plotting._matplotlib", "pint", "scipy.signal"}
TINY = ("--set", "solver.duration=0.2 s", "--set", "blade.nodes=4")


@pytest.fixture(scope="module")
def compiled():
    """What the run needs is in the cache: a process that compiles loads more."""
    evolvent.run("heliogyro", {"solver.duration": "0.2 s", "blade.nodes": 4})


def started(*words: str, cwd: os.PathLike) -> tuple[str, set[str]]:
    """What a fresh process prints on a command, and the modules that it has loaded."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, *words], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed, _, modules = done.stdout.rpartition("loaded:")
    return printed, set(modules.split())


def loaded(*words: str, cwd: os.PathLike) -> set[str]:
    """Modules that a fresh process has loaded after a command."""
    return started(*words, cwd=cwd)[1]


@pytest.mark.parametrize("words", [("--help",), ("list",), ("run", "--help")])
def test_help_and_list_load_no_large_library(words, tmp_path):
    found = loaded(*words, cwd=tmp_path)
    assert "click" in found
    assert not found & (NEVER | {"h5py", "matplotlib", "numba", "numpy", "pandas", "rich", "scipy", "xarray"})


@pytest.fixture(scope="module")
def drawn(compiled, tmp_path_factory):
    """A run with figures: what it prints, and the modules that it has loaded before it draws and at its end."""
    printed, found = started("run", "heliogyro", *TINY, "-o", "run.nc", cwd=tmp_path_factory.mktemp("drawn"))
    (before,) = (line for line in printed.splitlines() if line.startswith("loaded before figures:"))
    return printed, set(before.split()[3:]), found


@pytest.mark.slow
def test_a_run_loads_what_it_needs(drawn):
    _, found, _ = drawn
    assert {"numba", "xarray", "h5py"} <= found
    assert not found & (
        NEVER | {"h5netcdf", "matplotlib", "rich", "scipy.linalg", "scipy.optimize", "numba.np.arraymath"}
    )
    assert not found & {"evolvent.analysis.batch_results", "evolvent.solvers.sensitivity"}
    assert not found & {"evolvent.analysis.clearance", "evolvent.analysis.margins.evaluation"}
    assert "evolvent.families.threads.part" in found
    assert not found & {f"evolvent.families.{topic}.part" for topic in ("beams", "contact", "nets", "rods", "shells")}


@pytest.mark.slow
def test_figures_load_no_windows_and_no_scipy(drawn):
    """And no tables of properties, which can be had; they are drawn after the table of results is printed."""
    printed, _, found = drawn
    assert printed.startswith("False status")
    assert "\nTrue results: run.nc\nTrue figures: body_rate.png, " in printed
    assert "matplotlib.figure" in found
    assert "\ntables: False True\n" in printed
    assert not found & (NEVER | {"matplotlib.pyplot", "scipy.interpolate", "scipy.linalg", "scipy.optimize"})


@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
def test_units_that_need_the_library_find_it_in_a_run(tmp_path):
    found = loaded(
        "run", "heliogyro", *TINY, "--set", "body.spool_offset=2 inch", "--no-figures", "-o", "run.nc", cwd=tmp_path
    )
    assert "pint" in found
    assert "dask" not in found


def test_hidden_libraries_are_not_found_and_come_back(monkeypatch):
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    with startup.hidden("colorsys", "json"):
        assert sys.modules["json"] is not None  # loaded before: it stays
        with pytest.raises(ImportError):
            __import__("colorsys")
        assert startup.load("colorsys").hls_to_rgb
    with startup.hidden("wave_that_does_not_exist"):
        pass
    assert "wave_that_does_not_exist" not in sys.modules


def test_a_unit_itself_is_read_exactly():
    assert units.parse("0.1 N m s/rad", "N m s/rad") == 0.1


def test_spline_is_that_of_scipy(rng):
    from scipy.interpolate import CubicSpline

    for count in (4, 5, 30, 400):
        x, y = np.cumsum(rng.uniform(0.05, 0.2, count)), rng.normal(size=count)
        at = np.linspace(x[0], x[-1], 501)
        np.testing.assert_allclose(spline(x, y, at), CubicSpline(x, y)(at), rtol=0.0, atol=1e-11)
