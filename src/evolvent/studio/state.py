"""What the server holds: the folder, the queue, the case that is being written, and runs that were opened."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import pathlib
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from evolvent import cases, families
from evolvent.errors import InputError
from evolvent.studio import studydraft
from evolvent.studio.folder import Folder
from evolvent.studio.jobs import Job, Jobs
from evolvent.studio.worker import CASE, MODE

if TYPE_CHECKING:
    from evolvent.figures import Figure, Number

#: Runs that are kept in memory.
_KEPT = 8
#: The case that the form holds at first.
FIRST = "case:boom-slew"
#: Starts of cases that are kept for the pages that show them.
_STARTS = 16
#: Cases to begin with, name -> (what it is, YAML).
NEW = {
    "structure": (
        "a structure of one body, to which parts are added",
        """\
system: structure
parts:
  body: {kind: rigid-body, mass: 20 kg, inertia: [1.2, 1.2, 2 kg m^2]}
simulate: {until: 20 s}
""",
    )
}


@dataclasses.dataclass
class Draft:
    """The case in a form; the studio keeps the one that was changed last, for pages to come.

    Attributes
    ----------
    source : str, "case:NAME" of a built-in one, "file:NAME", or what it was opened from
    about : str
    content : dict
    """

    source: str = ""
    about: str = ""
    content: dict[str, Any] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class View:
    """What the page shows beside the panels: nothing, the case's start, runs ("run"), modes, a measurement, a study."""

    kind: str = ""
    refs: tuple[str, ...] = ()


def view_of(job: Job) -> View:
    """What shows a job."""
    kind = {"equilibrium": "run", "sweep": "study", "identify": "measure"}.get(job.kind, job.kind)
    return View(kind, (f"job:{job.key}",))


@dataclasses.dataclass(frozen=True)
class Loaded:
    """A run, a DataTree or a Dataset, with what is shown of it."""

    ref: str
    name: str
    path: pathlib.Path
    run: Any
    numbers: Sequence[Number]
    figures: Sequence[Figure]

    @property
    def still(self) -> bool:
        """Whether it is one state, such as an equilibrium."""
        return int(self.run.sizes.get("time", 1)) == 1


