"""The page of the comparison from its result; nothing is measured here."""

from __future__ import annotations

import math
from typing import Any

NAMES = {
    "evolvent": "evolvent",
    "exudyn": "Exudyn",
    "mujoco": "MuJoCo",
    "pyelastica": "PyElastica",
    "moordyn": "MoorDyn",
    "scipy": "SciPy",
}
HEAD = """# Comparison with other programs

<!-- written by `python3 start.py bench compare` -->

The same work in evolvent and in other programs, measured on one machine. Each program runs in its own process;
start, imports and compilation are not counted. `python3 start.py bench compare` installs the other programs in an
environment of their own, measures, and writes this page.
"""
#: Sphinx reads date and version from the file beside the page (docs/_ext/reference.py).
MEASURED = """```{measured} comparison.json
```
"""
FIGURES = """![Bars: time of a step of each program, for each work](images/comparison-time.png)

![Error over cost: each program at its steps, for each work](images/comparison-error.png)

In the second figure, left and low is better: less time, less error. Each line connects the steps of one method; steps
that were refused or stopped are missing. The figures show the numbers of the tables below.
"""
HOW = """How to read the tables:

- **per step** is the time of the stepping, median over interleaved repetitions (the smallest in brackets); **total**
  also includes building the model and the checks before the run.
  evolvent compiles at its first use, a minute or two for the implicit solver; that is not counted. Its checks
  (highest frequency, laws, balances) take tens of milliseconds per run, whatever its length, and these runs are short.
- **error** is the largest distance of the compared point from the reference, over the samples.
  Where it does not decrease with the step it is the error of the mesh, or of the reference, whose accuracy is stated.
- SciPy has no methods of fixed step: its RK45 (fifth order) runs at the step without error control.
  MuJoCo restarts from its first state after a warning; Exudyn divides a step whose iteration fails.
- **against evolvent** is the time per step over that of evolvent's first row with the same step: above 1, evolvent is
  faster; of rows with several threads, over that of evolvent with as many.
"""


def number(x: float, digits: int = 3) -> str:
    """A figure of so many digits, without an exponent where it reads well."""
    if not math.isfinite(x):
        return "NaN"
    return f"{x:.{digits}g}"


def row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def median(values: list[float]) -> float:
    """Middle of the values, or the mean of the two there."""
    s, k = sorted(values), len(values) // 2
    return s[k] if len(s) % 2 else 0.5 * (s[k - 1] + s[k])


def outcome(found: dict[str, Any], size: float) -> str:
    """What a program did on a step that is too large, in words."""
    words = " ".join((found.get("raised") or found.get("stopped") or found.get("warned") or "").split())
    words = words.replace("|", "/")[:220]
    if found.get("died"):
        return "the process died"
    if found.get("raised"):
        return f"refused or stopped: {words}"
    if found.get("stopped"):
        return f"stopped: {words}"
    error = found["error"]
    ending = f"with the warning {words}" if words else "without a warning"
    if not math.isfinite(error):
        return f"**ended with NaN, {ending}**"
    if error > 0.1 * size:
        return f"**ended {ending}, wrong by {number(error)} m**"
    return f"ended {ending}, error {number(error)} m"


def threads(way: dict[str, Any]) -> int:
    """Threads of a row, 1 where it says nothing."""
    return int(way.get("options", {}).get("threads", 1))


def table(work: dict[str, Any]) -> list[str]:
    """Times and errors of one work."""
    lines = [
        row(["program", "method", "step, s", "per step, us", "total, ms", "error, m", "against evolvent"]),
        row(["---"] * 2 + ["---:"] * 5),
    ]
    ours = {}
    for way in work["rows"]:
        for run in way["runs"]:
            if way["program"] == "evolvent" and run.get("stepping"):
                ours.setdefault((run["step"], threads(way)), median(run["stepping"]))
    for way in work["rows"]:
        for run in way["runs"]:
            cells = [NAMES[way["program"]], way["label"], number(run["step"])]
            if run.get("stepping"):
                least, middle = min(run["stepping"]), median(run["stepping"])
                cells += [f"{number(1e6 * middle)} ({number(1e6 * least)})", number(1e3 * median(run["all"]))]
                cells.append(number(run["error"], 2))
                key = run["step"], threads(way)
                same = way["program"] == "evolvent" or key not in ours
                cells.append("" if same else number(middle / ours[key], 2))
            else:
                cells += ["", "", outcome(run, work["size"]), ""]
            lines.append(row(cells))
    return lines


