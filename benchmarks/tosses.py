"""The cube of the laboratory set `tosses` under MuJoCo, its contact fitted to the same tosses.

    python benchmarks/tosses.py
    python benchmarks/tosses.py --data FOLDER --output own.json

Both programs get the same starts and the same 20 tosses, and both fit contact, rounding, inertia and the offset of the
centre of mass by the same robust least squares. MuJoCo's corners are spheres, as those of this package in effect are.
Kept are the fit of this package, which `evolvent validate tosses --set fitted=0` takes, and the errors of MuJoCo on all
tosses, which the set shows beside its own. MuJoCo is installed in `.peers/`.
"""

from __future__ import annotations

import argparse
import json
import pathlib
from typing import Any

import numpy as np
from peers.programs import Program, install
from scipy.spatial.transform import Rotation

from evolvent_papers.laboratory import toss_cube, toss_records, tosses
from evolvent_papers.laboratory.pendulum import spread_over
from evolvent_papers.laboratory.toss_records import AFTER, Motion, Toss

Array = np.ndarray
STORED = pathlib.Path(tosses.__file__).with_name("data") / "tosses.json"
#: Step of MuJoCo, s, and a finer one that measures its error.
STEP, FINE = 2.5e-4, 5e-5
#: Its numbers: logarithms, and the offset as `tosses` has it. Where a fit starts.
NAMES = ("time_constant", "damping_ratio", "friction", "rounding", "inertia", "slack")
FIRST = (0.01, 1.0, 0.2, 4e-3, 1.0, 0.1)
OFF = 0.05


class Peer:
    """MuJoCo's cube."""

    def __init__(self, program: Program, known: toss_cube.Known) -> None:
        self.program, self.known = program, known

    def spec(self, numbers: Array) -> dict[str, Any]:
        """What a model is made of."""
        own = dict(zip(NAMES, np.exp(numbers[: len(NAMES)]).tolist(), strict=True))
        own["impedance"] = 1.0 - min(own.pop("slack"), 0.9)
        own["rounding"] = min(own["rounding"], 0.9 * self.known.half)
        own["time_constant"] = max(own["time_constant"], 2.0 * STEP)
        own["off"] = (OFF * numbers[len(NAMES) :]).tolist()
        return {**own, "half": self.known.half, "gravity": self.known.gravity, "mass": toss_cube.MASS}

    def predicted(
        self, numbers: Array, toss: Toss, rows: int | None = None, *, step: float = STEP, first: bool = False
    ) -> Motion:
        """The motion of a toss from its flight, or from its first row."""
        spec = self.spec(numbers)
        off = np.array(spec["off"])
        start = toss.first_row(off) if first else toss.start(self.known.gravity, off)
        x, y, z, w = start.pose.as_quat()
        options = {
            "pose": [*start.position.tolist(), w, x, y, z],
            "rates": [*start.velocity.tolist(), *start.spin.tolist()],
            "rows": rows or toss.time.size,
            "every": toss.every,
        }
        answer = self.program.ask({"work": "toss", "spec": spec, "options": options, "step": step, "timed": False})
        if "rows" not in answer:
            raise SystemExit(f"MuJoCo did not predict {toss.name}: {answer}")
        found = np.array(answer["rows"])
        pose = Rotation.from_quat(found[:, [4, 5, 6, 3]])
        return Motion(found[:, :3] + pose.apply(off), pose)


def kept(off: toss_records.Off) -> dict[str, Any]:
    """Differences for JSON."""
    return {
        "position": round(off.position, 6),
        "rotation": round(off.rotation, 5),
        "right": off.right,
        "position_after": np.round(off.position_after, 5).tolist(),
        "rotation_after": np.round(off.rotation_after, 4).tolist(),
    }


def print_means(name: str, offs: list[toss_records.Off]) -> None:
    """Print means over tosses."""
    width, degrees = 100.0 / (2.0 * toss_records.NOMINAL), np.degrees(1.0)
    position, rotation = (np.mean([getattr(one, key) for one in offs]) for key in ("position", "rotation"))
    right = sum(one.right for one in offs)
    print(f"{name:<40} {width * position:6.1f} % {degrees * rotation:6.1f} deg, at rest right {right} of {len(offs)}")


def main() -> None:
    """Fit both, and keep what they find."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--data", help="folder with tosses of the same form; those of the package if left out")
    parser.add_argument("--fitted", type=int, default=20, help="number of tosses that are fitted")
    parser.add_argument("--output", type=pathlib.Path, default=STORED)
    asked = parser.parse_args()
    settings = tosses.Settings(fitted=asked.fitted)
    every = toss_records.tosses_of(asked.data, settings.tosses)
    chosen = spread_over(len(every), min(settings.fitted, len(every) - 1))
    own, others = [every[k] for k in chosen], [one for k, one in enumerate(every) if k not in chosen]
    known = toss_cube.known_of(own)
    found = toss_cube.fit(own, known, settings.horizon)
    print_means("evolvent, others", [one.off(toss_cube.cube(found.values, known).predicted(one)) for one in others])
    missing = install({"MuJoCo": "mujoco"})
    if missing:
        raise SystemExit(f"MuJoCo is missing: {missing['MuJoCo']}")
    program = Program("tosses_with_mujoco", peer=True)
    peer = Peer(program, known)
    start = np.concatenate([np.log(FIRST), np.zeros(3)])
    horizons = [one for one in toss_cube.SOONER if one < settings.horizon] + [settings.horizon]
    theirs = toss_records.fitted(peer.predicted, start, own, horizons)
    name = f"MuJoCo {program.version}"
    offs = {one.name: one.off(peer.predicted(theirs.values, one)) for one in every}
    print_means(f"{name}, fitted", [offs[one.name] for one in own])
    print_means(f"{name}, others", [offs[one.name] for one in others])
    print_means(
        f"{name}, others, first row", [one.off(peer.predicted(theirs.values, one, first=True)) for one in others]
    )
    fine = [peer.predicted(theirs.values, one, step=FINE) for one in others]
    finer = [one.off(motion) for one, motion in zip(others, fine, strict=True)]
    print_means(f"{name}, others, step {FINE:g} s", finer)
    program.close()
    print({key: value for key, value in peer.spec(theirs.values).items() if key != "mass"}, f"cost {theirs.cost:.4f}")
    held = {
        "command": "python benchmarks/tosses.py",
        "evolvent": {
            "known": known._asdict(),
            "fit": {key: np.asarray(value).tolist() for key, value in found._asdict().items()},
        },
        "peer": {
            "program": name,
            "fitted": [one.name for one in own],
            "cost": theirs.cost,
            "parameters": peer.spec(theirs.values),
            "after": list(AFTER),
            "tosses": {key: kept(off) for key, off in offs.items()},
        },
    }
    asked.output.write_text(json.dumps(held) + "\n", encoding="utf-8")
    print(f"written: {asked.output}")


if __name__ == "__main__":
    main()
