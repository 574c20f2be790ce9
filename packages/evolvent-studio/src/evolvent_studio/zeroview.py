"""Margins that ask what is zero: a button for each resistance that the case neither gives nor declares to be zero."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import ui

from evolvent.analysis.margins.factors import ACCELERATION
from evolvent_studio.context import Context
from evolvent_studio.drafts import view_of
from evolvent_studio.job import Job

#: Where resistances are declared to be zero.
_EVERY, _ONE = "every coordinate", "this one alone"


def with_zeros(content: Mapping[str, Any], missing: Sequence[str], coordinate: str = "") -> dict[str, Any]:
    """A case that declares resistances to be zero, in every coordinate or in one."""
    found = copy.deepcopy(dict(content))
    place: Any = found
    for key in ("margin", "lines", coordinate) if coordinate else ("margin",):
        if not isinstance(place.get(key), dict):
            place[key] = {}
        place = place[key]
    held = place.get("zero") or []
    place["zero"] = list(dict.fromkeys([*([held] if isinstance(held, str) else held), *missing]))
    return found


def draw_zeros(page: Context, job: Job) -> None:
    """Draw the buttons of a job of one case that failed for want of resistances; nothing of another job."""
    unstated = job.extra.get("unstated")
    if not job.sort.of_case or not isinstance(unstated, list) or len(unstated) < 2:
        return
    coordinate, *missing = map(str, unstated)
    chosen: set[str] = set()
    ui.label("Which of them are zero? Others need a part that gives them.").classes("ev-what")
    where = ui.toggle([_EVERY, _ONE], value=_EVERY).props('dense flat no-caps toggle-color=primary data-testid="where"')
    with ui.element("div").classes("ev-row").style("flex-wrap:wrap"):
        for one in missing:
            are = "are" if one.endswith("losses") else "is"
            text = "at rest: no acceleration is asked for" if one == ACCELERATION else f"{one} {are} zero"
            button = ui.button(text).props(f'outline dense color=primary data-testid="zero-{one}"')
            button.style("padding:0 10px").on_click(lambda b=button, o=one: turn(b, o))
    again = ui.button("Declare it and find the margins again", on_click=lambda: page.attempt(run))
    again.props('unelevated color=primary data-testid="zero-done"').style("align-self:flex-start")
    again.set_enabled(False)

    def turn(button: ui.button, one: str) -> None:
        """Choose a resistance, or no longer."""
        chosen.symmetric_difference_update({one})
        on = one in chosen
        button.props(add="unelevated" if on else "outline", remove="outline" if on else "unelevated")
        button.props["icon"] = "check" if on else None
        again.set_enabled(bool(chosen))

    def run() -> None:
        zeros = [one for one in missing if one in chosen]
        content = with_zeros(page.studio.job_case(job.key), zeros, coordinate if where.value == _ONE else "")
        page.studio.take_case(content, f"case of run {int(job.key[:4])}", str(job.extra.get("origin", "")))
        key = page.studio.submit(kind=job.kind)
        page.open_case()
        page.show(view_of(page.studio.jobs.get(key)), tab="runs")