def carried(work: dict[str, Any], mine: dict[str, Any], theirs: dict[str, Any]) -> list[str]:
    """Steps above the sensible that another program carried to the end, near the reference, and ours did not."""
    lines = []
    for a in mine["large"]:
        for b in theirs["large"]:
            gave_up = a.get("raised") or a.get("stopped") or a.get("died")
            if a["step"] == b["step"] and gave_up and outcome(b, work["size"]).startswith("ended without"):
                lines.append(
                    f"- {work['title']}, step {number(a['step'])} s: {NAMES[theirs['program']]} ({theirs['label']}) "
                    f"completed the run with an error of {number(b['error'], 2)} m, ours ({mine['label']}) did not."
                )
    return lines


def losses(works: list[dict[str, Any]]) -> list[str]:
    """Where another program is faster, or nearer the reference, at the same step."""
    lines = []
    for work in works:
        for theirs in work["rows"]:
            if theirs["program"] == "evolvent":
                continue
            for mine in work["rows"]:
                if mine["program"] != "evolvent" or threads(mine) != threads(theirs):
                    continue
                if mine["reference"] == theirs["reference"]:
                    lines += carried(work, mine, theirs)
                for a in mine["runs"]:
                    for b in theirs["runs"]:
                        if a["step"] != b["step"] or not b.get("stepping"):
                            continue
                        who = f"{work['title']}, step {number(a['step'])} s: {NAMES[theirs['program']]}"
                        who += f" ({theirs['label']})"
                        if a.get("raised"):
                            lines.append(f"- {who} takes this step, ours ({mine['label']}) is refused.")
                        if not a.get("stepping"):
                            continue
                        fast, near = median(a["stepping"]) / median(b["stepping"]), b["error"] / a["error"]
                        if fast > 1.0:
                            lines.append(
                                f"- {who} is {number(fast, 2)} times as fast per step as ours ({mine['label']}), "
                                f"with an error of {number(b['error'], 2)} m against {number(a['error'], 2)} m."
                            )
                        whole = median(a["all"]) / median(b["all"])
                        if whole > 1.0:
                            lines.append(f"- {who} takes 1/{number(whole, 2)} of our total time ({mine['label']}).")
                        if near < 0.99 and mine["reference"] == theirs["reference"]:
                            lines.append(
                                f"- {who} is closer to the reference: {number(b['error'], 2)} m, "
                                f"ours ({mine['label']}) {number(a['error'], 2)} m."
                            )
    return lines or ["- Nowhere in these works, at these steps."]


def page(result: dict[str, Any]) -> str:
    """The whole page."""
    machine = result["machine"]
    versions = ", ".join(f"{NAMES[name]} {text}" for name, text in result["versions"].items())
    lines = [
        HEAD,
        MEASURED,
        f"Measured on {result['date']}: {machine['kind']}, {machine['cores']} cores, Python {machine['python']}.",
    ]
    lines += [f"Programs: {versions}.", ""]
    lines += [f"- {NAMES[name]} did not take part: {why}" for name, why in result["missing"].items()]
    load = " and ".join(number(x) for x in machine["load"])
    lines.append(f"The machine's load was {load} at the start and the end, {result['repeat']} interleaved repetitions;")
    lines += ["where it is far above the number of cores, ratios are more reliable than times.", "", FIGURES, HOW]
    for work in result["works"]:
        lines += [f"## {work['title']}", "", work["text"], ""]
        lines += [
            f"Reference ({name}): {one['text']}, accurate to {number(one['sure'], 1)} m."
            for name, one in work["references"].items()
        ]
        lines += ["", *table(work), ""]
        if any(way["large"] for way in work["rows"]):
            lines += ["A step that is too large:", ""]
            lines += [row(["program", "method", "step, s", "outcome"]), row(["---", "---", "---:", "---"])]
        for way in work["rows"]:
            for run in way["large"]:
                lines.append(
                    row([NAMES[way["program"]], way["label"], number(run["step"]), outcome(run, work["size"])])
                )
        lines.append("")
    lines += ["## Where evolvent loses", "", *losses(result["works"]), ""]
    return "\n".join(lines)
