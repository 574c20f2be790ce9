"""A batch: many copies of one system, stepped beside one another by compiled code, each with its own parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent.analysis import runs
from evolvent.analysis.batch_parameters import BatchParameters
from evolvent.analysis.batch_results import BatchResults
from evolvent.analysis.copied_runs import copies_of, prepared
from evolvent.analysis.methods import choose_method
from evolvent.analysis.settings import check_run, seconds, settings_of
from evolvent.analysis.step_inputs import composed, listed, load_slices
from evolvent.analysis.varied_run import VariedRun
from evolvent.assembly import families
from evolvent.assembly.variants import Variants
from evolvent.parts.checks import positive
from evolvent.results.happened import ordered
from evolvent.solvers.time.copies import GOES_ON, HAS_FAILED, STOPPED_BY_EVENT, Copies
from evolvent.solvers.time.explicit.methods import METHODS as EXPLICIT
from evolvent.solvers.time.implicit.methods import METHODS, NAME
from evolvent_base.cores import cores, free_memory
from evolvent_base.errors import InputError, nearest

if TYPE_CHECKING:
    from evolvent.analysis.composition import Composition

Array = np.ndarray
#: End of the time of a batch where none is given, s, as of a stepper.
END = 1e4
#: Part of the memory that is free which the copies may take.
SHARE = 0.8
#: What `Batch.status` says of a copy.
STATUS = {GOES_ON: "running", STOPPED_BY_EVENT: "stopped by event", HAS_FAILED: "failed"}


class Batch:
    """Many copies of a system, of which each has its own parameters, loads, events and time.

    `evolvent.System.batch` makes one. Every copy is one block of memory. Compiled code steps the copies, on several
    threads; they share nothing that they write to, so that the bits of a copy are those of a single run at any number
    of threads.

    Attributes
    ----------
    count : int, number of copies
    until : float, s, the end of the time that may be stepped through
    method : str
    every : float, s, length of `step`; None where none was given
    workers : int, threads
    inputs : tuple of str, bodies on which forces and torques may be set

    Examples
    --------
    >>> import numpy as np
    >>> from evolvent import System, parts
    >>> system = System()
    >>> hub = system.add(parts.RigidBody(mass=2.0, inertia=1.0, rate=(0.0, 0.0, 0.1)), "hub")
    >>> batch = system.batch(4, until=10.0, step=0.1)  # doctest: +SKIP
    >>> batch.expand("hub.mass", np.linspace(1.0, 2.0, 4))  # doctest: +SKIP
    >>> rate = batch.bind("hub.rate.z")  # doctest: +SKIP
    >>> batch.run(5.0)  # doctest: +SKIP
    """

    def __init__(
        self, system: Composition, count: int, *, until: Any = None, every: Any = None,
        inputs: str | Sequence[str] = (), workers: int | None = None, **given: Any,
    ) -> None:  # fmt: skip
        self.count, self.inputs = _number("n", count), listed(inputs)
        most = min(cores(), self.count) if workers is None else _number("workers", workers)
        settings = settings_of({"until": END} | system.settings, {"until": until, **given})
        settings = {name: value for name, value in settings.items() if name not in ("every", "fine")}
        self.until, self.workers = float(settings.pop("until")), most
        own, variants = composed(system, self.inputs), Variants()
        assembly = own.assemble(variants)
        if families.reacts(assembly.model):
            raise InputError("a batch cannot have parts with feedback; step single systems by evolvent.Stepper")
        self.method = _method(assembly, settings.pop("method", "auto"), holds=bool(self.inputs))
        self.every = settings.get("step") if every is None else seconds("every", every)
        times = np.array([0.0, self.until])
        check_run(assembly, times, settings.get("step"))
        options = {"method": self.method, **settings}
        plan, _ = runs.plan(dataclasses.replace(assembly, shared=None), times, **options)
        run = prepared(plan, of_ends=True)
        self._copies = _copies(run, self.count, self.workers)
        self.assembly = run.assembly
        varied = VariedRun(own, variants, run)
        self._parameters = BatchParameters(varied, self._copies)
        self._results = BatchResults(self._copies, varied, self._parameters)
        self._held = dict[str, Array]()
        self._waiting, self._is_seen = np.ones(self.count, dtype=bool), False

    def __len__(self) -> int:
        return self.count

    def __repr__(self) -> str:
        states, counts = np.unique(self.status, return_counts=True)
        found = ", ".join(f"{k} {name}" for name, k in zip(states.tolist(), counts.tolist(), strict=True))
        return f"<Batch of {self.count} copies by {self.method}: {found}>"

    # ------------------------------------------------------------------------------------------------ parameters

    def expand(self, key: str, values: Any, which: Any = None) -> None:
        """Give every copy its own value of a key; the copies stand at their start again.

        Parameters
        ----------
        key : of a part, as of `evolvent.System.with_values`, such as "hinge 1.stiffness"
        values : (n,) or (n, ...), one for each copy, in SI units or as texts with a unit
        which : (count,) bool, or numbers of copies that the values are of; left out, all

        Raises
        ------
        InputError
            For keys and values that a case would refuse, and keys from which more follows than records of the model,
            such as the number of elements, with the number of the copy.
        """
        chosen = self._chosen(which)
        self._parameters.expand(key, values, chosen)
        self._results.parameters_changed()
        self._place(chosen)

    def reset(self, mask: Any = None) -> None:
        """Put copies back to their start.

        Parameters
        ----------
        mask : (count,) bool, or numbers of copies; left out, all
        """
        self._place(self._chosen(mask))

    def _place(self, which: Array) -> None:
        """Reset copies to the start, with their own values and zero inputs; delayed until copies are accessed."""
        self._waiting[which] = True
        if self._is_seen:
            self._placed()

    def _placed(self, *, seen: bool = False) -> Copies:
        """The copies, after delayed resets; `seen`: views of their memory exist from now on, resets are immediate."""
        self._is_seen |= seen
        which = np.flatnonzero(self._waiting)
        if which.size:
            self._copies.place(which, self._parameters.write)
            for held in self._held.values():
                held[:, which] = 0.0
            self._results.refresh(which)
            self._waiting[which] = False  # after all that can fail or be interrupted
        return self._copies

    def _chosen(self, which: Any) -> Array:
        """Numbers of copies."""
        if which is None:
            return np.arange(self.count)
        given = np.asarray(which)
        if given.dtype == bool and given.shape == (self.count,):
            return np.flatnonzero(given)
        if given.ndim == 1 and (not given.size or np.issubdtype(given.dtype, np.integer)):
            found = np.unique(given.astype(np.int64))
            if not found.size or (found[0] >= 0 and found[-1] < self.count):
                return found
        raise InputError(
            f"copies are chosen by {_short(which)}; give {self.count} truth values, or numbers from 0 to "
            f"{self.count - 1}"
        )

    # ------------------------------------------------------------------------------------------------ inputs

    def wrench(self, body: str) -> tuple[Array, Array]:
        """Force (N) at a body's origin and torque (N m) on each copy, inertial axes, to be written to.

        Returns
        -------
        (count, 3) float each
            In the memory of the copies. What stands there acts from the next step on; `reset` makes it zero.

        Raises
        ------
        InputError
            For a body that is not among the inputs.
        """
        if body not in self.inputs:
            raise InputError(f"{body!r} is not among the inputs; {nearest(str(body), self.inputs)}")
        found = self._input(body)
        if body not in self._held:
            self._held[body] = np.zeros((2, self.count, 3))
        return found

    def _input(self, body: str) -> tuple[Array, Array]:
        """The forces and torques on a body, in the memory of the copies."""
        copies = self._placed(seen=True)
        values = copies.memory.values(copies.blocks, "model", "parameters")
        force, torque = load_slices(self.assembly, body)
        return values[:, force], values[:, torque]

    def _jumped(self, which: Array) -> Array:
        """Which of the copies have other inputs than in the step before, (k,) bool."""
        found = np.zeros(which.size, dtype=bool)
        for body, held in self._held.items():
            for now, before in zip(self._input(body), held, strict=True):
                found |= np.any(now[which] != before[which], axis=1)
                before[which] = now[which]
        return found

    # ------------------------------------------------------------------------------------------------ time

    def step(self, n: int = 1, *, progress: Callable[[int, int], None] | None = None) -> None:
        """Go on by n times `every` in every copy that has not failed or stopped.

        Parameters
        ----------
        n : int
        progress : called with the number of copies that are done, and of all that move

        Raises
        ------
        InputError
            Without `every` or a fixed `step`, and beyond the end of the batch's time.
        """
        if self.every is None:
            raise InputError("every is missing; give the batch the length of a step, such as every=0.1, or use run")
        length = _number("n", n) * self.every
        self._go_to(self.time + length, progress)

    def run(self, until: Any = None, *, progress: Callable[[int, int], None] | None = None) -> None:
        """Go on to a time in every copy that has not failed or stopped, and has not reached it.

        Parameters
        ----------
        until : float, s; left out, the end of the batch's time
        progress : as of `step`
        """
        end = self.until if until is None else positive("until", until)
        self._go_to(np.full(self.count, end), progress)

    def _go_to(self, ends: Array, progress: Callable[[int, int], None] | None) -> None:
        copies = self._placed()
        moving = np.flatnonzero(copies.status == GOES_ON)
        late = moving[ends[moving] > self.until * (1.0 + 1e-12)]
        if late.size:
            raise InputError(
                f"copy {late[0]} would go on to {ends[late[0]]:g} s, beyond the batch's end at {self.until:g} s"
            )
        copies.go_to(moving, ends[moving], self._jumped(moving), progress)
        self._results.refresh(moving)

    @property
    def time(self) -> Array:
        """(count,) float, s, times that the copies have reached."""
        return self._placed().time.copy()

    @property
    def status(self) -> Array:
        """(count,) str, "running", "stopped by event" or "failed"."""
        return np.array([STATUS[k] for k in self._placed().status.tolist()])

    @property
    def reasons(self) -> Mapping[int, str]:
        """Why copies have failed, by their number."""
        return dict(self._placed().reasons)

    # ------------------------------------------------------------------------------------------------ results

    def bind(self, name: str) -> Array:
        """A result of every copy in one array, which `step`, `run` and `reset` write again.

        Parameters
        ----------
        name : str, such as "hub.rate.z", "boom.tip.position", "hinge 1.angle", as of `evolvent.Stepper.result`

        Returns
        -------
        (count, ...) float
            The same array for a name, whenever it is asked for.

        Raises
        ------
        InputError
            As of `evolvent.Stepper.result`.
        """
        self._placed(seen=True)
        return self._results.bind(name)

    @property
    def states(self) -> Array:
        """(count, ny) float, state vectors [q | v | accounts] now, in the memory of the copies; to be read."""
        copies = self._placed(seen=True)
        found = copies.memory.values(copies.blocks, "work", "y")
        found.flags.writeable = False
        return found

    def events(self, copy: int) -> list[tuple[float, str, str]]:
        """Events of a copy in order of time: time (s), name of the part, and what happened, such as "latched"."""
        (k,) = self._chosen([copy])
        times, kinds = self._placed().events(int(k))
        names = {place: name for name, place in reversed(self.assembly.names.items())}
        return [(time, names.get(place, ""), what) for time, place, what in ordered(self.assembly.model, times, kinds)]

    def close(self) -> None:
        """End the threads; `step` and `run` start others."""
        self._copies.close()


def _method(assembly: Any, asked: str, *, holds: bool) -> str:
    """The method of a batch; it `holds` inputs over steps.

    Raises
    ------
    InputError
        For inputs under a method whose forces are means of steps.
    """
    method, _ = choose_method(assembly, asked)
    if not (holds and method in METHODS and METHODS[method].flags["midpoint"]):
        return method
    if asked != "auto":
        known = [*EXPLICIT, *(name for name, of in METHODS.items() if not of.flags["midpoint"])]
        raise InputError(f"method is {asked!r}; a batch with inputs takes those: {', '.join(known)}")
    return NAME


def _copies(run: Any, count: int, workers: int) -> Copies:
    """Copies of a run.

    Raises
    ------
    InputError
        Where they need more memory than is free.
    """
    try:
        found = copies_of(run, count, workers)
    except MemoryError:
        raise InputError(f"n is {count}; so many copies need more memory than there is; use fewer") from None
    needed, free = found.blocks.nbytes, free_memory()
    if needed > SHARE * free:
        raise InputError(
            f"n is {count}; so many copies need {needed / 1e9:.3g} GB of memory, {free / 1e9:.3g} GB are free; "
            f"use at most {int(SHARE * free / found.memory.size)}"
        )
    return found


def _number(name: str, value: Any) -> int:
    """A whole number from 1."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError(f"{name} is {value!r}; it must be a whole number from 1")
    return int(value)


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
