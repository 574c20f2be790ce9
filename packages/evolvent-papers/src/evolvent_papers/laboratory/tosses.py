"""Tosses of a cube onto a board: flight, impacts, sliding and rest, predicted from the first rows and measured.

The cube touches the board with its eight corners, which are round, by a contact with stiffness, damping and Coulomb
friction. Contact, inertia and rounding are fitted to 20 tosses, spread over the set; gravity follows from their
flights and the size from their heights at rest, both in lengths of the record, which are not those of a ruler. The
other tosses are predicted from their flights. Before they are compared, starts beside each one say which of them are
chaotic.

Source: DAIRLab/contact-nets (BSD-3-Clause licence). Acosta, Yang, Posa, Validating Robotics Simulators on Real-World
Impacts, arXiv 2110.00541.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from evolvent_base import progress, units
from evolvent_base.figures import Figure, Line, Panel, stacked
from evolvent_base.schema import Section
from evolvent_papers.laboratory import book, tables, toss_records
from evolvent_papers.laboratory.book import Array, Budget, Comparison, Contribution, Set, Verdict
from evolvent_papers.laboratory.pendulum import spread_over
from evolvent_papers.laboratory.toss_cube import (
    FINE,
    NAMES,
    SOONER,
    UNITS,
    Known,
    alone,
    cube,
    fit,
    known_of,
    meant,
    stored_fit,
    values_of,
)
from evolvent_papers.laboratory.toss_records import AFTER, NOMINAL, RIGHT, Fit, Motion, Off, Toss

SOURCE = (
    "public repository DAIRLab/contact-nets, folder data/tosses_processed, commit c3dc21c, every ninth toss; "
    "BSD-3-Clause licence"
)
BUDGET = Budget(
    contributions=(
        Contribution(
            name="start", kind="measurement", size="spread of the motion by position, rotation and rates at the touch",
            source="scatter of the toss about its flight, and of records at rest",
        ),
        Contribution(
            name="contact", kind="measurement", size="by which fitted tosses differ more than by their starts",
            source="the fitted tosses",
        ),
        Contribution(name="fit", kind="parameters", size="covariance of the fit", source="the fitted tosses"),
        Contribution(name="tolerance", kind="numerics", size="change by a hundredth of it", source="computed"),
        Contribution(
            name="poses", kind="measurement", size="share of fitted tosses with a wrong pose at rest",
            source="the fitted tosses",
        ),
        Contribution(
            name="number of tosses", kind="measurement", size="scatter of a share of so many",
            source="the binomial distribution",
        ),
    ),
    widened="the predicted tosses had been compared with a model without an offset of the centre of mass before this "
    "one was chosen by the fitted tosses",
)  # fmt: skip
#: Least share of poses at rest that must be right.
GOAL = 0.8
#: Mean errors that Acosta, Yang and Posa report of all tosses, part of the cube's width in % and deg, as the README of
#: tests/benchmarks/omnibench/lane1r in the public repository omnilink-tech/omnisim quotes them.
REPORTED = {"Drake": (13.5, 16.5), "Bullet": (14.9, 16.5), "MuJoCo": (25.1, 21.7)}
#: Times after the first touch that are compared, s.
COMPARED = (0.04, 0.1, 0.2, 0.4)


class Settings(Section):
    """What `--set` changes."""

    fitted: Annotated[int, units.Whole(least=0, most=1000)] = Field(
        20, description="tosses that the contact is fitted to, spread over all; 0 for the stored fit to the package's"
    )
    tosses: Annotated[int, units.Whole(least=1, most=10000)] = Field(10000, description="tosses that are used at most")
    starts: Annotated[int, units.Whole(least=2, most=1000)] = Field(
        8, description="starts beside that of each toss, within its uncertainty, that say which are chaotic"
    )
    horizon: units.Time = Field(0.35, description="time after the first touch up to which the fit sees a toss, s")


# ------------------------------------------------------------------------------------------------ predictions


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Predicted:
    """A predicted toss, before it is compared.

    Attributes
    ----------
    toss : Toss
    motion : Motion
    chaotic : bool, whether a start beside it ends in another pose
    by_start, by_parameters, by_numerics : Off, spreads of the motion
    """

    toss: Toss
    motion: Motion
    chaotic: bool
    by_start: Off
    by_parameters: Off
    by_numerics: Off

    @property
    def off(self) -> Off:
        """Differences from the recorded motion."""
        return self.toss.off(self.motion)


def predicted(toss: Toss, found: Fit, known: Known, starts: int) -> Predicted:
    """The motion of a toss with its spreads by starts, by parameters and by the tolerance."""
    own, rows = cube(found.values, known), [toss.row_at(after) for after in AFTER]
    start = own.start(toss)
    motion = own.predicted(toss, start)
    draws = np.random.default_rng(0).standard_normal(((starts + 1) // 2, 12)) * known.deviations(toss)
    beside = [own.predicted(toss, start.moved(sign * one)) for one in draws for sign in (1.0, -1.0)][:starts]

    def moved(numbers: Array) -> Array:
        return np.concatenate(cube(numbers, known).predicted(toss).apart(motion), axis=1)

    deviations = book.by_parameters(moved, found.values, found.covariance)
    return Predicted(
        toss=toss, motion=motion,
        chaotic=not all(toss_records.difference(one, motion, rows).right for one in beside),
        by_start=_spread(np.sqrt(np.mean([np.square(np.hstack(one.apart(motion))) for one in beside], axis=0)), rows),
        by_parameters=_spread(deviations, rows),
        by_numerics=toss_records.difference(own.predicted(toss, start, tolerance=FINE), motion, rows),
    )  # fmt: skip


def _spread(deviations: Array, rows: Sequence[int]) -> Off:
    """Spreads by standard deviations of displacements and rotation vectors, (nt, 6) float."""
    moved, turned = (np.linalg.norm(deviations[:, part], axis=1) for part in (slice(3), slice(3, 6)))
    return Off(float(moved.mean()), float(turned.mean()), moved[list(rows)], turned[list(rows)], right=True)


# ------------------------------------------------------------------------------------------------ verdict

_WIDTH, _DEGREES = 100.0 / (2.0 * NOMINAL), math.degrees(1.0)
Read = Callable[[Off], float]


def _after_flight(key: str, k: int, off: Off) -> float:
    """The difference at the kth of the times `AFTER`."""
    return float(getattr(off, f"{key}_after")[k])


def _reads() -> list[tuple[str, str, float, Read]]:
    """What is compared: words, unit, factor, and how it is read of differences."""
    found: list[tuple[str, str, float, Read]] = [
        ("position, mean over the rows", "% of the width", _WIDTH, lambda off: off.position),
        ("rotation, mean over the rows", "deg", _DEGREES, lambda off: off.rotation),
    ]
    for after in COMPARED:
        k = AFTER.index(after)
        when = f"{1e3 * after:.0f} ms after the flight"
        found.append((f"position {when}", "% of the width", _WIDTH, functools.partial(_after_flight, "position", k)))
        found.append((f"rotation {when}", "deg", _DEGREES, functools.partial(_after_flight, "rotation", k)))
    return found


def run(settings: Settings, data: str | None) -> Verdict:
    """Fit the contact to some tosses, say which of the others are chaotic, and compare these."""
    tosses = toss_records.tosses_of(data, settings.tosses)
    chosen = spread_over(len(tosses), min(settings.fitted, len(tosses) - 1))
    own, others = [tosses[k] for k in chosen], [one for k, one in enumerate(tosses) if k not in chosen]
    known, found = stored_fit()
    if own:
        known = known_of(own)
        found = fit(own, known, settings.horizon)
    seen = [predicted(one, found, known, settings.starts) for one in progress.track(own, "fitted tosses")]
    ahead = [predicted(one, found, known, settings.starts) for one in progress.track(others, "predictions")]
    calm = [one for one in ahead if not one.chaotic]
    notes = [*_before(found, known, own, ahead), *_excess_notes(seen, found, known)]
    comparisons = [_compared(one, calm, seen, "that are not chaotic") for one in _reads()] if calm else []
    comparisons += [_compared(one, ahead, seen, "with chaotic ones") for one in _reads()[:2]]
    if calm:
        comparisons.append(_at_rest(calm, seen))
    notes += _after(ahead, calm, known, found, stored=data is None)
    return Verdict(comparisons=tuple(comparisons), figures=tuple(_figures(ahead, calm)), notes=tuple(notes))


def _mean(tosses: Sequence[Predicted], of: Callable[[Predicted], Off], read: Read) -> float:
    return float(np.mean([read(of(one)) for one in tosses]))


def _excess(seen: Sequence[Predicted], read: Read) -> float:
    """By how much fitted tosses that are not chaotic differ more than their starts let them, 1 or more."""
    calm = [one for one in seen if not one.chaotic]
    if not calm:
        return 1.0
    return max(1.0, _mean(calm, lambda one: one.off, read) / _mean(calm, lambda one: one.by_start, read))


def _compared(
    what: tuple[str, str, float, Read], tosses: Sequence[Predicted], seen: Sequence[Predicted], which: str
) -> Comparison:
    words, unit, factor, read = what
    parts = [_mean(tosses, of, read) for of in (
        lambda one: one.off, lambda one: one.by_start, lambda one: one.by_parameters, lambda one: one.by_numerics,
    )]  # fmt: skip
    ratio = _excess(seen, read)
    return Comparison(
        what=f"{words}: mean difference of {len(tosses)} tosses {which}", unit=unit, predicted=factor * parts[0],
        measured=0.0,
        band=BUDGET.band({
            "start": factor * parts[1], "contact": factor * math.sqrt(ratio**2 - 1.0) * parts[1],
            "fit": factor * parts[2], "tolerance": factor * parts[3],
        }, how=f"start and contact together are {ratio:.2g} times the start"),
    )  # fmt: skip


def _at_rest(calm: Sequence[Predicted], seen: Sequence[Predicted]) -> Comparison:
    """Share of poses at rest that are right."""
    before = [one for one in seen if not one.chaotic]
    wrong = (sum(not one.off.right for one in before) + 1.0) / (len(before) + 2.0)
    share = float(np.mean([one.off.right for one in calm]))
    return Comparison(
        what=f"pose at rest: right of {len(calm)} tosses that are not chaotic", unit="%", predicted=100.0 * share,
        measured=100.0, allowed=100.0 * (1.0 - GOAL), goal=f"{100.0 * GOAL:.0f} % or more",
        band=BUDGET.band({
            "poses": 100.0 * wrong, "number of tosses": 100.0 * math.sqrt(wrong * (1.0 - wrong) / len(calm)),
        }),
    )  # fmt: skip


def _before(found: Fit, known: Known, own: Sequence[Toss], ahead: Sequence[Predicted]) -> list[str]:
    """What is known before anything is compared."""
    listed = ", ".join(
        f"{name} {value:.4g} +- {std:.2g}{' ' if unit else ''}{unit}"
        for name, value, std, unit in zip(NAMES, *values_of(found), UNITS, strict=True)
    )
    sooner = ", ".join(f"{name} {value:.4g}" for name, value in zip(NAMES, meant(found.sooner), strict=True))
    flown = ", ".join(f"{1e3 * x:.1f} +- {1e3 * u:.1g}" for x, u in zip(known.off, known.off_std, strict=True))
    chaotic = [one.toss.name for one in ahead if one.chaotic]
    which = f"fitted to {len(own)} tosses" if own else "the stored fit to tosses of the package"
    return [
        "the bands hold: the start's uncertainty (scatter of its flight, and what records at rest are tilted and off "
        "in height), times the ratio by which fitted tosses differ more than that, which is what the contact model "
        "leaves unexplained; the covariance of the fit; the tolerance of the runs. They hold no mistake of the board's "
        "plane, and no toss that was recorded wrongly",
        f"{which}: {listed}; standard uncertainties by the infinitesimal jackknife over tosses, with what the "
        f"fit to {SOONER[0]:g} s after the touch has otherwise: {sooner} (inertia over mass times the square of half "
        "the side: 2/3 of a homogeneous cube, 10/9 of thin walls)",
        f"the flights alone, in which the centre of mass moves on a parabola, say an offset of {flown} mm",
        f"in lengths of the record gravity is {known.gravity:.4g} +- {known.gravity_std:.2g} m/s2 by the flights, and "
        f"half the side {1e3 * known.half:.2f} +- {1e3 * known.half_std:.2g} mm by the heights at rest: both say that "
        f"these lengths are {known.gravity / 9.81:.4f} and {known.half / NOMINAL:.4f} of true ones",
        f"chaotic, said before comparing: {len(chaotic)} of {len(ahead)} tosses, of which a start beside it, within "
        f"its uncertainty, ends more than {_DEGREES * RIGHT[0]:.0f} deg or {1e3 * RIGHT[1]:.0f} mm away: "
        f"{', '.join(chaotic) or 'none'}",
    ]


def _excess_notes(seen: Sequence[Predicted], found: Fit, known: Known) -> list[str]:
    """What a rigid cube with one Coulomb contact leaves of the fitted tosses."""
    if not seen:
        return ["without fitted tosses the starts' spreads are not widened"]
    ratios = [_excess(seen, read) for _, _, _, read in _reads()[:2]]
    each = alone(found, known, [one.toss for one in seen])
    (damping, friction), (u_damping, u_friction) = each.changes.std(axis=0), np.median(each.std, axis=0)
    before, after = (values[NAMES.index("damping")] for values in (meant(found.sooner), meant(found.values)))
    return [
        f"the fitted tosses that are not chaotic differ by {ratios[0]:.2g} (position) and {ratios[1]:.2g} (rotation) "
        "times what their starts let them",
        f"what one rigid Coulomb contact does not explain: by their first {SOONER[0]:g} s alone the fitted tosses ask "
        f"for frictions that scatter by {100.0 * friction:.0f} % (each is uncertain by {100.0 * u_friction:.0f} %) and "
        f"dampings that scatter by {100.0 * damping:.0f} % ({100.0 * u_damping:.0f} %); with their own they differ by "
        f"{1e3 * each.after:.2f} mm rms, else by {1e3 * each.before:.2f} mm. Later and slower impacts ask for a "
        f"damping of {after:.3g} s/m in place of {before:.3g} s/m: they lose more than a "
        "damping in proportion to the force",
        f"what no contact explains: at rest the recorded normals are {1e3 * known.tilt:.1f} mrad rms off the "
        f"vertical in each axis, and heights scatter by {1e3 * known.height:.2f} mm, more than a flight's noise of "
        f"{1e3 * known.noise[0]:.2f} mm and {1e3 * known.noise[1]:.1f} mrad",
    ]


def _after(
    ahead: Sequence[Predicted], calm: Sequence[Predicted], known: Known, found: Fit, *, stored: bool
) -> list[str]:
    """What is seen when predictions and records are compared."""
    own = cube(found.values, known)
    rows = [one.toss.off(own.predicted(one.toss, one.toss.first_row(np.array(own.off)))) for one in ahead]
    reported = "; ".join(f"{name} {a:g} % and {b:g} deg" for name, (a, b) in REPORTED.items())
    right = sum(one.off.right for one in ahead)
    notes = [
        f"from the first row alone, as in the report of Acosta, Yang and Posa: position {_all(rows, 'position')}, "
        f"rotation {_all(rows, 'rotation')} over all rows and tosses; they report {reported} of the whole set, as "
        "quoted by omnilink-tech/omnisim, with lengths of the record",
        f"pose at rest right: {right} of {len(ahead)} tosses with chaotic ones; the rotation of those that are not "
        f"chaotic and right is {_median(calm):.2g} deg off in the median",
    ]
    if stored:
        notes += _beside(ahead, calm)
    return notes


def _all(rows: Sequence[Off], key: str) -> str:
    factor, unit = (_WIDTH, "%") if key == "position" else (_DEGREES, "deg")
    values = factor * np.array([getattr(one, key) for one in rows])
    return f"{values.mean():.1f} +- {values.std():.1f} {unit}"


def _median(calm: Sequence[Predicted]) -> float:
    right = [one.off.rotation_after[-1] for one in calm if one.off.right]
    return _DEGREES * float(np.median(right)) if right else math.nan


def stored_peer() -> dict[str, Any]:
    """Errors of MuJoCo with its own best fit, as `python benchmarks/tosses.py` keeps them."""
    found: dict[str, Any] = json.loads(tables.stored("tosses.json"))["peer"]
    return found


def _peer_of(tosses: Sequence[Predicted]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    peer = stored_peer()
    kept = [peer["tosses"].get(one.toss.name) for one in tosses]
    return peer, kept if all(kept) else []


def _beside(ahead: Sequence[Predicted], calm: Sequence[Predicted]) -> list[str]:
    """MuJoCo beside, where it predicted the same tosses."""
    found = []
    for which, tosses in (("that are not chaotic", calm), ("with chaotic ones", ahead)):
        peer, kept = _peer_of(tosses)
        if not kept:
            continue
        reads = _reads()[:2]
        here = [factor * _mean(tosses, lambda one: one.off, read) for _, _, factor, read in reads]
        position, rotation = (
            factor * float(np.mean([one[key] for one in kept]))
            for key, (_, _, factor, _) in zip(("position", "rotation"), reads, strict=True)
        )
        found.append(
            f"{peer['program']}, its contact fitted to the same tosses, {len(kept)} tosses {which}: position "
            f"{position:.1f} % (here {here[0]:.1f}), rotation {rotation:.1f} deg (here {here[1]:.1f}), pose at rest "
            f"right {sum(one['right'] for one in kept)} (here {sum(one.off.right for one in tosses)})"
        )
    return found


# ------------------------------------------------------------------------------------------------ figures


def _figures(ahead: Sequence[Predicted], calm: Sequence[Predicted]) -> list[Figure]:
    """Errors over time, and one toss: the one in the middle of those that are not chaotic."""
    shown, panels = calm or ahead, []
    for key, factor, label in (
        ("position", _WIDTH, "position, % of the width"),
        ("rotation", _DEGREES, "rotation, deg"),
    ):
        lines = []
        for c, (which, tosses) in enumerate((("not chaotic", calm), ("all", ahead))):
            if not tosses:
                continue
            mean = np.mean([getattr(one.off, f"{key}_after") for one in tosses], axis=0)
            lines.append(Line(x=np.array(AFTER), y=factor * mean, label=f"evolvent, {which}", color=c))
            peer, kept = _peer_of(tosses)
            if kept:
                mean = np.mean([one[f"{key}_after"] for one in kept], axis=0)
                lines.append(
                    Line(x=np.array(AFTER), y=factor * mean, label=f"{peer['program']}, {which}", color=c, style="--")
                )
        panels.append(Panel(x_label="time after the flight, s", y_label=label, lines=lines))
    errors = Figure(
        name="tosses", title="Mean difference of predicted tosses from recorded ones", panels=panels,
        height=stacked(len(panels)),
    )  # fmt: skip
    one = sorted(shown, key=lambda each: each.off.position)[len(shown) // 2]
    return [errors, _figure_of(one)]


def _figure_of(one: Predicted) -> Figure:
    toss, panels = one.toss, []
    moved, turned = one.motion.apart(toss.recorded)
    for k, axis in enumerate("xyz"):
        lines = [
            Line(x=toss.time, y=toss.recorded.position[:, k], label="measured", color="gray", width=2.5),
            Line(x=toss.time, y=one.motion.position[:, k], label="predicted", color=0),
        ]
        panels.append(Panel(x_label="time, s", y_label=f"{axis}, m", lines=lines))
    lines = [
        Line(x=toss.time, y=_WIDTH * np.linalg.norm(moved, axis=1), label="position, % of the width", color=0),
        Line(x=toss.time, y=_DEGREES * np.linalg.norm(turned, axis=1), label="rotation, deg", color=1),
    ]
    panels.append(Panel(x_label="time, s", y_label="difference", lines=lines))
    return Figure(
        name="toss", title=f"{toss.name}: predicted from its flight, and measured", panels=panels,
        height=stacked(len(panels)),
    )  # fmt: skip


SETS = {
    "tosses": Set(
        name="tosses", title="A cube thrown onto a board: each toss from its flight, with a contact fitted to 20",
        source=SOURCE, Settings=Settings, run=run, budget=BUDGET,
    ),
}  # fmt: skip
