"""MuJoCo: points on three slides each, a body on a free joint, springs as tendons."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import mujoco


def version() -> str:
    return mujoco.__version__


def text(numbers: Any) -> str:
    """Numbers as an attribute has them."""
    return " ".join(repr(float(x)) for x in numbers)


def world(spec: dict[str, Any], options: dict[str, Any], step: float, bodies: str, springs: list[str]) -> str:
    gravity = f"0 0 {-spec['gravity']!r}"
    option = f'<option timestep="{step!r}" integrator="{options["integrator"]}" gravity="{gravity}">'
    return f"""<mujoco>{option}<flag contact="disable"/></option>
<worldbody>{bodies}</worldbody><tendon>{"".join(springs)}</tendon></mujoco>"""


def spring(stiffness: float, damping: float, length: float, a: str, b: str) -> str:
    return (
        f'<spatial stiffness="{stiffness!r}" damping="{damping!r}" springlength="{length!r}">'
        f'<site site="{a}"/><site site="{b}"/></spatial>'
    )


def line(spec: dict[str, Any], options: dict[str, Any], step: float) -> str:
    n = spec["segments"]
    h = spec["length"] / n
    bodies, springs = [f'<site name="s0" pos="{text(spec["nodes"][0])}"/>'], []
    slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    for i, place in enumerate(spec["nodes"][1:], 1):
        mass = spec["density"] * h * (1.0 if i < n else 0.5) + (0.0 if i < n else spec["bob"])
        # slides alone: the body does not turn, and its inertia does not matter
        bodies.append(
            f'<body name="b{i}" pos="{text(place)}">{slides}<inertial pos="0 0 0" mass="{mass!r}" '
            f'diaginertia="1e-3 1e-3 1e-3"/><site name="s{i}"/></body>'
        )
        springs.append(spring(spec["EA"] / h, spec["BA"] / h, h, f"s{i - 1}", f"s{i}"))
    return world(spec, options, step, "".join(bodies), springs)


def body(spec: dict[str, Any], options: dict[str, Any], step: float) -> str:
    ground, ends, springs = [], [], []
    for k, corner in enumerate(spec["corners"]):
        ground.append(f'<site name="g{k}" pos="{text([corner[0], corner[1], spec["height"]])}"/>')
        ends.append(f'<site name="s{k}" pos="{text(corner)}"/>')
        springs.append(spring(spec["stiffness"], spec["damping"], spec["natural"], f"g{k}", f"s{k}"))
    inner = (
        f'<body name="body"><freejoint/><inertial pos="0 0 0" mass="{spec["mass"]!r}" '
        f'diaginertia="{text(spec["inertia"])}"/>{"".join(ends)}</body>'
    )
    return world(spec, options, step, "".join(ground) + inner, springs)


def variants(spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """All masses by `mujoco.rollout`, a model each and the data of each thread."""
    import numpy as np
    from mujoco import rollout

    models = [
        mujoco.MjModel.from_xml_string(body(spec | {"mass": mass}, {"integrator": "RK4"}, step))
        for mass in spec["masses"]
    ]
    data = [mujoco.MjData(models[0]) for _ in range(options["threads"])]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((len(models), mujoco.mj_stateSize(models[0], kind)))
    for k, model in enumerate(models):
        first = mujoco.MjData(model)
        first.qvel[3:6] = spec["spin"]
        mujoco.mj_getState(model, first, start[k], kind)
    count = round(spec["samples"][-1] / step)

    def run() -> dict[str, Any]:
        with rollout.Rollout(nthread=options["threads"] if options["threads"] > 1 else 0) as pool:
            state, _ = pool.rollout(models, data, start, nstep=count)
        return {"places": np.asarray(state)[:, -1, 1:4].tolist(), "steps": len(models) * count}

    return run


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """Steps counted by `mj_step(model, data, nstep)`, in one call for each sample."""
    if work == "variants":
        return variants(spec, options, step)
    model = mujoco.MjModel.from_xml_string({"line": line, "body": body}[work](spec, options, step))
    data = mujoco.MjData(model)
    site = f"s{spec['segments']}" if work == "line" else "s0"
    if work == "body":
        data.qvel[3:6] = spec["spin"]

    def run() -> dict[str, Any]:
        times, places, steps = spec["samples"], [], 0
        for a, b in itertools.pairwise(times):
            count = round((b - a) / step)
            mujoco.mj_step(model, data, count)
            steps += count
            mujoco.mj_kinematics(model, data)
            places.append(data.site(site).xpos.tolist())
        warned = [mujoco.mjtWarning(k).name for k in range(len(data.warning)) if data.warning[k].number]
        return {"places": places, "steps": steps, "warned": ", ".join(warned)}

    return run
