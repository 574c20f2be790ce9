"""Compilation: the cache folder, laws as function pointers, and the package without compilation.

Several of these lean on numba's inner workings on purpose: a release of numba that changes them must show here.
"""

from __future__ import annotations

import ast
import importlib
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba import config

import evolvent
from evolvent import parts
from evolvent.analysis.system import System
from evolvent.assembly import needs
from evolvent.compiled import codecache, jit, laws, lookups
from evolvent.compiled.codecache import folder as cachefolder
from evolvent.equations.rhs import rhs
from evolvent.kernels.impulse import prepare
from evolvent.solvers import solve
from evolvent_base.errors import InputError

pytestmark = pytest.mark.slow
compiled_only = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT")


def python(script: str, *arguments: str, **environment: str) -> dict:
    """Run a script in a fresh process; what it prints last is JSON."""
    paths = [str(pathlib.Path(jit.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    env = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in paths if p)} | environment
    done = subprocess.run(
        [sys.executable, script, *arguments], capture_output=True, text=True, env=env, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


# ------------------------------------------------------------------------------------------------ cache folder


@pytest.fixture
def copied_package(tmp_path, monkeypatch):
    """A copy of the package's sources that the hash is taken from."""
    copy = tmp_path / "evolvent"
    shutil.copytree(cachefolder._PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(cachefolder, "_PACKAGE", copy)
    return copy


def test_a_change_of_how_functions_are_compiled_gives_another_cache_folder(copied_package):
    before = cachefolder._source_hash()
    path = copied_package / "compiled" / "jit.py"
    path.write_text(path.read_text() + "\n# changed\n")
    assert cachefolder._source_hash() != before


@pytest.mark.parametrize("name", ["kernels/rotations.py", "solvers/time/messages.py", "families/bodies/part_point.py"])
def test_a_change_elsewhere_keeps_the_cache_folder(copied_package, name):
    before = cachefolder._source_hash()
    path = copied_package / name
    path.write_text(path.read_text() + "\n# changed\n")
    assert cachefolder._source_hash() == before


@compiled_only
def test_warm_marks_stand_in_the_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(cachefolder, "CACHE_DIR", tmp_path / "fresh")
    assert not codecache.is_warm("rk4")
    codecache.mark_warm("rk4")
    assert codecache.is_warm("rk4")
    assert not codecache.is_warm("dopri5")


FIRST = """
import json
from evolvent.compiled import jit
from evolvent.kernels import ancf_beams
jit.load([ancf_beams.add_gravity])
print(json.dumps({"loaded": ancf_beams.add_gravity.is_loaded}))
"""


@compiled_only
def test_the_first_function_of_a_process_is_loaded(tmp_path):
    (tmp_path / "first.py").write_text(FIRST)
    assert python(str(tmp_path / "first.py"))["loaded"]


def motion(case: str) -> np.ndarray:
    """End of a short run of a built-in case, with no function loaded at its start."""
    needs.unload()
    run = evolvent.load(case).simulate(until=0.2, every=0.1)
    return np.concatenate([run[name][key].values[-1].ravel() for name in sorted(run.children) for key in
                           ("position", "rate", "angle") if key in run[name]])  # fmt: skip


@compiled_only
@pytest.mark.parametrize("case", ["hanging-chain", "boom-slew", "heliogyro"])
def test_a_function_that_is_not_loaded_is_loaded_as_it_is_called(case, monkeypatch):
    """Also in the middle of a compiled loop: the motion is the same."""
    expected = motion(case)
    assert expected.size
    monkeypatch.setattr(needs, "needed", lambda model, roots, without: roots)
    np.testing.assert_array_equal(motion(case), expected)
    assert len(jit.loaded_late) > 5


@compiled_only
@pytest.mark.parametrize("case", ["hanging-chain", "boom-slew", "solar-array", "heliogyro", "wrapped-rib"])
def test_what_a_run_calls_is_loaded_before_it_begins(case):
    motion(case)
    assert [function.__name__ for function in jit.loaded_late] == []


@compiled_only
@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_a_function_that_cannot_be_loaded_ends_the_run(error, monkeypatch):
    def refuse(function):
        raise error

    assembly = evolvent.load("hanging-chain").assemble()
    model, load = assembly.model, jit.Indirect.load
    needs.unload()
    with monkeypatch.context() as patch:
        patch.setattr(needs, "load", lambda model, *roots: None)
        inner = needs._called(prepare)[0][0]
        patch.setattr(type(inner), "load", lambda function: load(function) if function is prepare else refuse(function))
        with pytest.raises(error):
            prepare(0.0, assembly.y, assembly.s, model)
    assert motion("hanging-chain").size


@compiled_only
def test_what_was_loaded_without_a_function_is_loaded_with_it(monkeypatch):
    model, loaded = evolvent.load("hanging-chain").assemble().model.copy(), []  # nothing is loaded for it yet
    inner = needs._called(prepare)[0][0]
    name = f"{inner.py_func.__module__}.{inner.py_func.__name__}".removeprefix("evolvent.").removeprefix("kernels.")
    monkeypatch.setattr(jit, "load", loaded.append)
    needs.load(model, prepare, without=frozenset({name}))
    needs.load(model, prepare)
    needs.load(model, prepare)
    assert [inner in functions for functions in loaded] == [False, True]


@compiled_only
def test_runs_of_one_assembly_look_up_once_what_they_call(monkeypatch):
    assembly = evolvent.load("hanging-chain").assemble()
    options = {"samples": [0.0, 1e-4], "method": "rk4", "step": 1e-5}
    first = solve(assembly, **options)
    for name in ("needed", "absent"):
        monkeypatch.setattr(needs, name, lambda *_: pytest.fail("looked up again"))
    assert np.array_equal(solve(assembly, **options).y, first.y)


# ------------------------------------------------------------------------------------------------ laws


@laws.law
def hardening(extension, rate, t, p):
    return p[0] * extension + p[1] * extension**3


@laws.law
def brittle(extension, rate, t, p):
    if extension > p[0]:
        raise ValueError("the spring broke")
    return 0.1


@laws.law
def gust(x, v, t, p):
    if t > p[0]:
        raise ValueError("no wind data beyond this time")
    return 0.0, p[1], 0.0


@laws.law
def crossing(t, y, p):
    return y[0] - p[0]


def on_spring(law, *parameters, speed=1.0):
    """A mass that leaves the end of a spring under `law`."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=law, parameters=parameters))
    return system


def reeled(law, *parameters):
    """A blade of three nodes under a distributed load."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "hub")
    drive = parts.ConstantDrive(rate=3.5, angle=100.0)
    system.add(parts.Reel(body="hub", centre=(0.05, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    system.add(parts.Thread(reel="reel", length=2.0, line_density=7e-4, nodes=3, stiffness=1e3), "blade")
    system.add(parts.Load(along="blade", law=law, parameters=parameters))
    return system


@compiled_only
@pytest.mark.parametrize(("law", "kind"), [(hardening, "spring"), (gust, "force"), (crossing, "event")])
def test_a_law_is_compiled_to_its_one_signature(law, kind):
    compiled = law.of(kind)
    assert compiled is law.of(kind)
    assert [s.args for s in compiled.nopython_signatures] == [lookups.LAWS[kind].args]
    assert laws.law_address(compiled, kind) != 0


def test_a_law_acts_with_its_parameters():
    """Energy of a mass on k e + q e^3: its turning point is where k e^2 / 2 + q e^4 / 4 = m v^2 / 2."""
    k, q, e = 4.0, 8.0, 0.5
    speed = np.sqrt(k * e**2 + 0.5 * q * e**4)
    times = np.linspace(0.0, 2.0, 401)
    found = solve(on_spring(hardening, k, q, speed=speed).assemble(), samples=times, method="dopri5", rtol=1e-10)
    assert found.success
    assert abs(found.y[:, 0].max() - (1.0 + e)) < 1e-4


def test_after_an_exception_the_next_run_is_as_ever():
    times = [0.0, 0.2]
    before = solve(on_spring(brittle, 0.9).assemble(), samples=times, method="rk4", step=0.01)
    failed = solve(on_spring(brittle, 0.1).assemble(), samples=times, method="rk4", step=0.01)
    assert failed.status == "failed"
    after = solve(on_spring(brittle, 0.9).assemble(), samples=times, method="rk4", step=0.01)
    np.testing.assert_array_equal(before.y, after.y)


@compiled_only
def test_a_law_of_the_wrong_kind_is_refused_by_name():
    with pytest.raises(InputError, match=r"spring.*\.law: the law 'gust' .*returns 3 numbers; it must be law"):
        on_spring(gust, 1.0, 1.0).assemble()
    with pytest.raises(InputError, match=r"load.*\.law: the law 'hardening' .* must be law\(x, v, t, "):
        reeled(hardening, 1.0, 1.0).assemble()


def two_components(x, v, t, p):
    return 1.0, 2.0


def unknown_name(t, y, p):
    return level - y[0]  # noqa: F821


def unknown_attribute(extension, rate, t, p):
    return p.stiffness * extension


@compiled_only
@pytest.mark.parametrize(
    ("kind", "law", "said"),
    [
        ("force", two_components, "returns 2 numbers; it must be law"),
        ("event", unknown_name, "name 'level' is not defined"),
        ("spring", unknown_attribute, "Unknown attribute 'stiffness'"),
    ],
)
def test_a_law_that_does_not_compile_is_refused_in_one_sentence(kind, law, said):
    with pytest.raises(InputError) as refused:
        laws.law(law).of(kind, "part.law")
    message = str(refused.value)
    assert "\n" not in message
    where = f"part.law: the law {law.__name__!r} ({__file__}:{law.__code__.co_firstlineno})"
    assert message.startswith((f"{where} cannot be compiled", f"{where} returns"))
    assert laws.FORMS[kind].text in message
    assert said in message


def test_a_law_is_a_function():
    with pytest.raises(InputError, match=r"@evolvent\.law decorates a function, not 5"):
        laws.law(5)


@laws.law
def runs_out(t, p):
    if t > p[0]:
        raise ValueError("the table ends")
    return p[1] + t, 1.0, 0.0


@laws.law
def undefined(t, y, p):
    return math.nan + 0.0 * y[0]


@laws.law
def pole(x, v, t, p):
    return p[0] / t, 0.0, 0.0


@laws.law
def lost(extension, rate, t, p):
    return p[3] * extension if p.size > 3 else math.nan


def test_laws_are_tried_before_a_run():
    """Their exceptions, and what is no finite number, are refused by the law's and the part's name."""
    event = on_spring(hardening, 1.0, 0.0)
    event.add(parts.Event(law=undefined), "never")
    with pytest.raises(InputError, match=r"'never' at t = 0 s: the law 'undefined' .* returns nan; it must return"):
        solve(event.assemble(), samples=[0.0, 1.0])
    with pytest.raises(InputError, match=r"the law 'lost' .* returns nan"):
        solve(on_spring(lost).assemble(), samples=[0.0, 1.0])
    if not config.DISABLE_JIT:
        with pytest.raises(InputError, match=r"the law 'pole' .* returns \(inf, 0.0, 0.0\)"):
            solve(reeled(pole, 1.0).assemble(), samples=[0.0, 1.0])


def test_a_drive_law_is_tried_at_both_ends():
    def fed(*parameters):
        system = System()
        drive = parts.LawDrive(law=runs_out, parameters=parameters)
        system.add(parts.Reel(body="ground", radius=0.01, drive=drive), "reel")
        system.add(parts.Thread(reel="reel", length=2.0, line_density=7e-4, nodes=3, stiffness=1e3), "blade")
        return system

    with pytest.raises(InputError, match=r"'blade' at t = 3 s: the law 'runs_out' .* ValueError: the table ends"):
        solve(fed(2.0, 100.0).assemble(), samples=[0.0, 3.0])
    with pytest.raises(InputError, match="the table ends"):
        fed(-1.0, 100.0).assemble()
    with pytest.raises(InputError, match=r"LawDrive\.parameters is"):
        fed(2.0, np.nan)
    with pytest.raises(InputError, match=r"LawDrive\.parameters is"):
        fed("two")


def test_a_law_without_a_source_file_still_works():
    names = {"law": laws.law}
    exec("@law\ndef typed(extension, rate, t, p):\n    return 3.0 * extension\n", names)
    found = solve(on_spring(names["typed"]).assemble(), samples=[0.0, 0.1], method="rk4", step=0.01)
    assert found.success


EDITED = """
import importlib, json, pathlib, sys
sys.path.insert(0, sys.argv[1])
from evolvent import parts
from evolvent.equations.rhs import rhs
from evolvent.solvers import solve
from evolvent.solvers.time.explicit import loop as explicit
from evolvent.analysis.system import System
import my_law


def misses(function):
    return sum(getattr(function, 'of', lambda _: function)('spring').stats.cache_misses.values())


def hits(function):
    return sum(getattr(function, 'of', lambda _: function)('spring').stats.cache_hits.values())


before = [hits(my_law.pull), misses(my_law.pull)]
law = pathlib.Path(my_law.__file__)
law.write_text(law.read_text().replace("2.0", "4.00"))
pull = importlib.reload(my_law).pull
system = System()
system.add(parts.Point(mass=1.0, position=(1.5, 0.0, 0.0)), "ball")
system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=pull))
assembly = system.assemble()
found = solve(assembly, samples=[0.0, 0.1], method="rk4", step=0.01)
print(json.dumps({
    "before": before, "x": found.y[-1, 0], "law": [hits(pull), misses(pull)],
    "rhs": [hits(rhs.dispatcher), misses(rhs.dispatcher)],
    "loop": [hits(explicit.advance.dispatcher), misses(explicit.advance.dispatcher)],
}))
"""


@compiled_only
def test_editing_a_law_recompiles_that_law_alone(tmp_path, monkeypatch):
    """Another process has the law from the cache, edits it, and finds all but the law in the cache."""
    script, law = tmp_path / "script.py", tmp_path / "my_law.py"
    script.write_text(EDITED)
    law.write_text("from evolvent import law\n\n@law\ndef pull(e, rate, t, p):\n    return 2.0 * e\n")
    monkeypatch.syspath_prepend(tmp_path)
    pull = importlib.import_module("my_law").pull
    monkeypatch.delitem(sys.modules, "my_law")
    system = System()
    system.add(parts.Point(mass=1.0, position=(1.5, 0.0, 0.0)), "ball")
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b="ball", length=1.0, law=pull))
    found = solve(system.assemble(), samples=[0.0, 0.1], method="rk4", step=0.01)  # it leaves all in the cache
    edited = python(str(script), str(tmp_path))
    assert edited["before"] == [1, 0]
    assert edited["law"] == [0, 1]
    assert edited["rhs"] == [1, 0]
    assert edited["loop"] == [1, 0]
    np.testing.assert_allclose(found.y[-1, 0], 1.0 + 0.5 * np.cos(np.sqrt(2.0) * 0.1), rtol=1e-9)
    np.testing.assert_allclose(edited["x"], 1.0 + 0.5 * np.cos(2.0 * 0.1), rtol=1e-9)


# ------------------------------------------------------------------------------------------------ without compilation

TINY = """
import json
import numpy as np
from evolvent import law, parts
from evolvent.solvers.common.observations import observe
from evolvent.solvers import solve
from evolvent.analysis.system import System


@law
def pull(extension, rate, t, p):
    return p[0] * extension + 0.1 * rate


@law
def drag(x, v, t, p):
    return -p[0] * v[0], -p[0] * v[1], -p[0] * v[2]


@law
def turning(t, p):
    return p[0] + p[1] * t, p[1], 0.0


@law
def passing(t, y, p):
    return t - p[0]


def system(segments):
    s = System(gravity=(0.0, 0.0, -1.0))
    s.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.25), angular_velocity=(0.1, 0.0, 2.0)), "hub")
    drive = parts.LawDrive(law=turning, parameters=(6.5, 40.0))
    s.add(parts.Reel(body="hub", centre=(0.3, 0.0, 0.0), radius=0.01, drive=drive), "reel")
    s.add(parts.Thread(reel="reel", length=0.3, line_density=0.02, nodes=4, segments=segments, stiffness=50.0,
                       damping=0.01, wound_mass="carried"), "thread")
    s.add(parts.Load(along="thread", law=drag, parameters=(1e-3,)))
    s.add(parts.Point(mass=0.5, position=(0.0, 1.0, 0.0)), "ball")
    s.add(parts.Spring(a=("hub", (0.0, 0.2, 0.0)), b="ball", law=pull, parameters=(3.0,)))
    s.add(parts.Point(mass=0.4, position=(0.0, 2.0, 0.0)), "bob")
    s.add(parts.Joint(a="ball", b="bob", type="link"))
    s.add(parts.Event(law=passing, parameters=(0.05,)))
    return s.assemble()


out = {}
for segments, method in (("springs", "rk4"), ("inextensible", "dopri5")):
    a = system(segments)
    step = 2e-3 if method == "rk4" else None
    found = solve(a, samples=np.linspace(0.0, 0.06, 3), method=method, step=step, rtol=1e-6, atol=1e-8)
    seen = observe(a.model, found.t, found.y, found.s)
    out[method] = {"y": found.y.tolist(), "s": found.s.tolist(), "status": found.status,
                   "steps": found.statistics["steps"], "events": found.event_times.tolist(),
                   "tension": seen.tension.tolist(), "inventory": seen.inventory.tolist()}
print(json.dumps(out))
"""


@compiled_only
def test_the_package_without_compilation_gives_the_same_numbers(tmp_path):
    script, names = tmp_path / "tiny.py", {"__name__": "tiny"}
    script.write_text(TINY)
    exec(compile(TINY, str(script), "exec"), names)
    fast, plain = names["out"], python(str(script), NUMBA_DISABLE_JIT="1")
    for method in ("rk4", "dopri5"):
        a, b = fast[method], plain[method]
        assert a["status"] == b["status"] == "success"
        assert a["s"] == b["s"]
        assert max(a["s"][-1]) > max(a["s"][0])  # a node left the spool
        assert a["steps"] == b["steps"]
        assert len(a["events"]) == len(b["events"]) > 0
        for what in ("y", "events", "tension", "inventory"):
            np.testing.assert_allclose(a[what], b[what], rtol=1e-9, atol=1e-11, err_msg=f"{method}: {what}")


@compiled_only
def test_every_function_called_by_address_has_a_place_of_its_own():
    found = [function for function in jit.functions() if isinstance(function, jit.Indirect)]
    assert {"reels", "add_thread_residual", "kinematics"} <= {function.py_func.__name__ for function in found}
    assert len({function.slot for function in found}) == len(found)
    assert all(2 <= function.slot < jit.ADDRESSES.size for function in found)


# ---------------------------------------------------------------------------------------------- indices

DECORATORS = {"kernel", "inlined", "indirect", "entry"}


def negative_indices(source: str) -> list[str]:
    """Subscripts of compiled functions that hold a number below zero, or count from the end by subtraction alone."""
    found = []
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef):
            continue
        names = {getattr(d.func if isinstance(d, ast.Call) else d, "id", "") for d in function.decorator_list}
        if names & DECORATORS:
            for node in ast.walk(function):
                if isinstance(node, ast.Subscript):
                    parts = [node.slice] if not isinstance(node.slice, ast.Tuple) else node.slice.elts
                    bounds = [b for p in parts for b in ((p.lower, p.upper) if isinstance(p, ast.Slice) else (p,))]
                    if any(isinstance(b, ast.UnaryOp) and isinstance(b.op, ast.USub) for b in bounds):
                        found.append(ast.unparse(node))
    return found


def test_no_compiled_function_counts_from_the_end():
    """Compiled code takes indices as they are."""
    assert negative_indices("@inlined\ndef f(x):\n    return x[0, -1] + x[:-2]\n") == ["x[0, -1]", "x[:-2]"]
    assert [found for path in codecache.sources().values() for found in negative_indices(path.read_text("utf-8"))] == []


SHORT = """
import json
import numpy as np
from evolvent.kernels.drive import drive_angles
error = ""
try:
    drive_angles(0, np.zeros(3), 0, np.zeros(5), np.zeros(3))
except IndexError as found:
    error = str(found)
print(json.dumps({"error": error}))
"""


@compiled_only
def test_indices_can_be_checked(tmp_path):
    script = tmp_path / "short.py"
    script.write_text(SHORT)
    found = python(str(script), NUMBA_BOUNDSCHECK="1", EVOLVENT_CACHE=str(tmp_path))
    assert found["error"] == "index is out of bounds"


@laws.law
def last_parameter(extension, rate, t, p):
    return p[-1] * extension + p[-2:][0]


def test_a_law_may_count_from_the_end():
    system = System()
    point = system.add(parts.Point(mass=1.0, position=(2.0, 0.0, 0.0)))
    system.add(parts.Spring(a=(0.0, 0.0, 0.0), b=point, length=1.0, law=last_parameter, parameters=(1.0, 2.0, 3.0)))
    found = solve(system.assemble(), samples=[0.0, 1e-3], method="rk4", step=1e-3)
    assert found.y[-1, 3] == pytest.approx(-5e-3, rel=1e-5)  # 3 N/m times 1 m, and 2 N


@compiled_only
def test_threads_may_load_the_same_functions_at_once():
    """Loading from several threads, as in a server or a batch, must not fail with 'compilation disabled'."""
    system = System()
    system.add(parts.Point(mass=1.0, position=(2.0, 0.0, 0.0)))
    models = [system.assemble().model for _ in range(8)]
    needs.unload()
    with ThreadPoolExecutor(len(models)) as pool:
        list(pool.map(lambda model: needs.load(model, rhs), models))
    assert rhs.is_loaded
    for _ in range(10):  # one function, which is read from the cache folder again
        needs.unload()
        del rhs.__dict__["dispatcher"]
        with ThreadPoolExecutor(len(models)) as pool:
            list(pool.map(lambda _: jit.load([rhs]), models))
        assert rhs.is_loaded
