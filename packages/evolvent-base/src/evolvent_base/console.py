"""What the commands share: progress on the terminal, and checks of options."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import click

from evolvent_base import progress
from evolvent_base.errors import visible

#: Exit code of a command that was interrupted.
INTERRUPTED = 130
#: A stage is shown when it has taken this long, s.
DELAY = 1.0
#: What the drawing of a run's figures is called.
FIGURES = "drawing figures"


def once(ctx: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> str | None:
    """The value of an option that may be given once."""
    if len(values) > 1:
        name = max(parameter.opts, key=len)
        raise click.UsageError(f"{name} is given {len(values)} times, as {', '.join(map(repr, values))}", ctx)
    return values[0] if values else None


#: The option of every command that draws figures.
figure_format = click.option(
    "--format", "kind", type=click.Choice(("png", "pdf", "svg")), default="png", show_default=True,
    help="Format of the figures; 174 mm wide, with embedded fonts.",
)  # fmt: skip


def echo(text: str, *, err: bool = False, nl: bool = True) -> None:
    """Print a text to stdout or stderr; what it would hide is written as escapes."""
    click.echo(visible(text), err=err, nl=nl)


def discard_output() -> None:
    """Send what is still to be printed nowhere."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say(text: str, *, styled: bool = False) -> None:
    """Print to stdout; a reader that has gone away is no reason to stop. A styled text hides nothing any more."""
    try:
        (click.echo if styled else echo)(text)
    except BrokenPipeError:
        discard_output()


def made_table(heads: Sequence[str], rows: Sequence[Sequence[str]], *, words: int = 1) -> Any:
    """A table for the screen; the first `words` columns are at the left, the others at the right."""
    from rich.table import Table  # help and lists do without it
    from rich.text import Text  # help and lists do without it

    headed = any(heads)
    made = Table(box=None, pad_edge=False, header_style="dim", show_header=headed)
    for k in range(len(heads) or len(rows[0])):
        head = Text(visible(heads[k])) if headed else ""
        made.add_column(head, justify="right" if k >= words else "left", overflow="fold")
    for row in rows:
        made.add_row(*(Text(visible(cell)) for cell in row))
    return made


def note(sentence: str) -> None:
    """Print one sentence to stderr."""
    echo(f"evolvent: {sentence}", err=True)


@contextlib.contextmanager
def showing_progress(*, quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Show on stderr how far the operations inside are.

    On a terminal every operation that takes longer than a second has a bar with the time left. Elsewhere there are
    lines, ever more rarely (`progress.Lines`), and one at once that functions are compiled. Yields a function that
    prints a sentence without disturbing the bar.

    Parameters
    ----------
    quiet : bool, show nothing
    """
    if quiet or sys.stderr is None:
        with compiling(None):
            yield note
        return
    if not sys.stderr.isatty():
        with compiling(note), progress.shown_by(_Running().show):
            yield note
        return
    bars = _bars()
    with bars, progress.shown_by(bars.show), compiling(None):
        yield lambda sentence: bars.console.print(f"evolvent: {sentence}", markup=False, highlight=False)


@contextlib.contextmanager
def compiling(tell: Callable[[str], None] | None) -> Iterator[None]:
    """Report compilation as progress, and its start as a sentence to `tell`."""

    def show(state: progress.Compilation) -> None:
        if tell is not None and state.done == 0:
            tell(progress.starts_compiling(state.needed))
        progress.report(*progress.stage_of(state))

    with progress.compilation_shown_by(show):
        yield


class _Running(progress.ProgressLines):
    """Lines on stderr on all but figures, which take a few seconds."""

    def __init__(self) -> None:
        super().__init__(note)

    def show(self, stage: progress.Stage) -> None:
        if stage.what != FIGURES:
            super().show(stage)


def _bars() -> Any:
    """Bars on stderr, one at a time, each from `DELAY` after its start on."""
    from rich.console import Console  # help and lists do without it
    from rich.progress import (  # help and lists do without it
        BarColumn,
        Progress,
        ProgressColumn,
        Task,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text  # help and lists do without it

    class Amount(ProgressColumn):
        """Done and total with their unit."""

        def render(self, task: Task) -> Text:
            if not task.total:
                return Text("")
            return Text(f"{task.completed:.4g} of {task.total:.4g} {task.fields['unit']}".rstrip())

    class Bars(Progress):
        """The bar of the operation that reported last."""

        def get_renderables(self) -> Any:
            yield self.make_tasks_table([task for task in self.tasks if (task.elapsed or 0.0) > DELAY])

        def show(self, stage: progress.Stage) -> None:
            current = self.tasks[-1] if self.tasks else None
            if current is None or current.description != stage.what:
                for task in self.tasks:
                    self.remove_task(task.id)
                new = self.add_task(stage.what, total=stage.total or None, unit=stage.unit)
                self.update(new, completed=stage.done)
            else:
                self.update(current.id, completed=stage.done, total=stage.total or None)

    columns = TextColumn("{task.description}"), BarColumn(), Amount(), TimeRemainingColumn(), TextColumn("left")
    return Bars(*columns, console=Console(stderr=True), transient=True)
