"""Progress of long operations: the code that takes the time reports it, a command or the studio shows it.

>>> from evolvent import progress
>>> stages = []
>>> with progress.shown_by(stages.append):
...     total = sum(progress.track([1, 2, 3], "adding"))
>>> stages[-1]
Stage(what='adding', done=3.0, total=3.0, unit='')
"""

from __future__ import annotations

import contextlib
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
