"""What the server holds: the folder and the queue, runs that were opened, and what each tab of a browser shows."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import functools
import hashlib
import pathlib
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from evolvent import cases, results
from evolvent.assembly import families
from evolvent.design import studies
from evolvent.model import family
from evolvent.view import animation, show
from evolvent_base import file_keys
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import drafts, pages, parts, reading, signing, studydraft
from evolvent_studio.changes import changes
from evolvent_studio.drafts import Draft, View
from evolvent_studio.exports import Export, Exports
from evolvent_studio.folder import OWN, Folder
from evolvent_studio.jobkinds import MODE
from evolvent_studio.jobs import LONGEST_TITLE, Jobs
from evolvent_studio.placing import source_file
from evolvent_studio.studydraft import StudyDraft

if TYPE_CHECKING:
    from evolvent_base.figures import Figure, Number

#: Runs that are kept in memory.
_KEPT = 8
#: Largest file of a mode's motion, bytes.
_LARGEST_MODE = 100_000_000
#: The case that the form holds at first.
FIRST = "case:boom-slew"
#: What the parts of a case must support, by kind of job.
_SOLVERS = {"equilibrium": family.STATIC, "modes": family.MODES}
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
    def file(self) -> str:
        """Its file of the folder, '' of a job's."""
        return self.ref.partition(":")[2] if self.ref.startswith("file:") else ""

    @property
    def still(self) -> bool:
        """Whether it is one state, such as an equilibrium."""
        return int(self.run.sizes.get("time", 1)) == 1


