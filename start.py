#!/usr/bin/env python3
"""Set up a virtual environment beside this file and run evolvent, its tests, benchmarks or documentation in it.

    python3 start.py run heliogyro     results, figures, animation and report in heliogyro-run/
    python3 start.py quick             fast tests of every folder, under a minute
    python3 start.py test              lint, types, layers, tests, documentation; `test --release`: long tests, too
    python3 start.py docs              documentation as HTML in docs/_build/html/
    python3 start.py wheel             wheels, with compiled functions for this Python and platform, in dist/
    python3 start.py lowest            a fast part of the tests, every dependency at its lower bound
    python3 start.py bench             the benchmarks, or those named; `compare`, `shell_peers`, `tosses` only by name

Needs Python 3.11 or later with its venv module, and a way to download packages the first time.
"""

import sys

if sys.version_info < (3, 11):  # noqa: UP036  (this file may be started by any Python)
    sys.exit("evolvent needs Python 3.11 or later; this is Python " + sys.version.split()[0])

import hashlib
import json
import os
import pathlib
import platform
import shutil
import subprocess
import tempfile
import threading
import time
from typing import IO

ROOT = pathlib.Path(__file__).resolve().parent
VENV = ROOT / ".venv"
STAMP = VENV / "evolvent-installed.json"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
USAGE = (
    "usage: python3 start.py run CASE [options of evolvent run] | quick [options of pytest] | "
    "test [--release] [options of pytest] | docs | wheel | lowest [EXTRA ...] [-- options of pytest] | "
    "bench [NAME [options]]"
)
#: Of the files of a folder of tests `quick` runs the last, and every so manyth before it.
QUICK = 4
#: Pages; a warning is an error.
PAGES = ROOT / "docs" / "_build" / "html"
#: Where tests write the rows of the validation book, from which `tests/book.py` renews the table that is shipped.
BOOK = ROOT / "docs" / "_build" / "book"
#: Where tests write the names of those that failed, and how long each took (JUnit's format).
FAILED, DURATIONS = ROOT / "build" / "failed-tests", ROOT / "build" / "tests.xml"
#: Under what the tests that compare digits run once more: OpenBLAS' kernel for the oldest processor of each family, and
#: start states that round-off moves (tests/conftest.py).
OTHER_PROCESSOR = {
    "OPENBLAS_CORETYPE": "Prescott" if platform.machine() in ("x86_64", "AMD64") else "ARMV8",
    "EVOLVENT_ROUND_OFF": "1",
    "EVOLVENT_BOOK": "",
}
COMPILE = ["python", "-c", "from evolvent.compiled import precompile; precompile.compile_all()"]
#: Benchmarks that run only where they are named: they install other programs, and write a page of the documentation.
BY_NAME = ("compare", "shell_peers", "tosses")
#: Tests in an environment of their own: Basilisk's package bounds other packages from above.
TEST_BASILISK = "packages/evolvent-cosim/tests/cosim/test_basilisk.py"
BASILISK = ["python", "tools/lowest.py", "basilisk", "--", "-rs", TEST_BASILISK]
DOCTREES = PAGES.parent / "doctrees"
SPHINX = ["sphinx-build", "-j", "auto", "-W", "--keep-going", "-q", "-E", "-d", str(DOCTREES), "docs", str(PAGES)]


def say(text: str) -> None:
    """One line to stderr, at once."""
    print(text, file=sys.stderr, flush=True)


def call(command: list[str], output: IO[bytes] | None = None, **environment: str) -> int:
    """Run a command in the checkout; Ctrl-C is left to it, and its exit code is returned."""
    streams = {} if output is None else {"stdout": output, "stderr": output}
    with subprocess.Popen(command, cwd=ROOT, env=os.environ | environment, **streams) as process:
        while True:
            try:
                return process.wait()
            except KeyboardInterrupt:
                continue


