"""Benchmark of the inertia stand: the map of 999 bodies, and the same bodies under MuJoCo's batch.

    python benchmarks/stand.py [-o benchmarks/stand.json] [--repeat 3] [--bodies 24]

One core throughout. `map`: integration alone of the built-in study's 999 cases over 12.24 s, at a frequency accuracy of
1e-4 or better. `batch`: 999 bodies x 10 s with RK4 at 1 ms; MuJoCo integrates `--bodies` of them with its RK4 at the
same step through `mujoco.rollout` on one thread, a model each, scaled to 999; both must end at the same place.
`equal accuracy`: ours with the method and step whose frequency error is at most that of RK4 at 1 ms.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import sys
import time
from typing import Any, NamedTuple

import numpy as np

from evolvent import cases
from evolvent_massprops import batch
from evolvent_massprops.inertia_stand.structure import build, setup_of

STEP, DURATION = 1e-3, 10.0


class Prepared(NamedTuple):
    """A case, its highest natural frequency (rad/s), and what the batch integrates."""

    case: Any
    highest: float
    suspended: batch.Suspended


def bodies() -> list[Prepared]:
    """The 999 cases of the built-in map."""
    base = cases.load("inertia-stand")
    offsets = [(float(x), float(z)) for x in np.linspace(-1.2, 1.2, 37) for z in np.linspace(-0.56524, 0.56524, 27)]
    moved = [base.body.model_copy(update={"offset_x": x, "offset_z": z}) for x, z in offsets]
    found = []
    for case in (base.model_copy(update={"body": body}) for body in moved):
        highest = float(setup_of(case).modes.natural_frequency.max())
        found.append(Prepared(case, highest, batch.suspended_of(build(case).assemble())))
    return found


def integrate(prepared: list[Prepared], repeat: int, **options: Any) -> tuple[float, np.ndarray]:
    """Best CPU time of the integration, s, and the states."""
    suspended = [item.suspended for item in prepared]
    best = np.inf
    for _ in range(repeat):
        began = time.process_time()
        states = batch.integrate(suspended, **options)
        best = min(best, time.process_time() - began)
    return best, states


def xml(item: Prepared) -> str:
    """The case as a MuJoCo model: a free body, springs as spatial tendons between sites."""
    s = item.suspended
    J = s.inertia
    full = " ".join(repr(float(x)) for x in (J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]))
    text = " ".join(repr(float(x)) for x in s.state[:7])
    pos, quat = " ".join(text.split()[:3]), " ".join(text.split()[3:])
    ground, ends, tendons = [], [], []
    for k in range(len(s.stiffness)):
        ground.append(f'<site name="g{k}" pos="{" ".join(repr(float(x)) for x in s.ground[k])}"/>')
        ends.append(f'<site name="e{k}" pos="{" ".join(repr(float(x)) for x in s.attachment[k])}"/>')
        tendons.append(
            f'<spatial stiffness="{float(s.stiffness[k])!r}" springlength="{float(s.length[k])!r}">'
            f'<site site="g{k}"/><site site="e{k}"/></spatial>'
        )
    return f"""<mujoco><option timestep="{STEP}" integrator="RK4" gravity="0 {float(s.gravity[1])!r} 0">
<flag contact="disable" constraint="disable"/></option><worldbody>{"".join(ground)}
<body pos="{pos}" quat="{quat}"><freejoint/><inertial pos="0 0 0" mass="{float(s.mass)!r}" fullinertia="{full}"/>
{"".join(ends)}</body></worldbody><tendon>{"".join(tendons)}</tendon></mujoco>"""


def mujoco_batch(prepared: list[Prepared]) -> tuple[float, np.ndarray] | None:
    """CPU time, s, and final positions of the bodies under MuJoCo; None where it is not installed."""
    try:
        import mujoco
        from mujoco import rollout
    except ImportError:
        return None
    models = [mujoco.MjModel.from_xml_string(xml(item)) for item in prepared]
    data = mujoco.MjData(models[0])
    size = mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.zeros((len(models), size))
    for k, model in enumerate(models):
        mujoco.mj_resetData(model, data)
        mujoco.mj_getState(model, data, start[k], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    steps = round(DURATION / STEP)
    began = time.process_time()
    state, _ = rollout.rollout(models, data, start, nstep=steps)
    spent = time.process_time() - began
    return spent, np.asarray(state)[:, -1, 1:4]


def main() -> int:
    """Take all figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    default = pathlib.Path(__file__).with_name("stand.json")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=default)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--bodies", type=int, default=24, help="bodies that the peer integrates (default: %(default)s)")
    options = parser.parse_args()
    before = os.getloadavg()
    prepared = bodies()
    batch.warm_up()
    highest = max(item.highest for item in prepared)
    figures: dict[str, Any] = {"cases": len(prepared)}

    # the map: samples of the built-in case, every method at the step that keeps 1e-4
    every, samples = 1.0 / prepared[0].case.sensors.rate, prepared[0].case.sensors.samples
    for method in batch.METHODS:
        steps = max(1, int(np.ceil(every * highest / batch.accurate_step(method, 1e-4))))
        spent, _ = integrate(prepared, options.repeat, every=every, samples=samples, steps=steps, method=method)
        error = batch.amplification(method)(every / steps * highest)[1]
        figures[f"map, {method}"] = {"cpu_s": spent, "frequency_error": error, "step_s": every / steps}

    # the batch at equal step, and at equal frequency accuracy
    steps = round(every / STEP)
    count = round(DURATION / every) + 1
    ours, states = integrate(prepared, options.repeat, every=every, samples=count, steps=steps, method="rk4")
    target = abs(batch.amplification("rk4")(STEP * highest)[1])
    n = max(1, int(np.ceil(every * highest / batch.accurate_step("dop853", target))))
    equal, _ = integrate(prepared, options.repeat, every=every, samples=count, steps=n, method="dop853")
    figures["batch, rk4 at 1 ms"] = {"cpu_s": ours, "us_a_case_step": 1e6 * ours / len(prepared) / (DURATION / STEP)}
    figures["batch, equal frequency accuracy"] = {
        "cpu_s": equal, "method": "dop853", "step_s": every / n, "frequency_error": target
    }  # fmt: skip
    part = prepared[:: max(1, len(prepared) // options.bodies)][: options.bodies]
    peer = mujoco_batch(part)
    if peer is None:
        figures["MuJoCo"] = "not installed"
    else:
        spent, end = peer
        where = [k for k, item in enumerate(prepared) if any(item is one for one in part)]
        gap = float(np.abs(end - states[where, -1, :3]).max())
        whole = spent * len(prepared) / len(part)
        figures["MuJoCo, rk4 at 1 ms"] = {
            "cpu_s_scaled": whole, "bodies": len(part), "us_a_case_step": 1e6 * spent / len(part) / (DURATION / STEP),
            "gap_of_place_at_the_end_m": gap,
        }  # fmt: skip
        figures["MuJoCo / ours, equal step"] = whole / ours
        figures["MuJoCo / ours, equal frequency accuracy"] = whole / equal
    report = {"load": [before, os.getloadavg()], "figures": figures}
    options.output.write_text(json.dumps(report, indent=2) + "\n")
    for name, value in figures.items():
        if isinstance(value, dict):
            value = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in value.items())
        print(f"{name:44} {value if isinstance(value, str) else f'{value:.4g}'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
