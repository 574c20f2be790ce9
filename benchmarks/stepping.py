"""Time of a step: this checkout beside another one, in one run, and beside Exudyn.

    python benchmarks/stepping.py [--before CHECKOUT] [--only WORK ...] [--repeat 7] [--no-peers]

Each checkout has one process that has compiled what it needs before anything is timed. For every work the processes
run alternately, `--repeat` times each, and the shortest time of each counts, so that the load of the machine falls on
both alike. Prints a table and writes JSON.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

HERE = pathlib.Path(__file__).resolve()
WORKS = (
    "spring chain",
    "heliogyro, springs",
    "heliogyro, springs, c = 1e7",
    "heliogyro, links",
    "cable pendulum, 10",
    "cable pendulum, 20",
    "cable pendulum, 40",
    "wrapped-rib",
    "wrapped-rib-deploy",
    "wrapped-rib-hold",
    "tiny run",
)


def _stretch(stiffness: float, steps: int) -> Callable[[], tuple[float, int]]:
    """The heliogyro of `run.py` with half of its thread out, under rk4."""
    import run

    from evolvent.solvers import solve

    assembly = run.heliogyro("springs", stiffness=stiffness, out=0.5 * run.LENGTH)
    step = run.rk4_step(stiffness)

    def work() -> tuple[float, int]:
        found = solve(assembly, samples=[0.0, steps * step], method="rk4", step=step)
        return found.wall_time, found.statistics["steps"]

    return work


def _links() -> Callable[[], tuple[float, int]]:
    """The whole deployment on links of fixed length, dopri5 at the tolerance that `run.py` finds."""
    import run

    from evolvent.solvers import solve

    assembly = run.heliogyro("inextensible")

    def work() -> tuple[float, int]:
        found = solve(assembly, samples=run.SAMPLES, method="dopri5", rtol=LINKS_TOLERANCE, atol=1e-2 * LINKS_TOLERANCE)
        return found.wall_time, found.statistics["steps"] + found.statistics["rejected_steps"]

    return work


#: Relative tolerance at which `run.py` finds the lag of the tip within its limit.
LINKS_TOLERANCE = 10.0**-5.75


def _chain() -> Callable[[], tuple[float, int]]:
    import run

    assembly, steps = run.chain(), 20_000

    def work() -> tuple[float, int]:
        return run.step_chain(assembly, steps).wall_time, steps

    return work


def _pendulum(n: int) -> Callable[[], tuple[float, int]]:
    import pendulum

    return lambda: (1e-6 * 2000 * pendulum.ours("cable_stretch", n, 1)[0], 2000)


def _case(name: str) -> Callable[[], tuple[float, int]]:
    import evolvent

    def work() -> tuple[float, int]:
        found = evolvent.run(name)
        return float(found.attrs["wall_time_s"]), int(json.loads(found.attrs["statistics"])["steps"])

    return work


def _tiny() -> Callable[[], tuple[float, int]]:
    """All of a short run but its steps."""
    import evolvent

    overrides = {"blade.nodes": 2, "solver.duration": 1.0}

    def work() -> tuple[float, int]:
        best = float("inf")
        for _ in range(20):
            began = time.perf_counter()
            found = evolvent.run("heliogyro", overrides)
            best = min(best, time.perf_counter() - began - float(found.attrs["wall_time_s"]))
        return best, 1

    return work


def prepare(name: str) -> Callable[[], tuple[float, int]]:
    """A work by its name: a function that does it and returns seconds and steps."""
    if name == "spring chain":
        return _chain()
    if name.startswith("heliogyro, springs"):
        return _stretch(1e7, 200_000) if "1e7" in name else _stretch(1e4, 100_000)
    if name == "heliogyro, links":
        return _links()
    if name.startswith("cable pendulum"):
        return _pendulum(int(name.split()[-1]))
    return _tiny() if name == "tiny run" else _case(name)


def serve() -> int:
    """Do the works named on the standard input, one a line; print seconds and steps of each."""
    import evolvent

    sys.path.insert(0, str(pathlib.Path(evolvent.__file__).parents[2] / "benchmarks"))  # those of its own checkout
    known: dict[str, Callable[[], tuple[float, int]]] = {}
    for line in sys.stdin:
        name = line.strip()
        if name not in known:
            known[name] = prepare(name)
            known[name]()  # compiles
        print(json.dumps(known[name]()), flush=True)
    return 0


class Worker:
    """A process that runs the works on one checkout."""

    def __init__(self, checkout: pathlib.Path) -> None:
        sources = [checkout / "src", *sorted((checkout / "packages").glob("*/src"))]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, sources))}
        environment["EVOLVENT_CACHE"] = f"{os.environ.get('EVOLVENT_CACHE', '/tmp/evolvent-stepping')}-{checkout.name}"
        self.process = subprocess.Popen(
            [sys.executable, "-W", "ignore", str(HERE), "--serve"], env=environment, stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def run(self, name: str) -> tuple[float, int]:
        """Seconds and steps of a work."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{name}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"the process that runs {name!r} has ended")
        seconds, steps = json.loads(line)
        return seconds, steps

    def end(self) -> None:
        """End the process."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def peer(name: str) -> float | None:
    """Time of a step of Exudyn on the same work, us."""
    sys.path.insert(0, str(HERE.parent))
    if name == "spring chain":
        import run

        return run.exudyn_chain(5000)[0] / 5000 * 1e6
    if name.startswith("cable pendulum"):
        import pendulum

        return pendulum.peer("ANCFCable", int(name.split()[-1]), 1)[0]
    return None


def main() -> int:
    """Print the table and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--before", type=pathlib.Path, help="another checkout, such as a worktree of an older commit")
    parser.add_argument("--only", nargs="+", choices=WORKS, default=list(WORKS))
    parser.add_argument("--repeat", type=int, default=7, help="runs of each (default: %(default)s)")
    parser.add_argument("--no-peers", action="store_true", help="without Exudyn")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=HERE.with_suffix(".json"))
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        return serve()
    checkouts = {"now": HERE.parents[1]}
    if options.before:
        checkouts["before"] = options.before.resolve()
    if not options.no_peers and importlib.util.find_spec("exudyn") is None:
        print("Exudyn is not installed: no comparison with it", file=sys.stderr)
        options.no_peers = True
    workers = {side: Worker(checkout) for side, checkout in checkouts.items()}
    rows: list[dict[str, Any]] = []
    start = os.getloadavg()
    print(f"load {start[0]:.2f}\n{'us a step':30}{'now':>10}{'before':>10}{'ratio':>7}{'Exudyn':>10}{'times':>7}")
    for name in options.only:
        spent: dict[str, list[float]] = {side: [] for side in workers}
        steps = {}
        theirs = None
        for _ in range(options.repeat):
            for side, worker in workers.items():
                seconds, steps[side] = worker.run(name)
                spent[side].append(1e6 * seconds / steps[side])
            if not options.no_peers:
                found = peer(name)
                theirs = found if theirs is None or found is None else min(found, theirs)
        row: dict[str, Any] = {"work": name, "steps": steps, "us_a_step": {side: min(v) for side, v in spent.items()}}
        best = row["us_a_step"]
        text = f"{name:30}{best['now']:10.3f}"
        if options.before:
            row["ratio"] = best["now"] / best["before"]
            text += f"{best['before']:10.3f}{row['ratio']:7.2f}"
        if theirs is not None:
            row["exudyn_us_a_step"] = theirs
            text += f"{'':{0 if options.before else 17}}{theirs:10.3f}{theirs / best['now']:7.1f}"
        if options.before and steps["now"] != steps["before"]:
            text += f"  steps {steps['now']}, before {steps['before']}"
        print(text, flush=True)
        rows.append(row)
    for worker in workers.values():
        worker.end()
    options.output.write_text(json.dumps({"load": [start, os.getloadavg()], "rows": rows}, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
