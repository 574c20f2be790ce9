"""The example of a package from outside: installed, it is found by the command; its physics has closed forms."""

from __future__ import annotations

import contextlib
import functools
import importlib
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import evolvent
from evolvent import InputError, cases, parts
from evolvent.design import studies
from evolvent_base import plugins

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the package as pip installs it; no network is needed."""
    folder = tmp_path_factory.mktemp("plugin")
    shutil.copytree(EXAMPLE, folder / "source")
    options = ["--quiet", "--no-index", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(folder / "site"), "./source"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def environment(installed):
    """Variables of a process that finds the package."""
    source = str(pathlib.Path(evolvent.__file__).parents[1])
    before = os.environ.get("PYTHONPATH", "")
    env = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, [source, str(installed), before]))}
    del env["EVOLVENT_PLUGINS"]
    return env


#: A process that runs one command line after another: a list of words on every line of its input.
COMMANDS = """
import contextlib, io, json, os, sys
from evolvent_base import cli
for line in sys.stdin:
    folder, *sys.argv = json.loads(line)
    os.chdir(folder)
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            cli.main()
        except SystemExit as ended:
            code = ended.code
    print(json.dumps([code, out.getvalue(), err.getvalue()]), flush=True)
"""


@contextlib.contextmanager
def one_process(environment):
    """Such a process: a function of a folder and words that returns exit code, output and errors."""
    line = [sys.executable, "-c", COMMANDS]
    with subprocess.Popen(line, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:

        def run(folder: pathlib.Path, *words: str) -> tuple[int, str, str]:
            process.stdin.write(json.dumps([str(folder), "evolvent", *words]) + "\n")
            process.stdin.flush()
            return tuple(json.loads(process.stdout.readline()))

        yield run
        process.stdin.close()


@pytest.fixture(scope="module")
def commands(environment):
    """A process that has the package installed."""
    with one_process(environment) as run:
        yield run


@pytest.fixture
def command(commands, tmp_path):
    """Run a command line with the package installed; returns exit code, output and errors."""
    return functools.partial(commands, tmp_path)


@pytest.fixture
def mast(monkeypatch):
    """The module of the system, without entry points."""
    monkeypatch.syspath_prepend(str(EXAMPLE))
    return importlib.import_module("evolvent_pantograph.mast")


@pytest.fixture
def cable(monkeypatch):
    """The module of the part, without entry points."""
    monkeypatch.syspath_prepend(str(EXAMPLE))
    return importlib.import_module("evolvent_pantograph.cable")


@pytest.mark.slow
def test_the_command_finds_the_system(command, tmp_path):
    code, out, err = command("list")
    assert (code, err) == (0, "")
    assert "pantograph " in out
    assert "A mast of four scissor cells springs open" in out
    code, out, _ = command("show", "pantograph")
    assert code == 0
    assert out.startswith("# A mast of four scissor cells")
    code, out, _ = command("schema", "pantograph")
    assert code == 0
    assert json.loads(out)["properties"]["cells"]["description"] == "number of cells"
    code, out, err = command("run", "pantograph", "--set", "cells=2", "-o", "mast.nc", "--figures", "figures")
    assert code == 0, err
    assert "energy balance" in out
    assert len(list((tmp_path / "figures").glob("*.png"))) > 2
    code, out, err = command("info", "mast.nc")
    assert code == 0, err
    assert out.startswith("evolvent run of pantograph")
    # in this process the package is not installed: the file opens, and is shown as any structure
    back = evolvent.open(tmp_path / "mast.nc")
    assert back["mast_length"].sizes["time"] > 1
    assert "energy-balance" in [figure.name for figure in cases.presenter(back).figures(back)]
    assert re.search(r"mast_length +m +\(time\) +length of the mast", out)


def test_its_bad_input_is_one_sentence(command):
    for assignment, sentence in {
        "cells=0": "cells is 0; it must be a whole number from 1 to 100",
        "spring.stifness=1": "unknown key 'spring.stifness'; did you mean 'spring.stiffness'?",
        "half_angle=2 rad": "half_angle is 2 rad; it must be between 0 and pi/2 rad",
    }.items():
        code, out, err = command("run", "pantograph", "--no-figures", "--set", assignment)
        assert (code, out) == (2, "")
        assert err == f"evolvent: {sentence}\n"
    code, _, err = command("run", "pantograf")
    assert code == 2
    assert "did you mean 'pantograph'?" in err


def test_a_study_of_the_system(command, tmp_path):
    shutil.copy(EXAMPLE / "stiffness.study.yaml", tmp_path)
    code, out, err = command("sweep", "./stiffness.study.yaml", "-o", "out", "--workers", "1", "--figures", "figures")
    assert code == 0, err
    assert "4 cases, 4 run now" in out
    found = studies.open(tmp_path / "out")
    assert json.loads(found.attrs["versions"])["evolvent-pantograph"] == "0.1.0"
    assert (found.status == "success").all()
    # the lock gives way the more the faster it is reached
    assert (np.diff(found.mast_length_max) > 0.0).all()
    assert found.bar_1a_rate_z_min.attrs == {
        "units": "rad s-1",
        "long_name": "bar 1a.rate.z: angular velocity, body axes, least",
    }
    # the same angle is passed at rates that go as the root of the stiffness
    rates = found.bar_1a_rate_z_min.values / np.sqrt(found["spring.stiffness"].values)
    assert rates == pytest.approx(np.full(4, rates[0]), rel=2e-2)  # of samples a millisecond apart
    assert {p.name for p in (tmp_path / "figures").iterdir()} >= {"mast_length_max.png", "bar_1a_rate_z_min.png"}


def test_a_structure_with_the_part(command, tmp_path):
    shutil.copy(EXAMPLE / "guyed-mass.yaml", tmp_path)
    code, _, err = command("run", "guyed-mass.yaml", "-o", "mass.nc", "--no-figures")
    assert code == 0, err
    found = evolvent.open(tmp_path / "mass.nc")  # in this process the package is not installed
    mass, k, g, v = 2.0, 2000.0, 9.81, 1.0
    time, z = found["time"].values, found["mass"]["position"].values[:, 2]
    back = 2.0 * v / g  # it falls freely until the cable is tight again
    free = time < back
    assert z[free] == pytest.approx(-1.0 + v * time[free] - 0.5 * g * time[free] ** 2, abs=1e-6)
    # then it swings about the extension at rest
    static, w = mass * g / k, math.sqrt(k / mass)
    deepest = -1.0 - static - math.hypot(static, v / w)
    assert z.min() == pytest.approx(deepest, abs=2e-5)
    assert np.abs(found["energy_defect"].values).max() < 1e-5
    code, out, _ = command("schema", "structure")
    assert code == 0
    assert "tension-cable" in out
    for change, sentence in {
        "parts.cable.kind=tension-cabel": "parts.cable.kind is 'tension-cabel'; did you mean 'tension-cable'?",
        "parts.cable.stiffness=0": "parts.cable.stiffness is 0; it must be a stiffness",
        "parts.cable.points=[mass]": "parts.cable.points is ['mass']; it must be a list of two points",
    }.items():
        code, _, err = command("run", "guyed-mass.yaml", "--no-figures", "--set", change)
        assert code == 2
        assert sentence in err


#: Builds pages, then once more with another page.
TWO_BUILDS = """
import pathlib, shutil, sys
from sphinx.cmd.build import main
build = ["-q", "-b", "text", ".", "out"]
code = main(build)
shutil.copytree("out", "first")
print("second", file=sys.stderr)
pathlib.Path("index.md").write_text(sys.argv[1])
main(build)
sys.exit(code)
"""


@pytest.mark.slow
def test_pages_of_the_package_show_its_keys(environment, tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_parser")
    (tmp_path / "conf.py").write_text('extensions = ["myst_parser", "evolvent.sphinxext"]\n')
    page = "# Mast\n\n```{keys} pantograph tension-cable\n```\n\n```{parts} tension-cable\n```\n\n"
    (tmp_path / "index.md").write_text(page + "```{case-file} pantograph\n```\n")
    build = [sys.executable, "-c", TWO_BUILDS, "# Mast\n\n```{keys} pantografh\n```\n"]
    done = subprocess.run(build, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    first, _, second = done.stderr.partition("second\n")
    assert (done.returncode, first) == (0, "")
    assert "no system and no kind of part is called 'pantografh'; did you mean 'pantograph'?" in second
    text = (tmp_path / "first" / "index.txt").read_text()
    for words in ("Pantograph\n", "Tension cable\n", "cells", "stiffness", "system: pantograph"):
        assert words in text, words


#: Lines by which modules end the process that imports them, and how these endings are named.
ENDINGS = {
    "sys.exit(3)": "SystemExit: 3",
    "raise KeyboardInterrupt": "KeyboardInterrupt",
    "raise GeneratorExit('enough')": "GeneratorExit: enough",
    "raise BaseException": "BaseException",
}


#: A case that needs no package outside.
PLAIN = "parts: {a: {kind: point, mass: 1 kg}}\nsimulate: {until: 1 s}\n"


def entry_points(folder: pathlib.Path, name: str, systems: dict[str, str], kinds: dict[str, str]) -> None:
    """A package that has nothing but its entry points."""
    about = folder / f"{name}-0.1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1\n")
    points = ["[evolvent.systems]", *(f"{key} = {value}" for key, value in systems.items())]
    points += ["[evolvent.parts]", *(f"{key} = {value}" for key, value in kinds.items())]
    (about / "entry_points.txt").write_text("\n".join(points) + "\n")


@pytest.fixture(scope="module")
def faulty(environment, tmp_path_factory):
    """A process that has two more packages, and what it says of `list` and of a run, its first commands.

    `broken` cannot be loaded; `ending` has a module for each of `ENDINGS`, which provides a system and a part.
    """
    site, folder = tmp_path_factory.mktemp("site"), tmp_path_factory.mktemp("run")
    entry_points(site, "broken", {"broken": "no_such_module:System"}, {"hoop": "no_such_module:Hoop"})
    numbers = range(len(ENDINGS))
    systems, kinds = ({f"{key}{k}": f"ends_{k}:{name}" for k in numbers}
                      for key, name in (("ending", "System"), ("hoop", "Hoop")))  # fmt: skip
    entry_points(site, "ending", systems, kinds)
    for k, line in enumerate(ENDINGS):
        (site / f"ends_{k}.py").write_text(f"import sys\n{line}\n")
    (folder / "case.yaml").write_text(PLAIN)
    paths = {"PYTHONPATH": os.pathsep.join([environment["PYTHONPATH"], str(site)])}
    with one_process(environment | paths) as run:
        listed = run(folder, "list")
        yield run, listed, run(folder, "run", "case.yaml", "--no-figures", "-o", "run.nc")


@pytest.mark.slow
def test_a_package_that_cannot_be_loaded_harms_no_other(faulty, tmp_path):
    run, (code, out, err), ran = faulty
    assert code == 0
    assert "pantograph" in out
    assert "the system 'broken' of 'no_such_module:System' cannot be loaded: ModuleNotFoundError" in err
    (tmp_path / "case.yaml").write_text("system: broken\n")
    code, _, err = run(tmp_path, "run", "case.yaml")
    assert code == 2
    assert "the system 'broken' of 'no_such_module:System' cannot be loaded" in err
    # a part stops the cases that use it, and no others
    assert ran[0] == 0
    code, out, err = run(tmp_path, "parts")
    assert code == 0
    assert "tension-cable " in out
    assert "the plug-in 'hoop' of the package 'broken' cannot be loaded: ModuleNotFoundError" in err
    (tmp_path / "case.yaml").write_text(PLAIN)
    code, _, err = run(tmp_path, "run", "case.yaml", "--set", "parts.a.kind=hoop")
    assert code == 2
    assert err.startswith("evolvent: parts.a.kind is 'hoop'; the plug-in 'hoop' of the package 'broken' cannot be")


@pytest.mark.slow
def test_a_package_that_ends_the_process_is_named_and_harms_no_other(faulty, tmp_path):
    def part(k: int, why: str) -> str:
        return f"the plug-in 'hoop{k}' of the package 'ending' cannot be loaded: {why}\n"

    run, (code, out, err), ran = faulty
    assert code == 0
    assert "pantograph" in out
    for k, why in enumerate(ENDINGS.values()):
        system = f"evolvent: the system 'ending{k}' of 'ends_{k}:System' cannot be loaded: {why}\n"
        assert err.count(system) == err.count(f"evolvent: {part(k, why)}") == 1
    assert ran[0] == 0
    assert all("cannot be loaded" in line for line in ran[2].splitlines())
    for k in range(len(ENDINGS)):
        (tmp_path / "case.yaml").write_text(f"system: ending{k}\n")
        code, _, err = run(tmp_path, "run", "case.yaml")
        assert code == 2
        assert f"the system 'ending{k}' of 'ends_{k}:System' cannot be loaded" in err


def test_plug_ins_can_be_left_out(installed, monkeypatch):
    monkeypatch.syspath_prepend(str(installed))
    for word, listed in (("none", False), ("all", True)):
        monkeypatch.setenv("EVOLVENT_PLUGINS", word)
        assert ("pantograph" in [entry.name for entry in plugins.entry_points(cases.GROUP)]) == listed
    monkeypatch.setenv("EVOLVENT_PLUGINS", "no")
    with pytest.raises(InputError, match="EVOLVENT_PLUGINS is 'no'; it must be 'none' or 'all'"):
        plugins.entry_points(cases.GROUP)


@pytest.mark.slow
@pytest.mark.parametrize(("cells", "until"), [(1, 0.12), (3, 0.25)])
def test_the_mast_opens_as_its_one_degree_of_freedom_does(mast, cells, until):
    """The angle against an integration of Lagrange's equation, and the energy by the closed form."""
    case = mast.PantographCase(
        cells=cells, spring={"latch": None}, simulate={"until": until, "every": 0.002, "tolerance": 3e-8}
    )
    run = mast.Pantograph().plan(case).run(None)
    assert run.attrs["status"] == "success"
    m, L, k, n = case.bar.mass, case.bar.length, case.spring.stiffness, cells
    inertia = m * (L**2 + case.bar.width**2) / 12.0
    c = m * L**2 * n * (n**2 - 1) / 12.0

    def equation(t, y):
        # T = (c cos^2 + n I) w^2, V = n k (2 a - rest)^2 / 2
        a, w = y
        half_mass = c * math.cos(a) ** 2 + n * inertia
        force = -2.0 * n * k * (2.0 * a - case.spring.rest) + 2.0 * c * math.cos(a) * math.sin(a) * w**2
        return [w, force / (2.0 * half_mass)]

    time = run["time"].values
    exact = solve_ivp(equation, (0.0, time[-1]), [case.half_angle, 0.0], t_eval=time, rtol=1e-10, atol=1e-12)
    assert exact.y[0, -1] > math.radians(40.0)
    assert run["half_angle"].values == pytest.approx(exact.y[0], abs=2e-5)
    assert run["mast_length"].values == pytest.approx(n * L * np.sin(exact.y[0]), abs=5e-5)
    kinetic = (c * np.cos(exact.y[0]) ** 2 + n * inertia) * exact.y[1] ** 2
    assert run["energy_kinetic"].values == pytest.approx(kinetic, abs=1e-4 * kinetic.max())
    assert np.abs(run["momentum"].values).max() < 1e-8
    assert np.abs(run["angular_momentum"].values).max() < 1e-8


