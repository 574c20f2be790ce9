"""Winding a rib, implicit against explicit: table 1 and figure 10 of Yi, Yuan, Dong & Li (2017).

    python benchmarks/table1.py [-o benchmarks/table1.json] [--span 60] [--whole 80] [--short 1] [--figure FILE.png]

A rib of 12 m x 30 mm x 0.3 mm, E = 5 MPa, hinged to a hub of radius 0.6 m, wound by a torque of 0.2 N m spread over it
with alpha = 0.2 1/s; contact by Hunt-Crossley, 1e3 N/m at 4 contact points an element. `cable`: 40 elements, wound to a
good part over `--span`; `whip`: over `--whole`, through the whip of the last turns (at 66.8 s), where what an explicit
method can bear shrinks. `full`: the paper's 10 beams of 24 coordinates, over a short span, since the waves through the
rib's thickness hold explicit steps below 4 us. The hinge is a constraint under generalized-alpha, a penalty of 1e3 N/m
under the explicit methods. CPU time is that of the solution, less that of an empty one. `gap`: of the tip's place at
the end of the span from the smallest step of RK4. `refused` is a step above the stability limit, which is then run all
the same to see what becomes of it. Heun's method, whose limit is that of an undamped mode over the whole span, runs a
part of it only: its CPU time is scaled up. `the paper's contact`: K delta + c delta', 1e6 N/m and 1e3 N s/m.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import sys
import time
from typing import Any

import numpy as np

from evolvent import elements, parts
from evolvent.builder import Assembly
from evolvent.solvers import solve
from evolvent.solvers.drive import choose_step
from evolvent.solvers.implicit import solve_implicit
from evolvent.system import System

LENGTH, RADIUS, TORQUE, ALPHA = 12.0, 0.6, 0.2, 0.2
STIFFNESS = 1e3
#: CPU time of an empty run, s, by the method's first letters: what loads compiled code and checks the model.
IDLE: dict[str, float] = {}
#: Samples of figure 10, a second.
RATE = 20


def winding(formulation: str, n: int, *, penalty: bool, law: str = "hunt-crossley") -> Assembly:
    """The rib, straight outwards and at rest."""
    system = System()
    material = elements.Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0)
    system.add(
        parts.Beam(
            length=LENGTH, section=elements.Rectangle(thickness=0.0003, width=0.03), material=material, elements=n,
            formulation=formulation, position=(RADIUS, 0.0, 0.0), mass_damping=ALPHA,
        ),
        "rib",
    )  # fmt: skip
    stiffness = STIFFNESS if penalty else 0.0
    system.add(parts.Joint(a=(RADIUS, 0.0, 0.0), b="rib.root", type="spherical", stiffness=stiffness), "hinge")
    contact: dict[str, Any] = {"stiffness": STIFFNESS, "damping": 0.5}
    if law == "paper":
        contact = {"stiffness": 1e6, "damping": 1e3}
    system.add(
        parts.CylinderContact(
            body="ground", beams=["rib"], radius=RADIUS, half_length=1.5, law=law, points=4, **contact
        ),
        "hub",
    )
    system.add(parts.DistributedTorque(beam="rib", torque=TORQUE), "drive")
    return system.assemble()


class Row:
    """One run: its method, how it ended, what it cost, its samples."""

    def __init__(self, model: str, method: str, step: float | None, assembly: Assembly, run: Any) -> None:
        self.model, self.method = model, method
        began = time.process_time()
        self.solution = run()
        self.cpu = max(time.process_time() - began - IDLE.get(method[:2], 0.0), 1e-5)
        self.step = self.solution.statistics.get("mean_step") if step is None else step
        beams = assembly.model.flexible.beams
        vectors = 2 if beams["kind"][0] == 0 else 4
        last = 3 * vectors * (int(beams["nodes"][0]) - 1)
        q, v = int(beams["iq"][0]) + last, int(beams["iv"][0]) + last
        self.t = self.solution.t
        self.tip = self.solution.y[:, q : q + 3]
        self.speed = np.linalg.norm(self.solution.y[:, v : v + 3], axis=1)
        self.refused, self.part = "", 1.0

    def report(self, exact: Row) -> dict[str, Any]:
        """Figures of the table."""
        found = {
            "model": self.model, "method": self.method, "step_s": self.step, "cpu_s": self.cpu,
            "steps": self.solution.statistics["steps"], "status": self.solution.status,
            "message": self.solution.message, "refused": self.refused, "reached_s": float(self.t[-1]),
            "part_of_the_span": self.part,
        }  # fmt: skip
        if self.solution.success and self.part == 1.0:
            peak = int(np.argmax(self.speed))
            found |= {"peak_at_s": float(self.t[peak]), "peak_speed_m_s": float(self.speed[peak])}
            k = int(np.argmin(np.abs(self.t - exact.t[-1])))
            found["gap_m"] = float(np.linalg.norm(self.tip[k] - exact.tip[-1]))
        return found


def implicit(model: str, assembly: Assembly, samples: np.ndarray, step: float | None, **options: Any) -> Row:
    """A run of generalized-alpha."""
    row = Row(
        model, options.pop("method", "generalized-alpha"), step, assembly,
        lambda: solve_implicit(assembly, samples=samples, step=step, **options),
    )  # fmt: skip
    show(row)
    return row


def explicit(model: str, assembly: Assembly, samples: np.ndarray, method: str, share: float, part: float = 1.0) -> Row:
    """A run of an explicit method, over a part of the span, with a step of so many times its stability limit."""
    limit = choose_step(assembly, method, None, float(samples[-1]))[1]
    step = share * limit
    row = Row(
        model, method, step, assembly,
        lambda: solve(assembly, samples=part * samples, method=method, step=step, unsafe_step=share > 1.0),
    )  # fmt: skip
    row.part = part
    if row.solution.success:
        row.cpu /= part
    row.refused = f"limit {limit:.3g} s" if share > 1.0 else ""
    show(row)
    return row


def show(row: Row) -> None:
    """Say that a run has ended."""
    said = f"{row.model}, {row.method}, step {row.step:.3g} s: {row.solution.status}, {row.cpu:.3g} s"
    print(f"  {said}", file=sys.stderr, flush=True)


def warm(held: Assembly, loose: Assembly) -> None:
    """Compile what a model needs, and take the time of empty runs."""
    calls = {
        "ge": lambda: solve_implicit(held, samples=[0.0, 1e-9], step=1e-9),
        "rk": lambda: solve(loose, samples=[0.0, 1e-9], method="rk4", step=1e-9),
        "he": lambda: solve(loose, samples=[0.0, 1e-9], method="heun", step=1e-9),
    }
    for name, call in calls.items():
        spent = []
        for _ in range(4):
            began = time.process_time()
            call()
            spent.append(time.process_time() - began)
        IDLE[name] = min(spent)


def cable(span: float, whole: float) -> tuple[list[Row], Row]:
    """The winding of 40 cable elements."""
    n, model = 40, "cable, 40"
    samples = np.linspace(0.0, span, round(RATE * span) + 1)
    held, loose = winding("cable", n, penalty=False), winding("cable", n, penalty=True)
    warm(held, loose)
    rows = [implicit(model, held, samples, step) for step in (0.5, 0.1, 0.05, 0.02, 0.01, 0.005, 0.0025)]
    rows += [implicit(model, held, samples, None, tolerance=tol) for tol in (1e-3, 1e-4, 1e-5)]
    paper = winding("cable", n, penalty=False, law="paper")
    for step in (0.5, 0.05):
        rows.append(implicit(model, paper, samples, step, method="generalized-alpha, the paper's contact"))
    rows += [explicit(model, loose, samples, "rk4", share) for share in (2.0, 1.1, 0.95, 0.5)]
    best = rows[-1]
    rows += [explicit(model, loose, samples, "heun", 30.0), explicit(model, loose, samples, "heun", 0.95, 0.02)]
    model, samples = "whip", np.linspace(0.0, whole, round(RATE * whole) + 1)
    rows += [implicit(model, held, samples, None, tolerance=tol) for tol in (1e-3, 1e-4)]
    rows += [explicit(model, loose, samples, "rk4", share) for share in (0.95, 0.5, 0.25)]
    return rows, best


def full(span: float) -> tuple[list[Row], Row]:
    """The paper's 10 beams over a short span."""
    n, model = 10, "full, 10"
    samples = np.linspace(0.0, span, 21)
    held, loose = winding("full", n, penalty=False), winding("full", n, penalty=True)
    warm(held, loose)
    rows = [implicit(model, held, samples, step) for step in (0.5, 0.1, 0.05, 0.01)]
    rows += [explicit(model, loose, samples, "rk4", share) for share in (2.0, 1.1, 0.95, 0.5)]
    best = rows[-1]
    rows += [explicit(model, loose, samples, "heun", 200.0), explicit(model, loose, samples, "heun", 0.95, 0.005)]
    return rows, best


