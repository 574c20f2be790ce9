"""Shells beside other programs in one run: statics beside Kratos, a swinging plate beside Kratos, Exudyn and MuJoCo.

    python benchmarks/shell_peers.py [-o FILE] [--repeat 2] [--only static] [--no-install] [--data FILE]

The programs are installed in benchmarks/.peers, an environment of their own; all use one core. Every program has the
same nodes and quadrilaterals, material and loads (`peers/shell_works.py`); MuJoCo cuts quadrilaterals into triangles.
CPU time is that of the solve alone, the least of the runs; those longer than 5 s run once. Load steps are the fewest of
2, 5, 10, 20 that converge in Kratos, and those of tests/shells in evolvent.

The plate of `shells.py` falls for 0.2 s in steps of 1 ms; its error is the largest distance of the tip's place from the
reference over four samples. Of evolvent, Exudyn and Kratos the limit is extrapolated from the two finest meshes (error
of second order); the reference is the mean of the first two limits, and the distances of all from it are printed.
Kratos has 4 x 4 and 8 x 8 elements, which take minutes.
`--data` writes the values of Kratos that tests/shells compares with.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import pathlib
import sys
from typing import Any

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "peers"))

import shell_works as works  # noqa: E402
from programs import Program, install  # noqa: E402

Array = np.ndarray
PEERS = {
    "kratos": "KratosMultiphysics==10.4.4 KratosStructuralMechanicsApplication==10.4.4",
    "exudyn": "exudyn==1.13.6",
    "mujoco": "mujoco==4.0.0",
}
#: Runs that take longer, s, are not repeated.
ONCE = 5.0
BOSSAK = {"element": works.KRATOS["thick"], "bossak": -0.05, "relative": 1e-4}
#: Of the plate: program, label, options, and (elements of a side, step in s) of each run.
FINE = [(8, 2.5e-4), (16, 2.5e-4), (16, 1e-3)]
PLATES: list[tuple[str, str, dict[str, Any], list[tuple[int, float]]]] = [
    ("evolvent", "energy-momentum", {"method": "energy-momentum"}, [(8, 1e-3), (16, 1e-3), (32, 1e-3)]),
    ("evolvent", "generalized-alpha", {"method": "generalized-alpha"}, [(8, 1e-3), (16, 1e-3)]),
    ("kratos", "thick corotational, Bossak", BOSSAK, [(4, 1e-3), (8, 1e-3)]),
    ("exudyn", "thin ANCF, Gauss 5 x 5", {"integration": 0, "modified": True}, [(8, 1e-3)]),
    ("exudyn", "thin ANCF, reduced", {"integration": 1, "modified": True}, [(8, 1e-3), (16, 1e-3)]),
    ("mujoco", "triangles, cut at the held corner", {"diagonal": 0}, FINE),
    ("mujoco", "triangles, cut the other way", {"diagonal": 1}, FINE),
]  # fmt: skip
#: Rows whose limits are taken; those of the first two make the reference.
LIMITS = ("energy-momentum", "thin ANCF, reduced", "thick corotational, Bossak")


def best(program: Program, request: dict[str, Any], repeat: int) -> dict[str, Any]:
    """A run with the least CPU time; evolvent may compile in the first one."""
    found: dict[str, Any] = {}
    least = math.inf
    for _ in range(repeat):
        found = program.ask(request)
        if "raised" in found or "died" in found:
            return found
        least = min(least, found["cpu"])
        if found["cpu"] > ONCE:
            break
    return {**found, "cpu": least}


def errors(found: list[float], work: dict[str, Any]) -> list[float]:
    """Errors of what is watched, of its own size or of the structure's length."""
    return [abs(a - b) / work.get("length", abs(b)) for a, b in zip(found, work["wanted"], strict=True)]


def statics(programs: dict[str, Program], repeat: int) -> list[dict[str, Any]]:
    """All static works on all their meshes."""
    rows = []
    print(f"{'':36}{'mesh':>9}  {'program':24}{'error %':>16}{'CPU s':>9}")
    for name, work in works.STATIC.items():
        for mesh in work["meshes"]:
            spec = work["build"](mesh)
            coarse = mesh == work["meshes"][0]
            ways = [("evolvent", "")] + [("kratos", one) for one in (works.KRATOS if coarse else ("thick",))]
            for program, kind in ways:
                if program not in programs:
                    continue
                options = {"steps": work[program], "element": works.KRATOS.get(kind)}
                request = {"work": "static", "spec": spec, "options": options, "step": 0.0, "timed": False}
                answer = best(programs[program], request, repeat)
                row = {"work": name, "mesh": mesh, "program": program, "element": kind, "source": work["source"]}
                label = f"{name:36}{mesh[0]:4} x{mesh[1]:3}  {f'{program} {kind}':24}"
                if "values" in answer:
                    row |= {"values": answer["values"], "errors": errors(answer["values"], work), "cpu": answer["cpu"]}
                    shown = ", ".join(f"{100.0 * one:.2f}" for one in row["errors"])
                    print(f"{label}{shown:>16}{answer['cpu']:9.2f}", flush=True)
                else:
                    row["raised"] = answer.get("raised", "no answer")
                    print(f"{label}  {row['raised']}", flush=True)
                rows.append(row)
    return rows


