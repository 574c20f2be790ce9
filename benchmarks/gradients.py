"""Benchmark of derivatives of a run: their CPU time beside that of the run itself, in one process.

    python benchmarks/gradients.py [-o benchmarks/gradients.json] [--repeat 3] [--only NAME]

Every row is one structure under one method with fixed steps. The run, the adjoint with ten and with a hundred keys
(as many as the structure has), and neighbours with one and with three keys are taken in turn, `--repeat` times, and the
least CPU time of each counts: single figures are ratios of these. Assembly of the changed structures, two a key, is in
the times; the check by other steps is not. `back` is the pass backwards alone, and `kept` the run that keeps its steps.
The load of the machine at the start and at the end is written as well.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import pathlib
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import evolvent
from evolvent import System, elements, parts
from evolvent.solvers.sensitivity.adjoint import Adjoint

ALPHA, ENERGY = "generalized-alpha", "energy-momentum"
#: Keys of the adjoint and of neighbours that are measured.
BACK, BESIDE = (10, 100), (1, 3)
#: Settings of the rod and the plate: energy-momentum has an adjoint of them where it does not filter strains.
SHORT = {"every": 0.02, "step": 1e-3, "spectral_radius": 1.0}


class Case(NamedTuple):
    """A structure, the value that is derived, its keys, and the settings of its run."""

    system: System
    value: str
    keys: list[str]
    settings: dict[str, Any]


def chain(method: str) -> Case:
    """Fifty masses on springs hang and swing."""
    found, n = System(gravity=(0.0, 0.0, -9.81)), 50
    for k in range(n):
        at, rate = (0.0, 0.0, -0.1 * (k + 1)), (0.05 * k, 0.0, 0.0)
        found.add(parts.Point(mass=0.1, position=at, velocity=rate), f"m{k}")
        found.add(
            parts.Spring(a=f"m{k - 1}" if k else (0.0, 0.0, 0.0), b=f"m{k}", stiffness=2e3, length=0.1, damping=0.5),
            f"s{k}",
        )
    keys = [name for k in range(n - 1, -1, -1) for name in (f"m{k}.mass", f"s{k}.stiffness")]
    return Case(found, f"m{n - 1}.position.x.last", keys, {"until": 1.0, "every": 0.01, "step": 5e-5, "method": method})


def array(method: str) -> Case:
    """The built-in array, of which hinges latch."""
    hinges = [f"hinge {k}.{name}" for k in (1, 2, 3) for name in ("stiffness", "damping", "rest", "latch_stiffness")]
    keys = [*hinges, *(f"panel {k}.mass" for k in (1, 2, 3)), "satellite.mass"]
    step = "2 ms" if method == ALPHA else "20 ms"
    return Case(evolvent.load("solar-array"), "hinge 1.latch_time", keys, {"step": step, "method": method})


def boom(method: str) -> Case:
    """A clamped rod of 40 elements with a mass at each node falls and swings."""
    found, n = System(gravity=(0.0, 0.0, -9.81)), 40
    section, material = (
        elements.Tube(radius=0.02, thickness=0.001),
        elements.Material(young_modulus=7e10, poisson_ratio=0.3, density=1600.0),
    )
    found.add(parts.Rod(length=4.0, section=section, material=material, elements=n), "boom")
    found.add(parts.Joint(a="ground", b="boom.root", type="clamp"), "root")
    for k in range(1, n + 1):
        found.add(parts.Point(mass=0.02, at=f"boom[{k}]"), f"m{k}")
        found.add(parts.Spring(a=(0.1 * k, 0.0, 1.0), b=f"boom[{k}]", stiffness=1.0, length=0.5), f"s{k}")
    own = ["section.tube.radius", "section.tube.thickness", "material.young_modulus", "material.density"]
    nodes = [name for k in range(n, 0, -1) for name in (f"m{k}.mass", f"s{k}.stiffness")]
    keys = [*(f"boom.{name}" for name in own), "gravity.2", *nodes]
    return Case(found, "boom.tip.position.z.last", keys, {**SHORT, "until": 1.0, "method": method})


def beam(method: str) -> Case:
    """A clamped beam of 20 elements with a mass at each node falls and swings."""
    found, n = System(gravity=(0.0, 0.0, -9.81)), 20
    section = elements.Tube(radius=0.02, thickness=0.001)
    material = elements.Material(young_modulus=7e10, poisson_ratio=0.3, density=1600.0)
    found.add(parts.Beam(length=4.0, section=section, material=material, elements=n), "boom")
    found.add(parts.Joint(a="ground", b="boom.root", type="clamp"), "root")
    for k in range(1, n + 1):
        found.add(parts.Point(mass=0.02, at=f"boom[{k}]"), f"m{k}")
    own = ["section.tube.radius", "section.tube.thickness", "material.young_modulus", "material.density"]
    keys = [*(f"boom.{name}" for name in own), "gravity.2", *(f"m{k}.mass" for k in range(n, 0, -1))]
    return Case(found, "boom.tip.position.z.last", keys, {**SHORT, "until": 0.3, "method": method})


def plate(method: str) -> Case:
    """A plate of 8 x 8 shell elements, held at a corner, falls and swings."""
    found, n = System(gravity=(0.0, 0.0, -9.81)), 8
    material = elements.Material(young_modulus=2e7, poisson_ratio=0.3, density=1000.0)
    found.add(parts.Shell(size=(1.0, 1.0), elements=(n, n), thickness=0.01, material=material), "plate")
    found.add(parts.Joint(a=(0.0, 0.0, 0.0), b="plate[0]"), "corner")
    for k in range(1, 81):
        found.add(parts.Point(mass=0.01, at=f"plate[{k}]"), f"m{k}")
    own = [f"plate.{name}" for name in ("thickness", "material.young_modulus", "material.density")]
    keys = [*own, "gravity.2", *(f"m{k}.mass" for k in range(80, 0, -1))]
    return Case(found, "plate[80].position.z.last", keys, {**SHORT, "until": 0.2, "method": method})


CASES: dict[str, Callable[[str], Case]] = {
    "chain": chain, "array": array, "beam": beam, "boom": boom, "plate": plate,
}  # fmt: skip


@contextlib.contextmanager
def noted(name: str, spent: dict[str, float]) -> Iterator[None]:
    """Keep the least CPU time of what is done inside, s."""
    began = time.process_time()
    yield
    spent[name] = min(spent.get(name, float("inf")), time.process_time() - began)


def measure(case: Case, repeat: int) -> dict[str, Any]:
    """CPU times of a case, beside that of its run."""
    spent: dict[str, float] = {}
    parted: dict[str, float] = {}
    own: dict[str, Any] = {"run": Adjoint.run, "gradients": Adjoint.gradients}

    def timed(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def inside(*given: Any) -> Any:
            with noted(name, parted):
                return call(*given)

        return inside

    value, keys = case.value, case.keys
    case.system.simulate(keep=[value], **case.settings)  # compiles
    for _ in range(repeat):
        with noted("run", spent):
            case.system.simulate(keep=[value], **case.settings)
        for n in BESIDE:
            with noted(f"forward {n}", spent):
                case.system.sensitivity(value, keys[:n], check=False, **case.settings)
        try:
            for n in BACK:
                parted.clear()
                Adjoint.run, Adjoint.gradients = timed("kept", own["run"]), timed("back", own["gradients"])  # type: ignore[method-assign]
                with noted(f"adjoint {n}", spent):
                    case.system.sensitivity(value, keys[:n], mode="adjoint", check=False, **case.settings)
                for name, seconds in parted.items():
                    spent[f"{name} {n}"] = min(spent.get(f"{name} {n}", float("inf")), seconds)
        finally:
            Adjoint.run, Adjoint.gradients = own["run"], own["gradients"]  # type: ignore[method-assign]
    ratios = {name: round(seconds / spent["run"], 3) for name, seconds in spent.items() if name != "run"}
    return {"run_s": round(spent["run"], 4), "keys": len(keys), "ratios": ratios}


def main() -> None:
    """Print the table, and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", choices=sorted(CASES), action="append")
    options = parser.parse_args()
    load, rows = [os.getloadavg()[0]], {}
    for name in options.only or CASES:
        for method in (ALPHA, ENERGY):
            rows[f"{name}, {method}"] = found = measure(CASES[name](method), options.repeat)
            shown = "  ".join(f"{key} {value:.2f}" for key, value in found["ratios"].items())
            print(f"{name:6s} {method:18s} run {found['run_s']:.3f} s  {shown}", flush=True)
    load.append(os.getloadavg()[0])
    options.output.write_text(json.dumps({"load": load, "rows": rows}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
