"""Progress of long operations: the code that takes the time reports it, a command or the studio shows it.

>>> from evolvent_base import progress
>>> stages = []
>>> with progress.shown_by(stages.append):
...     total = sum(progress.track([1, 2, 3], "adding"))
>>> stages[-1]
Stage(what='adding', done=3.0, total=3.0, unit='', left=None)
"""

from __future__ import annotations

import contextlib
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import Any, NamedTuple, TypeVar

from evolvent_base.errors import counted

T = TypeVar("T")


class Stage(NamedTuple):
    """How far an operation is.

    Attributes
    ----------
    what : str, the operation ("drawing figures")
    done, total : float; `total` is 0 where it is not known
    unit : str, of both; '' for a count
    left : float, time left as the operation itself estimates it, s; None where it does not
    """

    what: str
    done: float
    total: float
    unit: str = ""
    left: float | None = None


_listener: ContextVar[Callable[[Stage], None] | None] = ContextVar("evolvent_progress", default=None)


@contextlib.contextmanager
def shown_by(listener: Callable[[Stage], None]) -> Iterator[None]:
    """Call `listener` with each `Stage` that is reported in this context."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def is_shown() -> bool:
    """Whether somebody listens."""
    return _listener.get() is not None


#: Times from the start of an operation to the first line on it, and between two lines at most, s.
FIRST, RAREST = 2.0, 60.0
#: Time between two states of a bar, s, and its length, letters.
_BAR_EVERY, _BAR_LENGTH = 0.2, 20
#: What the compilation of functions is called.
COMPILING = "compiling for this machine, once"


class ProgressLines:
    """One line after another on how far an operation is and how long it will still take.

    The first comes after `FIRST` seconds, then each takes as long as all before it, at most `RAREST`. The time left
    follows from the pace since the line before: a run whose steps become small takes longer than it seemed to at first.

    Parameters
    ----------
    write : called with each line
    clock : returns the time, s
    """

    def __init__(self, write: Callable[[str], object], clock: Callable[[], float] = time.monotonic) -> None:
        self.write, self.clock = write, clock
        self.what, self.began, self.next, self.renewed = "", 0.0, 0.0, 0.0
        self.last = 0.0, 0.0  # time and amount from which the pace is found

    def show(self, stage: Stage) -> None:
        """Take notice of a stage, and write a line if one is due."""
        if stage.total <= 0.0:
            return
        now = self.clock()
        if stage.what != self.what or stage.done < self.last[1]:
            self.what, self.began, self.next, self.last = stage.what, now, now + FIRST, (now, stage.done)
            self.renewed = self.next
            return
        if now < self.next or stage.done >= stage.total:
            return
        (before, done), spent = self.last, now - self.began
        rest = (stage.total - stage.done) * (now - before) / (stage.done - done) if stage.done > done else float("inf")
        rest = rest if stage.left is None else stage.left
        unit = f" {stage.unit}" if stage.unit else ""
        left = f"about {spoken(rest)} left" if rest < float("inf") else "no end in sight"
        amount = f"{stage.done:.4g} of {stage.total:.4g}{unit}"
        self.write(self.text(stage.what, amount, stage.done / stage.total, spoken(spent), left))
        later = min(max(spent, FIRST), RAREST)
        if now >= self.renewed:
            self.last, self.renewed = (now, stage.done), now + later
        self.next = now + self.pause(later)

    def text(self, what: str, amount: str, share: float, spent: str, left: str) -> str:
        """What is written."""
        return f"{what}: {amount} after {spent}, {left}"

    def pause(self, later: float) -> float:
        """Time to the next line, s, where the next one is due in `later` seconds."""
        return later


class Bar(ProgressLines):
    """One line with a bar, rewritten several times a second and cleared at the end, for terminals and notebooks.

    Parameters
    ----------
    stream : file that shows what follows a carriage return in place of the line
    clock : returns the time, s
    """

    def __init__(self, stream: Any, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(self._rewrite, clock)
        self._stream, self._length = stream, 0

    def show(self, stage: Stage) -> None:
        """Take notice of a stage; its end clears the line."""
        if self._length and (stage.what != self.what or stage.done >= stage.total):
            self.clear()
        super().show(stage)

    def text(self, what: str, amount: str, share: float, spent: str, left: str) -> str:
        """What is written."""
        filled = int(share * _BAR_LENGTH)
        bar = "\N{FULL BLOCK}" * filled + "\N{LIGHT SHADE}" * (_BAR_LENGTH - filled)
        return f"evolvent: {what}  {bar}  {amount}, {left}"

    def pause(self, later: float) -> float:
        """Time to the next state of the bar, s."""
        return _BAR_EVERY

    def clear(self) -> None:
        """Clear the line."""
        self._rewrite("")
        self._stream.write("\r")
        self._stream.flush()

    def _rewrite(self, text: str) -> None:
        self._stream.write("\r" + text.ljust(self._length))
        self._stream.flush()
        self._length = len(text)


def spoken(seconds: float) -> str:
    """A duration in the unit that suits it: "40 s", "5 min", "3.2 h", "12 days"."""
    for unit, size, limit in (("s", 1.0, 120.0), ("min", 60.0, 7200.0), ("h", 3600.0, 172800.0)):
        if seconds < limit:
            return f"{seconds / size:.{1 if seconds < 9.95 * size and unit != 's' else 0}f} {unit}"
    return f"{seconds / 86400.0:.2g} days"


def _on_stderr() -> ProgressLines:
    """A bar on a terminal and in a notebook, lines elsewhere."""
    notebook = type(sys.stderr).__module__.startswith("ipykernel")
    if notebook or (sys.stderr.isatty() and os.environ.get("TERM") != "dumb"):
        return Bar(sys.stderr)
    return ProgressLines(_say)


def _say(line: str) -> None:
    print(f"evolvent: {line}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def on_stderr(duration: float) -> Iterator[Callable[[float], None] | None]:
    """What a run from Python calls with the time reached (s) where nobody listens: shows it on stderr; else None."""
    if is_shown() or sys.stderr is None:
        yield None
        return
    lines = _on_stderr()
    try:
        yield lambda reached: lines.show(Stage("running", reached, duration, "s"))
    finally:
        if isinstance(lines, Bar):
            lines.clear()


def report(what: str, done: float = 0.0, total: float = 0.0, unit: str = "", left: float | None = None) -> None:
    """Report how far an operation is; nothing happens where nobody listens."""
    listener = _listener.get()
    if listener is not None:
        listener(Stage(what, float(done), float(total), unit, left))


def track(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Yield the items and report after each one.

    Parameters
    ----------
    items : iterable
    what : str, the operation
    total : int, number of items; left out, the length of a sequence
    """
    if total is None:
        total = len(items) if isinstance(items, Sequence) else 0
    report(what, 0, total)
    for done, item in enumerate(items, 1):
        yield item
        report(what, done, total)


