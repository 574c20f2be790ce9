"""Figures of the comparison with other programs, from the few numbers of its result that they show."""

from __future__ import annotations

import math
import pathlib
from typing import Any

from page import NAMES, median

#: One colour a program (Okabe and Ito's, told apart without red and green).
COLORS = {
    "evolvent": "#0072b2",
    "exudyn": "#e69f00",
    "mujoco": "#009e73",
    "pyelastica": "#cc79a7",
    "moordyn": "#56b4e9",
    "scipy": "#777777",
}
#: Names of the files, with what they show.
FILES = {
    "comparison-time.png": "Time of a step of each program and method, at the largest step compared",
    "comparison-error.png": "Error over the cost of a second of motion, of each program and method at its steps",
}


def summary(result: dict[str, Any]) -> dict[str, Any]:
    """What the figures show: per run the step (s), time of a step (median, least, s), error (m); when and of what."""
    works = []
    for work in result["works"]:
        rows = []
        for way in work["rows"]:
            runs = [
                {
                    "step": run["step"],
                    "median": median(run["stepping"]),
                    "least": min(run["stepping"]),
                    "error": run["error"] if math.isfinite(run["error"]) else None,
                }
                for run in way["runs"]
                if run.get("stepping")
            ]
            if runs:
                rows.append({"program": way["program"], "label": way["label"], "runs": runs})
        works.append({"title": work["title"], "rows": rows})
    return {key: result[key] for key in ("date", "machine", "repeat", "versions", "missing")} | {"works": works}


def draw(found: dict[str, Any], folder: pathlib.Path) -> None:
    """Draw both figures into a folder."""
    from matplotlib.figure import Figure

    works = found["works"]
    counts = [len(work["rows"]) for work in works]
    times = Figure(figsize=(8.0, 0.3 * sum(counts) + 0.7 * len(works)), layout="constrained")
    panels = times.subplots(len(works), 1, squeeze=False, height_ratios=[n + 1 for n in counts])[:, 0]
    for axes, work in zip(panels, works, strict=True):
        _times(axes, work)
    panels[-1].set_xlabel("time of a step, µs (median; the tick is the least)")
    times.savefig(folder / "comparison-time.png", dpi=150)

    errors = Figure(figsize=(10.0, 4.6), layout="constrained")
    panels = errors.subplots(1, len(works), squeeze=False)[0]
    for axes, work in zip(panels, works, strict=True):
        _errors(axes, work)
    panels[0].set_ylabel("error, m")
    errors.savefig(folder / "comparison-error.png", dpi=150)


def _name(row: dict[str, Any]) -> str:
    return f"{NAMES[row['program']]}: {row['label']}"


def _times(axes: Any, work: dict[str, Any]) -> None:
    """Bars of the time of a step, at the largest step of each row."""
    runs = [max(row["runs"], key=lambda run: run["step"]) for row in work["rows"]]
    for k, (row, run) in enumerate(zip(work["rows"], runs, strict=True)):
        axes.barh(k, 1e6 * run["median"], color=COLORS[row["program"]], height=0.7)
        axes.plot([1e6 * run["least"]] * 2, [k - 0.35, k + 0.35], color="black", linewidth=1.0)
        axes.text(1.05e6 * run["median"], k, f"{1e6 * run['median']:.3g}", va="center", fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(1.0, 1000.0)
    labels = [f"{_name(row)}, {run['step']:g} s" for row, run in zip(work["rows"], runs, strict=True)]
    axes.set_yticks(range(len(labels)), labels, fontsize=8)
    axes.invert_yaxis()
    axes.set_title(work["title"], fontsize=10, loc="left")
    axes.spines[["top", "right"]].set_visible(False)


def _errors(axes: Any, work: dict[str, Any]) -> None:
    """Error over the time that a second of motion takes; the steps of one row are joined."""
    marks = "osD^vPX*"
    for k, row in enumerate(work["rows"]):
        runs = [run for run in row["runs"] if run["error"]]
        cost = [1e3 * run["median"] / run["step"] for run in runs]
        axes.plot(
            cost, [run["error"] for run in runs], color=COLORS[row["program"]], marker=marks[k % len(marks)],
            markersize=6, linewidth=1.0, label=_name(row),
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    low, high = (math.log10(side) for side in axes.get_xlim())
    axes.set_xlim(10.0 ** math.floor(low), 10.0 ** math.ceil(high))  # whole decades, which alone are labelled
    axes.grid(alpha=0.3)
    axes.set_title(work["title"], fontsize=10)
    axes.set_xlabel("stepping a second of motion, ms")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), fontsize=7, frameon=False)