def test_the_mast_locks(mast):
    case = mast.PantographCase(cells=2, spring={"latch_damping": 1.0}, simulate={"until": 0.6, "tolerance": 1e-6})
    run = mast.Pantograph().plan(case).run(None)
    assert run.attrs["status"] == "success"
    assert 2.0 * float(run["half_angle"][-1]) == pytest.approx(math.radians(150.0), abs=2e-2)
    assert np.abs(run["energy_defect"].values).max() < 1e-3 * np.abs(run["energy"].values).max()


@pytest.mark.slow
def test_the_cable_is_a_spring_that_never_pushes(cable):
    """Against a spring while it is tight; no force while it is slack."""
    found = {}
    for name, tie in {
        "cable": cable.TensionCable(points=["left", "right"], stiffness=50.0, damping=0.3, length=1.0),
        "spring": parts.Spring(a="left", b="right", stiffness=50.0, damping=0.3, length=1.0),
    }.items():
        system = evolvent.System()
        system.add(parts.Point(mass=1.0), "left")
        system.add(parts.Point(mass=2.0, position=(1.2, 0.0, 0.0), velocity=(0.0, 0.5, 0.0)), "right")
        system.add(tie, "tie")
        found[name] = system.simulate(until=1.0, every=0.02, method="dopri5", tolerance=1e-10)
    length = found["spring"]["tie"]["length"].values
    tight = int(np.argmax(length < 1.0))
    assert 5 < tight < 40
    apart = np.linalg.norm(
        found["cable"]["right"]["position"].values - found["cable"]["left"]["position"].values, axis=1
    )
    assert apart[:tight] == pytest.approx(length[:tight], abs=1e-8)
    speed = found["cable"]["left"]["velocity"].values
    slack = np.flatnonzero(apart < 0.99)
    assert slack.size > 3
    run = slack[: np.argmax(np.diff(slack) > 1) + 1] if np.any(np.diff(slack) > 1) else slack
    assert speed[run] == pytest.approx(np.broadcast_to(speed[run[0]], (run.size, 3)), abs=1e-8)
    with pytest.raises(InputError, match=r"TensionCable\.points is .*it must be a list of two points"):
        cable.TensionCable(points=["left"], stiffness=50.0)
