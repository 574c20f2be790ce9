"""Ours: a wound rib of carbon, or as printed, springs open against a damper in its hinge, or drag, and latches.

Yi, Yuan, Dong & Li (2017) put dampers into the hinge to lower the impact "of winding and deployment", and let the mass
damping a guide their choice; they simulate the winding alone.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

import evolvent
from evolvent import cases, closed_forms
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers.papers import Made, Options
from evolvent_papers.papers.winding import markdown

Array = np.ndarray
Values = dict[str, float]
CASE = "wrapped-rib-deploy-damped"
#: Modulus as printed, Pa.
PRINTED = 5e6
#: Dampers in the hinge, N m s, and drags, 1/s, of the rib of carbon.
DAMPERS, DRAGS = (0.0, 0.03, 0.1, 0.3, 1.0), (0.005, 0.01, 0.015, 0.02)
#: Mass damping of the paper's figure 7, 1/s, in the elements of its first one, 1.2 m.
ROOT_ALPHA, ROOT_ELEMENTS = 0.5, (1, 2, 3, 4)
#: Ends of the runs, s, some 20 s beyond the latch: with most dampers, and with the largest damper or drag.
END, LATE = 85.0, 160.0
#: Time, of that in which a rib without damping leaves the hub, about which the tip's speed is averaged, and its share.
MIDDLE, ABOUT = 0.8, 0.1


class Deployment(NamedTuple):
    """A run to half a turn beyond the latch, in units of the free rib: v, EI/R, and L/v.

    Attributes
    ----------
    t, speed, moment : (nt,) s of the rib of carbon, tip speed over v, moment of the hinge over EI/R
    middle : float, mean speed of the tip over v while it leaves the hub
    latched, rate : float, s of the rib of carbon, time of the latch; rate of the root at it over v/L
    latch, most : float, largest moment of the latch, and of damper and latch at the samples, over EI/R
    damper, drag : float, what the damper and what drag has taken, of the energy wound
    defect : float, largest error of the energy balance, of the energy wound
    """

    t: Array
    speed: Array
    moment: Array
    middle: float
    latched: float
    rate: float
    latch: float
    most: float
    damper: float
    drag: float
    defect: float


@functools.lru_cache(maxsize=24)
def deployed(
    damping: float = 0.0, alpha: float = 0.0, modulus: float = 0.0, *, first: bool = False, end: float = END
) -> Deployment:
    """A deployment, its times and coefficients scaled to the modulus; `first`: drag on the first 1.2 m alone."""
    base = cases.load(CASE)
    share = modulus / base.rib.young_modulus if modulus else 1.0
    slow = math.sqrt(share)  # rates and coefficients go with it, moments and energies with `share`
    changes: dict[str, Any] = {
        "rib.young_modulus": base.rib.young_modulus * share, "rib.root_damping": damping * slow,
        "rib.root_latch_stiffness": base.rib.root_latch_stiffness * share, "damping.alpha": alpha * slow,
        "solver.duration": end / slow, "output.every": base.output.every / slow, "output.fine": False,
    }  # fmt: skip
    if first:
        changes["damping.elements"] = ROOT_ELEMENTS
    run, strip = evolvent.run(CASE, changes), cases.load(CASE, changes).strip
    v, moment, wound = closed_forms.deployment_speed(strip), strip.bending_stiffness / strip.radius, run.energy[0]
    hinge, t, speed = run["hinge-1"], run.time.values * slow, run["rib-1"].tip_speed.values / v
    about = np.abs(t / (MIDDLE * closed_forms.deployment_time(strip) * slow) - 1.0) < ABOUT
    torque, taken = -hinge.torque.values / moment, run.energy_losses.isel(time=-1)
    return Deployment(
        t=t, speed=speed, moment=torque, middle=float(speed[about].mean()),
        latched=float(hinge.latch_time[-1]) * slow, rate=abs(float(hinge.latch_rate[-1])) * strip.length / v,
        latch=float(hinge.latch_torque_peak[-1]) / moment, most=float(np.abs(torque).max()),
        damper=float(hinge.damper_work[-1] / wound), drag=float(taken.sel(cause="mass damping") / wound),
        defect=float(np.abs(run.energy_defect).max() / wound),
    )  # fmt: skip


def _ends(damping: float, alpha: float) -> float:
    """End of a run with a damper and a drag, s."""
    return LATE if damping > 0.5 or alpha > 0.012 else END


def measured() -> Values:
    """Of the rib of carbon: tip speeds over v, moments over EI/R, times in s; and of the rib as printed."""
    strip, printed = cases.load(CASE).strip, cases.load(CASE, {"rib.young_modulus": PRINTED}).strip
    free, strong, root = deployed(), deployed(0.3), deployed(0.0, ROOT_ALPHA, first=True)
    stopping, drag, same = deployed(1.0, end=LATE), deployed(0.0, 0.015, end=LATE), deployed(0.3, 0.0, PRINTED)
    momentum = strip.line_density * strip.length**2 * closed_forms.deployment_speed(strip) / 3.0
    values = {"stops": momentum / (0.5 * math.pi)}  # of a rigid rib, within a quarter turn
    for name, one in (("free", free), ("strong", strong), ("stopping", stopping), ("root", root), ("drag", drag)):
        values |= {f"v_{name}": one.middle, f"t_{name}": one.latched, f"m_{name}": one.latch, f"most_{name}": one.most}
    year = 365.25 * 86400.0
    return values | {
        "m_printed": same.latch, "t_printed": same.latched,
        "closed": closed_forms.opening(strip).latched, "closed_drag": closed_forms.opening(strip, alpha=0.015).latched,
        "damper": 100.0 * strong.damper, "defect": 100.0 * max(one.defect for one in (free, strong, drag)),
        "unit": 1e3 * strip.bending_stiffness / strip.radius,
        "years": closed_forms.opening(printed, alpha=0.2).unwound / year,
        "days": closed_forms.deployment_time(printed) / 86400.0,
    }  # fmt: skip


# ------------------------------------------------------------------------------------------------ figure


def figure(options: Options) -> Made:
    """Tip speed and moment of the hinge over time, loads at the latch over damper and drag, and load over time."""
    dampers = DAMPERS[::2] if options.quick else DAMPERS
    drags = DRAGS[1::2] if options.quick else DRAGS
    hinge: dict[float, Deployment] = {}
    for d in dampers:
        options.report(f"hinge damper {d:g} N m s")
        hinge[d] = deployed(d, end=_ends(d, 0.0))
    whole: dict[float, Deployment] = {0.0: hinge[0.0]}
    for a in drags:
        options.report(f"drag a = {a:g} 1/s")
        whole[a] = deployed(0.0, a, end=_ends(0.0, a))
    options.report("as printed, E = 5 MPa")
    printed = {d: deployed(d, 0.0, PRINTED, end=_ends(d, 0.0)) for d in dampers}
    shown = [(f"hinge damper {d:g} N m s" if d else "no damper", hinge[d]) for d in dampers]
    shown.append((f"a = {drags[-1]:g} 1/s on the whole rib", whole[drags[-1]]))
    lines: list[list[Line]] = [[], []]
    for k, (name, one) in enumerate(shown):
        lines[0].append(Line(x=one.t, y=one.speed, label=name, color=k, width=1.1))
        lines[1].append(Line(x=one.t, y=one.moment, color=k, width=1.1))
        lines[1].append(Line(x=np.array([one.latched]), y=np.zeros(1), color=k, style="", marker="^"))
    strip = cases.load(CASE).strip
    at = np.linspace(0.0, 1.0, 91)
    first = closed_forms.opening(strip)
    ahead = np.array([first.moment(strip, x * math.pi) for x in at]) * strip.radius / strip.bending_stiffness
    lines[1].append(
        Line(x=first.latched + at * math.pi / first.rate, y=ahead, label="elastica under m v^2/2, no damper",
             color="gray", style="--")
    )  # fmt: skip
    scale = math.sqrt(PRINTED / cases.load(CASE).rib.young_modulus)
    panels = [
        Panel(x_label="time, s", y_label="tip speed over v", lines=lines[0], y_zero=True,
              title="tip speed; v = sqrt(3 EI/m)/R = 2.40 m/s"),
        Panel(x_label="time, s", y_label="moment over EI/R", lines=lines[1],
              title="moment of the hinge: damper, then latch (triangles: it locks)"),
        Panel(x_label="hinge damper, N m s", y_label="over EI/R",
              lines=[*_points(hinge, "latch", "latch, 147 GPa", 0, "o"),
                     *_points(hinge, "most", "damper or latch, 147 GPa", 1, "s"),
                     *_points(printed, "latch", f"latch, 5 MPa (damper times {scale:.5f})", 2, "x")],
              y_zero=True, title="largest moment over the damper"),
        Panel(x_label="time of the latch, s", y_label="largest moment over EI/R",
              lines=[_traded(hinge, "hinge dampers", 1, "s"), _traded(whole, "a on the whole rib", 3, "D")],
              y_zero=True, title="load over time to deploy, 147 GPa"),
    ]  # fmt: skip
    title = (
        "Ours, not in the paper: dampers in the hinge while the wound rib deploys and latches\n"
        "(12 m x 0.03 m x 0.3 mm, R = 0.6 m; carbon, E = 147 GPa, EI/R = 16.5 mN m; as printed 5 MPa)"
    )
    drawn = Figure(name="rib-deployment-damping", title=title, panels=panels, columns=1, height=250.0)
    rows = [[f"{d:g}", "0", "147 GPa", *_numbers(one)] for d, one in hinge.items()]
    rows += [["0", f"{a:g}", "147 GPa", *_numbers(one)] for a, one in whole.items() if a]
    rows += [[f"{d:g}", "0", "5 MPa, scaled", *_numbers(one)] for d, one in printed.items()]
    head = (
        "damper, N m s", "a, 1/s", "E", "tip speed over v, leaving the hub", "latched at, s", "rate then over v/L",
        "latch over EI/R", "damper or latch over EI/R", "damper took, %", "drag took, %",
    )  # fmt: skip
    return Made(text=f"{NOTE}\n{markdown(head, rows)}", figure=drawn)


NOTE = """\
Wound without stretch, released, hinge opens from 90 deg (along the hub) to its latch at 0 deg (outwards). Times and
dampers of 5 MPa are scaled to 147 GPa by the square root of the moduli: the motions are the same. Moments are those up
to about half a turn beyond the latch. Percentages are of the energy wound.
"""


def _points(found: Mapping[float, Deployment], what: str, name: str, color: int, marker: str) -> list[Line]:
    """Computed points alone, a marker each."""
    y = np.array([getattr(one, what) for one in found.values()])
    return [Line(x=np.array(list(found)), y=y, label=name, color=color, style="", marker=marker)]


def _traded(found: Mapping[float, Deployment], name: str, color: int, marker: str) -> Line:
    """Largest moment over the time of the latch."""
    t, y = np.array([[one.latched, max(one.most, one.latch)] for one in found.values()]).T
    return Line(x=t, y=y, label=name, color=color, style="", marker=marker)


def _numbers(one: Deployment) -> list[str]:
    """Of a deployment in the table."""
    values = (one.middle, one.latched, one.rate, one.latch, one.most, 100.0 * one.damper, 100.0 * one.drag)
    return [f"{value:.3g}" for value in values]
