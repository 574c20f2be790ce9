"""Linear models of a system, to be reduced, and drawn by their frequency response."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from evolvent.base.errors import InputError
from evolvent.results.figures import Figure, Line, Panel, stacked
from evolvent.solvers.linear import FrequencyResponse, StateSpace
from evolvent.solvers.reduction import MODAL


class Response(FrequencyResponse):
    """`evolvent.solvers.linear.FrequencyResponse` with its figure."""

    __slots__ = ()

    def figure(self) -> Figure:
        """Magnitude and phase over the frequency, a line for each output and input; a panel for each unit."""
        hz = self.frequency_hz
        panels: dict[str, list[Line]] = {}
        phases: list[Line] = []
        for i, output in enumerate(self.outputs):
            for j, given in enumerate(self.inputs):
                label, color = f"{output} / {given}", len(phases)
                magnitude = self.magnitude[:, i, j]
                shown = np.where(np.isfinite(magnitude) & (magnitude > 0.0), magnitude, np.nan)
                panels.setdefault(self.units[i][j], []).append(Line(x=hz, y=shown, label=label, color=color))
                phases.append(Line(x=hz, y=self.phase_deg[:, i, j], color=color))
        drawn = [
            Panel(x_label="", y_label=f"magnitude, {unit}", lines=lines, log=True, log_x=True)
            for unit, lines in panels.items()
        ]
        drawn.append(Panel(x_label="frequency, Hz", y_label="phase, deg", lines=phases, log_x=True))
        height = stacked(len(drawn))
        return Figure(name="frequency-response", title="Frequency response", panels=drawn, height=height)

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Draw magnitude and phase over the frequency.

        Parameters
        ----------
        path : str, optional, file that ends with .png, .svg or .pdf

        Returns
        -------
        matplotlib.figure.Figure, or the path that was written

        Raises
        ------
        InputError
            If there is nothing to draw, or the file cannot be written.
        """
        from evolvent.view import plots

        if not self.inputs or not self.outputs or np.any(self.omega <= 0.0):
            raise InputError("a frequency response is drawn of inputs to outputs at frequencies above 0")
        return plots.sheet(self.figure()) if path is None else plots.save(self.figure(), path)


@dataclasses.dataclass(frozen=True, repr=False)
class LinearModel(StateSpace):
    """`evolvent.solvers.linear.StateSpace` with what shows it."""

    @classmethod
    def of(cls, found: StateSpace) -> Self:
        """The same model."""
        return cls(**{field.name: getattr(found, field.name) for field in dataclasses.fields(found)})

    def __repr__(self) -> str:
        """What the model consists of."""
        return f"<LinearModel: {self.summary}>"

    def frequency_response(self, omega: Any = None) -> Response:
        """As of `StateSpace`, with a method `plot`."""
        return Response(*super().frequency_response(omega))

    def reduce(
        self, n: int, method: str = MODAL, *, boundary: Sequence[str] = (), static_correction: bool = False
    ) -> LinearModel:
        """As of `StateSpace`."""
        return LinearModel.of(super().reduce(n, method, boundary=boundary, static_correction=static_correction))
