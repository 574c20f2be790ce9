"""Progress of long operations: the code that takes the time reports it, a command or the studio shows it.

>>> from evolvent.base import progress
>>> stages = []
>>> with progress.shown_by(stages.append):
...     total = sum(progress.track([1, 2, 3], "adding"))
>>> stages[-1]
Stage(what='adding', done=3.0, total=3.0, unit='')
"""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import NamedTuple, TypeVar

T = TypeVar("T")


class Stage(NamedTuple):
    """How far an operation is.

    Attributes
    ----------
    what : str, the operation ("drawing figures")
    done, total : float; `total` is 0 where it is not known
    unit : str, of both; '' for a count
    """

    what: str
    done: float
    total: float
    unit: str = ""


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


class Lines:
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
        self.what, self.began, self.next = "", 0.0, 0.0
        self.last = 0.0, 0.0  # time and amount of the line before

    def show(self, stage: Stage) -> None:
        """Take notice of a stage, and write a line if one is due."""
        if stage.total <= 0.0:
            return
        now = self.clock()
        if stage.what != self.what or stage.done < self.last[1]:
            self.what, self.began, self.next, self.last = stage.what, now, now + FIRST, (now, stage.done)
            return
        if now < self.next or stage.done >= stage.total:
            return
        (before, done), spent = self.last, now - self.began
        rest = (stage.total - stage.done) * (now - before) / (stage.done - done) if stage.done > done else float("inf")
        unit = f" {stage.unit}" if stage.unit else ""
        left = f"about {spoken(rest)} left" if rest < float("inf") else "no end in sight"
        self.write(f"{stage.what}: {stage.done:.4g} of {stage.total:.4g}{unit} after {spoken(spent)}, {left}")
        self.last, self.next = (now, stage.done), now + min(max(spent, FIRST), RAREST)


def spoken(seconds: float) -> str:
    """A duration in the unit that suits it: "40 s", "5 min", "3.2 h", "12 days"."""
    for unit, size, limit in (("s", 1.0, 120.0), ("min", 60.0, 7200.0), ("h", 3600.0, 172800.0)):
        if seconds < limit:
            return f"{seconds / size:.{1 if seconds < 9.95 * size and unit != 's' else 0}f} {unit}"
    return f"{seconds / 86400.0:.2g} days"


def on_stderr(duration: float) -> Callable[[float], None] | None:
    """What a run from Python calls with the time reached (s) where nobody listens: lines on stderr; else None."""
    if is_shown() or sys.stderr is None:
        return None
    lines = Lines(lambda line: print(f"evolvent: {line}", file=sys.stderr, flush=True))
    return lambda reached: lines.show(Stage("running", reached, duration, "s"))


def report(what: str, done: float = 0.0, total: float = 0.0, unit: str = "") -> None:
    """Report how far an operation is; nothing happens where nobody listens."""
    listener = _listener.get()
    if listener is not None:
        listener(Stage(what, float(done), float(total), unit))


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
    """Report how far compilation is."""
    for listener in _compilation_listeners:
        listener(state)
