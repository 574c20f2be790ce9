"""Modes of a system, to be read, drawn and saved."""

from __future__ import annotations

import dataclasses
import os
from typing import TYPE_CHECKING, Self

import numpy as np

from evolvent import results
from evolvent.analysis.mesh_error import MeshError
from evolvent.results import netcdf
from evolvent.results.tree import tree_of
from evolvent.solvers.common.sampled import empty
from evolvent.solvers.common.solution import Solution
from evolvent.solvers.modal.modal import NOTHING, VibrationModes
from evolvent.view import animation
from evolvent.view.drawing import motion_of
from evolvent_base import __version__, answer as an
from evolvent_base.showing import Shown

#: Round-off of places beside the size of a structure, from which moments of inertia follow.
OF_PLACES = 1e-9

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.results.motion import Motion


@dataclasses.dataclass(frozen=True)
class ModalResults(Shown, VibrationModes):
    """`evolvent.solvers.modal.modal.VibrationModes` with what shows them.

    Attributes
    ----------
    mesh : MeshError of the frequencies (`frequency_hz`), where it is asked for
    """

    mesh: MeshError | None = None

    @classmethod
    def of(cls, found: VibrationModes) -> Self:
        """The same modes."""
        return cls(**{field.name: getattr(found, field.name) for field in dataclasses.fields(found)})

    named = "modes"
    endings = (".nc",)

    def answer(self) -> an.Answer:
        """Frequencies, damping ratios and effective masses, what the equilibrium is beyond, and a file."""
        parts = {"Modes": [self._modes()], "Effective masses": self._sums()}
        return an.Answer(
            title=f"{len(self.pole)} modes", warnings=self.warnings,
            sections=[an.Section(title=title, blocks=blocks) for title, blocks in parts.items() if blocks],
            notes=[
                *([f"no table of masses: {self.without_masses}"] if self.without_masses else []),
                *([self.note] if self.note else []),
            ],
            files={"modes.nc": self._netcdf}, made=results.made_with(),
        )  # fmt: skip

    def _modes(self) -> an.Table:
        """A row a mode; effective masses of real modes alone."""
        heads = ["mode", "frequency, Hz", "frequency, rad/s", "damping ratio"]
        masses = None if np.iscomplexobj(self.shape) else self.effective_mass
        if masses is not None:
            heads += [f"mass {a}, kg" for a in "xyz"] + [f"inertia {a}, kg m²" for a in "xyz"]
        if self.mesh is not None:
            heads += ["extrapolated, Hz", "mesh error, %"]
        rows = []
        for k in range(len(self.pole)):
            row = [str(k), f"{self.frequency_hz[k]:.6g}", f"{self.frequency[k]:.6g}", f"{self.damping_ratio[k]:.4g}"]
            if masses is not None:
                row += self._masses(masses[k])
            if self.mesh is not None:
                row += [f"{self.mesh.extrapolated[k]:.6g}", f"{100.0 * self.mesh.relative[k]:.2g}"]
            rows.append(row)
        return an.Table(heads=heads, rows=rows)

    def _sums(self) -> list[an.Table]:
        """The effective masses of all modes, beside what there is; none of complex modes."""
        if np.iscomplexobj(self.shape):
            return []
        of = {
            "sum": self.effective_mass.sum(axis=0), "all modes": self.movable_mass,
            "held by supports": self.held_mass, "whole structure": self.total_mass,
        }  # fmt: skip
        heads = ["", *(f"mass {a}, kg" for a in "xyz"), *(f"inertia {a}, kg m²" for a in "xyz")]
        return [an.Table(heads=heads, rows=[[word, *self._masses(values)] for word, values in of.items()])]

    def _masses(self, values: np.ndarray) -> list[str]:
        """Effective masses and inertias, (6,), as texts; what is round-off as 0."""
        total = self.total_mass
        least = np.maximum(NOTHING * total, OF_PLACES**2 * np.repeat([total[:3].max(), total[3:].max()], 3))
        return [f"{value if value > floor else 0.0:.4g}" for value, floor in zip(values, least, strict=True)]

    def to_dataset(self) -> xr.Dataset:
        """As of `VibrationModes`, with extrapolated frequencies and the error of the mesh, where it is asked for."""
        found = super().to_dataset()
        if self.mesh is not None:
            what = "frequency, extrapolated from n and 2 n elements"
            found["frequency_extrapolated"] = ("mode", self.mesh.extrapolated, {"units": "Hz", "long_name": what})
            what = "relative error of the frequency by the mesh"
            found["mesh_error"] = ("mode", self.mesh.relative, {"units": "1", "long_name": what})
        return found

    def motion(self, k: int, *, amplitude: float | None = None, frames: int = 60) -> Motion:
        """The motion of one mode over one period.

        Parameters
        ----------
        k, amplitude, frames : as of `states`
        """
        t, y = self.states(k, amplitude, frames)
        s = np.repeat(self.equilibrium.s[-1:], t.size, axis=0)
        kept = empty(self.assembly.model, t.size)
        solution = Solution(
            assembly=self.assembly, method="modes", t=t, y=y, s=s, status="success", message="", statistics={},
            event_times=np.zeros(0), event_kinds=np.zeros(0, dtype=np.int64), wall_time=0.0, compile_time=0.0,
            kept=kept,
        )  # fmt: skip
        tree = tree_of(solution, lambda: {"status": "success", "message": ""}, balances=False)
        title = f"Mode {k}: {self.frequency_hz[k]:.4g} Hz"
        if self.damping_ratio[k] != 0.0:
            title += f", damping ratio {self.damping_ratio[k]:.3g}"
        found = motion_of(tree, title=title)
        assert found is not None
        return dataclasses.replace(found, forces=[], numbers={}, repeats=True)

    def animate(self, k: int, path: str | os.PathLike[str], *, amplitude: float | None = None, frames: int = 60) -> str:
        """Write the animation of one mode as an HTML page; returns its path.

        Parameters
        ----------
        k : int, number of the mode, from 0
        path : str
        amplitude : float, m, largest displacement; a tenth of the structure's size if left out
        frames : int, of one period

        Raises
        ------
        InputError
            If there is no such mode, or the file cannot be written.
        """
        return animation.write(self.motion(k, amplitude=amplitude, frames=frames), path)

    def _netcdf(self) -> memoryview:
        """Frequencies, damping, effective masses and shapes as NetCDF."""
        found = self.to_dataset()
        found.attrs |= {
            "title": "modes by evolvent",
            "source": f"evolvent {__version__}",
            "holds": results.MODES,
            "made_with": results.made_with(),
        }
        return netcdf.image(found)
