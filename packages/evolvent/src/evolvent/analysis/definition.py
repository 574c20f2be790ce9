"""SystemDefinition: what a system provides, so that command line, files, sweeps, studio and documentation serve it.

A definition is a class with a few members; the others have defaults that are derived from the parts. One from outside
the package is named by an entry point of the group ``evolvent.systems``::

    [project.entry-points."evolvent.systems"]
    pantograph = "pantograph:Pantograph"
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from evolvent import cases
from evolvent.analysis import accuracy, closure, limits, runs, trees
from evolvent.analysis.margins.kept_margins import KeptMargins
from evolvent.analysis.methods import choose_method
from evolvent.analysis.settings import check_run, sample_times
from evolvent.cases import CasePlan
from evolvent.results.fine_samples import Times
from evolvent.results.kept import is_of_samples, kept_of
from evolvent.results.limits import LIMITS
from evolvent.results.tree import root_of
from evolvent.solvers.common.laws import refusing_laws
from evolvent.solvers.time.explicit import plan as explicit_plan
from evolvent.solvers.time.implicit import plan as implicit
from evolvent.view import show, summary
from evolvent_base.errors import InputError, RunFailed, in_keys, naming_keys, nearest
from evolvent_base.schema import Section

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.analysis.margins.results import MarginResults
    from evolvent.analysis.modal import ModalResults
    from evolvent.analysis.system import System
    from evolvent.assembly.assembled import Assembly
    from evolvent.assembly.variants import Variants
    from evolvent.results.kept import Kept
    from evolvent.results.measurements import Measurements
    from evolvent.results.motion import Motion
    from evolvent.solvers.common.solution import Solution
    from evolvent_base.figures import Figure, Number

    #: Variables of the root: name -> (dimensions, values, units, long name).
    Variables = dict[str, tuple[tuple[str, ...], np.ndarray, str, str]]


class SystemDefinition:
    """A system that can be run by name: a short form of a case, from which parts follow.

    A subclass has `Case` and `build`, and overrides of the others what its field asks for.

    Attributes
    ----------
    Case : type of `evolvent_base.schema.Section`, the keys of its cases; its key ``system`` holds the system's name
    cases : mapping, name -> YAML text of the built-in cases (of a system outside the package)
    seed_key : str, key that a study gives each case its own seed by; '' for none
    start_key : str, key of a case that takes the run from whose end it starts; '' for none
    laws : names of the laws in Python that `build` takes
    data_files : mapping, name of a file with measured data that the system brings along -> its path
    keys : mapping, argument of `System.simulate` -> key of the case that gives it, for messages
    run_batch : function of a list of cases to their runs, for sweeps; None where cases run one by one
    """

    Case: ClassVar[type[Section]]
    cases: ClassVar[Mapping[str, str]] = {}
    seed_key: ClassVar[str] = ""
    start_key: ClassVar[str] = ""
    laws: ClassVar[tuple[str, ...]] = ()
    data_files: ClassVar[Mapping[str, str]] = {}
    keys: ClassVar[Mapping[str, str]] = {
        name: f"simulate.{name}"
        for name in ("until", "every", "method", "step", "tolerance", "absolute_tolerance", "spectral_radius")
    }
    run_batch: Callable[[Sequence[Any]], Sequence[Any]] | None = None
    #: Formulas beside the system's own that `evolvent calibrate` fits to the same data: label -> keys that they change.
    reference_formulas: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    #: Level of finer integration of its runs (`evolvent.analysis.accuracy`); set by `finer`.
    level: float = 0.0
    #: Whether `build` and `settings` let the system be stepped from outside (`evolvent.Stepper`).
    steps: ClassVar[bool] = True

    # ------------------------------------------------------------------------------ what a system must have

    def build(self, case: Any, *, laws: Mapping[str, Any] | None = None) -> System:
        """The parts of a case."""
        raise NotImplementedError(f"{type(self).__name__} has no build()")

    def settings(self, case: Any) -> dict[str, Any]:
        """How a case is run: arguments of `System.simulate` by name, of which `until` must be among them.

        By default those of the case's key ``simulate`` (a section `Simulate`).
        """
        found = case.simulate.settings()
        return dict(found)

    def prepared_settings(self, case: Any, assembly: Assembly, laws: Mapping[str, Any]) -> dict[str, Any]:
        """`settings` of a case whose parts are assembled; refuses what only these show."""
        return self.settings(case)

    def sections(self, case: Any) -> dict[str, Any]:
        """Sections of a case that `System.sections` holds, as a case file has them."""
        return {}

    def keeps_states(self, case: Any) -> bool:
        """Whether states of a run stay in memory with its tree: where its report has the margins along the run."""
        return "margin" in self.sections(case)

    # ---------------------------------------------------------------------------------- what follows from it

    def finer(self, level: float) -> Self:
        """The system, whose runs are integrated finer than their cases say, by a level of `accuracy.settings_at`."""
        found = copy.copy(self)
        found.level = level
        return found

    def integration(self, case: Any) -> str:
        """Tolerance or step of the runs of a case, in words."""
        assembly, times, settings = self.assembled(case, {})
        return accuracy.shown(accuracy.settings_at(self.level, assembly, times, settings))

    def system(self, case: Any) -> System:
        """The parts of a case, with its `settings` and `sections`."""
        found = self.build(case)
        found.settings = {name: value for name, value in self.settings(case).items() if value is not None}
        found.sections = self.sections(case)
        if self.level:
            assembly, times, settings = self.assembled(case, {})
            own = accuracy.settings_at(self.level, assembly, times, settings)
            found.settings |= {name: own[name] for name in accuracy.NAMES if own.get(name) is not None}
        return found

    def plan(
        self, case: Any, *, laws: Mapping[str, Any] | None = None, keep: Sequence[str] = (),
        variants: Variants | None = None,
    ) -> CasePlan:  # fmt: skip
        """The case, checked and prepared; nothing long is compiled.

        Parameters
        ----------
        laws : mapping, laws in Python by name
        keep : names of what alone is asked of the run, with reductions; if any, the plan has `keep`
        variants : what many cases of the system share, which are then assembled faster

        Raises
        ------
        InputError
            For whatever can be found before the run.
        """
        given = self._given(laws)
        keys = self.keys
        with naming_keys(keys):
            assembly, times, settings = self.assembled(case, given, variants)
            settings = accuracy.settings_at(self.level, assembly, times, settings)
            check_run(assembly, times, settings.get("step"))
            margins = KeptMargins.of(assembly, self.sections(case).get("margin", {}), keep)
            local = bool(keep) and not margins.of_run and is_of_samples(assembly, margins.others)
            fine = bool(settings.pop("fine", True)) and not local
            sampling = Times.of(times, self.between(case), fine=fine, values=assembly.y.size)
            method, prepare, note = self.prepare_run(case, assembly, sampling.all, settings)

        def sampled(progress: Callable[[float], None] | None) -> tuple[Solution, np.ndarray, str]:
            with naming_keys(keys):
                prepared, why = prepare()
                solution = prepared.run(progress).or_start(float(times[0]))
            solution.message = in_keys(solution.message, keys)
            return *sampling.chosen(solution), why

        def solve(progress: Callable[[float], None] | None) -> tuple[Solution, Variables, str, str]:
            solution, kept, why = sampled(progress)
            root, warning = self.findings(case, solution)
            solution, root = trees.without(solution, root, kept)
            return solution, root | sampling.mark(solution.t), warning, why

        def run(progress: Callable[[float], None] | None = None) -> xr.DataTree:
            solution, root, warning, why = solve(progress)
            found = self.tree(case, solution, why, laws=given, findings=(root, warning))
            if wanted:
                section = self.sections(case).get("margin", {})
                found.attrs[LIMITS] = limits.written(wanted, section, solution, root)
            return found

        def observe(names: Iterable[str]) -> xr.Dataset:
            solution, root, _, _ = solve(None)
            marks = {name: (dims, values) for name, (dims, values, *_) in sampling.mark(solution.t).items()}
            return trees.observed(solution, names, system=case.system, root=root).assign(marks)

        def kept_values() -> Kept:
            if not margins.need_run:
                return margins.without_run()
            whole, seen, why = sampled(None)
            solution = closure.check_energy_gain(whole if seen.all() else whole.chosen(seen))

            def root() -> xr.Dataset:
                _, found = trees.without(whole, self.findings(case, whole)[0], seen)
                return root_of(solution, found)

            found = kept_of(solution, margins.others, root, fine=sampling.is_fine(solution.t), why=why)
            return margins.added(found, solution)

        def start() -> xr.DataTree:
            solution = trees.at_start(assembly, method, float(times[0]))
            return trees.tree(solution, case="", why="", system=case.system, root=self.findings(case, solution)[0])

        names = limits.Names(
            start, lambda: self.margin(case, motion=False).names, lambda: assembly.parts, "it asks for"
        )
        wanted = () if keep else limits.of_texts(self.sections(case).get(LIMITS, ()), names)
        name = explicit_plan.cache_name(assembly, method)
        return CasePlan(
            duration=float(times[-1]), run=run, solver=name, note=note, start=start, observe=observe,
            keep=kept_values if keep else None,
        )  # fmt: skip

    def unstored(self, case: Any) -> Any:
        """A case without storage before its run: it is checked without the time that storage takes."""
        return case

    def between(self, case: Any) -> np.ndarray:
        """Times (s) between the samples at which `derived` gets the run as well; kept as fine samples are."""
        return np.zeros(0)

    def assembled(
        self, case: Any, laws: Mapping[str, Any], variants: Variants | None = None
    ) -> tuple[Assembly, np.ndarray, dict[str, Any]]:
        """The assembled parts of a case, the times of its samples (s), and the other settings of its run.

        Parameters
        ----------
        laws, variants : as of `plan`

        Raises
        ------
        InputError
            For parts and settings that cannot be used.
        """
        assembly = self.build(case, laws=laws).assemble(variants)
        with refusing_laws(assembly):
            settings = self.prepared_settings(case, assembly, laws)
        if "until" not in settings:
            raise InputError("simulate is missing; give how long the motion is followed, such as {until: 20 s}")
        times = sample_times(settings.pop("until"), settings.pop("every", None), values=assembly.y.size)
        return assembly, times, settings

    def prepare_run(
        self, case: Any, assembly: Assembly, times: np.ndarray, settings: Mapping[str, Any]
    ) -> tuple[str, Callable[[], tuple[Any, str]], str]:
        """The solver of a run, a function that prepares it and says why its method is taken, and a note on its cost.

        The run has ``run(progress)``, which returns a Solution. What can be found quickly is refused here, what needs
        compiled functions by the function.
        """
        method, _ = choose_method(assembly, settings.get("method", "auto"))
        beams = assembly.model.info.slender > 0
        if method not in explicit_plan.METHODS or (settings.get("step") is None and not beams):
            return method, lambda: runs.plan(assembly, times, **settings), ""
        checked, note = runs.plan(assembly, times, **settings), ""  # refuses an unstable step
        if beams and checked[0].step is not None:
            steps = f"{times[-1] / checked[0].step:.2g} steps of {checked[0].step:.2g} s"
            note = f"{method} takes {steps} over {times[-1]:.6g} s; energy-momentum takes far fewer with beams"
        return method, lambda: checked, note

    def tree(
        self,
        case: Any,
        solution: Solution,
        why: str,
        *,
        laws: Mapping[str, Any] | None = None,
        findings: tuple[Variables, str] | None = None,
    ) -> xr.DataTree:
        """The results of a case.

        Parameters
        ----------
        why : str, why the method was taken
        laws : mapping, the laws in Python of the run, by name
        findings : of the solution; found if left out
        """
        root, warning = self.findings(case, solution) if findings is None else findings
        found = trees.tree(
            solution, case=cases.to_yaml(case), why=why, system=case.system, root=root,
            title=getattr(case, "title", ""), warning=in_keys(warning, self.keys), keep_states=self.keeps_states(case),
        )  # fmt: skip
        if files := cases.files_of_case(case):
            found.attrs[cases.FILES] = json.dumps(files)
        if laws:
            found.attrs["laws"] = json.dumps({name: _law_name(law) for name, law in laws.items()})
        return found

    def findings(self, case: Any, solution: Solution) -> tuple[Variables, str]:
        """`derived` and `warning`; overridden where both follow from one computation."""
        return self.derived(case, solution), self.warning(case, solution)

    def derived(self, case: Any, solution: Solution) -> Variables:
        """Quantities of the field, for the root of the results: name -> (dimensions, values, units, long name)."""
        return {}

    def warning(self, case: Any, solution: Solution) -> str:
        """A warning about the run, one sentence; '' for none."""
        return closure.warning_of(solution)

    def numbers(self, run: Any) -> list[Number]:
        """Rows of the table on the screen."""
        return summary.numbers(run)

    def figures(self, run: Any) -> list[Figure]:
        """What is drawn of a run; may be empty."""
        return summary.figures(run)

    def motion(self, run: Any) -> Motion | None:
        """Lines, bodies and forces of a run, for animations and files; None where it holds too little."""
        return show.motion(run)

    def study_figures(self, dataset: xr.Dataset) -> dict[str, Any]:
        """Figures of a study: name -> `evolvent_base.figures.Figure`, or matplotlib's.

        Where there are some, outputs are not drawn over the keys; variables over time are drawn all the same.
        """
        return {}

    def stand_description(self, case: Any) -> dict[str, Any] | None:
        """A case as `evolvent identify` and `evolvent plan` describe a stand; None for a system that is none."""
        return None

    def measurements(self, path: str, case: Any, observed: Sequence[str]) -> Measurements | None:
        """Measured data of a file in the system's own form; None of any other file."""
        return None

    def closed_form(self, case: Any, time: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        """Variables of a run by the system's closed form at times (s): name -> (values, unit); empty without one."""
        return {}

    def check_follows(self, before: Any, after: Any) -> None:
        """Refuse a case that cannot start from the end of another one, with an InputError."""

    def stepping(self, case: Any) -> dict[str, Any]:
        """Method, step, tolerance and spectral radius of `evolvent.Stepper`, by the names of its arguments.

        Generalized-alpha takes the place of energy-momentum, which a stepper does not have.

        Raises
        ------
        InputError
            If the system is not stepped from outside.
        """
        if not self.steps:
            raise InputError(f"system is {case.system!r}, which is not stepped from outside")
        assembly = self.build(case).assemble()
        settings = self.prepared_settings(case, assembly, {})
        method, _ = choose_method(assembly, settings.get("method", "auto"))
        if method in implicit.METHODS and implicit.METHODS[method].flags["midpoint"]:
            method, _ = choose_method(assembly, implicit.NAME)
        found = {"method": method, "step": settings.get("step")}
        for name in ("tolerance", "spectral_radius"):
            if settings.get(name) is not None:
                found[name] = settings[name]
        return found

    def modes(self, case: Any, *, count: int | None = None, mesh_error: bool = False) -> ModalResults:
        """The slowest modes of a case about its equilibrium, by its keys `equilibrium` and `modes` where it has them.

        Parameters
        ----------
        count : int, in place of the case's own
        mesh_error : bool, as of `System.modes`

        Raises
        ------
        InputError, RunFailed
            As of `System.modes`.
        """
        section = getattr(case, "modes", None)
        options = _about_equilibrium(case)
        if section is not None:
            options |= {"count": section.count, "damped": section.damped}
        if count is not None:
            options["count"] = count
        found: ModalResults = self.build(case).modes(mesh_error=mesh_error, **options)
        return found

    def equilibrium(
        self, case: Any, progress: Callable[[float], None] | None = None, *, mesh_error: bool = False
    ) -> xr.DataTree:
        """The equilibrium of a case under its loads, whatever its status, by its key `equilibrium` where it has one.

        Parameters
        ----------
        progress : called with the load factor reached
        mesh_error : bool, as of `System.equilibrium`

        Raises
        ------
        InputError
            As of `System.equilibrium`.
        """
        section = getattr(case, "equilibrium", None)
        options = _about_equilibrium(case)
        if section is not None:
            options["load_steps"] = section.load_steps
        found: Any
        try:
            found = self.build(case).equilibrium(progress=progress, mesh_error=mesh_error, **options)
        except RunFailed as error:
            found = error.run
            if found is None:
                raise
        return found

    def margin(
        self, case: Any, *, motion: bool | None = None, progress: Callable[[float], None] | None = None, **keys: Any
    ) -> MarginResults:
        """Margins of a case, by its key `margin` where it has one.

        Parameters
        ----------
        motion, progress, keys : as of `System.margin`

        Raises
        ------
        InputError, RunFailed
            As of `System.margin`.
        """
        found: MarginResults = self.system(case).margin(motion=motion, progress=progress, **keys)
        return found

    def _given(self, laws: Any) -> dict[str, Any]:
        """The laws in Python that a run was given, by name; refuses those that `build` does not take."""
        asked: Any = laws
        if not isinstance(asked, Mapping | None):
            names = ", ".join(self.laws)
            raise InputError(f"the laws are {laws!r}; they must be a mapping of names ({names}) to laws")
        given = {name: law for name, law in (laws or {}).items() if law is not None}
        if given and not self.laws:
            names = ", ".join(map(str, given))
            raise InputError(f"laws are given ({names}), but {self.Case.model_fields['system'].default} takes none")
        for name in given:
            if name not in self.laws:
                raise InputError(f"no law is called {name!r}; {nearest(str(name), self.laws)}")
        return given


def _about_equilibrium(case: Any) -> dict[str, Any]:
    """Time, steady turn and relaxation that a case asks for."""
    section = getattr(case, "equilibrium", None)
    if section is None:
        return {}
    own = {name: getattr(section, name, None) for name in ("rotating", "relaxed")}
    return {"time": section.time} | {name: value for name, value in own.items() if value}


def _law_name(law: Any) -> str:
    """Name of a law, or of the first of (law, parameters)."""
    law = law[0] if isinstance(law, tuple) and law else law
    return str(getattr(law, "__name__", law))
