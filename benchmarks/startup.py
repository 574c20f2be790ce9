"""Start-up: what a command takes beside its solve, over the time that its libraries take to load.

    python benchmarks/startup.py [-o benchmarks/startup.json] [--repeat 7] [--systems heliogyro ...]

Every figure is a median of fresh processes that take turns, after one of each that is not counted: kernels, bytecode
and files are then in their caches (bytecode in its own folder, since some environments switch it off). A run
counts without the solution's own wall time. Two ratios stand beside each other: of the time by the clock, and of
processor time, which other processes on the machine disturb less.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
from typing import Any

LIBRARIES = "import numba, xarray"
DRAWING = "import numba, xarray, matplotlib.pyplot"
SYSTEMS = ("heliogyro", "inertia-stand", "wrapped-rib")
#: Wall time of the solve of a results file, s.
SOLVE = "import sys, h5py; print(float(h5py.File(sys.argv[1]).attrs['wall_time_s'][0]))"


class Process:
    """A command that is started again and again."""

    def __init__(self, words: list[str], run: str = "") -> None:
        self.words, self.run = words, run
        self.wall: list[float] = []
        self.cpu: list[float] = []

    def take(self, folder: str, environment: dict[str, str]) -> None:
        """Start it once; a run's solve is taken off."""
        before, began = os.times(), time.perf_counter()
        done = subprocess.run(self.words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        wall, after = time.perf_counter() - began, os.times()
        if done.returncode:
            raise RuntimeError(done.stderr)
        solve = 0.0
        if self.run:
            words = [sys.executable, "-c", SOLVE, self.run]
            solve = float(subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout)
        self.wall.append(wall - solve)
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        self.cpu.append(spent * (wall - solve) / wall)  # the solve has the same share of a busy processor

    def result(self) -> dict[str, float]:
        """Medians, s."""
        return {"wall_s": statistics.median(self.wall), "cpu_s": statistics.median(self.cpu)}


def processes(systems: list[str]) -> dict[str, Process]:
    """Every command that is timed."""
    evolvent = [sys.executable, "-m", "evolvent"]
    found = {
        "libraries": Process([sys.executable, "-c", LIBRARIES]),
        "drawing": Process([sys.executable, "-c", DRAWING]),
        "--help": Process([*evolvent, "--help"]),
        "list": Process([*evolvent, "list"]),
    }
    for name in systems:
        run = [*evolvent, "run", name, "-o", f"{name}.nc"]
        found[f"run {name} --no-figures"] = Process([*run, "--no-figures"], f"{name}.nc")
        found[f"run {name}"] = Process(run, f"{name}.nc")
    return found


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("startup.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default, help="JSON file (default: %(default)s)")
    parser.add_argument("--repeat", type=int, default=7, help="processes of each (default: %(default)s)")
    parser.add_argument("--systems", nargs="+", choices=SYSTEMS, default=list(SYSTEMS))
    options = parser.parse_args()
    timed, before = processes(options.systems), os.getloadavg()
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
    print(f"{'':32} {'clock, s':>9} {'CPU, s':>9} {'ratio':>7} {'CPU':>7}  wanted")
    for name, row in found.items():
        wanted, ratios = "", ("", "")
        if name.startswith("-") or name == "list":
            wanted = "< 0.3 s"
        elif name.startswith("run"):
            plain = name.endswith("--no-figures")
            base, more = found["libraries" if plain else "drawing"], 0.0 if plain else 1.0
            wanted = "<= 1.3 of libraries" if plain else "<= 1.3 of drawing, and 1 s taken off"
            row["ratio"], row["cpu_ratio"] = ((row[k] - more) / base[k] for k in ("wall_s", "cpu_s"))
            ratios = (f"{row['ratio']:.2f}", f"{row['cpu_ratio']:.2f}")
        print(f"{name:32} {row['wall_s']:9.3f} {row['cpu_s']:9.3f} {ratios[0]:>7} {ratios[1]:>7}  {wanted}")
    report = {"load": [before, os.getloadavg()], "repeat": options.repeat, "figures": found}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