def draw(rows: list[Row], path: pathlib.Path) -> None:
    """Figure 10: the tip's speed, implicit and explicit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(8.0, 4.6), layout="constrained")
    FigureCanvasAgg(sheet)
    axis = sheet.subplots()
    for row in rows:
        axis.plot(row.t, row.speed, lw=1.2, label=f"{row.method}, {row.step:.3g} s")
    axis.set_xlabel("time, s")
    axis.set_ylabel("tip speed, m/s")
    axis.legend(frameon=False)
    sheet.savefig(path, dpi=120)


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("table1.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default)
    parser.add_argument("--span", type=float, default=60.0, help="s of winding of the cable (default: %(default)s)")
    parser.add_argument("--whole", type=float, default=80.0, help="s of its winding to the end (default: %(default)s)")
    parser.add_argument("--short", type=float, default=1.0, help="s of the paper's beams (default: %(default)s)")
    parser.add_argument("--figure", type=pathlib.Path, help="draw figure 10 there")
    options = parser.parse_args()
    before = os.getloadavg()
    figures: list[dict[str, Any]] = []
    drawn: list[Row] = []
    for rows, best in (cable(options.span, options.whole), full(options.short)):
        figures += [row.report(best) for row in rows]
        if not drawn:
            drawn = [row for row in rows if row.model == "whip" and row.solution.success]
            drawn += [row for row in rows if row.model == "whip" and row.method == "rk4"][-1:]
    speeds = {f"{row.method}, {row.step:.6g} s": row.speed[:: RATE // 4].round(4).tolist() for row in drawn}
    report = {
        "load": [before, os.getloadavg()], "span_s": options.span, "whole_s": options.whole, "short_s": options.short,
        "rows": figures,
        "figure 10": {"every_s": (RATE // 4) / RATE, "tip_speed_m_s": speeds},
    }  # fmt: skip
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    if options.figure is not None:
        draw(drawn, options.figure)
    print(f"{'model':10} {'method':40} {'step, s':>9} {'CPU, s':>8} {'peak, s':>8} {'gap, mm':>9}  ended")
    for row in figures:
        peak, gap = row.get("peak_at_s"), row.get("gap_m")
        end = "" if row["status"] == "success" else f"{row['status']} at {row['reached_s']:.3g} s"
        if row["part_of_the_span"] < 1.0:
            end = f"scaled from {row['part_of_the_span']:g} of the span"
        end = ", ".join(part for part in (f"refused ({row['refused']})" if row["refused"] else "", end) if part)
        print(
            f"{row['model']:10} {row['method']:40} {row['step_s']:9.3g} {row['cpu_s']:8.3g} "
            f"{'' if peak is None else f'{peak:.2f}':>8} {'' if gap is None else f'{1e3 * gap:.3g}':>9}  {end}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
