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

The same work given to evolvent and to programs that are made for parts of it, in one run, each in a process of its own
that is kept (start, imports and compilation are not counted). Written by `python3 start.py bench compare`, which
installs the others in an environment of their own; what is shown was measured, nothing is copied from elsewhere.
"""
FIGURES = """![Bars: time of a step of each program, for the three works](images/comparison-time.png)

![Error over cost: each program at its steps, for the three works](images/comparison-error.png)

Left and low is better in the second figure: little time, little error. Each line joins the steps of one method; steps
that were refused or stopped are missing. The figures show the numbers of the tables below.
"""
HOW = """How to read the tables:

- **a step** is the stepping alone, median over interleaved repetitions (the least in brackets); **in all** also
  builds the model and makes the checks beforehand.
  evolvent compiles when it is first used, a minute or two for the implicit solver; that is not counted. Its checks
  (highest frequency, laws, accounts) cost tens of milliseconds a run whatever its length, and these runs are short.
- **error** is the largest distance of the place compared from the reference, over its samples.
  Where it does not fall with the step it is that of the mesh, or of the reference, which is only as sure as it says.
- SciPy has no methods of fixed step: its RK45 (fifth order) is held at the step, its control of the error switched off.
  MuJoCo begins anew from its first state after a warning; Exudyn divides a step whose iteration fails.
- **against evolvent** divides by the time a step of evolvent's first row of the same step: above 1, evolvent is faster.
"""


def number(x: float, digits: int = 3) -> str:
    """A figure of so many digits, without an exponent where it reads well."""
    if not math.isfinite(x):
        return "not a number"
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
    told = f"with the warning {words}" if words else "without a word"
    if not math.isfinite(error):
        return f"**ended with what is not a number, {told}**"
    if error > 0.1 * size:
        return f"**ended {told}, wrong by {number(error)} m**"
    return f"ended {told}, error {number(error)} m"


def table(work: dict[str, Any]) -> list[str]:
    """Times and errors of one work."""
    lines = [
        row(["program", "method", "step, s", "a step, us", "in all, ms", "error, m", "against evolvent"]),
        row(["---"] * 2 + ["---:"] * 5),
    ]
    ours = {}
    for way in work["rows"]:
        for run in way["runs"]:
            if way["program"] == "evolvent" and run.get("stepping"):
                ours.setdefault(run["step"], median(run["stepping"]))
    for way in work["rows"]:
        for run in way["runs"]:
            cells = [NAMES[way["program"]], way["label"], number(run["step"])]
            if run.get("stepping"):
                least, middle = min(run["stepping"]), median(run["stepping"])
                cells += [f"{number(1e6 * middle)} ({number(1e6 * least)})", number(1e3 * median(run["all"]))]
                cells.append(number(run["error"], 2))
                same = way["program"] == "evolvent" or run["step"] not in ours
                cells.append("" if same else number(middle / ours[run["step"]], 2))
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
                    f"came to the end with an error of {number(b['error'], 2)} m, ours ({mine['label']}) gave none."
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
                if mine["program"] != "evolvent":
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
                                f"- {who} is {number(fast, 2)} times as fast a step as ours ({mine['label']}), with an "
                                f"error of {number(b['error'], 2)} m against {number(a['error'], 2)} m."
                            )
                        whole = median(a["all"]) / median(b["all"])
                        if whole > 1.0:
                            lines.append(f"- {who} takes 1/{number(whole, 2)} of our time in all ({mine['label']}).")
                        if near < 0.99 and mine["reference"] == theirs["reference"]:
                            lines.append(
                                f"- {who} is nearer the reference: {number(b['error'], 2)} m, "
                                f"ours ({mine['label']}) {number(a['error'], 2)} m."
                            )
    return lines or ["- Nowhere in these works, at these steps."]


def page(result: dict[str, Any]) -> str:
    """The whole page."""
    machine = result["machine"]
    versions = ", ".join(f"{NAMES[name]} {text}" for name, text in result["versions"].items())
    lines = [
        HEAD,
        f"Measured on {result['date']}: {machine['kind']}, {machine['cores']} cores, Python {machine['python']}.",
    ]
    lines += [f"Programs: {versions}.", ""]
    lines += [f"- {NAMES[name]} did not take part: {why}" for name, why in result["missing"].items()]
    load = " and ".join(number(x) for x in machine["load"])
    lines.append(
        f"The machine's load was {load} at the start and the end, {result['repeat']} repetitions were taken in turn;"
    )
    lines += ["where it exceeds the cores by much, ratios tell more than times.", "", FIGURES, HOW]
    for work in result["works"]:
        lines += [f"## {work['title']}", "", work["text"], ""]
        lines += [
            f"Reference ({name}): {one['text']}, sure to {number(one['sure'], 1)} m."
            for name, one in work["references"].items()
        ]
        lines += ["", *table(work), "", "A step that is too large:", ""]
        lines += [row(["program", "method", "step, s", "what it did"]), row(["---", "---", "---:", "---"])]
        for way in work["rows"]:
            for run in way["large"]:
                lines.append(
                    row([NAMES[way["program"]], way["label"], number(run["step"]), outcome(run, work["size"])])
                )
        lines.append("")
    lines += ["## Where evolvent loses", "", *losses(result["works"]), ""]
    return "\n".join(lines)
