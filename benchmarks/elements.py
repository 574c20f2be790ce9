"""Benchmark of the elements: energy's derivatives by quadratic forms, and by Gauss points.

    python benchmarks/elements.py [-o benchmarks/elements.json] [--repeat 7]

One core. Each figure is the least time of a call in a compiled loop over 1000 bent elements that share one form, as in
a rib of uniform section. `Gauss points` is the same force of the `full` beam by 5 x 3 x 3 points of its volume,
compiled as well; both must agree.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from evolvent.elements import (
    Form,
    Material,
    Rectangle,
    beam_form,
    cable_bending,
    cable_form,
    straight_beam,
    straight_cable,
)
from evolvent.families.beams import cable
from evolvent.kernels import ancf

COUNT, LENGTH, DAMPING, RATE = 1000, 0.3, 0.01, 100.0
SECTION, MATERIAL = (
    Rectangle(thickness=3e-4, width=0.03),
    Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0),
)
#: Least time of a call that is aimed at, s.
GOALS = {"beam force": 0.3e-6, "beam tangent": 3e-6, "cable force": 0.5e-6, "cable tangent": 0.5e-6}

force_of, tangent_of, STATE, BEAM, CABLE = ancf.force_of, ancf.tangent_of, ancf.STATE, ancf.N, cable.N
CHANGES = np.zeros(2 * ancf.PRODUCTS)
bending_damping, bending_damping_tangent = cable.add_bending_damping, cable.add_bending_damping_tangent


# ------------------------------------------------------------------------------------------------ loops over elements


@njit
def beam_forces(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        force_of(e[k], u[k], STATE, 0.0, H, h, BEAM, changes, work, f)


@njit
def beam_tangents(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        tangent_of(e[k], u[k], STATE, 0.0, 0.0, H, h, BEAM, changes, work, K)


@njit
def beam_damped_forces(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        force_of(e[k], u[k], STATE, DAMPING, H, h, BEAM, changes, work, f)


@njit
def beam_damped_tangents(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        tangent_of(e[k], u[k], STATE, DAMPING, RATE, H, h, BEAM, changes, work, K)


@njit
def cable_forces(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        force_of(e[k], u[k], STATE, 0.0, H, h, CABLE, changes, work, f)


@njit
def cable_tangents(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        tangent_of(e[k], u[k], STATE, 0.0, 0.0, H, h, CABLE, changes, work, K)


@njit
def cable_damped_forces(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        force_of(e[k], u[k], STATE, DAMPING, H, h, CABLE, changes, work, f)
        bending_damping(e[k], u[k], DAMPING, B, f)


@njit
def cable_damped_tangents(e, u, H, h, B, changes, work, f, K):
    for k in range(e.shape[0]):
        tangent_of(e[k], u[k], STATE, DAMPING, RATE, H, h, CABLE, changes, work, K)
        bending_damping_tangent(e[k], u[k], DAMPING, RATE, B, K)


# ------------------------------------------------------------------------------------------------ Gauss points


def gauss_points() -> tuple[np.ndarray, np.ndarray]:
    """S,x; S,y; S,z : (45, 3, 8) at 5 x 3 x 3 points of the element's volume, and their weights."""
    gradients, weights = [], []
    t, w = SECTION.thickness, SECTION.width
    across = list(zip(*np.polynomial.legendre.leggauss(3), strict=True))
    for x, wx in zip(*np.polynomial.legendre.leggauss(5), strict=True):
        xi = 0.5 + 0.5 * x
        for y, wy in across:
            for z, wz in across:
                q, r = 0.5 * t * y / LENGTH, 0.5 * w * z / LENGTH
                a = 6.0 * xi * (1.0 - xi) / LENGTH
                Sx = [-a, 1 - 4 * xi + 3 * xi**2, -q, -r, a, 3 * xi**2 - 2 * xi, q, r]
                gradients.append([Sx, [0, 0, 1 - xi, 0, 0, 0, xi, 0], [0, 0, 0, 1 - xi, 0, 0, 0, xi]])
                weights.append(0.125 * wx * wy * wz * LENGTH * t * w)
    return np.array(gradients), np.array(weights)


