"""System: parts by name, and the analyses of what they make."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, overload

import lazy_loader as lazy
import numpy as np

from evolvent.analysis import limits, margins, runs, simulation, trees, variation
from evolvent.analysis.composition import Composition
from evolvent.analysis.methods import choose_method
from evolvent.analysis.storage import Aged, storage_of, stored
from evolvent.results.limits import LIMITS
from evolvent_base.answer import Answer, Section, Table
from evolvent_base.errors import InputError, RunFailed
from evolvent_base.progress import on_stderr
from evolvent_base.showing import Answered

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.analysis import (
        batch as batches,
        linear,
        loop_modes as loops,
        mesh_error as mesh,
        modal,
        reflector_keys,
        reflector_results,
        sensitivity,
        storage_results,
    )
    from evolvent.analysis.sensitivity_results import Sensitivities
    from evolvent.assembly.assembled import Assembly
    from evolvent.results.kept import Kept
    from evolvent.solvers.common.solution import Solution
    from evolvent.solvers.modal import linear as linearized, modes as vibrations
    from evolvent.solvers.static import static
else:  # runs do without; what these may ask for on threads is loaded at once
    batches = lazy.load("evolvent.analysis.batch", suppress_warning=True)
    linear = lazy.load("evolvent.analysis.linear", suppress_warning=True)
    loops = lazy.load("evolvent.analysis.loop_modes", suppress_warning=True)
    mesh = lazy.load("evolvent.analysis.mesh_error", suppress_warning=True)
    modal = lazy.load("evolvent.analysis.modal", suppress_warning=True)
    reflector_keys = lazy.load("evolvent.analysis.reflector_keys", suppress_warning=True)
    reflector_results = lazy.load("evolvent.analysis.reflector_results", suppress_warning=True)
    sensitivity = lazy.load("evolvent.analysis.sensitivity", suppress_warning=True)
    storage_results = lazy.load("evolvent.analysis.storage_results", suppress_warning=True)
    linearized = lazy.load("evolvent.solvers.modal.linear", suppress_warning=True)
    vibrations = lazy.load("evolvent.solvers.modal.modes", suppress_warning=True)
    static = lazy.load("evolvent.solvers.static.static", suppress_warning=True)


class System(Composition, Answered):
    """A mechanical system, composed part by part.

    Parameters
    ----------
    gravity : (3,) float, m/s2, or with a unit in the last entry, inertial frame; acts on every mass
    title : str, what the system is, for the titles of pictures
    settings : mapping, optional, arguments that `simulate` takes where they are left out
    sections : mapping, optional, other sections of the case, as in a file: `store` is the storage before every
        analysis, such as ``{"store": {"time": "10 years", "temperature": "20 degC"}}``; `margin` holds keys of `margin`
    spin : mapping or list of them, optional, rigid rotation of all that moves at the start, ``{"axis": (0, 0, 1),
        "rate": "5 deg/s"}``, with `about` a point on the axis in place of the centre of mass, and with `parts` of these
        alone; beside the velocities that parts have themselves
    velocity : (3,) float, m/s, optional, of all that moves at the start, inertial axes, likewise
    start : path, optional, file of a run of the same parts, from whose end this one starts

    Examples
    --------
    >>> from evolvent import System, parts
    >>> system = System(gravity=(0.0, 0.0, -9.81))
    >>> bob = system.add(parts.Point(mass=1.0, position=(1.0, 0.0, 0.0)))
    >>> rod = system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=bob, type="link", length=1.0))
    >>> assembly = system.assemble()
    """

    def answer(self) -> Answer:
        """Kinds and number of the parts."""
        kinds: dict[str, list[str]] = {}
        for name, part in self._parts.items():
            kinds.setdefault(str(type(part).model_fields["kind"].default), []).append(name)
        rows = [
            (kind, ", ".join(names[:6]) + (", ..." if len(names) > 6 else ""), str(len(names)))
            for kind, names in kinds.items()
        ]
        facts = [("parts", str(len(self._parts)))]
        if np.any(self._gravity):
            facts.append(("gravity", f"{self._gravity.tolist()} m/s²"))
        facts += [(name, str(self.settings[name])) for name in ("until", "method") if name in self.settings]
        parts = Section(
            title="Parts", blocks=[Table(heads=("kind", "names", "number"), rows=rows, words=2)] if rows else []
        )
        return Answer(title=self.title or "System", facts=facts, sections=[parts])

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """The same system with other values of some keys, which shares what does not change.

        Its analyses give the same numbers, to the last bit, as a system that is built with these values. Stiffnesses,
        dampings, gains, limits, masses and the size of loads go into a copy of the model that is there
        (`evolvent.model.questions.Parts.changes`); where anything else follows from a value, the system is assembled
        whole, at its first analysis.

        Parameters
        ----------
        values : mapping, key of a part -> value, also with a unit: ``{"hinge 1.stiffness": "2 N m/rad"}``; numbers
            select entries of lists (``"slew.profile.table.1.1"``). ``parts.`` may stand before, as in case files, and
            keys of a case beside its parts work as well: ``gravity.2``, ``simulate.until``. ``"hinge.stiffness"`` is
            that of ``"hinge 1"``, ``"hinge 2"`` and so on, where it is the same in all of them

        Returns
        -------
        System, a copy; this one keeps its values

        Raises
        ------
        InputError
            For keys and values that a case would refuse; one sentence.

        Examples
        --------
        >>> import evolvent
        >>> array = evolvent.load("solar-array")
        >>> softer = array.with_values({"hinge 1.stiffness": 0.18, "panel 3.mass": "4.1 kg"})
        >>> softer.parts["hinge 1"].stiffness
        0.18
        """
        return variation.with_values(self, values)

    def batch(
        self, n: int, *, until: Any = None, every: Any = None, method: str | None = None, step: Any = None,
        tolerance: float | None = None, spectral_radius: float | None = None, inputs: str | Sequence[str] = (),
        workers: int | None = None,
    ) -> batches.Batch:  # fmt: skip
        """Make many copies of the system, which compiled code steps beside one another.

        Parameters
        ----------
        n : int, number of copies
        until : float, s, or with a unit
            The end of the time that may be stepped through; left out, that of `settings`, or 1e4 s.
        every : float, s, or with a unit
            Length of a step of the batch, `Batch.step`; left out, `step`.
        method : str
            An implicit one; left out, that of `simulate` if it is implicit, else generalized-alpha.
        step, tolerance, spectral_radius : as of `simulate`
        inputs : names of bodies on which forces and torques will be set, under generalized-alpha or hht
        workers : int, threads; left out, one for every core

        Returns
        -------
        evolvent.analysis.batch.Batch
            ``batch.expand("hinge 1.stiffness", values)`` gives each copy its own parameter,
            ``batch.bind("hub.rate.z")`` is an array of a result, and ``batch.step()``, ``batch.run(10.0)`` and
            ``batch.reset(mask)`` move the copies.

        Raises
        ------
        InputError
            As of `simulate`; for explicit methods, feedback, threads that are paid out, and more copies than the memory
            holds.
        """
        return batches.Batch(
            self, n, until=until, every=every, method=method, step=step, tolerance=tolerance,
            spectral_radius=spectral_radius, inputs=inputs, workers=workers,
        )  # fmt: skip

    @overload
    def simulate(
        self, *, until: Any = None, every: Any = None, fine: bool | None = None, method: str | None = None,
        step: Any = None, tolerance: float | None = None, spectral_radius: float | None = None,
        progress: Callable[[float], None] | None = None, keep: None = None,
    ) -> xr.DataTree: ...  # fmt: skip

    @overload
    def simulate(
        self, *, until: Any = None, every: Any = None, fine: bool | None = None, method: str | None = None,
        step: Any = None, tolerance: float | None = None, spectral_radius: float | None = None,
        progress: Callable[[float], None] | None = None, keep: Sequence[str],
    ) -> Kept: ...  # fmt: skip

    def simulate(
        self,
        *,
        until: Any = None,
        every: Any = None,
        fine: bool | None = None,
        method: str | None = None,
        step: Any = None,
        tolerance: float | None = None,
        spectral_radius: float | None = None,
        progress: Callable[[float], None] | None = None,
        keep: Sequence[str] | None = None,
    ) -> xr.DataTree | Kept:
        """Integrate the motion from the start over time.

        Parameters
        ----------
        until : float, s, or a text with a unit ("20 s"), end of the run; needed unless the system was read from a case
        every : float, s, or a text, between samples; a 400th of the run if left out
        fine : bool, whether finer samples are kept where the motion is fast, at most as many as the others; True if
            left out. A variable ``fine_sample`` marks them.
        method : {"auto", "generalized-alpha", "hht", "energy-momentum", "dopri5", "rk4", "heun"}
            "auto" chooses from the parts; the result's attributes ``method`` and ``method_reason`` say which and why.
        step : float, s, or a text, of a method with fixed steps; chosen if left out
        tolerance : float, of an adaptive method
        spectral_radius : float, at infinite frequency: 0 to 1 of generalized-alpha, 1/2 to 1 of hht, 1/3 to 1 of
            energy-momentum; 0.9 if left out
        progress : called with the time reached (s), a few times a second; left out, a run that takes longer than 2 s
            prints lines with the time left on stderr
        keep : names of variables with reductions, as of a study (``"hinge 1.latch_time.last"``, ``.max``, ``.min``),
            of margins (``"hinge 1.margin"``, ``"hinge 1.margin_in_run"``) and of statistics; these values alone are
            returned, without the time that a tree takes

        Returns
        -------
        xarray.DataTree, or evolvent.results.kept.Kept of what is kept
            One group a part, by its name; times, energy balance and momenta at the root; units on every variable. Its
            attribute ``status`` is "success", "stopped by event" or "interrupted".

        Raises
        ------
        InputError
            For parts that cannot be assembled, or that the method does not support; the sentence names the part. For
            names of `keep` that the run does not have.
        RunFailed
            If the run did not reach its end; ``.run`` holds what was computed.
        """
        given = {"until": until, "every": every, "fine": fine, "method": method, "step": step}
        given |= {"tolerance": tolerance, "spectral_radius": spectral_radius}
        settings = self._run_settings(given)
        with on_stderr(settings["until"]) as shown:
            listener = shown if progress is None else progress
            if keep is not None:
                return simulation.kept(self, keep, listener, settings)
            assembly = self.assemble()
            return runs.simulate(
                assembly, case=functools.partial(self.copy()._case, settings), title=self.title, progress=listener,
                keep_states="margin" in self.sections, judge=self._judge(assembly), **settings,
            )  # fmt: skip

    def _judge(self, assembly: Assembly) -> Callable[[Solution], dict[str, str]]:
        """Function of a solution to the attributes of its results that say what it makes of the limits."""
        texts: Any = self.sections.get(LIMITS, ())
        if not texts:
            return lambda solution: {}

        def start() -> xr.DataTree:
            return trees.tree(trees.at_start(assembly, choose_method(assembly, "auto")[0], 0.0), case="", why="")

        names = limits.Names(start, lambda: self.margin(motion=False).names, lambda: assembly.parts, "it asks for")
        wanted, section = limits.of_texts(texts, names), self.sections.get("margin", {})
        return lambda solution: {LIMITS: limits.written(wanted, section, solution, {})}

    def sensitivity(
        self, values: str | Sequence[str], keys: str | Sequence[str], *, until: Any = None, every: Any = None,
        fine: bool | None = None, method: str | None = None, step: Any = None, tolerance: float | None = None,
        spectral_radius: float | None = None, mode: str = "forward", check: bool = True,
        progress: Callable[[float], None] | None = None,
    ) -> Sensitivities:  # fmt: skip
        """Derivatives of values of a simulation by keys of its parts, of the discrete solution.

        Through latches, whose times are values like others, and through contacts where they are smooth. Adaptive steps
        are those of the run.

        Parameters
        ----------
        values : names of single numbers, as of `keep` of `simulate`: ``"hinge 1.latch_time"``, ``"hub.rate.z.last"``
        keys : keys of parts that hold a number with a unit: ``"parts.hinge 1.stiffness"``, ``"panel 3.mass"``; one of
            repeated parts, ``"hinge.stiffness"``, changes in all of them together
        until, every, fine, method, step, tolerance, spectral_radius, progress : as of `simulate`
        mode : {"forward", "adjoint"}
            Neighbours for each key, or one pass back through the run, which is faster for many keys and has fewer
            values and parts (docs, "Sensitivities of a run").
        check : bool
            Whether errors of integration are found, by another run with a tolerance ten times as large, or steps twice
            as long.

        Returns
        -------
        evolvent.analysis.sensitivity_results.Sensitivities
            ``found.dataset`` with ``derivative`` (value, key), in units ``unit``; ``relative``, the relative change of
            the value by that of the key; ``result`` (value) and ``at`` (key); ``derivative_error`` and
            ``result_error``, of integration, where they are checked. ``print(found)`` shows them,
            ``found.save("table.csv")`` and ``found.plot("bars.png")`` write them.

        Raises
        ------
        InputError, RunFailed
            For methods, parts, values and keys that have no derivative, and as of `simulate`.
        """
        given = {"until": until, "every": every, "fine": fine, "method": method, "step": step}
        settings = self._run_settings(given | {"tolerance": tolerance, "spectral_radius": spectral_radius})
        with on_stderr(settings["until"]) as shown:
            listener = shown if progress is None else progress
            return sensitivity.sensitivity(self, values, keys, progress=listener, mode=mode, check=check, **settings)

    def margin(
        self, *, motion: bool | None = None, progress: Callable[[float], None] | None = None, **keys: Any
    ) -> Any:
        """Torque and force margins of every hinge and slide over its whole travel.

        Parameters
        ----------
        motion : bool, whether the margins along the simulated motion are found as well; left out, where the system has
            settings that say how long it is simulated
        progress : as of `simulate`
        keys : keys of the section `margin` of a case, in place of those of the case that the system was read from:
            factors, evidence, zero, stations, others, pace, time, spin, centre, lines, parts

        Returns
        -------
        evolvent.analysis.margins.results.MarginResults
            ``margins.least``, ``margins.negative``, ``margins["hinge 1"].margin("motorization")``;
            ``margins.plot("margins.png")``, ``margins.save("margins.json")``.

        Raises
        ------
        InputError
            For parts that margins do not support, a coordinate without an end of its travel, and a resistance that is
            neither given nor declared to be zero; the sentence names it.
        RunFailed
            If the run did not reach its end; ``.run`` holds what was computed.
        """
        asked = margins.evaluation.with_keys(self.sections.get("margin", {}), keys)
        assembly = self.assemble()
        at_rest = margins.evaluation.at_rest(assembly, asked)
        moves = motion or (motion is None and "until" in self.settings)
        solution = self._solved(assembly, progress) if moves else None
        found = at_rest.results(solution, title=self.title, case=self._case(self.settings))
        if (section := storage_of(self.sections)) is not None:
            found.remarks.insert(0, f"after storage for {section.shown}; `evolvent storage` has the margins before")
        return found

    def storage(
        self, *, motion: bool | None = None, progress: Callable[[float], None] | None = None
    ) -> storage_results.StorageResults:
        """What storage in the stowed position leaves: forces and shapes, margins and deployment, before and after.

        Every other analysis of a system with the section `store` begins after the storage; this one shows both sides.

        Parameters
        ----------
        motion : bool, whether the deployment is simulated before and after; left out, where the system has settings
            that say how long
        progress : as of `simulate`

        Returns
        -------
        evolvent.analysis.storage_results.StorageResults
            Margins among it where the system has the section `margin`.

        Raises
        ------
        InputError
            Without the section `store`, or viscoelastic parts; where the stowed position is in no equilibrium.
        RunFailed
            If a deployment did not reach its end.
        """
        section = storage_of(self.sections)
        if section is None:
            raise InputError("store is missing; give how long the system is stored, such as store: {time: 10 years}")
        before = self._unstored()
        done = stored(before, section)
        self._aged = Aged(section, dataclasses.replace(before, model=before.model.copy()), done.assembly)
        moves = motion or (motion is None and "until" in self.settings)
        solutions = [self._solved(one, progress) for one in (before, done.assembly)] if moves else [None, None]
        of_both = list[Any]()
        if "margin" in self.sections:
            asked = margins.evaluation.with_keys(self.sections["margin"], {})
            of_both = [
                margins.evaluation.at_rest(one, asked).results(run, title=self.title)
                for one, run in zip((before, done.assembly), solutions, strict=True)
            ]
        case = self._case(self.settings)
        deployments = [trees.tree(run, case=case, why="", title=self.title) for run in solutions if run is not None]
        over = trees.tree(done.solution, case=case, why="equilibria over storage", title=self.title)
        return storage_results.StorageResults(
            section, done, trees.over(over, done.times, "time since the start of storage"), margins=of_both,
            runs=deployments, title=self.title, case=case,
        )  # fmt: skip

    def reflector(self, **keys: Any) -> reflector_results.ReflectorResults:
        """What the net of the system is as a reflector, in equilibrium with what holds its rim.

        Parameters
        ----------
        keys : keys of the section `reflector` of a case, in place of those of the case that the system was read from:
            net, frequency, length_error, limit, temperature, measured, adjust, after

        Returns
        -------
        evolvent.analysis.reflector_results.ReflectorResults
            ``found.cut_lengths``, ``found.tension``, ``found.error.fit.rms``, ``found.sensitivity``;
            ``found.save("cut.json")`` writes lengths that the key ``cut`` of a net reads, ``found.plot("net.png")``.

        Raises
        ------
        InputError
            Without a net, or for keys that cannot be used.
        RunFailed
            If there is no equilibrium.
        """
        asked = reflector_keys.keys_of(self.sections.get("reflector", {}), keys)
        return reflector_results.ReflectorResults(
            self.assemble(), asked, title=self.title, case=self._case(self.settings)
        )

    def _solved(self, assembly: Any, progress: Callable[[float], None] | None) -> Any:
        """The motion of an assembly by the system's settings, as a `Solution`."""
        settings = self._run_settings({})
        with on_stderr(settings["until"]) as shown:
            solution, _, _ = runs.solve(assembly, progress=shown if progress is None else progress, **settings)
        if solution.status == "failed":
            raise RunFailed(solution.message, solution)
        return solution

    def equilibrium(
        self, *, load_steps: int | Sequence[float] | None = None, arc_length: bool = False, time: float = 0.0,
        rotating: str | Sequence[float] | None = None, centre: Sequence[float] | None = None, relaxed: bool = False,
        tolerance: float = 1e-10, progress: Callable[[float], None] | None = None, mesh_error: bool = False,
    ) -> xr.DataTree:  # fmt: skip
        """Find the equilibrium under the loads, from the start.

        Parameters
        ----------
        load_steps, arc_length, time, rotating, centre, relaxed, tolerance : as of
            `evolvent.solvers.static.static.solve_static`
        progress : called with the load factor reached
        mesh_error : bool
            Whether it is found once more with every element of beams, rods and threads in halves: what parts show has
            then the attributes ``extrapolated`` (Richardson) and ``mesh_error``, the relative error by its length.

        Returns
        -------
        xarray.DataTree
            One group a part, as of `simulate`, with one sample: the equilibrium.

        Raises
        ------
        InputError
            As of `simulate`.
        RunFailed
            If there is no equilibrium; ``.run`` holds the last state that was reached.
        """
        found = static.solve_static(
            self.assemble(), load_steps=load_steps, arc_length=arc_length, time=time, rotating=rotating, centre=centre,
            relaxed=relaxed, tolerance=tolerance, progress=progress,
        )  # fmt: skip
        why = "equilibrium under the loads" + (" after all relaxation" if relaxed else "")
        run = trees.tree(
            found.chosen(slice(-1, None)), case=self._case(self.settings), why=why, title=self.title,
        )  # fmt: skip
        if run.attrs["status"] == "failed":
            raise RunFailed(run.attrs["message"], run)
        if mesh_error:
            finer = mesh.refined(self).equilibrium(
                load_steps=load_steps, arc_length=arc_length, time=time, rotating=rotating, centre=centre,
                relaxed=relaxed, tolerance=tolerance, progress=progress,
            )  # fmt: skip
            mesh.note(run, finer, self.parts)
        return run

    def modes(
        self, *, count: int = 10, damped: bool = False, time: float = 0.0,
        rotating: str | Sequence[float] | None = None, centre: Sequence[float] | None = None, relaxed: bool = False,
        mesh_error: bool = False,
    ) -> Any:  # fmt: skip
        """Find the slowest modes about the equilibrium, with its stresses, loads and steady turn.

        Parameters
        ----------
        count, damped, time, rotating, centre, relaxed : as of `evolvent.solvers.modal.modes.modes`
        mesh_error : bool
            Whether they are found once more with every element of beams, rods, threads and shells in halves, for an
            estimate of the error of the mesh, ``modes.mesh``.

        Returns
        -------
        evolvent.analysis.modal.ModalResults
            ``frequency_hz``, ``damping_ratio``, ``effective_mass``; shapes by part, ``modes["boom"].displacement``;
            ``modes.animate(0, "mode1.html")``.

        Raises
        ------
        InputError
            For parts that have no linear form; the sentence names the part.
        RunFailed
            If there is no equilibrium.
        """
        given: Any = {"damped": damped, "time": time, "rotating": rotating, "centre": centre, "relaxed": relaxed}
        find = vibrations.modes
        found = modal.ModalResults.of(find(self.assemble(), count=count, **given))
        if mesh_error:
            finer = find(mesh.refined(self).assemble(), count=count + mesh.MORE, **given)
            found = dataclasses.replace(found, mesh=mesh.of_modes(found, finer, self.parts))
        return found

    def loop_modes(
        self, *, time: float = 0.0, values: Mapping[str, float] | None = None, count: int = 10
    ) -> Any:  # fmt: skip
        """Find the modes of a spool's loop of feedback, about the steady turn at the start.

        Parameters
        ----------
        time, values, count : as of `evolvent.analysis.loop_modes.loop_modes`

        Returns
        -------
        evolvent.analysis.loop_modes.LoopModes

        Raises
        ------
        InputError
            If no spool reacts, or the start is no steady turn.
        """
        return loops.loop_modes(self.assemble(), time=time, values=values, count=count)

    def linearize(
        self, inputs: Sequence[str], outputs: Sequence[str], *, modes: int | None = None, method: str = "modal",
        damped: bool = True, time: float = 0.0, rotating: str | Sequence[float] | None = None,
        centre: Sequence[float] | None = None, boundary: Sequence[str] = (), static_correction: bool = False,
    ) -> Any:  # fmt: skip
        """Make a linear state-space model about the equilibrium, whole or reduced.

        Parameters
        ----------
        inputs : names such as "hub.torque.z" or "boom.tip.force.y"
        outputs : names such as "hub.rate.z" or "boom.tip.displacement.y"
        modes : int, optional, size of a reduced model
        method : {"modal", "craig-bampton"}
        damped, time, rotating, centre, boundary, static_correction : as of `evolvent.solvers.modal.linear.linearize`

        Returns
        -------
        evolvent.analysis.linear.LinearModel
            ``model.to_control()`` and ``model.to_scipy()`` give it to python-control and SciPy;
            ``model.frequency_response().plot("response.png")``.

        Raises
        ------
        InputError, RunFailed
            As of `modes`.
        """
        found = linearized.linearize(
            self.assemble(), inputs, outputs, modes=modes, method=method, damped=damped, time=time, rotating=rotating,
            centre=centre, boundary=boundary, static_correction=static_correction,
        )  # fmt: skip
        return linear.LinearModel.of(found)
