"""What an FMU is while it runs: variables in front of an `evolvent.Stepper`."""

from __future__ import annotations

import functools
import json
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from evolvent import __version__
from evolvent.errors import EvolventError
from evolvent.fmu.write import CASE, MODEL
from evolvent.stepping import Stepper

#: Units of the variables, as powers of SI's base units.
UNITS = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "s": {"s": 1},
}
INPUTS = {"force": "N", "torque": "N.m"}
OUTPUTS: dict[str, tuple[int, str | None, str]] = {
    "position": (3, "m", "of the origin"),
    "velocity": (3, "m/s", "of the origin"),
    "quaternion": (4, None, "body to inertial, scalar first"),
    "rate": (3, "rad/s", "angular velocity"),
    "structure_force": (3, "N", "of the structure on the body"),
    "structure_torque": (3, "N.m", "of the structure on the body, about its origin"),
}


class Instance:
    """One instance of an FMU; to be mixed with the library's own class.

    Notes
    -----
    The case is built, and its solver compiled or loaded, as the initialisation begins.
    """

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self._folder = pathlib.Path(given["resources"])
        self._model = json.loads((self._folder / MODEL).read_text(encoding="utf-8"))
        self._stepper: Stepper | None = None
        self._begin = 0.0
        self._wrench = {body: np.zeros((2, 3)) for body in self._model["inputs"]}
        me: Any = self
        me.modelName, me.description, me.version = (self._model[key] for key in ("name", "description", "version"))
        self._register()

    # -------------------------------------------------------------------------------------------- variables

    def _register(self) -> None:
        from pythonfmu3 import DefaultExperiment, Dimension, Float64, Fmi3Causality, Fmi3Variability
        from pythonfmu3.unit import Unit

        me: Any = self
        me.default_experiment = DefaultExperiment(
            start_time=0.0, stop_time=self._model["until"], step_size=self._model["every"]
        )
        me.register_units([Unit(name, **powers) for name, powers in UNITS.items()])
        changing = {"variability": Fmi3Variability.continuous}
        clock = Float64(
            "time", unit="s", causality=Fmi3Causality.independent, getter=lambda: self._begin + self._now, **changing
        )
        me.register_variable(clock, nested=False)
        for body in self._model["bodies"]:
            for k, (kind, unit) in enumerate(INPUTS.items() if body in self._wrench else ()):
                place = self._wrench[body][k]
                variable = Float64(
                    f"{body}.{kind}",
                    unit=unit,
                    causality=Fmi3Causality.input,
                    dimensions=[Dimension(start="3")],
                    getter=place.tolist,
                    setter=functools.partial(place.__setitem__, slice(None)),
                    description=f"{kind} on {body}, inertial axes, held over a step",
                    **changing,
                )
                me.register_variable(variable, nested=False)
            for kind, (size, measure, what) in OUTPUTS.items():
                variable = Float64(
                    f"{body}.{kind}",
                    unit=measure,
                    causality=Fmi3Causality.output,
                    dimensions=[Dimension(start=str(size))],
                    getter=self._reader(body, kind),
                    description=f"{what}, inertial axes" if size == 3 else what,
                    **changing,
                )
                me.register_variable(variable, nested=False)

    def _reader(self, body: str, kind: str) -> Callable[[], list[float]]:
        """What reads an output."""

        def read() -> list[float]:
            stepper = self._begun()
            if kind.startswith("structure"):
                return list(map(float, stepper.wrench(body)[kind.endswith("torque")]))
            return list(map(float, getattr(stepper.body(body), kind)))

        return read

    # -------------------------------------------------------------------------------------------- time

    @property
    def _now(self) -> float:
        """Time since the start, s."""
        return 0.0 if self._stepper is None else self._stepper.time

    def _begun(self) -> Stepper:
        """The stepper, from its start on."""
        if self._stepper is None:
            model = self._model
            start = {model["start_key"]: str(self._folder / model["start"])} if "start" in model else {}
            self._stepper = Stepper.of_case(self._folder / CASE, start, inputs=model["inputs"], until=model["until"])
        return self._stepper

    def setup_experiment(self, start_time: float) -> None:
        """Take the time at which the case begins, s."""
        self._begin = start_time

    def enter_initialization_mode(self) -> None:
        """Build the case."""
        from pythonfmu3 import Fmi3Status

        if self._model["version"] != __version__:
            self._tell(f"made by evolvent {self._model['version']}, run by {__version__}", Fmi3Status.warning)
        self._begun()

    def do_step(self, current_time: float, step_size: float) -> Any:
        """Go on by `step_size` s with the inputs as they are."""
        from pythonfmu3 import Fmi3Status
        from pythonfmu3.fmi3slave import Fmi3StepResult

        stepper = self._begun()
        try:
            for body, (force, torque) in self._wrench.items():
                stepper.set_wrench(body, force.tolist(), torque.tolist())
            stepper.step(min(step_size, self._rest(step_size)))
        except EvolventError as error:
            self._tell(str(error), Fmi3Status.error)
            return Fmi3StepResult(status=Fmi3Status.error)
        return Fmi3StepResult(status=Fmi3Status.ok)

    def _rest(self, step: float) -> float:
        """Time up to the end where a step ends there but for round-off, else that of the step, s."""
        stepper = self._begun()
        rest = stepper.until - stepper.time
        return rest if 0.0 < step - rest <= 1e-9 * stepper.until else step

    def _tell(self, message: str, status: Any) -> None:
        me: Any = self
        me.log(message, status)