@njit
def forces_by_points(e, S, weights, lam, mu, f):
    """Add the force of each element to f: int F S dV, S = lam tr(E) I + 2 mu E."""
    F, E = np.zeros((3, 3)), np.zeros((3, 3))
    for k in range(e.shape[0]):
        for p in range(weights.size):
            for a in range(3):
                for c in range(3):
                    F[a, c] = 0.0
                for i in range(8):
                    for c in range(3):
                        F[a, c] += S[p, a, i] * e[k, 3 * i + c]
            for a in range(3):
                for b in range(3):
                    E[a, b] = 0.5 * (F[a, 0] * F[b, 0] + F[a, 1] * F[b, 1] + F[a, 2] * F[b, 2])
                E[a, a] -= 0.5
            trace = lam * (E[0, 0] + E[1, 1] + E[2, 2])
            for a in range(3):
                x = y = z = 0.0
                for b in range(3):
                    stress = weights[p] * (2.0 * mu * E[a, b] + (trace if a == b else 0.0))
                    x += stress * F[b, 0]
                    y += stress * F[b, 1]
                    z += stress * F[b, 2]
                for i in range(8):
                    f[3 * i] += S[p, a, i] * x
                    f[3 * i + 1] += S[p, a, i] * y
                    f[3 * i + 2] += S[p, a, i] * z


# ------------------------------------------------------------------------------------------------ figures


def least_time(call: Callable[[], Any], repeat: int) -> float:
    """Of a call on one element, s, compilation aside."""
    call()
    best = np.inf
    for _ in range(repeat):
        began = time.perf_counter()
        for _ in range(20):
            call()
        best = min(best, (time.perf_counter() - began) / (20 * COUNT))
    return float(best)


def bent(straight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and rates of many elements."""
    rng = np.random.default_rng(1)
    shape = (COUNT, straight.size)
    return straight + 0.01 * rng.normal(size=shape), rng.normal(size=shape)


def measure(repeat: int) -> dict[str, float]:
    """All figures, s a call."""
    figures: dict[str, float] = {}
    beam: Form = beam_form("full", LENGTH, SECTION, MATERIAL)
    thin: Form = cable_form(LENGTH, SECTION, MATERIAL)
    B, work = cable_bending(LENGTH, SECTION, MATERIAL), np.zeros(ancf.WORK)
    kinds = {
        "beam": (beam, straight_beam(LENGTH), beam_forces, beam_tangents, beam_damped_forces, beam_damped_tangents),
        "cable": (
            thin, straight_cable(LENGTH), cable_forces, cable_tangents, cable_damped_forces, cable_damped_tangents
        ),
    }  # fmt: skip
    for kind, (form, straight, *loops) in kinds.items():
        e, u = bent(straight)
        f, K = np.zeros(straight.size), np.zeros((straight.size, straight.size))
        for name, loop in zip(("force", "tangent", "damped force", "damped tangent"), loops, strict=True):
            arguments = (e, u, form.H, form.h, B, CHANGES, work, f, K)
            figures[f"{kind} {name}"] = least_time(lambda loop=loop, a=arguments: loop(*a), repeat)

    e, u = bent(straight_beam(LENGTH))
    S, weights = gauss_points()
    lam = MATERIAL.E * MATERIAL.nu / ((1.0 + MATERIAL.nu) * (1.0 - 2.0 * MATERIAL.nu))
    one, other, K = np.zeros(24), np.zeros(24), np.zeros((24, 24))
    forces_by_points(e, S, weights, lam, MATERIAL.shear_modulus, one)
    beam_forces(e, u, beam.H, beam.h, B, CHANGES, work, other, K)
    if not np.allclose(one, other, rtol=0.0, atol=1e-9 * np.abs(one).max()):
        raise SystemExit("the force by Gauss points is not that of the form")
    figures["beam force by Gauss points"] = least_time(
        lambda: forces_by_points(e, S, weights, lam, MATERIAL.shear_modulus, one), repeat
    )
    return figures


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("elements.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default)
    parser.add_argument("--repeat", type=int, default=7)
    options = parser.parse_args()
    before = os.getloadavg()
    figures = measure(options.repeat)
    report = {"load": [before, os.getloadavg()], "seconds_a_call": figures, "goals": GOALS}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    for name, value in figures.items():
        goal = f"   goal {1e9 * GOALS[name]:.0f}" if name in GOALS else ""
        print(f"{name:28} {1e9 * value:8.0f} ns{goal}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