class Compilation(NamedTuple):
    """How far compilation is.

    Attributes
    ----------
    done, needed : int, functions
    left : float, s, estimated; not a number at the start
    """

    done: int
    needed: int
    left: float


_compilation_listeners: list[Callable[[Compilation], None]] = []


@contextlib.contextmanager
def compilation_shown_by(listener: Callable[[Compilation], None]) -> Iterator[None]:
    """Call `listener` with a `Compilation` at the start of each compilation, and after every function."""
    _compilation_listeners.append(listener)
    try:
        yield
    finally:
        _compilation_listeners.remove(listener)


def report_compilation(state: Compilation) -> None:
    """Report how far compilation is; where nobody listens, as in a run from Python, it is shown on stderr."""
    for listener in _compilation_listeners:
        listener(state)
    if not _compilation_listeners and not is_shown() and sys.stderr is not None:
        if state.done == 0:
            _say(starts_compiling(state.needed))
            _shown_compilation[:] = [_on_stderr()]
        for lines in _shown_compilation:
            lines.show(stage_of(state))


#: What shows the compilation that goes on where nobody listens.
_shown_compilation: list[ProgressLines] = []


def starts_compiling(needed: int) -> str:
    """The sentence at the start of a compilation of so many functions."""
    return f"compiling {counted(needed, 'function')} for this machine, once"


def stage_of(state: Compilation) -> Stage:
    """Compilation as an operation like others."""
    left = state.left if math.isfinite(state.left) else None
    return Stage(COMPILING, float(state.done), float(state.needed), "functions", left)
