"""Benchmarks: whole deployments, a spring chain beside Exudyn, first results of fresh processes, a user's law.

    python benchmarks/run.py [-o benchmarks/results.json] [--only NAME ...] [--repeat 3]

Prints a table and writes JSON. Nothing here is a test; README.md in this folder says how each figure is taken.
"""

from __future__ import annotations

import argparse
import functools
import importlib.metadata
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import law, parts
from evolvent.analysis.system import System
from evolvent.assembly.assembled import Assembly
from evolvent.solvers import Solution, solve
from evolvent.solvers.common.observations import observe
from evolvent.solvers.time.explicit.plan import choose_step

# The deployment of Tenenbaum (2014): see README.md of the project.
LENGTH, RADIUS, SPOOL_RATE, OFFSET = 5.0, 0.01, 3.5, 0.05
DURATION = 142.857
SAMPLES = np.arange(0.0, DURATION, 0.1)
#: Share of RK4's stability limit that its step takes here: near the fastest that it can honestly be run.
SHARE = 0.8
#: Largest difference of the tip's lag from the tight limit, deg.
LAG_LIMIT = 1e-3
CHAIN = 40


class Table:
    """Rows of (name, value, unit, goal) that are printed at the end, and the figures for JSON."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, str, str]] = []
        self.figures: dict[str, Any] = {}

    def add(self, name: str, value: float, unit: str, goal: str = "", **more: Any) -> None:
        """One figure."""
        self.figures[name] = {"value": value, "unit": unit, "goal": goal, **more}
        self.rows.append((name, f"{value:.4g} {unit}", goal))
        print(f"  {name}: {value:.4g} {unit}", file=sys.stderr, flush=True)

    def show(self) -> None:
        """Print all rows in columns."""
        widths = [max(len(row[k]) for row in [*self.rows, ("", "", "")]) for k in range(2)]
        for name, value, goal in self.rows:
            print(f"{name:<{widths[0]}}  {value:>{widths[1]}}  {goal and 'goal ' + goal}".rstrip())


def best(repeat: int, run: Callable[[], Solution]) -> Solution:
    """The run of least solve time; a run that failed is an error."""
    found = min((run() for _ in range(repeat)), key=lambda solution: solution.wall_time)
    if not found.success:
        raise RuntimeError(found.message)
    return found


# ------------------------------------------------------------------------------------------------ deployment


def heliogyro(segments: str, *, stiffness: float = 1e4, out: float = 0.0) -> Assembly:
    """Two symmetric blades of 20 nodes on a spinning body; `out` metres are paid out at the start."""
    system = System()
    system.add(parts.RigidBody(motion="spin", inertia=0.004, rate=6.0), "body")
    drive = parts.ConstantDrive(rate=SPOOL_RATE, angle=out / RADIUS)
    system.add(parts.Reel(body="body", centre=(OFFSET, 0.0, 0.0), radius=RADIUS, drive=drive), "reel")
    system.add(
        parts.Thread(
            reel="reel",
            length=LENGTH,
            line_density=0.000735,
            nodes=20,
            tip_mass=0.0005,
            segments=segments,
            stiffness=stiffness,
            damping=1e-3,
            multiplicity=2,
        ),
        "blade",
    )
    return system.assemble()


def tip_lag(assembly: Assembly, solution: Solution) -> np.ndarray:
    """Lag angle of the tip (eq. 19) at every sample but the first, deg."""
    seen = observe(assembly.model, solution.t, solution.y, solution.s)
    x = np.einsum("tji,tj->ti", seen.body_rotation[:, assembly.index("body")], seen.position[:, 0])
    x -= [OFFSET, 0.0, RADIUS]
    return np.degrees(np.arccos(x[1:, 0] / np.linalg.norm(x[1:], axis=1)))


def rk4_step(stiffness: float) -> float:
    """Step of RK4 (s), a share of its stability limit."""
    return SHARE * choose_step(heliogyro("springs", stiffness=stiffness), "rk4", None, DURATION)[1]


def cost_of_stretches(stiffness: float, repeat: int, stretches: int = 10, steps: int = 150_000) -> tuple[float, float]:
    """Time of a whole deployment with RK4 from stretches at several lengths paid out, and its number of steps.

    The cost of a step grows with the nodes that are out. `stretches` equal parts of the deployment are each
    represented by `steps` steps from their middle, or by all that it has left, where the thread starts straight.
    """
    step = rk4_step(stiffness)
    span = min(steps * step, 0.45 * DURATION / stretches)
    costs = []
    for k in range(stretches):
        assembly = heliogyro("springs", stiffness=stiffness, out=LENGTH * (k + 0.5) / stretches)
        run = functools.partial(solve, assembly, samples=[0.0, span], method="rk4", step=step)
        found = best(repeat, run)
        costs.append(found.wall_time / found.statistics["steps"])
    total = DURATION / step
    return float(np.mean(costs)) * total, total


def deployment(table: Table, repeat: int) -> None:
    """Whole deployments on springs and on links of fixed length."""
    soft = heliogyro("springs")
    found = best(repeat, lambda: solve(soft, samples=SAMPLES, method="rk4", step=rk4_step(1e4)))
    springs = found.wall_time
    careful = best(repeat, lambda: solve(soft, samples=SAMPLES, method="rk4"))
    scaled, _ = cost_of_stretches(1e4, repeat)
    table.add("deployment, rk4, c = 1e4 N/m", springs, "s", steps=found.statistics["steps"], scaled_instead=scaled)
    table.add("  with the automatic step", careful.wall_time, "s", steps=careful.statistics["steps"])
    stretches, steps = cost_of_stretches(1e7, repeat)
    stiff = stretches * springs / scaled  # stretches cost a little more a step than a whole run does
    table.add("deployment, rk4, c = 1e7 N/m (scaled)", stiff, "s", steps=steps, stretches_alone=stretches)

    links = heliogyro("inextensible")
    dopri5 = functools.partial(solve, links, samples=SAMPLES, method="dopri5")
    tight = tip_lag(links, dopri5(rtol=1e-12, atol=1e-14))
    scan = []
    for exponent in np.arange(-5.0, -8.1, -0.25):
        rtol = float(10.0**exponent)
        found = best(repeat, functools.partial(dopri5, rtol=rtol, atol=0.01 * rtol))
        gap = float(np.abs(tip_lag(links, found) - tight).max())
        scan.append({"rtol": rtol, "lag_gap_deg": gap, "wall_time_s": found.wall_time, **found.statistics})
        if gap <= LAG_LIMIT:
            break
    chosen = scan[-1]
    fast = best(5 * repeat, functools.partial(dopri5, rtol=chosen["rtol"], atol=0.01 * chosen["rtol"])).wall_time
    table.add(
        "deployment, inextensible, dopri5",
        fast,
        "s",
        "<= 0.035 s",
        rtol=chosen["rtol"],
        atol=0.01 * chosen["rtol"],
        lag_gap_deg=chosen["lag_gap_deg"],
        scan=scan,
    )
    table.add("  its relative tolerance", chosen["rtol"], "")
    table.add("  its lag, from the tight limit", chosen["lag_gap_deg"], "deg", f"<= {LAG_LIMIT} deg")
    table.add("inextensible against rk4, c = 1e7", stiff / fast, "times", ">= 1000 times")
    table.add("inextensible against rk4, c = 1e4", springs / fast, "times")


# ------------------------------------------------------------------------------------------------ spring chain

CHAIN_MASS, CHAIN_STIFFNESS, CHAIN_DAMPING, CHAIN_GAP, CHAIN_STEP = 0.1, 1e3, 0.1, 0.1, 1e-3
GRAVITY = (0.0, 0.0, -9.81)


@law
def linear(extension, rate, t, p):
    """The built-in spring-damper as a user would write it."""
    return p[0] * extension + p[1] * rate


def chain(*, law: bool = False) -> Assembly:
    """Masses on a line, hung up at one end, that swing down under gravity."""
    system = System(gravity=GRAVITY)
    before: Any = (0.0, 0.0, 0.0)
    for k in range(CHAIN):
        point = system.add(parts.Point(mass=CHAIN_MASS, position=((k + 1) * CHAIN_GAP, 0.0, 0.0)))
        if law:
            spring = parts.Spring(a=before, b=point, law=linear, parameters=(CHAIN_STIFFNESS, CHAIN_DAMPING))
        else:
            spring = parts.Spring(a=before, b=point, stiffness=CHAIN_STIFFNESS, damping=CHAIN_DAMPING)
        system.add(spring)
        before = point
    return system.assemble()


def step_chain(assembly: Assembly, steps: int) -> Solution:
    """RK4 over so many steps."""
    return solve(assembly, samples=[0.0, steps * CHAIN_STEP], method="rk4", step=CHAIN_STEP)


def exudyn_chain(steps: int) -> tuple[float, np.ndarray]:
    """The same chain in Exudyn under RK44: seconds of solve and the last mass's place."""
    import exudyn as exu
    import exudyn.itemInterface as items  # noqa: N813

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    before = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[0.0, 0.0, 0.0]))
    for k in range(CHAIN):
        node = mbs.AddNode(items.NodePoint(referenceCoordinates=[(k + 1) * CHAIN_GAP, 0.0, 0.0]))
        mbs.AddObject(items.ObjectMassPoint(physicsMass=CHAIN_MASS, nodeNumber=node))
        marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=node))
        weight = [CHAIN_MASS * g for g in GRAVITY]
        mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=weight))
        mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[before, marker],
                referenceLength=CHAIN_GAP,
                stiffness=CHAIN_STIFFNESS,
                damping=CHAIN_DAMPING,
            )
        )
        before = marker
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = steps * CHAIN_STEP
    settings.timeIntegration.explicit.computeEndOfStepAccelerations = False
    settings.timeIntegration.explicit.computeMassMatrixInversePerBody = True
    settings.timeIntegration.explicit.useLieGroupIntegration = False
    settings.timeIntegration.verboseMode = 0
    settings.linearSolverType = exu.LinearSolverType.EigenSparse  # twice as fast here as its default
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1e9
    settings.displayStatistics = False
    settings.displayComputationTime = False
    began = time.perf_counter()
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)
    spent = time.perf_counter() - began
    place = mbs.GetNodeOutput(node, variableType=exu.OutputVariableType.Position)
    return spent, np.array(place)


