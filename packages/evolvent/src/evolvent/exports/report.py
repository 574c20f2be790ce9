"""A run as one HTML page that needs nothing else: no network, no file beside it."""

from __future__ import annotations

import dataclasses
import datetime
import io
import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from PIL import Image

from evolvent import cases
from evolvent.analysis.clearance import clearances
from evolvent.analysis.clearance_results import Clearances
from evolvent.analysis.margins import evaluation, factors, latches
from evolvent.analysis.margins.results import MarginResults
from evolvent.analysis.system import System
from evolvent.exports import drawings
from evolvent.exports.pictures import pictures
from evolvent.results import WELL, limits, made_with, statistics_of, unfinished
from evolvent.results.tree import solution_of
from evolvent.view import animation, show
from evolvent_base import answer as an, pages, showing
from evolvent_base.errors import InputError, counted
from evolvent_base.figures import Figure
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
    written : files of the run's figures and animation, which it shows; what has no file is drawn

    Raises
    ------
    InputError
        If the file cannot be written, or clearances cannot be found.
    """
    found = clearances(run) if clearance else None
    page = _page(run, date or datetime.datetime.now(datetime.UTC), found, written).encode()
    write_file(path, page)
    return len(page)


def _page(run: Any, date: datetime.datetime, found: Clearances | None, written: Sequence[str]) -> str:
    module, stored = cases.presenter(run), _Stored.of(run)
    margins, words = _margins(run, stored)
    results = [(n.label, n.value) for n in module.numbers(run) if n.label != "warning"]
    again = an.Remark("Saved as a file, this case can be run again: evolvent run case.yaml.")
    parts: dict[str, Sequence[an.Block]] = {
        "Results": [an.Table(heads=(), rows=results, words=2, kind="results")],
        "Animation": _animation(run, found, written),
        "Figures": _pictures(module.figures(run), written),
        "Storage": stored.blocks,
        "Margins": words,
        "Clearances": [] if found is None else an.within(found.answer()),
        "Balances": _balances(run),
        "Case": [again, an.Listing(run.attrs["case"])],
        "Provenance": [an.Table(heads=(), rows=_provenance(run, date), words=2, kind="results")],
    }
    sections = [an.Section(title=title, blocks=blocks) for title, blocks in parts.items() if blocks]
    status, missed, met = run.attrs["status"], _missed(run, margins), limits.met(limits.of_run(run))
    verdict = f"{status}, but {' and '.join(missed)}" if missed else f"{status}, {met}" if met else status
    return showing.page(
        an.Answer(
            title=_title(run), about="Report of a simulation",
            status=(verdict, status in WELL and not missed),
            facts=[*_facts(run), *stored.facts], sections=[*_verdict(run, margins, missed), *_notes(run), *sections],
            contents=True,
        )
    )  # fmt: skip


def _missed(run: Any, margins: MarginResults | None) -> list[str]:
    """What does not hold: limits that are missed, and margins below 0."""
    found = [text] if (text := limits.verdict(limits.of_run(run))) else []
    if margins is not None and margins.negative:
        count = len(margins.negative)
        found.append(f"{counted(count, 'margin')} {'is' if count == 1 else 'are'} negative")
    return found


def _verdict(run: Any, margins: MarginResults | None, missed: Sequence[str]) -> list[an.Section]:
    """What the run says of the limits and margins of its case; none of one without them."""
    found: list[str] = [f"Limit {one.text}: {one.shown}" for one in limits.of_run(run)]
    if margins is not None and margins.names:
        where = f", in {', '.join(margins.negative)}" if margins.negative else ""
        found.append(f"least margin {margins.least:+.3f}{where}")
    kind = "failure" if missed else "good"
    return [an.Section(title="Verdict", blocks=[an.Points(found)], kind=kind)] if found else []


# ------------------------------------------------------------------------------------------------ parts


def _title(run: Any) -> str:
    motion = cases.presenter(run).motion(run)
    system: str = run.attrs["system"].replace("-", " ").capitalize()
    if motion is None or motion.title.startswith(system):
        return system
    return f"{system}: {motion.title}"


def _facts(run: Any) -> list[tuple[str, str]]:
    """Samples, solver and date of a run."""
    attrs = run.attrs
    return [
        ("time", f"{counted(run.sizes['time'], 'sample')} to {float(run.time.values[-1]):.6g} s"),
        ("method", attrs["method"]),
        ("date", _day(attrs["date"]) if "date" in attrs else "not recorded"),
    ]


def _day(date: str) -> str:
    try:
        moment = datetime.datetime.fromisoformat(date)
        return f"{moment.day} {moment:%B %Y, %H:%M %Z}".strip(" ,")
    except ValueError:
        return date


def _notes(run: Any) -> list[an.Section]:
    """What a reader must know first: that the run is not complete, and its warnings."""
    attrs, notes = run.attrs, list[an.Section]()

    def add(kind: str, *texts: str, heading: str = "") -> None:
        notes.append(an.Section(title=heading, blocks=texts, kind=kind))

    if unfinished(run):
        heading = {"failed": "This run failed", "interrupted": "This run was interrupted"}[attrs["status"]]
        message = attrs["message"].removeprefix(attrs["status"]).strip(" :")
        covers = f"What follows covers the run up to {float(run.time.values[-1]):.6g} s"
        add("failure", message, f"{covers} and is no result of the whole case.", heading=heading)
    elif attrs["status"] != "success":
        add("note", attrs["message"])
    if attrs.get("warning"):
        add("warning", attrs["warning"], heading="Warning")
    laws = json.loads(attrs["laws"])
    if laws:
        named = ", ".join(f"{key}: {law}" for key, law in laws.items())
        add("note", f"This run used laws of the user, which the case cannot hold: {named}.")
    return notes


def _system(run: Any, content: dict[str, Any]) -> System:
    """The parts of a run, from its case, of which other analyses are made.

    Raises
    ------
    InputError
        Where the run does not hold all of it.
    """
    if json.loads(run.attrs["laws"]):
        raise InputError("the run used laws of the user, which the case cannot hold")
    cases.check_files_of_run(run)
    name = (content.get("margin") or {}).get("factors")
    if name is not None and name not in factors.built_in():
        raise InputError(f"the run does not hold the factors of {name!r}; evolvent margin reads them")
    found: System = cases.presenter(run).system(cases.load(content))
    return found


@dataclasses.dataclass(frozen=True)
class _Stored:
    """What a run says of the storage before it: nothing of one that was not stored.

    Attributes
    ----------
    facts : list of (name, value), how long it was stored, and how warm
    blocks : list of blocks, forces and margins before and after
    system : System, optional, of the run, after its storage
    """

    facts: list[tuple[str, str]]
    blocks: list[an.Block]
    system: System | None = None

    @classmethod
    def of(cls, run: Any) -> _Stored:
        """That of a run; where it cannot be found, the reason is stated."""
        content = cases.content_of_run(run)
        if not content.get("store"):
            return cls([], [])
        try:
            system = _system(run, content)
            found = system.storage(motion=False)
        except InputError as error:
            return cls([], [f"What storage has left is not stated: {error}."])
        return cls([("stored", found.stored_for)], an.within(found.answer()), system)


def _margins(run: Any, stored: _Stored) -> tuple[MarginResults | None, list[an.Block]]:
    """The margins of the case of a run, with what the run says of latches and stops; none without a key `margin`.

    Where the margins cannot be found, the reason is stated.
    """
    content = cases.content_of_run(run)
    if not isinstance(content.get("margin"), dict):
        return None, []
    try:
        found = _margins_of(run, stored.system or _system(run, content))
        shown = an.within(found.answer())
    except InputError as error:
        return None, [f"The margins of this case are not stated: {error}."]
    return found, [*(f"After storage for {value}." for _, value in stored.facts), *shown]


def _margins_of(run: Any, system: System) -> MarginResults:
    """Margins of the case of a run, its latches and stops; those along the run where its states are kept."""
    keys = evaluation.with_keys(system.sections.get("margin", {}), {})
    at_rest = evaluation.at_rest(system.assemble(), keys)
    solution, why = solution_of(run), "a file of results has no states; evolvent margin gives them"
    if solution is not None and solution.status == "failed":
        solution, why = None, "the run failed"
    try:
        found, why = at_rest.results(solution), "" if solution is not None else why
    except InputError as error:
        if solution is None:
            raise
        found, why = at_rest.results(), str(error)
    found.latches = [latches.of_tree(at_rest.assembly, table, run) for table in at_rest.tables]
    found.without_run = why
    return found


def _pictures(figures: Sequence[Figure], written: Sequence[str] = ()) -> list[pages.Picture]:
    """Figures as images in the page, those that were `written` as PNG or SVG files as these files are."""
    kinds = {".png": "png", ".svg": "svg+xml"}
    files = {os.path.basename(path): path for path in written}
    found = []
    for figure in figures:
        for ending, kind in kinds.items():
            if (path := files.get(figure.name + ending)) is not None:
                found.append(pages.picture(pathlib.Path(path).read_bytes(), kind, figure.title, titled=True))
                break
        else:
            found.append(showing.figure_picture(figure))
    return found


def _animation(run: Any, found: Clearances | None, written: Sequence[str]) -> list[an.Block]:
    """The page of the animation, and stills for paper; empty if the run holds no motion.

    Without clearances, which it would show, the page is the file that is `written`.
    """
    motion = animation.of_run(run)
    if motion is None:
        return []
    motion = motion if found is None else found.marked(motion)
    stills = []
    plain = dataclasses.replace(motion, title="")
    times = np.linspace(motion.time[0], motion.time[-1], _STILLS + 1)[1:]
    for picture in pictures(plain, times, size=(360, 270), inertial=True):
        content = io.BytesIO()
        Image.fromarray(picture[..., :3]).quantize(64, dither=Image.Dither.NONE).save(content, format="PNG")
        stills.append(pages.picture(content.getvalue(), "png", motion.title))
    file = next((path for path in written if os.path.basename(path) == drawings.ANIMATION), None)
    if file is None or found is not None:
        page = animation.page(motion, playing=False)[0]
    else:
        page = pathlib.Path(file).read_bytes()
    return [an.Frame(motion.title, page.decode(), stills)]


def _balances(run: Any) -> list[an.Block]:
    """Largest defects of the balances, and the values of conserved quantities; empty if there are none."""
    time, least = run.time.values, show.round_off(run)
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
            unit = variable.attrs["units"]
            kept.setdefault(unit, []).extend(_account(run, str(name), least.get(unit, 0.0)))
    tables: list[an.Block] = (
        [an.Table(heads=("balance", "largest defect", "at", "at the end"), rows=defects)] if defects else []
    )
    for unit, rows in kept.items():
        name, shown = _ACCOUNTS[unit], unit.replace("m2", "m²").replace("s-1", "s⁻¹")
        heads = (f"{name.lower()}, {shown}", "at the start", "smallest", "largest", "at the end")
        tables.append(an.Table(heads=heads, rows=rows, title=name) if rows else f"{name}: zero throughout.")
    return tables


def _account(run: Any, name: str, least: float) -> list[tuple[str, ...]]:
    """Rows of one variable: what it is, first, least, largest, last; none for what is `least` or less throughout."""
    variable = run[name]
    values = variable.values.reshape(variable.sizes["time"], -1)
    places = [""]
    for dimension in variable.dims[1:]:
        listed = run[dimension].values if dimension in run.coords else np.arange(1, run.sizes[dimension] + 1)
        places = [f"{before}, {x}".lstrip(", ") for before in places for x in listed]
    rows = []
    for k, place in enumerate(places):
        one = np.where(np.abs(values[:, k]) <= least, 0.0, values[:, k])
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
