"""Blades paid out by a drive that reacts: what it measures and commands, and the modes of its loop."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, NoReturn

import lazy_loader as lazy
import numpy as np

from evolvent import cases, results
from evolvent.analysis.loop_modes import loop_modes
from evolvent.analysis.stepper import Stepper
from evolvent.results import netcdf
from evolvent_base.answer import Answer, Section, Table
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.showing import Shown
from evolvent_papers.heliogyro import straight
from evolvent_papers.heliogyro.case import Case
from evolvent_papers.heliogyro.structure import build

if TYPE_CHECKING:
    from evolvent.analysis.loop_modes import LoopModes

if TYPE_CHECKING:
    import xarray as xr
else:
    xr = lazy.load("xarray")

#: Parts of the blade that are out where modes of the loop are found; each in the middle of a segment.
PARTS = (0.6, 0.7, 0.8, 0.9, 1.0)


@dataclasses.dataclass(frozen=True)
class LoopTable(Shown):
    """Modes of the loop at several lengths.

    Attributes
    ----------
    length : (k,) float, m, that are out; time : (k,) float, s, at which the run reaches it
    modes : of each
    """

    length: np.ndarray
    time: np.ndarray
    modes: tuple[LoopModes, ...]

    @property
    def pole(self) -> np.ndarray:
        """Poles at all lengths, 1/s."""
        return np.concatenate([one.pole for one in self.modes])

    named = "modes"
    endings = (".nc",)

    def answer(self) -> Answer:
        """A row a mode at every length, and a file."""
        rows = []
        for length, time, of in zip(self.length, self.time, self.modes, strict=True):
            for k, pole in enumerate(of.pole):
                own = [f"{length:.5g}", f"{time:.5g}"] if k == 0 else ["", ""]
                numbers = (f"{of.frequency[k]:.4g}", f"{of.damping_ratio[k]:.3g}", f"{pole.real:.3g}")
                rows.append([*own, str(k), *numbers])
        heads = ("out, m", "time, s", "mode", "frequency, rad/s", "damping ratio", "growth, 1/s")
        return Answer(
            title="Modes of the closed loop", sections=[Section(title="", blocks=[Table(heads=heads, rows=rows)])],
            files={"modes.nc": self._netcdf}, made=results.made_with(),
        )  # fmt: skip

    def _netcdf(self) -> memoryview:
        """Lengths, times and poles as NetCDF."""
        poles = np.full((self.length.size, max(of.pole.size for of in self.modes)), np.nan, dtype=complex)
        for row, of in zip(poles, self.modes, strict=True):
            row[: of.pole.size] = of.pole
        own = ("length", "mode")
        found = xr.Dataset(
            {
                "time": ("length", self.time, {"units": "s", "long_name": "when so much is out"}),
                "pole_real": (own, poles.real, {"units": "s-1", "long_name": "growth of the mode"}),
                "pole_imaginary": (own, poles.imag, {"units": "s-1", "long_name": "angular frequency of the mode"}),
            },
            coords={"length": ("length", self.length, {"units": "m", "long_name": "length that is out"})},
            attrs={"title": "modes of a closed loop by evolvent", "made_with": results.made_with()},
        )
        return netcdf.image(found)

    def motion(self, k: int, **_: Any) -> NoReturn:
        """Refused: modes of a map have no shapes that are drawn."""
        raise InputError("modes of a closed loop are not drawn; evolvent modes CASE prints them")

    animate = motion


def modes(case: Case, count: int | None) -> LoopTable:
    """Modes of the loop where parts of the blade are out, with the law as it is when the run comes there.

    Raises
    ------
    InputError
        If a blade of the case is not out so far in its run.
    """
    given, blade = case.spool.feedback, case.blade
    assert given is not None
    quiet = cases.load(case.model_dump(mode="json"), {"spool.feedback.sensor.noise": {}})
    stepper = Stepper.of_case(quiet)
    segment = blade.length / blade.nodes
    wanted = [segment * (max(round(part * blade.nodes), 1) - 0.5) for part in PARTS]
    wanted = [length for length in wanted if length > case.spool.start_length]
    loop, found = stepper.loops[0], []
    names = [name for name in loop.drive.names if name != "t"]
    for stop in stepper.stops(stepper.until):
        stepper.go_to(stop)
        if not wanted:
            break
        command = loop.commands[-1]
        out = command.angle * (case.spool.radius - case.spool.film_thickness / (4.0 * np.pi) * command.angle)
        if out < wanted[0]:
            continue
        length = wanted.pop(0)
        momentum = straight.start_momentum(case)
        inertia = float(straight.straight_inertia(case, np.full((1, case.body.blades), length), corrected=True)[0])
        frozen = cases.load(
            quiet.model_dump(mode="json"),
            {
                "spool.start_length": length, "spool.start_lag": 0.0, "spool.feedback.rate": 0.0,
                "body.rate": momentum / inertia if case.body.motion != "driven" else case.body.rate,
            },
        )  # fmt: skip
        values = dict(zip(names, [command.angle, command.rate, *loop.filtered[-1]], strict=True))
        most = 6 if count is None else count
        of = loop_modes(build(frozen).assemble(), values=values, time=command.time, count=most)
        found.append((length, command.time, of))
    if not found:
        raise InputError(
            f"no more than spool.start_length, {case.spool.start_length:g} m, are out by the end of the run; modes of "
            f"the loop are those at lengths that it pays out"
        )
    lengths, times, modes_at = zip(*found, strict=True)
    return LoopTable(np.array(lengths), np.array(times), tuple(modes_at))


def feedback_figure(run: Any) -> Figure:
    """Lags, measured and true, with the rate of the spool and the length that is out, over time."""
    run = results.regular(run)
    time, blade, reel = run.time.values, run.children["blade-1"], run.children["reel-1"]
    lines = []
    if "measured_lag" in reel:
        measured = np.degrees(reel.measured_lag.values)
        lines.append(Line(x=time, y=measured, label="measured", color=3, style=" ", marker="."))
    lines.append(Line(x=time, y=np.degrees(blade.tip_lag.values), label="of the tip", color=0))
    panels = [
        Panel(x_label="", y_label="lag, deg", lines=lines),
        Panel(x_label="", y_label="rate of the spool, rad/s", lines=[Line(x=time, y=reel.rate.values)]),
        Panel(x_label="time, s", y_label="length that is out, m", lines=[Line(x=time, y=blade.deployed_length.values)]),
    ]
    if "measured_spin" in reel:
        spin = [
            Line(x=time, y=reel.measured_spin.values, label="measured", color=3, style=" ", marker="."),
            Line(x=time, y=run.body_rate.values, label="of the body", color=0),
        ]
        panels.insert(1, Panel(x_label="", y_label="spin, rad/s", lines=spin))
    title = "Pay-out by a drive that reacts"
    return Figure(name="feedback", title=title, panels=panels, height=stacked(len(panels)))