def spring_chain(table: Table, repeat: int) -> None:
    """Microseconds a step of RK4 on a chain of 40 masses."""
    steps = 50_000
    assembly = chain()
    found = best(repeat, lambda: step_chain(assembly, steps))
    ours = found.wall_time / found.statistics["steps"] * 1e6
    table.add(f"spring chain, n = {CHAIN}, rk4", ours, "us a step", "<= 4 us")
    try:
        version = importlib.metadata.version("exudyn")
        few = 5000
        runs = [exudyn_chain(few) for _ in range(repeat)]
    except (ImportError, importlib.metadata.PackageNotFoundError) as error:
        print(f"  no comparison with Exudyn: {error}", file=sys.stderr)
        return
    short = 1000  # the chain becomes chaotic later on
    place = step_chain(assembly, short).y[-1, 3 * (CHAIN - 1) : 3 * CHAIN]
    gap = float(np.abs(exudyn_chain(short)[1] - place).max())
    theirs = min(run[0] for run in runs) / few * 1e6
    table.add("  Exudyn, RK44", theirs, "us a step", version=version, gap_of_last_place_after_1_s_m=gap)
    table.add("  Exudyn against evolvent", theirs / ours, "times")


def users_law(table: Table, repeat: int) -> None:
    """A chain on a law that the user wrote, against the built-in one; runs alternate, so that load falls on both."""
    steps, times = 50_000, ([], [])
    assemblies = chain(), chain(law=True)
    for _ in range(2 * repeat):
        for assembly, spent in zip(assemblies, times, strict=True):
            spent.append(best(1, lambda assembly=assembly: step_chain(assembly, steps)).wall_time)
    built_in, law = min(times[0]), min(times[1])
    table.add("user's spring law, rk4", law / steps * 1e6, "us a step")
    table.add("  against the built-in spring", law / built_in, "times", "<= 1.5 times")


