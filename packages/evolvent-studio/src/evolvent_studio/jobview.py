"""What is shown of a job that has no results yet: how far it is, or why it has none."""

from __future__ import annotations

import datetime

from nicegui import ui

from evolvent_base.errors import counted
from evolvent_studio.changes import ADDED, REMOVED
from evolvent_studio.context import Context
from evolvent_studio.job import Job
from evolvent_studio.zeroview import draw_zeros

#: How a job ended, in a word.
STATUS = {"stopped by event": "stopped", "success": "done", "interrupted": "cancelled"}
#: Letters of one change that are shown.
_LONGEST = 70
#: Letters of a message that is shown whole.
_SHORT = 90
#: Seconds between two looks at a job.
_LOOK = 0.3


def status_of(job: Job) -> tuple[str, str]:
    """How a job ended, in words, and the class of the page for it: a warning or a missed limit is not green."""
    text = STATUS.get(job.status, job.status)
    look = "success" if job.status == "stopped by event" else job.status
    if look == "success" and job.is_warning:
        look = "interrupted"
    return text, look


def draw_limits(met: int, count: int) -> None:
    """A badge: how many limits of its case a run meets."""
    badge = ui.label(f"{met} of {counted(count, 'limit')} met")
    badge.classes(f"ev-badge {'good' if met == count else 'bad'}").props('data-testid="limits"')


def draw_folded(text: str, look: str) -> ui.element:
    """A message whose first clause is shown, and the rest on a click; of a short one all."""
    head, found, rest = text.partition("; ") if len(text) > _SHORT else (text, "", "")
    if not found or "\n" in head:
        head, found, rest = text.partition("\n") if len(text) > _SHORT else (text, "", "")
    if not rest.strip():
        return ui.label(text).classes(look)
    folded = ui.element("details").classes(f"ev-folded {look}")
    with folded:
        with ui.element("summary"):
            ui.label(head)
        ui.label(rest)
    return folded


def date_text(job: Job) -> str:
    """When a job was added, on the clock of the server: the time, and of another day the day too; '' if not known."""
    try:
        date = datetime.datetime.fromisoformat(str(job.extra.get("date", ""))).astimezone()
    except ValueError:
        return ""
    today = datetime.datetime.now().astimezone().date()
    if date.date() == today:
        return f"{date:%H:%M}"
    return f"{date.day} {date:%b}, {date:%H:%M}" if date.year == today.year else f"{date.day} {date:%b %Y, %H:%M}"


def changes_text(job: Job, most: int = 1000) -> str:
    """What differs from the case that a job was made from, such as "spool.rate = 3 rad/s"; '' of other jobs.

    Parameters
    ----------
    most : int, of keys that are written out
    """
    changed, of = job.extra.get("changes"), str(job.extra.get("of", ""))
    if not isinstance(changed, list) or not of:
        return ""
    if not changed:
        return f"{of}, unchanged"
    before = "" if of == job.title else f"{of}: "
    return before + _listed(changed, most)


def since_text(job: Job, most: int = 1000) -> str:
    """What differs from the run of the same case before, such as "since run 3: spool.rate = 3 rad/s"; '' of the first.

    Parameters
    ----------
    most : int, of keys that are written out
    """
    changed, before = job.extra.get("since"), job.extra.get("before")
    if not isinstance(changed, list) or not before:
        return ""
    return f"since run {before}: {_listed(changed, most)}" if changed else f"the same case as run {before}"


def _listed(changed: list[list[str]], most: int) -> str:
    """Changed keys with their texts."""
    texts = [f"{key} {text}" if text in (ADDED, REMOVED) else f"{key} = {text}" for key, text in changed]
    texts = [text if len(text) <= _LONGEST else f"{text[: _LONGEST - 1]}…" for text in texts]
    more = len(texts) - most
    return ", ".join(texts[:most]) + (f" and {more} more" if more > 0 else "")


