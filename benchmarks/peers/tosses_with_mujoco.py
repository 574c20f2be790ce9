"""MuJoCo: a cube with round corners that falls onto a plane, for `benchmarks/tosses.py`."""

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


def world(spec: dict[str, Any], step: float) -> str:
    """The cube, whose eight corners are spheres, and the board.

    The Jacobian is dense: the sparse factor of MuJoCo 4.0.0 is wrong for some models.
    """
    reach, moment = spec["half"] - spec["rounding"], spec["inertia"] * spec["mass"] * spec["half"] ** 2
    corners = "".join(
        f'<geom type="sphere" size="{spec["rounding"]!r}" '
        f'pos="{text(off + reach * sign for off, sign in zip(spec["off"], signs, strict=True))}"/>'
        for signs in itertools.product((-1.0, 1.0), repeat=3)
    )
    impedance = (spec["impedance"], spec["impedance"], 1e-3, 0.5, 2.0)
    mass = f'mass="{spec["mass"]!r}" diaginertia="{text(3 * [moment])}"'
    return f"""<mujoco>
<option timestep="{step!r}" gravity="0 0 {-spec["gravity"]!r}" cone="elliptic" jacobian="dense"
integrator="implicitfast"/>
<default><geom condim="3" friction="{spec["friction"]!r} 0 0" solimp="{text(impedance)}"
solref="{spec["time_constant"]!r} {spec["damping_ratio"]!r}"/></default>
<worldbody><geom type="plane" size="5 5 0.1"/><body name="cube"><freejoint/>
<inertial pos="0 0 0" {mass}/>{corners}</body></worldbody></mujoco>"""


def prepare(work: str, spec: dict[str, Any], options: dict[str, Any], step: float) -> Callable[[], dict[str, Any]]:
    """Position of the centre of mass and quaternion, scalar first, at `rows` times `every` s apart."""
    substeps = max(1, round(options["every"] / step))
    model = mujoco.MjModel.from_xml_string(world(spec, options["every"] / substeps))

    def run() -> dict[str, Any]:
        data = mujoco.MjData(model)
        data.qpos[:] = options["pose"]
        data.qvel[:] = options["rates"]
        rows = [data.qpos.tolist()]
        for _ in range(options["rows"] - 1):
            mujoco.mj_step(model, data, substeps)
            rows.append(data.qpos.tolist())
        return {"rows": rows}

    return run
