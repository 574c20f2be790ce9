"""What the studio reads of the working folder, in a process of its own with limits of time and memory.

`main` of this module is that process for texts, that of `evolvent_studio.preview` for starts of cases, for
which it loads much more. Each line on its stdin asks for one task, a JSON object; it answers with lines of JSON: any
number of notes, then what was found, or the reason why not. It ends with its stdin. A task that takes too much ends the
process (by `RLIMIT_CPU` and `RLIMIT_AS` where the system has them, else by the clock); the next task starts another
one.
"""

from __future__ import annotations

import atexit
import base64
import contextlib
import functools
import json
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from typing import Any

from evolvent import cases
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import child

#: Processor time of a task, s: a text, the start of a case; between its notes, and the time on the clock for each.
TEXT, START, CLOCK = 3.0, 20.0, 5.0
#: Address space of the process, bytes.
MEMORY = 4_000_000_000
#: Values of a text that is put into a form, at most; elements and nodes of a case whose start is drawn.
MOST_VALUES, MOST_ELEMENTS = 20_000, 20_000
#: Longest time until the process is there, s.
_STARTING = 120.0
#: Keys of a case that count elements, and one that multiplies them.
_COUNTS, _TIMES = ("elements", "nodes"), ("multiplicity", "blades")


class Reader:
    """Asks a process for one task after another; it is started when it is needed, and again when it has died.

    Parameters
    ----------
    module : str, of the studio, which the process runs
    """

    def __init__(self, module: str) -> None:
        self._module = module
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._empty = contextlib.ExitStack()

    def ask(self, task: str, seconds: float, note: Callable[[str], None] = lambda text: None, **given: Any) -> Any:
        """What a task finds.

        Raises
        ------
        InputError
            If it cannot be done, or takes more than `seconds` of processor time, or too much memory.
        """
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                try:
                    self._start()
                except OSError as error:
                    raise InputError(f"no process could be started: {error}") from None
            process = self._process
            assert process is not None
            assert process.stdin is not None
            try:
                process.stdin.write(json.dumps({"task": task, "seconds": seconds, "given": given}) + "\n")
                process.stdin.flush()
                while True:
                    answer = json.loads(self._lines.get(timeout=CLOCK * seconds) or "{}")
                    if "note" not in answer:
                        break
                    note(answer["note"])
            except (OSError, queue.Empty, ValueError):
                answer = {}
            if "error" in answer:
                raise InputError(answer["error"])
            if "found" not in answer:
                self.end()
                raise InputError(
                    f"it takes more than {seconds:g} s or {MEMORY // 1_000_000_000} GB, and is not read here; "
                    f"`evolvent run` has no such limit"
                )
            return answer["found"]

    def _start(self) -> None:
        """Start the process in an empty folder, from which no module and no settings are picked up."""
        self.end()
        empty = self._empty.enter_context(tempfile.TemporaryDirectory(prefix="evolvent-reading-"))
        process = child.start(self._module, folder=empty, stderr=subprocess.DEVNULL)
        self._process, self._lines = process, queue.SimpleQueue()
        threading.Thread(target=_listen, args=(process, self._lines), daemon=True).start()
        with contextlib.suppress(queue.Empty):
            self._lines.get(timeout=_STARTING)

    def end(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            child.close(process)
        self._empty.close()


def _listen(process: subprocess.Popen[str], lines: queue.SimpleQueue[str]) -> None:
    """Pass on what a process prints; an empty line says that it is gone."""
    with contextlib.suppress(ValueError, OSError):
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line)
    lines.put("")


@functools.cache
def reader(module: str) -> Reader:
    """The process for texts ("reading") or for starts ("preview"); it ends with this one."""
    found = Reader(module)
    atexit.register(found.end)
    return found


def content(source: str, name: str) -> Any:
    """What a YAML text holds, for a form.

    Raises
    ------
    InputError
        If it is not YAML, or holds more than a form can show.
    """
    try:
        return reader("reading").ask("content", TEXT, source=source, name=name)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(name) else f"{name}: {text}") from None


def start(case: Any, note: Callable[[str], None]) -> bytes:
    """The start of a case for the viewer, packed; see `evolvent_studio.preview.start_of`.

    Raises
    ------
    InputError
        If it cannot be drawn, or takes too long.
    """
    return base64.b64decode(reader("preview").ask("start", START, note, content=case))


def check_size(case: Any) -> None:
    """Refuse a case of more elements and nodes than are assembled before it is run.

    Parameters
    ----------
    case : mapping, its content

    Raises
    ------
    InputError
    """
    count = elements(case)
    if count > MOST_ELEMENTS:
        raise InputError(
            f"the case has {count} elements and nodes; the start of at most {MOST_ELEMENTS} is drawn before it is run"
        )


def elements(value: Any) -> int:
    """Elements and nodes that a case asks for."""
    if isinstance(value, (list, tuple)):
        return sum(map(elements, value))
    if not isinstance(value, dict):
        return 0
    counts = [value.get(key) for key in (*_COUNTS, *_TIMES)]
    own, *times = (
        sum(n for n in counts[: len(_COUNTS)] if isinstance(n, int)),
        *(n for n in counts[len(_COUNTS) :] if isinstance(n, int) and n > 1),
    )
    for factor in times:
        own *= factor
    inner = own + sum(map(elements, value.values()))
    repeat = value.get("repeat")
    count = repeat.get("count") if isinstance(repeat, dict) else None
    return inner * count if isinstance(count, int) and count > 1 else inner


# ------------------------------------------------------------------------------------------------ the process


def _content(note: Callable[[str], None], *, source: str, name: str) -> Any:
    found = cases.parse_yaml(source, name)
    if (count := _values(found)) > MOST_VALUES:
        raise InputError(f"it holds {count} values; the studio shows {MOST_VALUES} at most, `evolvent run` takes all")
    return found


def _values(found: Any) -> int:
    inner = found.values() if isinstance(found, dict) else found if isinstance(found, list) else ()
    return 1 + sum(map(_values, inner))


def _facts(note: Callable[[str], None], *, source: str, name: str) -> Any:
    """First keys of a text that holds a mapping, and whether it describes a stand; None of what holds none."""
    found = cases.parse_yaml(source, name)
    if not isinstance(found, dict):
        return None
    stand = found.get("stand")
    return {"keys": list(found)[:MOST_VALUES], "is_stand": isinstance(stand, dict) and "kind" in stand}


def _allow(seconds: float) -> None:
    """Let this process take as much more processor time, where the system can limit it."""
    with contextlib.suppress(ImportError):
        import resource  # not on Windows

        usage = resource.getrusage(resource.RUSAGE_SELF)
        limit = int(usage.ru_utime + usage.ru_stime + seconds) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def answer(tasks: Mapping[str, Callable[..., Any]]) -> int:
    """Answer until stdin ends; returns the exit code.

    Parameters
    ----------
    tasks : functions of what a task is given, and of what takes notes, by the names of the tasks
    """
    send = child.channel()
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))

    send(ready=True)
    for line in sys.stdin:
        asked = json.loads(line)
        seconds = asked["seconds"]

        def note(text: str, seconds: float = seconds) -> None:
            _allow(seconds)  # functions are compiled once, whatever the case
            send(note=text)

        _allow(seconds)
        try:
            send(found=tasks[asked["task"]](note, **asked["given"]))
        except EvolventError as error:
            send(error=str(error))
        except (MemoryError, RecursionError):
            return 1
    return 0


def main() -> int:
    """Answer what is asked about texts."""
    return answer({"content": _content, "facts": _facts})
