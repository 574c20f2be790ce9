"""A system that another simulator drives, time after time, through forces on its bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from evolvent import cases
from evolvent.analysis.step_inputs import listed, of_case, with_inputs
from evolvent.analysis.stepping import IMPLICIT, SteppedAssembly
from evolvent.analysis.system import System
from evolvent.parts.checks import number, positive
from evolvent.solvers.common.start import STEP_ALLOWED
from evolvent.solvers.time.explicit.plan import METHODS
from evolvent.solvers.time.implicit import plan as implicit
from evolvent_base.errors import InputError, naming_keys, nearest


class Stepper(SteppedAssembly):
    """A system that is stepped from outside, for co-simulation.

    Parameters
    ----------
    system : System, which is left as it is
    inputs : names of bodies on which forces and torques will be set; of one body its name alone will do
    method : an explicit method, or an implicit one but energy-momentum, by name
    start : float, s
    until : float, s, the end of the time that may be stepped through
    step : float, s, of a fixed-step method; None: by tolerance, or from the highest frequency
    tolerance : float, of adaptive methods
    spectral_radius : float, of implicit methods

    Raises
    ------
    InputError
        For an unknown body or method, an input on a body that no force moves, or a system that the method cannot carry.

    Notes
    -----
    A wrench is held over the steps until it is set again. The explicit methods restart at every step.

    Examples
    --------
    >>> from evolvent import Stepper, System, parts
    >>> system = System()
    >>> hub = system.add(parts.RigidBody(mass=2.0, inertia=1.0), "hub")
    >>> stepper = Stepper(system, inputs=[hub], until=10.0, step=0.1)  # doctest: +SKIP
    >>> stepper.set_wrench(hub, torque=(0.0, 0.0, 0.1))  # doctest: +SKIP
    >>> stepper.step(0.5)  # doctest: +SKIP
    """

    def __init__(
        self,
        system: System,
        *,
        inputs: str | Sequence[str] = (),
        method: str = implicit.NAME,
        start: float = 0.0,
        until: float = 1e4,
        step: float | None = None,
        tolerance: float = 1e-4,
        spectral_radius: float = 0.9,
    ) -> None:
        known = [*IMPLICIT, *METHODS]
        if method not in known:
            raise InputError(f"method is {method!r}; {nearest(str(method), known)}")
        if not isinstance(system, System):
            raise InputError(f"system is a {type(system).__name__}; it must be a System (Stepper.of_case takes a case)")
        start, until = _time("start", start), _time("until", until)
        if not until > start:
            raise InputError(f"until is {until!r} s; it must be after the start, {start!r} s")
        step = None if step is None else positive("step", step, allowed=STEP_ALLOWED)
        tolerance = positive("tolerance", tolerance)
        named = listed(inputs)
        super().__init__(
            with_inputs(system, named), method=method, start=start, until=until, inputs=named, step=step,
            tolerance=tolerance, spectral_radius=spectral_radius,
        )  # fmt: skip

    @classmethod
    def of_case(
        cls,
        case: Any,
        overrides: Mapping[str, Any] | None = None,
        *,
        inputs: str | Sequence[str] = (),
        start: float = 0.0,
        until: float | None = None,
    ) -> Stepper:
        """A case, stepped by the method of its section ``solver``.

        Parameters
        ----------
        case, overrides : as of `evolvent.run`
        inputs : names of bodies on which forces and torques will be set
        start : float, s
        until : float, s, the end of the time that may be stepped through; None: that of the case's run

        Returns
        -------
        Stepper

        Raises
        ------
        InputError
            If the case cannot be used, or its system cannot be stepped from outside.
        """
        loaded = cases.load(case, overrides)
        system, options, end = of_case(loaded, until)
        keys = cases.solver_keys(loaded)
        with naming_keys(keys):
            stepper = cls(system, inputs=inputs, start=start, until=end, **options)
        stepper._keys = keys
        return stepper


def _time(name: str, value: Any) -> float:
    """`value` as a finite time, s."""
    return number(name, value, allowed="a finite time in seconds")