class Studio:
    """What all tabs of browsers share, and what one of them shows: its draft, view, panel, colours and measurement.

    Parameters
    ----------
    folder : Folder
    """

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.jobs = Jobs(folder)
        self.exports = Exports()
        self._signer = signing.of_user()
        self._lock = threading.Lock()
        self.computing = threading.Lock()  # held by a thread that assembles or compiles: functions are loaded by one
        self._starts: dict[str, bytes] = {}
        self._begin("")

    def _begin(self, name: str) -> None:
        """Show what a tab shows at first."""
        self.draft, self.view, self.tab = Draft(), View(), "case"
        self.dark: bool | None = None  # as the browser has it
        self.measure: dict[str, Any] = {}
        self.calibration: dict[str, Any] = copy.deepcopy(drafts.CALIBRATED)
        self.studies = {
            kind: studydraft.opened(self.folder, f"new:{word}") for kind, word in studydraft.NEW_ONES.items()
        }
        self._name, self._saved = name, ""
        self.open_case(FIRST)

    # -------------------------------------------------------------------------------------------- tabs

    def of_tab(self, name: str) -> Studio:
        """The studio with what a tab of a browser had open when it was there last; queue and folder are shared.

        Parameters
        ----------
        name : str, of the tab
        """
        found = copy.copy(self)
        found._begin(name if pages.is_name(name) else "")
        with contextlib.suppress(EvolventError, OSError, ValueError, TypeError, KeyError, AttributeError):
            found._restore(pages.load(self.folder, self._signer, name))
        return found

    def _restore(self, content: Mapping[str, Any]) -> None:
        """Take what was kept of a tab, all of it or nothing."""
        draft, view = Draft(**content["draft"]), content["view"]
        studies = {kind: StudyDraft(**content["studies"][kind]) for kind in studydraft.NEW_ONES}
        texts = (
            draft.source, draft.about, draft.origin, content["tab"], view["kind"], *view["refs"],
            *(text for one in studies.values() for text in (one.source, one.about)),
        )  # fmt: skip
        contents = (draft.content, draft.base, content["measure"], *(one.content for one in studies.values()))
        if not all(isinstance(text, str) for text in texts) or not all(isinstance(one, dict) for one in contents):
            return
        measure = drafts.kept(content["measure"], drafts.MEASURED)
        calibration = drafts.kept_calibration(content["calibration"])
        if measure is None or calibration is None:
            return
        self.draft = self._checked(draft)
        self.view, self.tab = View(view["kind"], tuple(view["refs"])), content["tab"]
        self.dark = content["dark"] if content["dark"] in (True, False) else None
        self.measure, self.studies, self.calibration = measure, studies, calibration

    def save(self) -> None:
        """Keep what the tab shows, where it has changed."""
        content = {
            "draft": dataclasses.asdict(self.draft), "view": dataclasses.asdict(self.view), "tab": self.tab,
            "studies": {kind: dataclasses.asdict(one) for kind, one in self.studies.items()}, "dark": self.dark,
            "measure": self.measure, "calibration": self.calibration,
        }  # fmt: skip
        text = repr(content)
        if self._name and text != self._saved:
            self._saved = text
            with contextlib.suppress(EvolventError, OSError, ValueError, TypeError):
                pages.save(self.folder, self._signer, self._name, content)

    # -------------------------------------------------------------------------------------------- cases

    def sources(self) -> dict[str, str]:
        """Cases that can be opened, source -> how it is shown: those of the folder first."""
        written = self.folder.yaml().items()
        found = {f"file:{name}": name for name, one in written if one.keys & {"system", "parts"}}
        found |= {f"file:{name}": f"{name} ({why})" for name, why in self.folder.unreadable().items()}
        found |= {f"new:{name}": f"new {name}" for name in NEW}
        return found | {f"case:{name}": name for name in cases.built_in()}

    def study_sources(self, kind: str = "sweep") -> dict[str, str]:
        """Studies that a job of a kind can run, source -> how it is shown: those of the folder first."""
        word = studydraft.NEW_ONES[kind]
        every = self.folder.yaml().items()
        found = {f"file:{name}": name for name, one in every if {"case", "over"} <= one.keys}
        found |= {f"new:{word}": f"new {word}"}
        if kind == "sweep":  # none of those built in draws
            found |= {f"case:{name}": name for name in studies.built_in()}
        return found

    def stands(self) -> list[str]:
        """Files that describe a stand."""
        return [name for name, one in self.folder.yaml().items() if one.is_stand]

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
            content, about = self.folder.content(name), name
            if not isinstance(content, Mapping):
                raise InputError(f"{name}: it holds no case; a case is a mapping of keys to values")
            content = cases.content_of(content)
        return self._checked(Draft(source, about, content, copy.deepcopy(content), source))

    def take_case(self, content: Mapping[str, Any], about: str, origin: str = "") -> None:
        """Put a case that stands elsewhere into the form.

        Parameters
        ----------
        origin : str, source of the case that it is a change of
        """
        taken = cases.content_of(content)
        base = copy.deepcopy(taken)
        if origin:
            try:
                base = self.read_case(origin).base
            except EvolventError:  # the file is gone
                origin = ""
        self.draft = self._checked(Draft("", about, taken, base, origin))

    def _checked(self, draft: Draft) -> Draft:
        draft.content = parts.one_by_one(draft.content)
        self.folder.placed(draft.content, source_file(draft.origin or draft.source))
        cases.system(str(draft.content.get("system", "")))
        return draft

    def submit(self, draft: Draft | None = None, kind: str = "run") -> str:
        """Put a case, that of the form unless given, into the queue; returns the job's key.

        Parameters
        ----------
        kind : str, that of a job of one case (`evolvent_studio.jobkinds.Kind.of_case`), what is computed of it

        Raises
        ------
        InputError
            If it cannot be run.
        """
        draft = draft or self.draft
        content = self.folder.placed(draft.content, source_file(draft.origin or draft.source))
        case = cases.load(content)
        definition = cases.system(case.system)
        assembled = reading.elements(content) <= reading.MOST_ELEMENTS  # of a larger one by its job alone
        before = definition.unstored(case)  # storage, too, is left to the job
        if assembled and kind == "run":
            definition.plan(before)
        elif assembled:
            assembly = definition.build(before).assemble()
            if kind in _SOLVERS:  # what others lack is found with their results, which takes longer
                families.check(assembly, _SOLVERS[kind])
        name = pathlib.PurePosixPath((draft.origin or draft.source).partition(":")[2]).stem or case.system
        changed = [list(change) for change in changes(draft.base, draft.content)] if draft.base else []
        of = name if draft.origin else draft.about
        extra = {"origin": draft.origin, "of": of, "changes": changed, **self._since(draft.origin, of, content)}
        title = " ".join(str(content.get("title") or name).split())[:LONGEST_TITLE]
        return self.jobs.add(kind, title, case=cases.to_yaml(case, content), extra=extra).key

    def _since(self, origin: str, of: str, content: Mapping[str, Any]) -> dict[str, Any]:
        """The last run of the same case, and what differs from it; empty where there is none."""
        for job in self.jobs.listed():
            if job.sort.of_case and (job.extra.get("origin"), job.extra.get("of")) == (origin, of):
                with contextlib.suppress(EvolventError, OSError):
                    found = changes(self.job_case(job.key), content)
                    return {"before": int(job.key[:4]), "since": [list(change) for change in found]}
        return {}

    def start(self, content: Mapping[str, Any], note: Callable[[str], None] = lambda text: None) -> str:
        """The start of a case, ready for the viewer; returns its name for `start_of`.

        Raises
        ------
        InputError
            If its parts cannot be assembled.
        """
        reading.check_size(content)
        beside = source_file(self.draft.origin or self.draft.source)
        packed = reading.start(self.folder.placed(content, beside), note)
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

    def open_case_named(self) -> str | dict[str, Any]:
        """The case that is open: its name where it is as it was saved or built in, else its content."""
        kind, _, name = self.draft.source.partition(":")
        saved = kind in ("case", "file") and self.draft.content == self.draft.base
        return name if saved else copy.deepcopy(self.draft.content)

    def open_case_title(self) -> str:
        """What the case that is open is called, and whether it has changed."""
        name = (self.draft.origin or self.draft.source).partition(":")[2] or self.draft.about
        return name if self.draft.content == self.draft.base else f"{name}, changed"

    def follow_case(self, kind: str) -> bool:
        """Take the case that is open into the study of a kind of job, where it follows it; returns whether it changed.

        Keys and results that only the case before has are forgotten.

        Raises
        ------
        InputError
            If the case cannot be read.
        """
        study, case = self.studies[kind], self.open_case_named()
        if not study.follows or study.content.get("case") == case:
            return False
        content = studydraft.with_case(self.folder, study, case)
        if study.source.startswith("new:") and "" in (content.get("over") or {}):  # nothing of the case before is left
            origin = (self.draft.origin or self.draft.source).partition(":")[2]
            content["study"] = plain(pathlib.PurePosixPath(origin).stem)
        self.studies[kind] = dataclasses.replace(study, content=content)
        return True

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
        elif kind == "file":
            path = self.folder.inside(name)
        else:
            raise InputError(f"{ref!r:.200} is not a run")
        if path.is_dir():  # of a study
            self.folder.check_plain(path)
            return path
        return self.folder.file(self.folder.name(path))

    def has_report(self, ref: str) -> bool:
        """Whether there is a page with the results of a job or a folder."""
        return self._report(ref) is not None

    def _report(self, ref: str) -> pathlib.Path | None:
        kind, _, key = ref.partition(":")
        return self.jobs.report(key) if kind == "job" else self.folder.report(key) if kind == "file" else None

    def report(self, ref: str) -> pathlib.Path:
        """The page with the results of a job, "job:KEY", or of a dispersion in a folder, "file:NAME".

        Raises
        ------
        InputError
            If there is none.
        """
        path = self._report(ref)
        if path is None:
            raise InputError(f"{ref!r:.200} has no page with results")
        return self.folder.file(self.folder.name(path))

    def beside(self, ref: str, name: str) -> pathlib.Path:
        """A file beside the results of a job, "job:KEY".

        Raises
        ------
        InputError
            If there is none.
        """
        kind, _, key = ref.partition(":")
        path = self.folder.existing(OWN, self.jobs.get(key).key, name) if kind == "job" else None
        if path is None:
            raise InputError(f"{ref!r:.200} has no file {name!r}")
        return self.folder.file(self.folder.name(path))

    def name(self, ref: str) -> str:
        """How a run is called on the page."""
        kind, _, name = ref.partition(":")
        if kind != "job":
            return name
        title = self.jobs.get(name).title  # which refuses what is no job
        return f"{int(name[:4])} {title}"

    def load(self, ref: str) -> Loaded:
        """A run with its figures and numbers.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        path = self.path(ref)
        try:
            stamp = file_keys.state(path)
        except OSError:
            raise InputError(f"there is no file {self.folder.name(path)!r} any more") from None
        with self._lock:
            run, numbers, figures = _loaded(path, stamp)
        return Loaded(ref, self.name(ref), path, run, numbers, figures)

    def motion(self, ref: str) -> bytes | None:
        """The packed motion of a run, None where it has none."""
        loaded = self.load(ref)
        with self._lock:
            return _motion(loaded.path, file_keys.state(loaded.path))

    def mode(self, ref: str) -> bytes | None:
        """The packed motion of a mode, "job:KEY:NUMBER"; None where there is none."""
        key, _, number = ref.removeprefix("job:").rpartition(":")
        place = self.jobs.folder_of(self.jobs.get(key).key)
        if not re.fullmatch(r"[0-9]{1,4}", number):
            return None
        try:
            return self.folder.read(OWN, place.name, MODE.format(number), most=_LARGEST_MODE)
        except InputError:
            return None

    def export(self, ref: str, kind: str) -> Export:
        """Begin to write a download of a run.

        Raises
        ------
        InputError
            If the run cannot be read, or something is missing that the download needs.
        """
        return self.exports.start(kind, self.load(ref).path, plain(self.name(ref)))

    def case_text(self, ref: str) -> str:
        """The case of a run, as YAML."""
        return str(self.load(ref).run.attrs["case"])

    def job_case(self, key: str) -> dict[str, Any]:
        """The case of a job, whether it has run or not."""
        return cases.content_of(self.jobs.case(key))


def plain(name: str) -> str:
    """The name of a run as that of a file: letters, digits, dots and dashes."""
    return re.sub(r"[^\w.-]+", "-", name.removesuffix(".nc"), flags=re.ASCII).strip("-.") or "run"


@functools.lru_cache(maxsize=_KEPT)
def _loaded(path: pathlib.Path, stamp: tuple[int, ...]) -> tuple[Any, Any, Any]:
    found = results.open(path)
    module = cases.presenter(found)
    return found, module.numbers(found), [figure.whole or figure for figure in module.figures(found)]


@functools.lru_cache(maxsize=_KEPT)
def _motion(path: pathlib.Path, stamp: tuple[int, ...]) -> bytes | None:
    run = _loaded(path, stamp)[0]
    motion = show.motion(run) if run.sizes.get("time", 1) == 1 else animation.of_run(run)
    return None if motion is None else animation.pack(motion)
