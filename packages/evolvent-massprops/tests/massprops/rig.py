"""A simulated stand and its description, shared by the tests of weighing."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import yaml

from evolvent_massprops.inertia import Body, Stand, linear_model

A, B, K = 2.0, 0.8696, 740250.0
RATE = 50.0
BODY = Body(mass=15190.0, centre=(0.1, 0.0, 0.05), inertia=(3703.0, 43920.0, 43920.0))
EXAMPLES = pathlib.Path(__file__).parents[4] / "examples"
#: The example's offsets lie at this body's.
SET = {"body.offset_x": "0.1 m +- 0.5 mm", "body.offset_z": "0.05 m +- 0.5 mm"}
#: The same with the number of modes: to find that takes most of the time of an evaluation.
THREE = SET | {"identification.order": 3}


def stand(**fields: Any) -> Stand:
    """Four springs, with light damping."""
    return Stand.rectangle(A, B, **({"stiffness": K, "length": 0.5, "damping": 200.0} | fields))


def knock(
    *, samples: int = 612, rate: float = RATE, noise: float = 1e-4, seed: int = 1, body: Body = BODY, **fields: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Times and readings (samples, 4), m, of the springs' ends after a load is let go at the first."""
    s = stand(**fields)
    modes = linear_model(s, body).modes()
    t = np.arange(samples) / rate
    x = modes.motion(t, modes.release((0.0, -9806.65, 0.0), s.points[0]), s.points).T
    return t, x + noise * np.random.default_rng(seed).standard_normal(x.shape)


def write_csv(path: pathlib.Path, t: np.ndarray, x: np.ndarray, *, unit: str = " (m)") -> str:
    """A CSV file with the columns time and sensor 1 to 4."""
    head = ",".join(["time (s)", *(f"sensor {c + 1}{unit}" for c in range(x.shape[1]))])
    text = "\n".join(",".join("" if np.isnan(v) else f"{v:.12g}" for v in row) for row in np.column_stack([t, x]))
    path.write_text(f"{head}\n{text}\n", encoding="utf-8")
    return str(path)


def description() -> dict[str, Any]:
    """The example's content."""
    content: dict[str, Any] = yaml.safe_load((EXAMPLES / "stand.yaml").read_text(encoding="utf-8"))
    return content