# ------------------------------------------------------------------------------------------------ first results

FIRST = """
import evolvent
overrides = {"blade.segments": "inextensible", "solver.method": "dopri5"} if FAST else {}
run = evolvent.run("heliogyro", overrides)
assert run.attrs["status"] == "success"
"""


def fresh_process(command: list[str], cache: str | None, folder: str) -> float:
    """Seconds from starting a process to its end."""
    environment = dict(os.environ)
    if cache is not None:
        environment["EVOLVENT_CACHE"] = cache
    began = time.perf_counter()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    spent = time.perf_counter() - began
    if done.returncode:
        raise RuntimeError(done.stderr)
    return spent


def first_result(table: Table, repeat: int) -> None:
    """Start of a process to its result, interpreter and imports included."""
    fast = [sys.executable, "-W", "ignore", "-c", f"FAST = True\n{FIRST}"]
    default = [sys.executable, "-W", "ignore", "-c", f"FAST = False\n{FIRST}"]
    command = [sys.executable, "-m", "evolvent", "run", "heliogyro", "--quiet", "-o", "run.nc", "--figures", "figures"]
    with tempfile.TemporaryDirectory() as folder:
        cache = os.path.join(folder, "cache")
        cold = fresh_process(fast, cache, folder)
        warm = min(fresh_process(fast, cache, folder) for _ in range(repeat))
        fresh_process(default, cache, folder)
        slower = min(fresh_process(default, cache, folder) for _ in range(repeat))
        figures = min(fresh_process(command, cache, folder) for _ in range(repeat))
    table.add("first result, cold cache", cold, "s", "< 30 s")
    table.add("first result, warm cache", warm, "s", "< 2 s")
    table.add("first result, warm, default case (rk4)", slower, "s")
    table.add("command with figures, warm, default case", figures, "s")