def use_one_thread() -> None:
    """Let the linear algebra use one thread: the matrices are small, and threads only get into each other's way."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def keep_bytecode() -> None:
    """Keep bytecode in the virtual environment where the user wants none beside the sources.

    Without any, every process compiles each module that it imports: 2 to 5 s.
    """
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
        os.environ.setdefault("PYTHONPYCACHEPREFIX", str(VENV / "bytecode"))


def set_up(extra: str | None) -> int:
    """Create the environment and install the checkout, unless that was done for these very pyproject.toml."""
    projects = [ROOT / "pyproject.toml", *sorted((ROOT / "packages").glob("*/pyproject.toml"))]
    stated = b"".join(path.read_bytes() for path in projects)
    digest = hashlib.sha256(stated + sys.version.encode()).hexdigest()
    extras: set[str] = set()
    if STAMP.exists() and PYTHON.exists():
        stamp = json.loads(STAMP.read_text())
        if stamp["digest"] == digest:
            extras = set(stamp["extras"])
            if extra is None or extra in extras:
                return 0
    began = time.perf_counter()
    if not PYTHON.exists():
        say(f"setting up {VENV} ...")
        if subprocess.run([sys.executable, "-m", "venv", "--clear", str(VENV)], check=False).returncode:
            say("no virtual environment could be made; does this Python have its venv module (python3-venv)?")
            return 1
    wanted = sorted(extras | ({extra} if extra else set()))
    target = f"{ROOT}[{','.join(wanted)}]" if wanted else str(ROOT)
    say("installing evolvent and what it needs ...")
    # --no-compile: what is never imported need not be compiled
    pip = [str(PYTHON), "-m", "pip", "install", "-q", "--no-compile", "--disable-pip-version-check", "-e", target]
    code = call(pip)
    if code == 0:
        STAMP.write_text(json.dumps({"digest": digest, "extras": wanted}))
        say(f"installed in {time.perf_counter() - began:.0f} s")
    return code


def run(arguments: list[str]) -> int:
    """`evolvent run` in this folder; without -o it keeps all it writes in the new folder CASE-run."""
    if code := set_up(None):
        return code
    return call([str(BIN / "evolvent"), "run", *arguments])


def in_parallel() -> list[str]:
    """Options of pytest that run tests on up to four processes.

    Tests stay in their order, so that most files run on one process with what their tests share; a process that has no
    more takes half of what another has left.
    """
    workers = min(4, os.cpu_count() or 1)
    return ["-n", str(workers), "--dist", "worksteal"] if workers > 1 else []


def quick(arguments: list[str]) -> int:
    """The fast tests alone, without lint, types, documentation: of some files of each folder, or of what is named."""
    if code := set_up("test"):
        return code
    began = time.perf_counter()
    files = [] if arguments else quick_files()
    code = call([str(BIN / "pytest"), "-q", "-m", "not slow and not release", *in_parallel(), *files, *arguments])
    say(f"{'ok' if code == 0 else 'FAILED'} in {time.perf_counter() - began:.0f} s")
    return code


def quick_files() -> list[str]:
    """Every `QUICK`th file of each folder of tests, which take under a minute on two cores."""
    folders = sorted({path.parent for path in test_files()})
    files = [sorted(filter(has_fast, folder.glob("test_*.py"))) for folder in folders]
    return [str(path) for several in files for path in several[::-QUICK]]


def test_files() -> list[pathlib.Path]:
    """Files of tests: of the core, and of each package."""
    folders = [ROOT / "tests", *(ROOT / "packages").glob("*/tests")]
    return sorted(path for folder in folders for path in folder.rglob("test_*.py"))


def has_fast(path: pathlib.Path) -> bool:
    """Whether a file has tests without the marker `slow`."""
    text = path.read_text(encoding="utf-8")
    return "pytestmark = pytest.mark.slow" not in text and text.count("mark.slow") < text.count("\ndef test_")


def test(arguments: list[str]) -> int:
    """Lint, format, types, layers, tests and documentation; all are run, and any failure counts.

    Tests with the marker `release` run only with the option `--release`. The other steps run beside the tests, which at
    times leave a core idle; the pages too, for the book changes only where the step `book` fails.
    """
    release = "--release" in arguments
    arguments = [word for word in arguments if word != "--release"]
    # a slow test of digits runs once, in the step `digits`
    chosen = [] if release else ["-m", "not release" if arguments else "not release and not (slow and digits)"]
    if code := set_up("test"):
        return code
    use_one_thread()
    if not arguments:  # the validation book is that of a whole run
        shutil.rmtree(BOOK, ignore_errors=True)
    os.environ.setdefault("EVOLVENT_BOOK", str(BOOK))
    FAILED.parent.mkdir(exist_ok=True)
    os.environ["EVOLVENT_FAILED_TESTS"] = str(FAILED)
    find_browser()
    checks = {
        "lint": ["ruff", "check"],
        "format": ["ruff", "format", "--check"],
        "types": ["mypy"],
        "layers": ["lint-imports", "--no-logo"],
    }
    tests = {"tests": ["pytest", "-q", "-rs", f"--junitxml={DURATIONS}", *in_parallel(), *chosen, *arguments]}
    failed: dict[str, list[str]] = {}
    compiled = threading.Event()  # before tests and pages, which would each compile the same functions

    def beside() -> None:
        run_steps(checks, failed, shown=False)
        compiled.wait()
        run_steps({"docs": SPHINX}, failed, shown=False)

    other = threading.Thread(target=beside)
    other.start()
    run_steps({"compile": COMPILE}, failed, shown=True)
    compiled.set()
    run_steps(tests, failed, shown=True)
    if not arguments:
        whole = [] if "tests" in failed else ["--whole"]  # a test that failed has not entered all of its rows
        run_steps({"book": ["python", "tests/book.py", str(BOOK), *whole]}, failed, shown=True)
        run_steps({"digits": ["pytest", "-q", "-m", "digits", *in_parallel(), *with_digits()]}, failed, shown=True)
        if release:
            run_steps({"basilisk": BASILISK}, failed, shown=True)
    other.join()
    names = [test for tests_of_step in failed.values() for test in tests_of_step]
    say("all passed" if not failed else "\n  ".join([f"failed: {', '.join(failed)}", *names]))
    return 1 if failed else 0


def with_digits() -> list[str]:
    """Files that have a test with the marker `digits`: to collect all of the others takes ten seconds."""
    paths = [path for path in test_files() if "@pytest.mark.digits" in path.read_text(encoding="utf-8")]
    return [str(path.relative_to(ROOT)) for path in paths]


def run_steps(steps: dict[str, list[str]], failed: dict[str, list[str]], *, shown: bool) -> None:
    """Run steps one after another, and enter those that fail with the names of their tests.

    The output of steps that are not `shown` is printed as each of them ends.
    """
    for name, (program, *options) in steps.items():
        say(f"--- {name}: {' '.join([program, *options])}")
        began = time.perf_counter()
        if program == "pytest":
            FAILED.unlink(missing_ok=True)
        with tempfile.TemporaryFile() as kept:
            environment = OTHER_PROCESSOR if name == "digits" else {}
            code = call([str(BIN / program), *options], None if shown else kept, **environment)
            kept.seek(0)
            text = kept.read().decode(errors="replace")
        if code:
            failed[name] = FAILED.read_text().splitlines() if program == "pytest" and FAILED.exists() else []
        say(f"{text}--- {name}: {'ok' if code == 0 else 'FAILED'} in {time.perf_counter() - began:.1f} s")


def find_browser() -> None:
    """Install Chromium for the tests of the studio and the report where that can be done, or say why they skip."""
    if any(shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome")):
        return
    say("no Chromium is installed, in which the studio is tested ...")
    if shutil.which("apt-get") and hasattr(os, "geteuid") and os.geteuid() == 0:
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        subprocess.run(["apt-get", "update", "-q"], check=False, **quiet)
        done = subprocess.run(
            ["apt-get", "install", "-y", "-q", "--no-install-recommends", "chromium"], check=False, **quiet
        )
        say("installed it" if done.returncode == 0 else "it could not be installed: those tests are skipped")
    else:
        say("it can be installed by root alone, or by other means than apt-get: those tests are skipped")


def docs(arguments: list[str]) -> int:
    """The documentation; its examples and tutorials run, which takes a minute or two."""
    if code := set_up("docs"):
        return code
    use_one_thread()
    program, *options = SPHINX
    say("building the pages; their examples and tutorials run, which takes a minute or two ...")
    code = call([str(BIN / program), *arguments, *options])
    if code == 0:
        say(f"open {PAGES / 'index.html'}")
    return code


def wheel(arguments: list[str]) -> int:
    """Wheels that need no compilation at a user's first run, in dist/ or the folder that is named."""
    if code := set_up("wheel"):
        return code
    folder = pathlib.Path(arguments[0]) if arguments else ROOT / "dist"
    return build_wheel(PYTHON, folder, ROOT / "build" / "kernels")