class Studio:
    """All that pages share.

    Parameters
    ----------
    folder : Folder
    """

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.jobs = Jobs(folder)
        self.draft = Draft()
        self.view = View()
        self.tab = "case"
        self.dark: bool | None = None  # as the browser has it
        self.measure: dict[str, Any] = {}
        self.study = studydraft.opened(folder, "new:study")
        self._lock = threading.Lock()
        self.computing = threading.Lock()  # held by a thread that assembles or compiles: functions are loaded by one
        self._starts: dict[str, bytes] = {}
        self.open_case(FIRST)

    # -------------------------------------------------------------------------------------------- cases

    def sources(self) -> dict[str, str]:
        """Cases that can be opened, source -> how it is shown."""
        found = {f"new:{name}": f"new {name}" for name in NEW}
        found |= {f"case:{name}": name for name in cases.built_in()}
        written = self.folder.yaml().items()
        found |= {f"file:{name}": name for name, content in written if "system" in content or "parts" in content}
        return found | {f"file:{name}": f"{name} (cannot be read)" for name in self.folder.unreadable()}

    def study_sources(self) -> dict[str, str]:
        """Studies that can be run."""
        from evolvent import studies

        found = {"new:study": "new study"} | {f"case:{name}": name for name in studies.built_in()}
        every = self.folder.yaml().items()
        return found | {f"file:{name}": name for name, content in every if {"case", "over"} <= set(content)}

    def stands(self) -> list[str]:
        """Files that describe a stand."""
        found = []
        for name, content in self.folder.yaml().items():
            stand = content.get("stand")
            if isinstance(stand, Mapping) and "kind" in stand:
                found.append(name)
        return found

    def open_case(self, source: str) -> None:
        """Put a case into the form.

        Raises
        ------
        InputError
            If it cannot be read, or is no case.
        """
        self.draft = self.read_case(source)

    def read_case(self, source: str) -> Draft:
        """A case for the form.

        Raises
        ------
        InputError
            If it cannot be read, or is no case.
        """
        kind, _, name = source.partition(":")
        if kind == "case":
            content, about = cases.content_of(name), cases.built_in()[name]
        elif kind == "new" and name in NEW:
            about, text = NEW[name]
            content = cases.content_of(cases.parse_yaml(text, name))
        else:
            content, about = cases.parse_yaml(self.folder.text(name), name), name
            if not isinstance(content, Mapping):
                raise InputError(f"{name}: it holds no case; a case is a mapping of keys to values")
            content = cases.content_of(content)
        return self._checked(Draft(source, about, content))

    def take_case(self, content: Mapping[str, Any], about: str) -> None:
        """Put a case that stands elsewhere into the form."""
        self.draft = self._checked(Draft("", about, cases.content_of(content)))

    def _checked(self, draft: Draft) -> Draft:
        self.folder.check_case(draft.content)
        cases.system(str(draft.content.get("system", "")))
        return draft

    def submit(self, draft: Draft | None = None, kind: str = "run") -> str:
        """Put a case, that of the form unless given, into the queue; returns the job's key.

        Parameters
        ----------
        kind : "run", "equilibrium" or "modes", what is computed of it

        Raises
        ------
        InputError
            If it cannot be run.
        """
        draft = draft or self.draft
        self.folder.check_case(draft.content)
        content = self._placed(draft.content)
        case = cases.load(content)
        definition = cases.system(case.system)
        if kind == "run":
            definition.plan(case)
        else:
            families.check(definition.build(case).assemble(), families.MODES if kind == "modes" else families.STATIC)
        name = draft.source.partition(":")[2] or case.system
        text = cases.to_yaml(case)
        return self.jobs.add(kind, pathlib.PurePosixPath(name).stem, case=text).key

    def _placed(self, content: Any) -> Any:
        """A case whose files are named from the root of the disk on, for the process that runs it."""
        if isinstance(content, Mapping):
            return {key: self._placed(value) for key, value in content.items()}
        if isinstance(content, str) and content.endswith(".nc"):
            return str(self.folder.inside(content))
        return content

    def start(self, content: Mapping[str, Any], note: Callable[[str], None] = lambda text: None) -> str:
        """The start of a case, ready for the viewer; returns its name for `start_of`.

        Raises
        ------
        InputError
            If its parts cannot be assembled.
        """
        from evolvent.studio import preview

        self.folder.check_case(content)
        with self.computing:
            packed = preview.start_of(self._placed(content), note)
        name = hashlib.sha256(packed).hexdigest()[:24]
        with self._lock:
            self._starts.pop(name, None)
            self._starts[name] = packed
            while len(self._starts) > _STARTS:
                del self._starts[next(iter(self._starts))]
        return name

    def start_of(self, name: str) -> bytes | None:
        """A start by its name; None where it is kept no longer."""
        return self._starts.get(name)

    # -------------------------------------------------------------------------------------------- runs

    def path(self, ref: str) -> pathlib.Path:
        """File of a run: "job:KEY" or "file:NAME".

        Raises
        ------
        InputError
            If there is none, or it lies outside the working folder.
        """
        kind, _, name = ref.partition(":")
        if kind == "job":
            path = self.jobs.result(name)
            if path is None:
                raise InputError(f"{name} has no results")
            return path
        if kind != "file":
            raise InputError(f"{ref!r} is no run")
        return self.folder.inside(name)

    def name(self, ref: str) -> str:
        """How a run is called on the page."""
        kind, _, name = ref.partition(":")
        return f"{int(name[:4])} {self.jobs.get(name).title}" if kind == "job" else name

    def load(self, ref: str) -> Loaded:
        """A run with its figures and numbers.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        path = self.path(ref)
        try:
            stamp = path.stat().st_mtime_ns
        except OSError:
            raise InputError(f"there is no file {self.folder.name(path)!r} any more") from None
        with self._lock:
            run, numbers, figures = _loaded(path, stamp)
        return Loaded(ref, self.name(ref), path, run, numbers, figures)

    def motion(self, ref: str) -> bytes | None:
        """The packed motion of a run, None where it has none."""
        loaded = self.load(ref)
        with self._lock:
            return _motion(loaded.path, loaded.path.stat().st_mtime_ns)

    def mode(self, ref: str) -> bytes | None:
        """The packed motion of a mode, "job:KEY:NUMBER"; None where there is none."""
        key, _, number = ref.removeprefix("job:").rpartition(":")
        path = self.jobs.place(self.jobs.get(key).key) / MODE.format(number)
        return path.read_bytes() if number.isdecimal() and path.is_file() else None

    def case_text(self, ref: str) -> str:
        """The case of a run, as YAML."""
        return str(self.load(ref).run.attrs["case"])

    def job_case(self, key: str) -> dict[str, Any]:
        """The case of a job, whether it has run or not."""
        self.jobs.get(key)
        return cases.content_of(self.jobs.place(key) / CASE)


@functools.lru_cache(maxsize=_KEPT)
def _loaded(path: pathlib.Path, stamp: int) -> tuple[Any, Any, Any]:
    from evolvent import results

    found = results.open(path)
    module = cases.presenter(found)
    return found, module.numbers(found), module.figures(found)


@functools.lru_cache(maxsize=_KEPT)
def _motion(path: pathlib.Path, stamp: int) -> bytes | None:
    from evolvent import animation, show

    run = _loaded(path, stamp)[0]
    motion = show.motion(run) if run.sizes.get("time", 1) == 1 else animation.of_run(run)
    return None if motion is None else animation.pack(motion)
