"""A wheel with compiled functions: nothing is compiled at a user's first run, and nobody else gets its processor."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

import pytest
from numba import config

from evolvent.compiled import codecache, jit
from evolvent.compiled.codecache import folder as cachefolder
from evolvent_base import packages

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT"),
    pytest.mark.skipif(codecache.BASELINE is None, reason="wheels are made on processors that have the baseline"),
    pytest.mark.skipif(importlib.util.find_spec("hatchling") is None, reason="hatchling builds the wheel"),
]
ROOT = pathlib.Path(__file__).parents[2]
#: Runs the command line on each list of words that it is given, and prints what was compiled.
COMMANDS = """
import json, sys
from numba.core import event
from evolvent_base import cli
import evolvent

class Compiled(event.Listener):
    names = []
    def on_start(self, e):
        self.names.append(e.data["dispatcher"].py_func.__qualname__)
    def on_end(self, e):
        pass

event.register("numba:compile", Compiled())
codes, names = [], []
for words in json.loads(sys.argv[1]):
    sys.argv, Compiled.names = ["evolvent", *words], []
    try:
        cli.main()
    except SystemExit as ended:
        codes.append(ended.code)
    names.append(Compiled.names)
Compiled.names = []
found = {"compiled": names, "codes": codes, "file": evolvent.__file__}
"""
PRINT = "print(json.dumps(found))\n"
#: After kernels of the package have run, a function and a law of the user are compiled for this machine's processor.
HOST = """
import numba
from llvmlite import binding
from numba.core.registry import cpu_target
from evolvent.compiled.laws import law_address

before = cpu_target.target_context.codegen()

@evolvent.law
def law(extension, rate, t, p):
    return p[0] * extension

@numba.njit
def own(x):
    return 2.0 * x

law_address(law.of("spring"), "spring")
own(1.0)
after = cpu_target.target_context.codegen()
compiled = [list(f.overloads.values())[0].library.codegen for f in (law.of("spring"), own)]
found["same"] = before is after and all(c is before for c in compiled)
found["processor"] = after.magic_tuple()[1]
found["host"] = binding.get_host_cpu_name()
"""
SHORT = {
    "heliogyro": ["--set", "solver.duration=3 s"],
    "inertia-stand": [],
    "wrapped-rib": ["--set", "solver.duration=1 s"],
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The core's wheel as `start.py wheel` builds it, with this process's cache; those of the others are beside it."""
    spec = importlib.util.spec_from_file_location("start", ROOT / "start.py")
    assert spec is not None
    assert spec.loader is not None
    start = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(start)
    folder = tmp_path_factory.mktemp("dist")
    assert start.build_wheel(pathlib.Path(sys.executable), folder, tmp_path_factory.mktemp("kernels")) == 0
    (found,) = folder.glob("evolvent-*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: pathlib.Path, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A fresh environment with the wheels; what they need is this environment's."""
    folder = tmp_path_factory.mktemp("fresh")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    (packages,) = folder.rglob("site-packages")
    others = [path for path in sys.path if path.endswith(("site-packages", "dist-packages"))]
    (packages / "others.pth").write_text("\n".join(others))
    pip = [sys.executable, "-m", "pip", "--python", str(python_of(folder)), "install", "-q", "--no-index", "--no-deps"]
    subprocess.run(
        [*pip, "--no-compile", "--disable-pip-version-check", *map(str, wheel.parent.glob("*.whl"))], check=True
    )
    return folder


def python_of(folder: pathlib.Path) -> pathlib.Path:
    """The interpreter of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def call(installed: pathlib.Path, cache: pathlib.Path, program: str, *commands: list[str]) -> tuple[dict, str]:
    """Run a program on command lines in the fresh environment; returns what it prints last, as JSON, and its stderr."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"EVOLVENT_CACHE": str(cache)}
    script = cache.parent / "program.py"
    script.write_text(program)
    done = subprocess.run(
        [str(python_of(installed)), str(script), json.dumps(commands)],
        capture_output=True, text=True, env=environment, cwd=cache.parent, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1]), done.stderr


@pytest.fixture(scope="module")
def first(installed: pathlib.Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict, str]:
    """What the first runs from the wheel say, without a cache; then a user's functions are compiled."""
    words = [["run", name, *keys, "--no-figures"] for name, keys in SHORT.items()]
    return call(installed, tmp_path_factory.mktemp("first") / "cache", COMMANDS + HOST + PRINT, *words)