def plates(programs: dict[str, Program], repeat: int) -> dict[str, Any]:
    """The swinging plate by every program, and the reference."""
    rows: list[dict[str, Any]] = []
    for program, label, options, runs in PLATES:
        for n, step in runs if program in programs else []:
            spec = {**works.plate(n), "samples": works.SAMPLES}
            request = {"work": "dynamic", "spec": spec, "options": options, "step": step, "timed": False}
            answer = best(programs[program], request, repeat)
            row: dict[str, Any] = {"program": program, "label": label, "elements": n, "step": step}
            if "places" in answer:
                row |= {"places": answer["places"], "ms": 1e3 * answer["cpu"] / answer["steps"]}
            else:
                row["raised"] = answer.get("raised", "no answer")
            rows.append(row)
            print(
                f"  {program} {label} {n} x {n}: {row.get('ms', math.nan):.2f} ms a step", file=sys.stderr, flush=True
            )
    limits = {}
    for label in LIMITS:
        found = [np.array(row["places"]) for row in rows if row["label"] == label and "places" in row]
        if len(found) > 1:
            limits[label] = found[-1] + (found[-1] - found[-2]) / 3.0
    reference = np.mean([limits[label] for label in LIMITS[:2] if label in limits], axis=0)

    def off(places: Any) -> float:
        return float(np.linalg.norm(np.asarray(places) - reference, axis=1).max())

    spread = {label: off(places) for label, places in limits.items()}
    print(
        "limits of the plate's tip, mm from the reference: "
        + ", ".join(f"{k} {1e3 * v:.2f}" for k, v in spread.items())
    )
    ours = next((row["ms"] for row in rows if row["label"] == "energy-momentum" and row["elements"] == 16), math.nan)
    print(f"{'':46}{'elements':>10}{'step ms':>9}{'error mm':>10}{'CPU ms a step':>15}{'ratio':>8}")
    for row in rows:
        name = f"{row['program']}, {row['label']}"
        label = f"{name:46}{row['elements']:6} x{row['elements']:2}"
        if "raised" in row:
            print(f"{label}  {row['raised']}")
            continue
        row |= {"error": off(row["places"]), "ratio": row["ms"] / ours}
        print(f"{label}{1e3 * row['step']:9.2f}"
              f"{1e3 * row['error']:10.2f}{row['ms']:15.2f}{row['ratio']:8.2f}")  # fmt: skip
    return {"rows": rows, "reference": reference.tolist(), "spread": spread}


def data(rows: list[dict[str, Any]], plate: dict[str, Any], version: str) -> dict[str, Any]:
    """Values of Kratos, for the tests."""
    kept = [row for row in rows if row["program"] == "kratos" and "values" in row]
    names = ("work", "mesh", "element", "values")
    moving = [row for row in plate["rows"] if row["program"] == "kratos" and "places" in row]
    return {
        "program": "Kratos Multiphysics", "version": version, "written_by": "benchmarks/shell_peers.py --data",
        "static": [{name: row[name] for name in names} for row in kept],
        "plate": [{name: row[name] for name in ("elements", "step", "places")} for row in moving],
        "samples": works.SAMPLES,
    }  # fmt: skip


def main() -> int:
    """Print the tables and write the JSON file."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--only", choices=("static", "plate"), help="one of both tables")
    parser.add_argument("--no-install", action="store_true", help="take the environment as it is")
    parser.add_argument("--data", type=pathlib.Path, help="file of the values that the tests compare with")
    options = parser.parse_args()
    missing = {} if options.no_install else install(PEERS)
    programs = {}
    for name in ("evolvent", *PEERS):
        if name in missing:
            continue
        programs[name] = Program(f"shells_with_{name}", peer=name in PEERS)
        if programs[name].missing:
            print(f"going on without {name}: {programs.pop(name).missing}", file=sys.stderr)
    load, versions = os.getloadavg(), {name: program.version for name, program in programs.items()}
    print(f"load {load[0]:.2f}; " + ", ".join(f"{name} {version}" for name, version in versions.items()))
    rows = statics(programs, options.repeat) if options.only != "plate" else []
    plate = plates(programs, options.repeat) if options.only != "static" else {"rows": []}
    for program in programs.values():
        program.close()
    result = {"load": [load, os.getloadavg()], "versions": versions, "static": rows, "plate": plate}
    options.output.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if options.data and "kratos" in versions:
        text = json.dumps(data(rows, plate, versions["kratos"]), indent=1)
        options.data.write_text(text + "\n", encoding="utf-8")
    print(f"load at the end {os.getloadavg()[0]:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
