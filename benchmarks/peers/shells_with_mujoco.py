"""MuJoCo: a flex of two dimensions, triangles with stretching and bending, integrator `discrete` with Newton."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np


def version() -> str:
    return mujoco.__version__


def text(numbers: Any) -> str:
    """Numbers as an attribute has them."""
    return " ".join(repr(x) for x in np.ravel(numbers).tolist())


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """The plate in motion; each quadrilateral is two triangles, by the diagonal of `options["diagonal"]`."""
    x = np.reshape(spec["nodes"], (-1, 3))
    corners = [(0, 1, 2, 0, 2, 3), (0, 1, 3, 1, 2, 3)][options["diagonal"]]
    triangles = [[quad[k] for k in corners] for quad in spec["quads"]]
    mass = spec["density"] * spec["thickness"] * spec["area"]
    xml = f"""<mujoco><option timestep="{step!r}" integrator="discrete" solver="Newton" tolerance="1e-10"
    gravity="0 0 {-spec["gravity"]!r}"><flag contact="disable"/></option><worldbody>
    <flexcomp name="plate" type="direct" dim="2" mass="{mass!r}" radius="{0.5 * spec["thickness"]!r}"
    point="{text(x)}" element="{text(triangles)}"><pin id="{text(spec["pinned"])}"/>
    <contact selfcollide="none"/>
    <elasticity young="{spec["E"]!r}" poisson="{spec["nu"]!r}" thickness="{spec["thickness"]!r}" elastic2d="both"/>
    </flexcomp></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)

    def run() -> dict[str, Any]:
        places, steps, cpu = [], 0, 0.0
        for a, b in itertools.pairwise(spec["samples"]):
            count = round((b - a) / step)
            began = time.process_time()
            mujoco.mj_step(model, data, count)
            cpu += time.process_time() - began
            steps += count
            mujoco.mj_forward(model, data)
            places.append(data.flexvert_xpos[spec["tip"]].tolist())
        warned = [mujoco.mjtWarning(k).name for k in range(len(data.warning)) if data.warning[k].number]
        return {"places": places, "cpu": cpu, "steps": steps, "warned": ", ".join(warned)}

    return run
