"""Benchmark of many copies: Python's share of a variant, two threads beside one, dispersed runs, steps of rods.

    python benchmarks/batches.py [-o benchmarks/batches.json] [--variants 200] [--dispersed 1000] [--rods 4096]

All figures are taken in one run on one machine, so that their ratios hold where the times do not. `beyond` is the
processor time of a variant minus that of the compiled time loop and of its initialization; `python` is the part of it
that is spent outside all compiled functions. `threads` steps the same copies of `solar-array` by one
thread and by two, alternately, and takes the least wall time of each; the bits must agree. On a machine with other
work the gain says little; what holds others back is `python_share`, of the processor time of a run. `dispersed` is the
wall time of `simulate_many` on all cores, and that of a batch from its making to its last result. A step of `rods` is
one of one rod of 40 elements by generalized-alpha, 1 ms, of `rods by rk4` one of 5 us, in lanes where these are faster;
`per_core` divides by the threads.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import pathlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

import evolvent
from evolvent import System, elements, parts
from evolvent.compiled import jit
from evolvent_base.cores import cores

KEYS = {"hinge 1.stiffness": 0.2, "hinge 2.stiffness": 0.1, "hinge 3.stiffness": 0.05}
MASS = {"panel 1.mass": 4.0}
#: Values that are kept.
KEPT = ("hinge 1.latch_time.last", "hinge 1.torque.max", "energy.last", "pivot 1.force.max")
#: Compiled time loops, and the functions that initialize them.
LOOPS = ("advance", "advance_many", "begin", "begin_many", "restart", "restart_many", "count_open")


class Loops:
    """Processor time that compiled functions take in all threads: those of some names, or all."""

    def __init__(self, names: Sequence[str] = ()) -> None:
        self.spent, self.compiled, self._call, self._names = 0.0, 0.0, jit._call, names

    def __enter__(self) -> Loops:
        def timed(compiled: Any, arguments: Any) -> Any:
            began = time.thread_time()
            try:
                return self._call(compiled, arguments)
            finally:
                spent = time.thread_time() - began
                self.compiled += spent
                if not self._names or compiled.py_func.__name__ in self._names:
                    self.spent += spent

        jit._call = timed
        return self

    def __exit__(self, *error: object) -> None:
        jit._call = self._call

    def shares(self, count: int, work: Callable[[], object]) -> dict[str, float]:
        """Milliseconds for each of `count` runs: in the loops, outside them, and the part of the latter in Python."""
        self.spent = self.compiled = 0.0
        began = time.process_time()
        work()
        whole = time.process_time() - began
        python = 1e3 * (whole - self.compiled) / count
        return {
            "solve_ms": 1e3 * self.spent / count,
            "beyond_ms": 1e3 * (whole - self.spent) / count,
            "python_ms": python,
        }


def drawn(keys: dict[str, float], count: int) -> dict[str, np.ndarray]:
    """Values of keys, 3 % about the nominal ones."""
    rng = np.random.default_rng(1)
    return {key: nominal * (1.0 + 0.03 * rng.standard_normal(count)) for key, nominal in keys.items()}


def body() -> System:
    """A body on a spring, which explicit steps suit."""
    system = System(settings={"until": 2.0})
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.0, 0.0, 0.1)), "hub")
    system.add(parts.Spring(a="hub", b=(0.0, 0.0, 1.0), stiffness=100.0, length=0.5), "spring")
    return system


def batched(system: System, values: dict[str, np.ndarray], count: int, workers: int, **settings: Any) -> np.ndarray:
    """The last states of a batch, from its making on."""
    batch = system.batch(count, workers=workers, **settings)
    for key, own in values.items():
        batch.expand(key, own)
    bound = batch.bind("hinge 1.angle") if "hinge 1" in system.parts else batch.bind("hub.position")
    batch.run()
    batch.close()
    return np.concatenate([batch.states.reshape(count, -1), bound.reshape(count, -1)], axis=1)


def beyond(count: int) -> Iterator[dict[str, Any]]:
    """Python's share of a variant, by ways and by what is kept."""
    array, free = evolvent.load("solar-array"), body()
    works: list[tuple[str, System, dict[str, np.ndarray], list[str] | None]] = [
        *((f"simulate_many, {name}", array, drawn(KEYS, count), [name]) for name in KEPT),
        ("simulate_many, with a mass", array, drawn(KEYS | MASS, count), [KEPT[0]]),
        ("simulate_many, body, dopri5", free, drawn({"hub.mass": 2.0}, count), ["hub.position.z.last"]),
        ("batch", array, drawn(KEYS, count), None),
        ("batch, with a mass", array, drawn(KEYS | MASS, count), None),
        ("batch, body, generalized-alpha", free, drawn({"spring.stiffness": 100.0}, count), None),
    ]
    for name, system, values, keep in works:

        def work(size: int, system: Any = system, values: Any = values, keep: Any = keep) -> object:
            own = {key: of[:size] for key, of in values.items()}
            if keep is None:
                return batched(system, own, size, 1)
            return evolvent.simulate_many(system, {key: of.tolist() for key, of in own.items()}, keep, workers=1)

        work(3)
        with Loops(LOOPS) as loops:
            yield {"work": name, **loops.shares(count, functools.partial(work, count))}


