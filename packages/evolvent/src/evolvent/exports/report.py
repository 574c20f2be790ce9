"""A run as one HTML page that needs nothing else: no network, no file beside it."""

from __future__ import annotations

import dataclasses
import datetime
import io
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from evolvent import cases
from evolvent.analysis import clearance_results
from evolvent.analysis.clearance import clearances
from evolvent.exports import margins_page
from evolvent.exports.figure_pictures import figure_picture, figure_pictures
from evolvent.exports.pictures import pictures
from evolvent.results import WELL, made_with, statistics_of, unfinished
from evolvent.view import animation
from evolvent_base import pages
from evolvent_base.errors import counted
from evolvent_base.files import write_file

#: Stills that stand for the animation on paper.
_STILLS = 3
#: Units of what is conserved, or accounted for.
_ACCOUNTS = {"J": "Energy", "kg m2 s-1": "Angular momentum", "kg m s-1": "Linear momentum"}


def write(
    run: Any,
    path: str,
    *,
    date: datetime.datetime | None = None,
    clearance: bool = False,
    written: Sequence[str] = (),
) -> int:
    """Write the report of a run; returns its size, bytes.

    Parameters
    ----------
    run : xarray.Dataset
    path : str
    date : the moment that it states; now unless given
    clearance : bool, whether it has clearances between bodies, which need the package coal
    written : files of the run's figures, which it shows; figures that have no file are drawn

    Raises
    ------
    InputError
        If the file cannot be written, or clearances cannot be found.
    """
    found = clearances(run) if clearance else None
    page = _page(run, date or datetime.datetime.now(datetime.UTC), found, written).encode()
    write_file(path, page)
    return len(page)


def _page(run: Any, date: datetime.datetime, found: xr.Dataset | None, written: Sequence[str]) -> str:
    module = cases.presenter(run)
    status = run.attrs["status"]
    parts = {
        "results": ("Results", [(n.label, n.value) for n in module.numbers(run) if n.label != "warning"]),
        "animation": ("Animation", _animation(run, found)),
        "figures": ("Figures", figure_pictures(module.figures(run), written)),
        "margins": ("Margins", margins_page.section(run)),
        "clearances": ("Clearances", {} if found is None else _clearances(found)),
        "balances": ("Balances", _balances(run)),
        "case": ("Case", run.attrs["case"]),
        "provenance": ("Provenance", _provenance(run, date)),
    }
    shown = {key: name for key, (name, content) in parts.items() if content}
    return pages.render(
        "report.html",
        title=_title(run),
        status=status,
        good=status in WELL,
        facts=_facts(run),
        notes=_notes(run),
        sections=shown,
        **{key: content for key, (_, content) in parts.items()},
    )


# ------------------------------------------------------------------------------------------------ parts


def _title(run: Any) -> str:
    motion = cases.presenter(run).motion(run)
    system: str = run.attrs["system"].replace("-", " ").capitalize()
    if motion is None or motion.title.startswith(system):
        return system
    return f"{system}: {motion.title[:1].lower()}{motion.title[1:]}"


def _facts(run: Any) -> list[str]:
    """Samples, solver and date of a run."""
    attrs = run.attrs
    return [
        f"{counted(run.sizes['time'], 'sample')} to {float(run.time.values[-1]):.6g} s",
        attrs["method"],
        _day(attrs["date"]) if "date" in attrs else "date not recorded",
    ]


def _day(date: str) -> str:
    try:
        moment = datetime.datetime.fromisoformat(date)
        return f"{moment.day} {moment:%B %Y, %H:%M %Z}".strip(" ,")
    except ValueError:
        return date


def _notes(run: Any) -> list[dict[str, Any]]:
    """What a reader must know first: that the run is not complete, and its warnings."""
    attrs, notes = run.attrs, []

    def add(kind: str, *texts: str, heading: str = "") -> None:
        notes.append({"kind": kind, "heading": heading, "texts": texts})

    if unfinished(run):
        heading = {"failed": "This run failed", "interrupted": "This run was interrupted"}[attrs["status"]]
        message = attrs["message"].removeprefix(attrs["status"]).strip(" :")
        covers = f"What follows covers the run up to {float(run.time.values[-1]):.6g} s"
        add("failure", message, f"{covers} and is no result of the whole case.", heading=heading)
    elif attrs["status"] != "success":
        add("note", attrs["message"])
    if attrs.get("warning"):
        add("warning", attrs["warning"], heading="Warning")
    if attrs.get("latches"):
        add("note", f"Latches: {attrs['latches']}.")
    laws = json.loads(attrs["laws"])
    if laws:
        named = ", ".join(f"{key}: {law}" for key, law in laws.items())
        add("note", f"This run used laws of the user, which the case cannot hold: {named}.")
    return notes