def duration(seconds: float) -> str:
    """A time as one reads it."""
    if seconds < 60.0:
        return f"{seconds:.0f} s" if seconds >= 10.0 else f"{seconds:.1f} s"
    minutes = int(seconds // 60)
    return f"{minutes} min {seconds % 60:.0f} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def progress_text(job: Job) -> str:
    """How far a job is, as a sentence."""
    if job.status == "cancelling":
        return "stopping" if job.sort.at_once else "stopping; what was computed is kept"
    if job.status == "running":
        if not job.sort.counted:
            return job.note or "starting"
        if not job.reached:
            return job.note or "starting; where functions must be compiled first, this takes up to a minute"
        reached = f"{job.reached:.4g} of {job.end:.4g}{job.sort.unit}"
        left = job.left
        return reached + (f", about {duration(left)} left" if left is not None else "")
    if job.status == "waiting":
        return "queued"
    return job.message.removeprefix(job.status).strip() or f"took {duration(job.elapsed)}"


def _title(job: Job) -> str:
    return f"{job.sort.title} {int(job.key[:4])} {job.title}"


def draw_progress(page: Context, job: Job) -> None:
    """Draw how far a job is, and follow it."""
    with ui.element("div").classes("ev-empty").props('data-testid="progress"'):
        word = {"waiting": "waiting", "running": "running", "cancelling": "stopping"}[job.status]
        ui.label(f"{_title(job)}: {word}").classes("ev-h1")
        if about := changes_text(job):
            ui.label(about).classes("ev-changes")
        with ui.element("div").classes("ev-track").style("margin:10px 0 6px"):
            bar = ui.element("div").style(f"width:{100.0 * job.share:.1f}%")
        text = ui.label(progress_text(job))
        if job.status != "cancelling":
            ui.button("Cancel", on_click=lambda: page.attempt(lambda: page.studio.jobs.cancel(job.key))).props(
                'outline color=primary data-testid="cancel"'
            ).style("margin-top:12px")

        def follow() -> None:
            bar.style(f"width:{100.0 * job.share:.1f}%")
            text.set_text(progress_text(job))

        ui.timer(_LOOK, follow)


def draw_without(page: Context, job: Job) -> None:
    """Draw a job that ended without results: its message and its case."""
    with ui.element("div").classes("ev-titlebar"):
        ui.label(_title(job)).classes("ev-h1")
        text, look = status_of(job)
        ui.label(text).classes(f"ev-status {look}")
    kind = "bad" if job.status == "failed" else "warn"
    message = job.message or "nothing was computed"
    if job.sort.many and job.end > 0.0:
        message += f"; {job.reached:.0f} of {job.end:.0f} {job.sort.many} are done"
    draw_folded(message[:1].upper() + message[1:], f"ev-banner {kind}").props('data-testid="message"')
    draw_zeros(page, job)
    if job.sort.resumed:
        button = ui.button(
            f"Continue the {job.sort.title.lower()}",
            on_click=lambda: page.attempt(lambda: page.studio.jobs.resume(job.key)),
        )
        button.props('unelevated color=primary data-testid="continue"').style("align-self:flex-start")
        ui.label("What is done is not computed again.").classes("ev-what")
    if job.sort.of_case:
        ui.button("Open its case", on_click=lambda: page.open_job_case(job.key)).props(
            'outline color=primary data-testid="open-job-case"'
        ).style("align-self:flex-start")


def draw_job(page: Context, key: str) -> bool:
    """Draw a job without results; False where it has some, and nothing is drawn."""
    job = page.studio.jobs.jobs.get(key)
    if job is None:
        ui.label("This run was removed.").classes("ev-empty")
    elif job.open:
        draw_progress(page, job)
    elif page.studio.jobs.result(key) is None:
        draw_without(page, job)
    else:
        return False
    return True


def ask_title(page: Context, key: str) -> None:
    """Ask for another name of a job; all pages show it at their next look at the queue."""
    jobs = page.studio.jobs
    page.ask(
        f"Rename run {int(key[:4])}", jobs.get(key).title, lambda name: jobs.rename(key, name), word="Rename",
        marks=("title", "title-done"), most=80,
    )  # fmt: skip