def two_threads(count: int, repeat: int = 3) -> dict[str, float]:
    """Least wall and processor times of the steps of one batch by one thread and by two, and Python's share of these.

    Where two threads take more processor time than one, they wait for one another's memory.
    """
    array, values = evolvent.load("solar-array"), drawn(KEYS, count)
    found: dict[int, list[float]] = {1: [], 2: []}
    spent: dict[int, list[float]] = {1: [], 2: []}
    states = {}
    for threads in (1, 2) * repeat:
        batch = array.batch(count, workers=threads)
        for key, own in values.items():
            batch.expand(key, own)
        began = time.perf_counter()
        with Loops() as loops:
            shares = loops.shares(count, batch.run)
        found[threads].append(time.perf_counter() - began)
        spent[threads].append(1e-3 * count * (shares["solve_ms"] + shares["beyond_ms"]))
        states[threads] = batch.states.tobytes()
        batch.close()
    if states[1] != states[2]:
        raise RuntimeError("the bits depend on the number of threads")
    one, two = min(found[1]), min(found[2])
    python = shares["beyond_ms"] / (shares["beyond_ms"] + shares["solve_ms"])
    cpu = {"one_cpu_s": min(spent[1]), "two_cpu_s": min(spent[2])}
    return {"one_s": one, "two_s": two, "gain": one / two, **cpu, "python_share": python}


def dispersed(count: int) -> dict[str, float]:
    """Wall times of dispersed runs on all cores."""
    array, values = evolvent.load("solar-array"), drawn(KEYS | MASS, count)
    evolvent.simulate_many(array, {key: own[:3].tolist() for key, own in values.items()}, [KEPT[0]], workers=1)
    began = time.perf_counter()
    found = evolvent.simulate_many(array, {key: own.tolist() for key, own in values.items()}, [KEPT[0]])
    middle = time.perf_counter()
    batched(array, values, count, cores())
    return {
        "runs": count, "failed": int(np.sum(found.status.values == "failed")), "simulate_many_s": middle - began,
        "batch_s": time.perf_counter() - middle,
    }  # fmt: skip


def rods(count: int, method: str = "generalized-alpha", step: float = 1e-3, steps: int = 50) -> dict[str, float]:
    """Steps per second of rods of 40 elements that fall from the horizontal."""
    system = System(gravity=(0.0, -9.81, 0.0))
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=7200.0)
    rod = parts.Rod(length=1.0, section=elements.Rectangle(thickness=0.02, width=0.02), material=material, elements=40)
    system.add(rod, "rod")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="rod.root"))
    began = time.perf_counter()
    batch = system.batch(count, until=10.0, method=method, step=step, every=steps * step)
    made = time.perf_counter() - began
    batch.step()  # whose functions are compiled
    began, spent = time.perf_counter(), time.process_time()
    batch.step()
    wall, cpu = time.perf_counter() - began, time.process_time() - spent
    batch.close()
    taken, size = count * steps, batch._copies.memory.size
    return {
        "rods": count, "threads": batch.workers, "made_s": made, "bytes_each": size, "steps_per_s": taken / wall,
        "per_core": taken / wall / batch.workers, "per_cpu_s": taken / cpu,
    }  # fmt: skip


def main() -> int:
    """Print the tables and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--variants", type=int, default=200)
    parser.add_argument("--dispersed", type=int, default=1000)
    parser.add_argument("--rods", type=int, default=4096)
    options = parser.parse_args()
    before = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    print(f"{'a run':42}{'solve, ms':>11}{'beyond, ms':>12}{'in Python, ms':>15}{'beyond/solve':>14}")
    rows = []
    for row in beyond(options.variants):
        rows.append(row)
        share = row["beyond_ms"] / row["solve_ms"]
        times = f"{row['solve_ms']:11.3f}{row['beyond_ms']:12.3f}{row['python_ms']:15.3f}"
        print(f"{row['work']:42}{times}{share:14.3f}", flush=True)
    result: dict[str, Any] = {"cores": cores(), "load_before": before, "beyond": rows}
    for name, found in (
        ("threads", two_threads(min(options.variants, 200))),
        ("dispersed", dispersed(options.dispersed)),
        ("rods", rods(options.rods)),
        ("rods by rk4", rods(options.rods, "rk4", 5e-6, 200)),
    ):
        result[name] = found
        print(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in found.items()), flush=True)
    options.output.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