# ------------------------------------------------------------------------------------------------ all


def machine() -> dict[str, Any]:
    """What the figures depend on."""
    model = platform.processor()
    cpuinfo = pathlib.Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].split(":", 1)[1].strip() if lines else model
    versions = {name: importlib.metadata.version(name) for name in ("numpy", "numba", "scipy")}
    return {"cpu": model, "cores": os.cpu_count(), "python": platform.python_version(), **versions, "load": load()}


def load() -> list[float] | None:
    """Mean number of running processes over 1, 5 and 15 minutes."""
    return [round(x, 2) for x in os.getloadavg()] if hasattr(os, "getloadavg") else None


BENCHMARKS = {
    "deployment": deployment,
    "spring_chain": spring_chain,
    "users_law": users_law,
    "first_result": first_result,
}


def main() -> int:
    """Run the benchmarks that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("results.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default, help="JSON file (default: %(default)s)")
    parser.add_argument("--only", nargs="+", choices=sorted(BENCHMARKS), default=list(BENCHMARKS))
    parser.add_argument("--repeat", type=int, default=3, help="runs of each, the best counts (default: %(default)s)")
    options = parser.parse_args()
    table, about = Table(), machine()
    print(f"{about['cpu']}, {about['cores']} cores, load {about['load']}", file=sys.stderr)
    solve(chain(), samples=[0.0, 0.01], method="rk4", step=CHAIN_STEP)  # compiled before anything is timed
    for name in options.only:
        print(f"{name} ...", file=sys.stderr, flush=True)
        BENCHMARKS[name](table, options.repeat)
    about["load_at_the_end"] = load()
    options.output.write_text(json.dumps({"machine": about, "figures": table.figures}, indent=2) + "\n")
    table.show()
    return 0


if __name__ == "__main__":
    sys.exit(main())
