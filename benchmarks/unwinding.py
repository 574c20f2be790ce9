"""A rib that springs off its hub, beside a chain of rigid links: another model of it, written for this alone.

    python benchmarks/unwinding.py [-o benchmarks/unwinding.json] [--links 40 80] [--end 1000]

The chain has a mass at every joint and a spring of stiffness EI/h against turning there; its joints touch the hub
through springs of 0.3 N/m. Angles of links are its coordinates, the mass matrix is full, the classical Runge-Kutta
method of 0.05 s steps it, and nothing of evolvent is used. 160 links take some minutes. Beside it the built-in case, as
it is and with 160 elements and a tolerance of 1e-5, and the closed form of a long straight tail,
`evolvent.closed_forms.deployed_tip_radius`.
"""

from __future__ import annotations

import argparse
import json
import math
import pathlib
import sys
import time
from typing import Any

import numpy as np
from numba import njit

import evolvent
from evolvent import cases, closed_forms

CONTACT, STEP = 0.3, 0.05


@njit
def accelerations(angle, rate, h, mass, R, EI):
    """Angular accelerations of the links (n,), energy and the tip's distance from the axis."""
    n = angle.size
    force, x, energy, radius = np.zeros((n, 2)), np.array([R, 0.0]), 0.0, 0.0
    for i in range(n):
        x[0] += h * math.cos(angle[i])
        x[1] += h * math.sin(angle[i])
        radius = math.hypot(x[0], x[1])
        if radius < R:
            force[i] = CONTACT * (R - radius) / radius * x
            energy += 0.5 * CONTACT * (R - radius) ** 2
    load, matrix, beyond = np.zeros(n), np.empty((n, n)), np.empty(n)
    pull, sum_ = np.zeros(2), 0.0
    for i in range(n - 1, -1, -1):
        sum_ += mass[i]
        beyond[i] = sum_
        pull += force[i]
        load[i] = h * (math.cos(angle[i]) * pull[1] - math.sin(angle[i]) * pull[0])
    for i in range(n):  # the first link is clamped to the tangent by a spring of half a length
        before, stiffness = (angle[i - 1], EI / h) if i else (0.5 * math.pi, 2.0 * EI / h)
        moment = stiffness * (angle[i] - before)
        energy += 0.5 * moment * (angle[i] - before)
        load[i] -= moment
        if i:
            load[i - 1] += moment
    for i in range(n):
        for j in range(n):
            inertia = h * h * beyond[max(i, j)]
            matrix[i, j] = inertia * math.cos(angle[i] - angle[j])
            load[i] -= inertia * math.sin(angle[i] - angle[j]) * rate[j] ** 2
            energy += 0.5 * matrix[i, j] * rate[i] * rate[j]
    return np.linalg.solve(matrix, load), energy, radius


@njit
def unwind(n, end, R, L, line_density, EI):
    """Times every 100 s, the tip's distance from the axis, and the energy, (k, 3)."""
    h, every = L / n, round(100.0 / STEP)
    mass = np.full(n, line_density * h)
    mass[-1] *= 0.5
    angle = 0.5 * math.pi + 2.0 * math.asin(0.5 * h / R) * (np.arange(n) + 0.5)
    rate = np.zeros(n)
    found = np.empty((int(end / 100.0 + 1e-9) + 1, 3))
    for k in range(every * (len(found) - 1) + 1):
        a1, energy, radius = accelerations(angle, rate, h, mass, R, EI)
        if k % every == 0:
            found[k // every] = k * STEP, radius, energy
        r2 = rate + 0.5 * STEP * a1
        a2 = accelerations(angle + 0.5 * STEP * rate, r2, h, mass, R, EI)[0]
        r3 = rate + 0.5 * STEP * a2
        a3 = accelerations(angle + 0.5 * STEP * r2, r3, h, mass, R, EI)[0]
        r4 = rate + STEP * a3
        a4 = accelerations(angle + STEP * r3, r4, h, mass, R, EI)[0]
        angle += STEP / 6.0 * (rate + 2.0 * r2 + 2.0 * r3 + r4)
        rate += STEP / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("-o", "--output", default=str(pathlib.Path(__file__).with_suffix(".json")))
    parser.add_argument("--links", type=int, nargs="*", default=[40, 80])
    parser.add_argument("--end", type=float, default=1000.0)
    asked = parser.parse_args()
    rows: list[dict[str, Any]] = []
    span = {"solver.duration": asked.end, "output.every": 100.0}
    strip = None
    for changes in ({}, {"rib.elements": 160, "solver.tolerance": 1e-5}):
        began = time.perf_counter()
        run = evolvent.run("wrapped-rib-deploy", span | changes)
        strip = cases.load(cases.parse_yaml(run.attrs["case"], "the case of the run")).strip
        energy = run.energy.values
        row = {"model": f"evolvent, {run.sizes['node'] - 1} elements", "radius_m": float(run.tip_radius[-1, 0])}
        rows.append(row | {"energy": energy[-1] / energy[0], "seconds": time.perf_counter() - began})
    for links in asked.links:
        began = time.perf_counter()
        found = unwind(links, asked.end, strip.radius, strip.length, strip.line_density, strip.bending_stiffness)
        row = {"model": f"chain, {links} links", "radius_m": found[-1, 1], "energy": found[-1, 2] / found[0, 2]}
        rows.append(row | {"seconds": time.perf_counter() - began})
    closed = float(closed_forms.deployed_tip_radius(strip, asked.end))
    print(f"tip from the axis at {asked.end:g} s; closed form {closed:.4f} m")
    for row in rows:
        row["over_closed_form"] = row["radius_m"] / closed - 1.0
        print(
            f"{row['model']:24} {row['radius_m']:.4f} m  {100.0 * row['over_closed_form']:+.2f} %  "
            f"energy kept {row['energy']:.5f}  {row['seconds']:.1f} s"
        )
    told = {"end_s": asked.end, "closed_form_m": closed, "rows": rows}
    pathlib.Path(asked.output).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
