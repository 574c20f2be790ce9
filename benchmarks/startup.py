"""Start-up: processor time of a command and of a studio's job, over the time that its libraries take to load.

    python benchmarks/startup.py [-o benchmarks/startup.json] [--repeat 7] [--cases solar-array ...]

Every figure is a median of fresh processes that take turns, after one of each that is not counted: kernels, bytecode
and files are then in their caches (bytecode in its own folder, since some environments switch it off). Processor time,
of the user and of the system, is that of the whole process, less the solution's own time in a run; other processes on
the machine disturb it less than the time by the clock, which stands beside it. A job of the studio is measured where
it has the package (Linux): in a process that loads the libraries, and in a fork of one that has loaded them.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

LIBRARIES = "import numba, xarray"
DRAWING = "import numba, xarray, matplotlib.figure, matplotlib.backends.backend_agg"
CASES = ("solar-array",)
#: Wall time of the solve of a results file, s.
SOLVE = "import sys, h5py; print(float(h5py.File(sys.argv[1]).attrs['wall_time_s'][0]))"
#: What is wanted: the largest ratio to the libraries.
WITH_FIGURES, WITHOUT = 3.0, 1.4


class Process:
    """A command that is started again and again in an empty folder; `run` is the file of results that it writes."""

    def __init__(self, words: list[str], *, wanted: float = 0.0, run: str = "") -> None:
        self.words, self.wanted, self.run = words, wanted, run
        self.wall: list[float] = []
        self.cpu: list[float] = []

    def take(self, folder: str, environment: dict[str, str]) -> None:
        """Start it once; a run's solve is taken off."""
        place = tempfile.mkdtemp(dir=folder)
        before, began = os.times(), time.perf_counter()
        done = subprocess.run(self.words, cwd=place, env=environment, capture_output=True, text=True, check=False)
        wall, after = time.perf_counter() - began, os.times()
        if done.returncode:
            raise RuntimeError(done.stderr)
        solve = 0.0
        if self.run:
            words = [sys.executable, "-c", SOLVE, self.run]
            solve = float(subprocess.run(words, cwd=place, capture_output=True, text=True, check=True).stdout)
        shutil.rmtree(place)
        self.wall.append(wall - solve)
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        self.cpu.append(spent * (wall - solve) / wall)  # the solve has the same share of a busy processor

    def result(self) -> dict[str, float]:
        """Medians, s."""
        return {"wall_s": statistics.median(self.wall), "cpu_s": statistics.median(self.cpu)}


def processes(cases: list[str]) -> dict[str, Process]:
    """Every command that is timed."""
    evolvent = [sys.executable, "-m", "evolvent"]
    found = {
        "libraries": Process([sys.executable, "-c", LIBRARIES]),
        "libraries and drawing": Process([sys.executable, "-c", DRAWING]),
        "--help": Process([*evolvent, "--help"]),
        "list": Process([*evolvent, "list"]),
        "show solar-array": Process([*evolvent, "show", "solar-array"]),
        "margin solar-array": Process([*evolvent, "margin", "solar-array"]),
        "reflector net-reflector": Process([*evolvent, "reflector", "net-reflector"]),
    }
    for name in cases:
        run = [*evolvent, "run", name]
        without = [*run, "--no-figures", "-o", "run.nc"]
        found[f"run {name} --no-figures"] = Process(without, wanted=WITHOUT, run="run.nc")
        found[f"run {name}"] = Process(run, wanted=WITH_FIGURES, run=f"{name}-run/run.nc")
    return found


def jobs(case: str, repeat: int) -> dict[str, dict[str, float]]:
    """Times of a studio's job that runs a case, in a process that loads the libraries and in a fork."""
    from evolvent import cases
    from evolvent_studio import warm
    from evolvent_studio.folder import Folder
    from evolvent_studio.jobs import Jobs

    found = {}
    with tempfile.TemporaryDirectory() as folder:
        queue = Jobs(Folder(folder))
        for name in ("studio's job, loading", "studio's job, forked"):
            if "forked" in name:
                warm.server().begin()
                while not warm.server().is_ready():
                    time.sleep(0.05)
            taken = [_job(queue, cases.text(case)) for _ in range(repeat + 1)][1:]
            wall, cpu = (statistics.median(one) for one in zip(*taken, strict=True))
            found[name] = {"wall_s": wall, "cpu_s": cpu}
        queue.stop()
        warm.server().end()
    return found


def _job(queue: Any, text: str) -> tuple[float, float]:
    """Time by the clock and of the processor of a job; the latter is read until its process has ended."""
    began, cpu, ticks = time.perf_counter(), 0.0, os.sysconf("SC_CLK_TCK")
    job = queue.add("run", "job", case=text)
    while job.open:
        time.sleep(0.003)
        process = queue._process
        try:
            if process is not None:
                fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
                cpu = (int(fields[11]) + int(fields[12])) / ticks
        except (OSError, IndexError):  # it has just ended
            continue
    if job.status != "success":
        raise RuntimeError(job.message)
    return time.perf_counter() - began, cpu


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("startup.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default, help="JSON file (default: %(default)s)")
    parser.add_argument("--repeat", type=int, default=7, help="processes of each (default: %(default)s)")
    parser.add_argument("--cases", nargs="+", default=list(CASES), help="cases that are run (default: solar-array)")
    options = parser.parse_args()
    timed, before = processes(options.cases), os.getloadavg()
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": os.path.join(folder, "bytecode")}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for process in timed.values():
            process.take(folder, environment)
            process.wall.clear()
            process.cpu.clear()
        for _ in range(options.repeat):
            for process in timed.values():
                process.take(folder, environment)
    found: dict[str, Any] = {name: process.result() for name, process in timed.items()}
    if sys.platform == "linux" and importlib.util.find_spec("evolvent_studio") is not None:
        found |= jobs("solar-array", options.repeat)
    print(f"{'':32} {'clock, s':>9} {'CPU, s':>9} {'of libraries':>13}  wanted")
    for name, row in found.items():
        row["ratio"] = row["cpu_s"] / found["libraries"]["cpu_s"]
        wanted = timed[name].wanted if name in timed else 0.0
        print(
            f"{name:32} {row['wall_s']:9.2f} {row['cpu_s']:9.2f} {row['ratio']:13.2f}"
            f"  {f'at most {wanted:g}' if wanted else ''}".rstrip()
        )
    report = {"load": [before, os.getloadavg()], "repeat": options.repeat, "figures": found}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
