"""Comparison with other programs on the same work, written as the page docs/comparison.md.

    python benchmarks/compare.py [-o benchmarks/compare.json] [--page docs/comparison.md] [--repeat 5] [--no-install]
    python benchmarks/compare.py --redraw [--page docs/comparison.md]

The numbers that the page's figures show are kept beside it as comparison.json; `--redraw` draws them again and measures
nothing.

Exudyn, MuJoCo, PyElastica and MoorDyn are installed in benchmarks/.peers, an environment of their own; those that
cannot be are left out, and the page says so. Each program is a process that is kept; repetitions are interleaved.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import os
import pathlib
import platform
import sys
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "peers"))

import page  # noqa: E402
import plots  # noqa: E402
import works  # noqa: E402
from programs import FIRST, PATIENCE, PYTHON, Program, install  # noqa: E402

#: Programs and what is installed of each.
PEERS = {
    "exudyn": "exudyn>=1.13",
    "mujoco": "mujoco>=3.2",
    "pyelastica": "pyelastica>=0.3",
    "moordyn": "moordyn>=2.3",
}


def request(way: dict[str, Any], step: float, *, timed: bool) -> dict[str, Any]:
    """What a program is asked."""
    spec = works.WORKS[way["work"]]["spec"]
    return {"work": way["work"], "spec": spec, "options": way["options"], "step": step, "timed": timed}


def error_of(places: list[list[float]], reference: list[list[float]]) -> float:
    """Largest distance over the samples, m; NaN where one is not finite or is missing."""
    if len(places) < len(reference) or not all(math.isfinite(x) for place in places for x in place):
        return math.nan
    return max(math.dist(a, b) for a, b in zip(places, reference, strict=True))


def measure(repeat: int, missing: dict[str, str], only: list[str]) -> dict[str, Any]:
    """All works, all ways, repetitions interleaved."""
    works.complete()
    print("references ...", file=sys.stderr, flush=True)
    known = works.references()
    load = os.getloadavg()[0]
    programs: dict[str, Program] = {}
    for name in dict.fromkeys(way["program"] for way in works.WAYS):
        if name in missing:
            continue
        programs[name] = Program(f"with_{name}", peer=name in PEERS)
        if programs[name].missing:
            missing[name] = programs[name].missing
            del programs[name]
    found = []
    for key in only:
        work = works.WORKS[key]
        rows = []
        for way in works.WAYS:
            if way["work"] == key and way["program"] in programs:
                names = ("program", "label", "reference", "options")
                runs = [{"step": step, "stepping": [], "all": []} for step in way["steps"]]
                rows.append({**{k: way[k] for k in names}, "way": way, "runs": runs, "large": []})
        for k in range(repeat + 1):  # the first is not counted: it may compile
            for one in rows:
                program = programs[one["program"]]
                for run in one["runs"]:
                    print(f"{key} {k} {one['label']} {run['step']}", file=sys.stderr, flush=True)
                    answer = program.ask(request(one["way"], run["step"], timed=k > 0))
                    take(run, answer, known[one["reference"]]["places"], counted=k > 0)
                program.patience = FIRST if k == 0 else PATIENCE
        for one in rows:
            for step in one["way"]["large"]:
                answer = programs[one["program"]].ask(request(one["way"], step, timed=False))
                run = {"step": step}
                take(run, answer, known[one["reference"]]["places"], counted=False)
                one["large"].append(run)
            del one["way"]
        used = dict.fromkeys(one["reference"] for one in rows)
        found.append(
            {
                **{name: work[name] for name in ("title", "text", "size")},
                "references": {name: known[name] for name in used},
                "rows": rows,
            }
        )
    for program in programs.values():
        program.close()
    return {
        "date": datetime.date.today().isoformat(),
        "machine": {
            "kind": platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
            "load": [load, os.getloadavg()[0]],
        },
        "repeat": repeat,
        "versions": {name: program.version for name, program in programs.items()},
        "missing": missing,
        "works": found,
    }


def take(run: dict[str, Any], answer: dict[str, Any], reference: list[list[float]], *, counted: bool) -> None:
    """Keep what a run says: seconds a step and in all, error, how it ended."""
    for name in ("raised", "stopped", "warned", "died"):
        if answer.get(name):
            run[name] = answer[name]
    if "places" not in answer:
        return
    run["error"] = error_of(answer["places"], reference)
    if counted and answer["steps"]:
        run["stepping"] += [x / answer["steps"] for x in answer["stepping"]]
        run["all"] += answer["all"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=pathlib.Path, default=HERE / "compare.json")
    parser.add_argument("--page", type=pathlib.Path, default=HERE.parent / "docs" / "comparison.md")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--only", nargs="+", choices=list(works.WORKS), default=list(works.WORKS))
    parser.add_argument("--no-install", action="store_true", help="take the environment as it is")
    parser.add_argument("--redraw", action="store_true", help="draw the figures from the numbers beside the page")
    options = parser.parse_args()
    kept, images = options.page.with_suffix(".json"), options.page.parent / "images"
    if options.redraw:
        plots.draw(json.loads(kept.read_text(encoding="utf-8")), images)
        return 0
    missing = {} if options.no_install else install(PEERS)
    if not PYTHON.exists():
        missing = dict.fromkeys(PEERS, "no environment was set up")
    result = measure(options.repeat, missing, options.only)
    options.output.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    options.page.write_text(page.page(result), encoding="utf-8")
    shown = plots.summary(result)
    kept.write_text(json.dumps(shown, indent=1) + "\n", encoding="utf-8")
    images.mkdir(exist_ok=True)
    plots.draw(shown, images)
    print(options.page.read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