def _clearances(found: xr.Dataset) -> dict[str, Any]:
    """Table, figure and sentences."""
    drawn = figure_picture(clearance_results.figure(found))
    return {"rows": clearance_results.rows(found), "drawn": drawn, "notes": clearance_results.notes(found)}


def _animation(run: Any, found: xr.Dataset | None) -> dict[str, Any]:
    """The page of the animation, and stills for paper; empty if the run holds no motion."""
    motion = animation.of_run(run)
    if motion is None:
        return {}
    motion = motion if found is None else clearance_results.marked(motion, found)
    from PIL import Image

    stills = []
    plain = dataclasses.replace(motion, title="")
    times = np.linspace(motion.time[0], motion.time[-1], _STILLS + 1)[1:]
    for picture in pictures(plain, times, size=(360, 270), inertial=True):
        content = io.BytesIO()
        Image.fromarray(picture[..., :3]).quantize(64, dither=Image.Dither.NONE).save(
            content, format="PNG", optimize=True
        )
        stills.append(pages.picture(content.getvalue(), "png", motion.title))
    return {"title": motion.title, "page": animation.page(motion, playing=False)[0].decode(), "stills": stills}


def _balances(run: Any) -> dict[str, list[Any]]:
    """Largest defects of the balances, and the values of conserved quantities; empty if there are none."""
    time = run.time.values
    defects: list[tuple[str, ...]] = []
    kept: dict[str, list[tuple[str, ...]]] = {}
    for name, variable in run.data_vars.items():
        if variable.dims[:1] != ("time",) or variable.dtype.kind != "f" or np.isnan(variable.values).all():
            continue
        values = variable.values.reshape(time.size, -1)
        if str(name).endswith(("_balance", "_defect")) and values.shape[1] == 1:
            k = int(np.nanargmax(np.abs(values[:, 0])))
            unit = variable.attrs.get("units", "1")
            long_name = variable.attrs.get("long_name", str(name)) + ("" if unit == "1" else f", {unit}")
            defects.append((long_name, f"{values[k, 0]:.2e}", f"{time[k]:.5g} s", f"{values[-1, 0]:.2e}"))
        elif variable.attrs.get("units") in _ACCOUNTS and values.shape[1] <= 12:
            kept.setdefault(variable.attrs["units"], []).extend(_account(run, str(name)))
    tables = [
        {"name": _ACCOUNTS[unit], "unit": unit.replace("m2", "m²").replace("s-1", "s⁻¹"), "rows": rows}
        for unit, rows in kept.items()
    ]
    return {"defects": defects, "kept": tables} if defects or tables else {}


def _account(run: Any, name: str) -> list[tuple[str, ...]]:
    """Rows of one variable: what it is, first, least, largest, last; none for what is zero throughout."""
    variable = run[name]
    values = variable.values.reshape(variable.sizes["time"], -1)
    places = [""]
    for dimension in variable.dims[1:]:
        listed = run[dimension].values if dimension in run.coords else np.arange(1, run.sizes[dimension] + 1)
        places = [f"{before}, {x}".lstrip(", ") for before in places for x in listed]
    rows = []
    for k, place in enumerate(places):
        one = values[:, k]
        if np.any(np.nan_to_num(one)):
            what = variable.attrs.get("long_name", name)
            numbers = (one[0], np.nanmin(one), np.nanmax(one), one[-1])
            rows.append((f"{what}: {place}" if place else what, *(f"{x + 0.0:.4g}" for x in numbers)))
    return rows


def _count(value: float) -> str:
    """Whole numbers with all their digits."""
    return f"{int(value):,}" if float(value).is_integer() and abs(value) < 1e15 else f"{value:.6g}"


def _provenance(run: Any, date: datetime.datetime) -> list[tuple[str, str]]:
    """Rows of what made the run and the report."""
    attrs = run.attrs
    statistics = {k: v for k, v in statistics_of(run).items() if v is not None}
    account = ", ".join(f"{name.replace('_', ' ')} {_count(value)}" for name, value in statistics.items())
    return [
        ("run on", _day(attrs["date"]) if "date" in attrs else "not recorded in the file"),
        ("run with", attrs.get("made_with", f"evolvent {attrs['version']}; the rest is not recorded in the file")),
        ("method", f"{attrs['method']}: {account}" if account else attrs["method"]),
        ("time of the solve", f"{attrs['wall_time_s']:.3g} s, and {attrs['compile_time_s']:.3g} s to compile or load"),
        ("credibility", attrs.get("credibility", "not recorded in the file")),
        ("report written on", _day(date.isoformat())),
        ("report written with", made_with()),
    ]