def kernels_called_in(path: pathlib.Path) -> set[tuple[str, bool]]:
    """Kernels that plain functions of a file call, and whether they declare their types."""
    (top,) = (name for name, folder in packages.folders().items() if path.is_relative_to(folder))
    names = (top, *path.relative_to(packages.folders()[top]).with_suffix("").parts)
    known = vars(importlib.import_module(".".join(name for name in names if name != "__init__"))).copy()
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("evolvent"):
            module = importlib.import_module(str(node.module))
            known |= {a.asname or a.name: vars(module)[a.name] for a in node.names if a.name in vars(module)}
    found = set()

    def look(node: ast.AST) -> None:
        if isinstance(node, ast.FunctionDef) and isinstance(known.get(node.name), jit.Kernel | jit.Indirect):
            return
        if isinstance(node, ast.Call):
            function, rest = node.func, []
            while isinstance(function, ast.Attribute):
                function, rest = function.value, [function.attr, *rest]
            called = known.get(function.id) if isinstance(function, ast.Name) else None
            for name in rest:
                called = getattr(called, name, None)
            if isinstance(called, jit.Kernel):
                found.add((called.__name__, called.signature is not None))
        for child in ast.iter_child_nodes(node):
            look(child)

    look(tree)
    return found


def files_of(name: str, folder: pathlib.Path) -> list[pathlib.Path]:
    """Files of one function in a folder of compiled functions."""
    return list(folder.glob(f"*/*/{name}-*"))


def test_kernels_that_python_calls_declare_their_types():
    """Else they would be compiled at a user's first run."""
    imports = re.compile(r"(from|import) (evolvent\.(kernels|flow|solvers)|evolvent_massprops\.batch)")
    paths = [path for folder in packages.folders().values() for path in folder.rglob("*.py")]
    paths = [path for path in paths if imports.search(path.read_text("utf-8"))]
    found = set().union(*(kernels_called_in(path) for path in paths))
    assert {("drive", True), ("advance_block", True), ("marker_kinematics", True)} <= found
    assert {name for name, declared in found if not declared} == set()


def test_the_wheel_is_for_this_python_and_platform_and_small(wheel):
    version = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    assert wheel.stem.split("-")[2:4] == [version, version]
    assert wheel.stem.split("-")[4] != "any"
    assert wheel.stat().st_size <= 15e6
    kernels = [name for name in zipfile.ZipFile(wheel).namelist() if name.startswith("evolvent/_kernels/")]
    assert {name.split("/")[2] for name in kernels} == {codecache.folder_name()}


def test_no_file_of_the_wheel_names_a_folder_of_this_machine(wheel):
    with zipfile.ZipFile(wheel) as content:
        for name in (name for name in content.namelist() if "/_kernels/" in name):
            data = content.read(name)
            for path in (ROOT, cachefolder.CACHE_DIR, pathlib.Path.home()):
                assert os.fsencode(path) not in data, name


@pytest.mark.parametrize("name", SHORT)
def test_the_first_run_from_a_wheel_compiles_nothing(installed, first, name):
    (found, err), k = first, list(SHORT).index(name)
    assert pathlib.Path(found["file"]).is_relative_to(installed)
    assert (found["compiled"][k], found["codes"][k]) == ([], 0)
    assert "compiling" not in err


def test_what_others_compile_is_for_the_host(first):
    found, _ = first
    assert found["same"]
    assert found["processor"] == found["host"]


def test_a_wheel_for_other_versions_compiles(installed, tmp_path):
    """Its folder has another name then; all but one function are put into the user's cache, to save time."""
    (shipped,) = installed.rglob("_kernels")
    (kernels,) = shipped.iterdir()
    cache = tmp_path / "cache"
    shutil.copytree(shipped, cache)
    lacking = files_of("inventory", cache)
    assert lacking
    for path in lacking:
        path.unlink()
    other = kernels.rename(shipped / kernels.name.replace("numba-", "numba-0."))
    try:
        words = ["run", "heliogyro", *SHORT["heliogyro"], "--no-figures"]
        found, err = call(installed, cache, COMMANDS + PRINT, words)
    finally:
        other.rename(kernels)
    assert found["compiled"][0][0] == "inventory"  # then what is linked into it
    assert found["codes"] == [0]
    assert "compiling 1 function for this machine, once" in err
