"""Linear models of a system, to be reduced, and drawn by their frequency response."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
import scipy

from evolvent.elements.reduced_files import write_model
from evolvent.elements.reduced_models import ReducedModel, check_model
from evolvent.solvers.modal.linear import FrequencyResponse, StateSpace
from evolvent.solvers.modal.reduction import CRAIG_BAMPTON, FULL, MODAL
from evolvent_base.answer import Answer, Section
from evolvent_base.errors import InputError, counted
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.showing import Shown


class Response(Shown, FrequencyResponse):
    """`evolvent.solvers.modal.linear.FrequencyResponse` with its figure."""

    named = "frequency responses"

    def answer(self) -> Answer:
        """Magnitude and phase over the frequency; without a figure where a frequency is 0, or nothing to draw."""
        drawn = [self.figure()] if self._is_drawn else []
        facts = [("inputs", ", ".join(self.inputs)), ("outputs", ", ".join(self.outputs))]
        title = "Frequency response"
        return Answer(title=title, facts=facts, sections=[Section(title=title, blocks=drawn)])

    @property
    def _is_drawn(self) -> bool:
        return bool(self.inputs and self.outputs and np.all(self.omega > 0.0))

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """As of `Shown`."""
        if not self._is_drawn:
            raise InputError("a frequency response is drawn of inputs to outputs at frequencies above 0")
        return super().plot(path)

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


@dataclasses.dataclass(frozen=True, repr=False)
class LinearModel(StateSpace):
    """`evolvent.solvers.modal.linear.StateSpace` with what shows it."""

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

    def reduced_body(self, nodes: Mapping[str, str], path: str | None = None) -> ReducedModel:
        """The model as a `ReducedBody` takes it: stiffness and mass by its interface nodes and modes with these held.

        Parameters
        ----------
        nodes : dict, name of an interface node -> point of the structure, {"root": "boom.root"}; they must be in the
            `boundary` of a Craig-Bampton model. An edge of a surface, {"root": "panel.x0"}, gives the interface nodes
            "root 0", "root 1" and so on
        path : str, optional, file to write, which ends with .npz or .json

        Returns
        -------
        ReducedModel
            Its axes are the inertial ones; damping is left out.

        Raises
        ------
        InputError
            If the model is modal, something holds the structure, or a node has no rotation.

        Notes
        -----
        With modal coordinates eta, stiffness S = diag(square) and u_b = B V eta of the nodes, eta = Psi u_b + N xi: N
        spans B V N = 0, and N^T S Psi = 0 makes Psi static, so that rigid motions are those of the nodes alone.
        """
        if self.method not in (CRAIG_BAMPTON, FULL):
            raise InputError(f"method is {self.method!r}; a reduced body is made of a Craig-Bampton or a full model")
        if self.rigid != 6:
            raise InputError(
                f"the structure has {counted(self.rigid, 'rigid-body mode')}, but a reduced body needs 6: nothing may "
                f"hold it, and all of its parts must be joined"
            )
        named = {
            name if len(found) == 1 else f"{name} {k}": one
            for name, place in nodes.items()
            for found in (self._source.places(place),)
            for k, one in enumerate(found)
        }
        places = [*named.values()]
        for place in places:
            if self.method == CRAIG_BAMPTON and place not in self.boundary:
                raise InputError(f"nodes holds {place!r}, which is not in the boundary of the model; name it there")
        rows = self._source.boundary_rows(places)
        if not places or len(rows) != 6 * len(places):
            raise InputError("nodes must name points with three displacements and three rotations each, at least one")
        S = rows @ self.basis
        N = scipy.linalg.null_space(S / np.linalg.norm(S, axis=1)[:, None])
        inverse = np.linalg.pinv(S)
        stiff = self.square[:, None] * inverse
        own = N.T @ (self.square[:, None] * N)
        Psi = inverse - N @ np.linalg.solve(own, N.T @ stiff) if N.size else inverse
        T = np.hstack([Psi, N])
        K, M = T.T @ (self.square[:, None] * T), T.T @ T
        positions = np.array([self._source.points[place].position for place in places])
        found = ReducedModel(
            0.5 * (K + K.T), 0.5 * (M + M.T), positions, tuple(named), np.zeros((0, len(K))),
            warning=self.warning,
        )  # fmt: skip
        check_model(found, "the reduced model")
        if path is not None:
            write_model(path, found)
        return found
