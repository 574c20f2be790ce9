"""Margins as one HTML page that needs nothing else, and as a section of the report of a run."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from evolvent import cases
from evolvent.analysis.margins import evaluation, factors, latches
from evolvent.exports.figure_pictures import figure_picture
from evolvent.results import made_with
from evolvent.results.tree import solution_of
from evolvent_base import pages
from evolvent_base.errors import InputError
from evolvent_base.files import write_file

if TYPE_CHECKING:
    from evolvent.analysis.margins.results import MarginResults


def write(found: MarginResults, path: str) -> str:
    """Write the page; returns its path.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = pages.render(
        "margins.html", title=f"Margins of {found.title or 'a mechanism'}", margins=_content(found),
        made_with=f"made with {made_with()}", case=found.case,
    )  # fmt: skip
    write_file(path, page.encode())
    return path


def section(run: Any) -> dict[str, Any]:
    """The section of a run's report: the margins of its case, with what the run says of latches and stops.

    Empty where the case has no key `margin`. Where the margins cannot be found, the verdict is the reason. Those along
    the run need its states, which a file of results does not have.
    """
    try:
        content = cases.parse_yaml(run.attrs["case"], "the case of the run")
    except InputError:
        return {}
    if not isinstance(content, dict) or not isinstance(content.get("margin"), dict):
        return {}
    try:
        return _content(*_of_run(run, content))
    except InputError as error:
        verdict = f"The margins of this case are not stated: {error}."
        return {"verdict": verdict, "tables": [], "drawn": None, "notes": []}


def _of_run(run: Any, content: dict[str, Any]) -> tuple[MarginResults, str]:
    """Margins of the case of a run, its latches and stops, and why there are none along it."""
    if json.loads(run.attrs["laws"]):
        raise InputError("the run used laws of the user, which the case cannot hold")
    cases.check_files_of_run(run)
    name = content["margin"].get("factors")
    if name is not None and name not in factors.built_in():
        raise InputError(f"the run does not hold the factors of {name!r}; evolvent margin reads them")
    system = cases.presenter(run).system(cases.load(content))
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
    return found, why


def _content(found: MarginResults, why: str = "") -> dict[str, Any]:
    """Verdict, tables, figure and notes.

    Parameters
    ----------
    why : why there are no margins along a run
    """
    tables = [
        ("Margins", found.rows()),
        ("What brings each margin to 0", found.balance_rows()),
        *((f"{one.coordinate.name}: what counts where its margin is least", found.contributions(one.coordinate.name))
          for one in found.tables),
    ]  # fmt: skip
    if found.latches:
        tables.append(("Latches and stops in the run", found.latch_rows()))
    negative = ", ".join(map(repr, found.negative))
    return {
        "verdict": f"The margin of {negative} is below 0." if negative else "Every margin holds.",
        "tables": tables,
        "drawn": figure_picture(found.figure()),
        "notes": [
            *found.notes(),
            *filter(None, [found.standard.source, why and f"no margins along the run: {why}"]),
        ],
    }
