"""Guard against loss of speed: CPU time of a few works over that of a calibrated loop, beside the stored ratios.

    python3 start.py bench guard [--store] [--repeat 60] [--history FILE]

The loop and the works, of 10 to 20 ms each, run alternately in one process, and the least CPU time of each counts. On
a busy machine each of them so finds moments in which other processes do not disturb it. The ratio of a work to the loop
is compared with the one stored last for this kind of machine. A work is measured again, up to three times, where its
ratio is too large; if it stays at or above 1.2 of the stored one the guard fails (exit code 1).

Every call appends a line of JSON to benchmarks/history.jsonl: date, version, machine, ratios, and whether they were
stored (`--store`) for later calls to compare with.
"""

from __future__ import annotations

import argparse
import datetime
import json
import pathlib
import platform
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
HISTORY = HERE / "history.jsonl"
#: A work fails at this ratio to the stored value.
LIMIT = 1.2
#: Measurements of a work that is too slow at first.
ROUNDS = 4

Work = Callable[[], object]

# ---------------------------------------------------------------------------------------------- decisions


def ratios(times: dict[str, list[float]], loop: str = "loop") -> dict[str, float]:
    """Least time of each work over the least time of the loop."""
    least = min(times[loop])
    return {name: min(values) / least for name, values in times.items() if name != loop}


def too_slow(found: dict[str, float], stored: dict[str, float], limit: float = LIMIT) -> list[str]:
    """Names of works whose ratio is at or above `limit` times the stored one; works that are not stored pass."""
    return [name for name, value in found.items() if name in stored and value >= limit * stored[name]]


def check(
    measure: Callable[[Iterable[str]], dict[str, float]],
    names: Iterable[str],
    stored: dict[str, float],
    rounds: int = ROUNDS,
) -> tuple[dict[str, float], list[str]]:
    """Ratios of all works, and the names of those that stay too slow.

    Parameters
    ----------
    measure : takes names, returns their ratios
    names : works
    stored : ratios to compare with
    rounds : measurements of a work that is too slow; the least ratio counts
    """
    found = dict(measure(names))
    slow = too_slow(found, stored)
    for _ in range(rounds - 1):
        if not slow:
            break
        again = measure(slow)
        found |= {name: min(found[name], value) for name, value in again.items()}
        slow = too_slow(found, stored)
    return found, slow


def read(path: pathlib.Path) -> list[dict[str, Any]]:
    """Lines of the history; none if there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def stored_ratios(history: list[dict[str, Any]], machine: str) -> dict[str, float]:
    """The ratios stored last for a kind of machine; none if there are none."""
    for line in reversed(history):
        if line["stored"] and line["machine"] == machine:
            return dict(line["ratios"])
    return {}


# ---------------------------------------------------------------------------------------------- measurement


def machine() -> str:
    """The kind of machine: architecture and name of the processor, as LLVM knows it."""
    from llvmlite import binding

    return f"{platform.machine()} {binding.get_host_cpu_name()}"


def loop() -> Work:
    """The calibrated loop: a line of 200 masses on springs in compiled code, without this package."""
    import numba
    import numpy as np

    @numba.njit
    def step(x: np.ndarray, v: np.ndarray, f: np.ndarray, steps: int) -> None:
        n = x.shape[0]
        for _ in range(steps):
            f[:] = 0.0
            for i in range(n - 1):
                d0, d1, d2 = x[i + 1, 0] - x[i, 0], x[i + 1, 1] - x[i, 1], x[i + 1, 2] - x[i, 2]
                length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                pull = 100.0 * (length - 1.0) / length
                f[i, 0] += pull * d0
                f[i, 1] += pull * d1
                f[i, 2] += pull * d2
                f[i + 1, 0] -= pull * d0
                f[i + 1, 1] -= pull * d1
                f[i + 1, 2] -= pull * d2
            for i in range(n):
                for k in range(3):
                    v[i, k] += 1e-3 * f[i, k]
                    x[i, k] += 1e-3 * v[i, k]

    def work() -> None:
        x = np.zeros((200, 3))
        x[:, 0] = 1.01 * np.arange(200)
        step(x, np.zeros_like(x), np.zeros_like(x), 7_000)

    return work


def works() -> dict[str, Work]:
    """The works by name: an explicit thread, an explicit chain of springs, and a beam by both implicit methods."""
    import run

    import evolvent
    from evolvent import elements, parts
    from evolvent.solvers import solve
    from evolvent.solvers.time.implicit import energy_momentum
    from evolvent.solvers.time.implicit.plan import solve_implicit

    thread, step = run.heliogyro("springs", stiffness=1e4, out=0.5 * run.LENGTH), run.rk4_step(1e4)
    chain = run.chain()
    system = evolvent.System(gravity=(0.0, -9.81, 0.0))
    section = elements.Rectangle(thickness=0.02, width=0.02)
    material = elements.Material(young_modulus=2e6, poisson_ratio=0.3, density=1000.0)
    system.add(
        parts.Beam(length=2.0, section=section, material=material, elements=20, formulation="cable_stretch"), "beam"
    )
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="beam.root"))
    cable = system.assemble()
    return {
        "thread, RK4": lambda: solve(thread, samples=[0.0, 6_000 * step], method="rk4", step=step),
        "spring chain, RK4": lambda: run.step_chain(chain, 2_000),
        "cable, generalized-alpha": lambda: solve_implicit(cable, samples=[0.0, 0.3], step=1e-3),
        "cable, energy-momentum": lambda: energy_momentum.plan(cable, samples=[0.0, 0.3], step=1e-3).run(),
    }


def measurer(repeat: int) -> Callable[[Iterable[str]], dict[str, float]]:
    """A function that measures the ratios of works by name; all that they need is compiled before."""
    known = {"loop": loop(), **works()}
    for work in known.values():
        work()

    def measure(names: Iterable[str]) -> dict[str, float]:
        wanted = ["loop", *names]
        times: dict[str, list[float]] = {name: [] for name in wanted}
        for _ in range(repeat):
            for name in wanted:
                began = time.process_time()
                known[name]()
                times[name].append(time.process_time() - began)
        return ratios(times)

    measure.names = [name for name in known if name != "loop"]  # type: ignore[attr-defined]
    return measure


def main() -> int:
    """Measure, compare, and append a line to the history."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--store", action="store_true", help="later calls on such a machine compare with these ratios")
    parser.add_argument("--repeat", type=int, default=60, help="runs of each work (default: %(default)s)")
    parser.add_argument("--history", type=pathlib.Path, default=HISTORY, help="default: %(default)s")
    options = parser.parse_args()
    sys.path.insert(0, str(HERE))
    import evolvent

    here = machine()
    stored = {} if options.store else stored_ratios(read(options.history), here)
    measure = measurer(options.repeat)
    found, slow = check(measure, measure.names, stored)  # type: ignore[attr-defined]
    for name, value in found.items():
        compared = f"{value / stored[name]:.2f} of the stored {stored[name]:.3g}" if name in stored else "not stored"
        print(f"{name:32} {value:8.3f} of the loop, {compared}{'  TOO SLOW' if name in slow else ''}")
    line = {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "version": evolvent.__version__,
        "machine": here,
        "python": platform.python_version(),
        "stored": options.store,
        "passed": not slow,
        "ratios": {name: round(value, 4) for name, value in found.items()},
    }
    with options.history.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
    if not stored and not options.store:
        print(f"no ratios are stored for a machine of the kind {here!r}: nothing was compared; --store stores these")
    if slow:
        print(f"slower than {LIMIT} times the stored ratio: {', '.join(slow)}")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
