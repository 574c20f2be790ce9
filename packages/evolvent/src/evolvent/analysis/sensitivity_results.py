"""Sensitivities of a run with what shows them: a table, a figure, files."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from evolvent.results import made_with, netcdf
from evolvent_base import answer as an
from evolvent_base.figures import Figure, Line, Panel
from evolvent_base.showing import Shown

if TYPE_CHECKING:
    import xarray as xr

#: Values and keys in the figure, at most; and the height of the bar of a key, of its row.
_MOST_VALUES, _MOST_KEYS, _BAR = 4, 20, 0.6


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Sensitivities(Shown):
    """Derivatives of values of a run by keys.

    Attributes
    ----------
    dataset : xarray.Dataset
        ``derivative`` (value, key), in units ``unit``; ``relative``, the relative change of the value by that of the
        key; ``result`` (value) and ``at`` (key); ``derivative_error`` and ``result_error``, of integration, where they
        are checked. Attributes: ``method``, ``mode``, ``change`` of the keys, ``steps``, ``integration``, on what the
        errors rest, and ``warning``.
    """

    dataset: xr.Dataset
    named, endings = "sensitivities", (".csv", ".nc")

    def __repr__(self) -> str:
        """How many derivatives, and the method."""
        size = self.dataset.sizes
        return f"<Sensitivities: {size['value']} values by {size['key']} keys, {self.dataset.attrs['method']}>"

    def answer(self) -> an.Answer:
        """A row for every value and key, what the errors rest on, a figure and files."""
        rows, attrs = self.rows(), self.dataset.attrs
        title = f"Sensitivities, by {attrs['method']}"
        return an.Answer(
            title=title, sections=[an.Section(title=title, blocks=[an.Table.of(rows, words=2), *self.figures()])],
            notes=[attrs["integration"]] if "integration" in attrs else [],
            warnings=[attrs["warning"]] if "warning" in attrs else [], made=made_with(),
            files={"sensitivities.csv": lambda: an.as_csv(rows), "sensitivities.nc": self._netcdf},
        )  # fmt: skip

    def rows(self) -> list[list[str]]:
        """A table: its head, then a row for every value and key."""
        found = self.dataset
        table = [["value", "key", "derivative", "unit", "relative", "error"]]
        for i, value in enumerate(found["value"].values):
            for j, key in enumerate(found["key"].values):
                derivative, relative = float(found.derivative[i, j]), float(found.relative[i, j])
                error = f"{float(found.derivative_error[i, j]):.2g}" if "derivative_error" in found else "-"
                unit = str(found.unit.values[i, j])
                table.append([str(value), str(key), f"{derivative:.7g}", unit, f"{relative:.5g}", error])
        return table

    def figures(self) -> list[Figure]:
        """Relative changes of the first values by those of the keys, as bars, the strongest on top; none of zeros."""
        found, panels, count = self.dataset, list[Panel](), 0
        for i, value in enumerate(found["value"].values):
            relative = np.where(np.isfinite(found.relative.values[i]), found.relative.values[i], 0.0)
            ranked = np.argsort(-np.abs(relative), kind="stable")[:_MOST_KEYS]
            if len(panels) == _MOST_VALUES or not relative.any():
                continue
            rows, lines = np.arange(ranked.size, dtype=float)[::-1], list[Line]()
            for x, y in zip(relative[ranked], rows, strict=True):
                sides = y + 0.5 * _BAR * np.array([1.0, 1.0, -1.0, -1.0, 1.0])
                lines.append(Line(x=np.array([0.0, x, x, 0.0, 0.0]), y=sides, color=1, width=0.8, fill="#9ecae1"))
            keys = [str(found["key"].values[j]).removeprefix("parts.") for j in ranked]
            panels.append(Panel(x_label="relative change by that of the key", y_label="", lines=lines,
                                title=str(value), y_names=dict(zip(rows.tolist(), keys, strict=True))))  # fmt: skip
            count = max(count, ranked.size)
        title, height = "Sensitivities of a run", len(panels) * (30.0 + 9.0 * count)
        return [Figure(name="sensitivities", title=title, panels=panels, height=height)] if panels else []

    def _netcdf(self) -> memoryview:
        """The data set as NetCDF; names and units, which hold blanks, are variables."""
        found = self.dataset
        return netcdf.image(found.reset_coords([name for name in found.coords if name not in found.dims]))
