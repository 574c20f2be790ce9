"""Benchmark of variants: what named values cost beside the solve, and variants of `solar-array` per second.

    python benchmarks/variants.py [-o benchmarks/variants.json] [--variants 200] [--workers 2] [--repeat 15]

`beyond` is the processor time of ``simulate(keep=[...])`` less that of the run itself (the time loop, its start and
what it returns), the least of the repetitions, after a first call; `of many` that of a variant of `simulate_many` less
the time loop. Variants differ in two stiffnesses and a mass; each
way computes the same bits. "cases one by one" reads, checks, assembles and runs every case as studies of other systems
do; "with_values" varies the built structure; "simulate_many" does so on threads. `cpu` is processor time of this
process.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import pathlib
import sys
import time
from typing import Any

import numpy as np

import evolvent
from evolvent import cases
from evolvent.analysis.many_runs import ManyRuns
from evolvent.assembly.variants import Variants
from evolvent.solvers.time import run
from evolvent.solvers.time.copies import Copies

#: Cases and what is kept of each.
KEPT = (
    ("solar-array", ["hinge 1.latch_time.last"]),
    ("solar-array", ["hinge 1.torque.max"]),
    ("solar-array", ["pivot 1.force.max"]),
    ("solar-array", ["energy.last"]),
    ("boom-slew", ["hub.rate.z.last"]),
    ("boom-slew", ["boom.tip.position.x.last"]),
    ("heliogyro", ["body.rate.z.last"]),
)
#: Variants that are made together where each is timed.
TOGETHER = 8
KEEP = ["hinge 1.latch_time.last", "hinge 2.latch_time.last", "hinge 2.latch_torque_peak.last"]


class _Timed:
    """Processor time that calls of a method take.

    Parameters
    ----------
    of, name : class and name of the method
    """

    def __init__(self, of: Any, name: str) -> None:
        self.spent, self._of, self._name, self._own = 0.0, of, name, getattr(of, name)

    def __enter__(self) -> _Timed:
        own = self._own

        def timed(*arguments: Any) -> Any:
            began = time.process_time()
            try:
                return own(*arguments)
            finally:
                self.spent += time.process_time() - began

        setattr(self._of, self._name, timed)
        return self

    def __exit__(self, *_: object) -> None:
        setattr(self._of, self._name, self._own)


def beyond(case: str, keep: list[str], repeat: int) -> dict[str, Any]:
    """Least processor times of a run, of what is kept of it beside the run, and of a variant of many, s."""
    system = evolvent.load(case)
    with _Timed(run.MotionRun, "solution") as solves:
        system.simulate(keep=keep)
        rows = []
        for _ in range(repeat):
            solves.spent, began = 0.0, time.process_time()
            system.simulate(keep=keep)
            rows.append((solves.spent, time.process_time() - began - solves.spent))
    solve, others = np.array(rows).min(axis=0).tolist()
    return {
        "case": case,
        "keep": keep,
        "solve_s": solve,
        "beyond_s": others,
        "of_many_s": of_many(system, keep, repeat),
    }


def of_many(system: evolvent.System, keep: list[str], repeat: int) -> float:
    """Least processor time of a variant beside the time loop, where a thread has a run for all of them; NaN without."""
    many, found = ManyRuns.of(system, keep, system._run_settings({})), math.nan
    if many is None:
        return found
    with _Timed(Copies, "run_to_end") as loops:
        for n in range(1 + -(-repeat // TOGETHER)):
            loops.spent, began = 0.0, time.process_time()
            count = len([*many.kept([{}] * TOGETHER, None)])
            each = (time.process_time() - began - loops.spent) / count
            found = each if n == 1 else min(found, each)  # the first ones make the copies
    return found


def values(count: int) -> list[dict[str, float]]:
    """Values of each variant."""
    rng = np.random.default_rng(1)
    keys, nominal = ("hinge 1.stiffness", "hinge 2.stiffness", "panel 1.mass"), np.array([0.2, 0.1, 4.0])
    drawn = nominal * (1.0 + 0.03 * rng.standard_normal((count, 3)))
    return [dict(zip(keys, row, strict=True)) for row in drawn.tolist()]


def one_by_one(content: Any, changes: dict[str, float], shared: Variants) -> Any:
    """What is kept of a case with changed keys."""
    case = cases.load(content, changes)
    return cases.system(case.system).plan(case, keep=KEEP, variants=shared).keep()


def per_second(count: int, workers: int) -> list[dict[str, Any]]:
    """Times of each way, whose results must have the same bits."""
    system, listed, content = evolvent.load("solar-array"), values(count), cases.content_of("solar-array")
    shared = Variants()
    ways = {
        "cases one by one": lambda: [
            one_by_one(content, {f"parts.{key}": value for key, value in one.items()}, shared) for one in listed
        ],
        "with_values": lambda: [system.with_values(one).simulate(keep=KEEP) for one in listed],
        "simulate_many, 1": lambda: evolvent.simulate_many(system, listed, KEEP, workers=1),
        f"simulate_many, {workers}": lambda: evolvent.simulate_many(system, listed, KEEP, workers=workers),
    }
    system.simulate(keep=KEEP)
    rows, bits = [], {}
    for name, way in ways.items():
        began, spent = time.perf_counter(), time.process_time()
        found: Any = way()
        wall, cpu = time.perf_counter() - began, time.process_time() - spent
        if name.startswith("simulate_many"):
            last = found["hinge_1_latch_time_last"].values.tolist()
        else:
            last = [one[KEEP[0]] for one in found]
        bits[name] = np.array(last).tobytes()
        rows.append({"way": name, "wall_s": wall, "cpu_s": cpu, "per_s": count / wall, "cpu_each_s": cpu / count})
    if len(set(bits.values())) > 1:
        raise RuntimeError("the ways differ in their bits")
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description="Benchmark of variants.")
    parser.add_argument("-o", "--output", default=str(pathlib.Path(__file__).with_name("variants.json")))
    parser.add_argument("--variants", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=15)
    options = parser.parse_args()
    before = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    kept = [beyond(case, keep, 3 if case == "heliogyro" else options.repeat) for case, keep in KEPT]
    rows = per_second(options.variants, options.workers)
    result = {"cores": os.cpu_count(), "load_before": before, "variants": options.variants, "kept": kept, "ways": rows}
    pathlib.Path(options.output).write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    print(f"{'case':<13}{'keep':<32}{'solve, ms':>12}{'beyond, ms':>12}{'of many, ms':>13}")
    for one in kept:
        times = f"{1e3 * one['solve_s']:>12.2f}{1e3 * one['beyond_s']:>12.2f}{1e3 * one['of_many_s']:>13.2f}"
        print(f"{one['case']:<13}{', '.join(one['keep']):<32}{times}")
    print(f"\n{'way':<20}{'wall, s':>10}{'cpu, s':>10}{'per s':>10}{'cpu each, ms':>14}")
    for one in rows:
        times = f"{one['wall_s']:>10.2f}{one['cpu_s']:>10.2f}{one['per_s']:>10.1f}{1e3 * one['cpu_each_s']:>14.2f}"
        print(f"{one['way']:<20}{times}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