def build_wheel(python: pathlib.Path, folder: pathlib.Path, kernels: pathlib.Path) -> int:
    """Compile what is not in the cache, and build the wheels with it: it is in that of the package evolvent."""
    shutil.rmtree(kernels, ignore_errors=True)
    say("compiling all functions that are not in the cache; all of them take a minute or two on two cores ...")
    if code := call([str(python), "-m", "evolvent.compiled.precompile", str(kernels)]):
        return code
    os.environ["EVOLVENT_KERNELS"] = str(kernels)
    pip = [str(python), "-m", "pip", "wheel", "-q", "--disable-pip-version-check", "--no-deps", "--no-build-isolation"]
    projects = [str(path.parent) for path in sorted((ROOT / "packages").glob("*/pyproject.toml"))]
    code = call([*pip, "-w", str(folder.resolve()), *projects])
    del os.environ["EVOLVENT_KERNELS"]
    for path in sorted(folder.glob("evolvent*.whl")) if code == 0 else ():
        say(f"{path}: {path.stat().st_size / 1e6:.1f} MB")
    return code


def bench(arguments: list[str]) -> int:
    """The benchmarks; without the peer that they are compared to where it cannot be installed."""
    if set_up("bench"):
        say("going on without the packages that the benchmarks are compared to")
        if code := set_up(None):
            return code
    known = sorted(path.stem for path in (ROOT / "benchmarks").glob("*.py"))
    asked = [word for word in arguments if word in known]
    options = [word for word in arguments if word not in known]
    if options and len(asked) != 1:
        say(f"options belong to one benchmark; name it: {', '.join(known)}")
        return 2
    chosen = asked or [name for name in known if name not in BY_NAME]
    codes = [call([str(PYTHON), str(ROOT / "benchmarks" / f"{name}.py"), *options]) for name in chosen]
    return max(codes)


def lowest(arguments: list[str]) -> int:
    """Tests with every dependency at its lower bound, in an environment of their own in build/lowest/."""
    return call([sys.executable, str(ROOT / "tools" / "lowest.py"), *arguments])


def main() -> int:
    """Choose by the first word."""
    commands = {
        "run": run,
        "quick": quick,
        "test": test,
        "docs": docs,
        "wheel": wheel,
        "lowest": lowest,
        "bench": bench,
    }
    if len(sys.argv) < 2 or sys.argv[1] not in commands:
        say(USAGE)
        return 2
    keep_bytecode()
    return commands[sys.argv[1]](sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
