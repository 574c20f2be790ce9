"""A fitted Prony series as an answer: terms, shifts, what is left after years, a figure, and a line for a case."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Any

from evolvent.design.calibration import uncertainty
from evolvent.design.calibration.relaxation import pictures, shifts
from evolvent.design.calibration.relaxation.fitted import YEARS, Fitted, Value, rounded
from evolvent.design.calibration.relaxation.search import MOST_TERMS
from evolvent_base import answer as an
from evolvent_base.errors import counted
from evolvent_base.scales import YEAR, celsius, shown_time

#: Overlap of curves in reduced time that is named as short, and 95 % bound of a shift that is named as vague, decades.
SHORT, VAGUE = 0.3, 0.5
#: Ratio from which the scatter that is stated and that of the residuals are said to differ.
_DIFFER = 1.5
_time = functools.partial(shown_time, digits=3)


@dataclasses.dataclass(frozen=True, kw_only=True, eq=False)
class Relaxation(Fitted):
    """A Prony series fitted to relaxation curves: it prints, draws and saves what was found."""

    def answer(self) -> an.Answer:
        """Terms, shifts, what is left, and the line for a case."""
        return answer_of(self)


def _shown(one: Value, unit: str = "") -> tuple[str, str, str]:
    """Value, standard uncertainty and 95 % bounds, as cells of a table."""
    unit = f" {unit}" if unit else ""
    low, high = (rounded(end, one.error) for end in (one.low, one.high))
    return f"{rounded(one.value, one.error)}{unit}", f"{one.error:.2g}{unit}", f"{low} to {high}{unit}"


# ------------------------------------------------------------------------------------------------ answer


def answer_of(found: Fitted) -> an.Answer:
    """What was fitted."""
    heads = ("", "value", "standard uncertainty", "95 % bounds")
    terms = [
        (f"{k}", *_shown(share), *_shown(time, "s"))
        for k, (share, time) in enumerate(zip(found.shares, found.times, strict=True), start=1)
    ]
    both = ("standard uncertainty", "95 % bounds")
    of_terms = an.Table(heads=("term", "share", *both, "time", *both), rows=terms)
    tried = [
        (f"{one.terms}", f"{one.response.size}", f"{one.rms * found.scale:.4g}",
         f"{one.criterion - min(other.criterion for other in found.tried):.1f}" if one.covariance is not None else
         "not determined")
        for one in found.tried
    ]  # fmt: skip
    unit = found.measured.unit
    of_tried = an.Table(
        heads=("terms", "parameters", f"root mean square{f', {unit}' if unit else ''}", "criterion above the least"),
        rows=tried,
    )
    left = an.Table(heads=heads, rows=_left(found), title="Force that is left")
    blocks: list[an.Block] = [of_terms, left, *_summary(found)]
    sections = [an.Section(title="Prony series", blocks=blocks)]
    if found.temperatures.size > 1:
        sections.append(an.Section(title="Shift by temperature", blocks=_shift_tables(found, heads)))
    at = f", at {celsius(found.reference)}" if found.reference is not None else ""
    sections += [
        an.Section(title="For a case", blocks=[found.section]),
        an.Section(title="Number of terms", blocks=[of_tried], level=an.DETAIL),
        an.Section(title="Figure", blocks=[pictures.figure(found)], level=an.PAGE),
    ]
    return an.Answer(
        title=f"Prony series of {found.measured.source or 'relaxation curves'}{at}",
        sections=sections, warnings=[*found.warnings, *_warnings(found)], notes=found.measured.notes,
        files={
            "relaxation.json": lambda: an.as_json(to_dict(found)), "viscoelastic.yaml": lambda: found.section + "\n",
        },
    )  # fmt: skip


def _left(found: Fitted) -> list[tuple[str, ...]]:
    """Rows on the forces, and on the share that is left after some times."""
    unit = found.measured.unit
    years = YEARS * YEAR
    return [
        ("instantaneous force", *_shown(found.instantaneous, unit)),
        ("force that stays", *_shown(found.equilibrium, unit)),
        (f"share left after {_time(found.longest)}, the longest", *_shown(found.share_left(found.longest))),
        (f"share left after {YEARS:g} years", *_shown(found.share_left(years))),
        ("share that stays", *_shown(found.left)),
    ]


def _shift_tables(found: Fitted, heads: Sequence[str]) -> list[an.Block]:
    law = found.solved.response.shift
    rows = []
    assert found.free is not None
    for T, one, free in zip(found.temperatures, found.decades(), found.decades(found.free), strict=True):
        cells = ("0", "", "") if free.error == 0.0 else _shown(free)
        rows.append((celsius(T), *cells, *(() if isinstance(law, shifts.Free) else (f"{one.value + 0.0:.4g}",))))
    own = () if isinstance(law, shifts.Free) else ("by the law",)
    blocks: list[an.Block] = [an.Table(heads=("temperature", "decades", *heads[2:], *own), rows=rows)]
    if isinstance(law, shifts.Arrhenius):
        energy = Value(*(law.UNIT / 1e3 * number for number in found.constants[0]))
        blocks.append(an.Table(heads=heads, rows=[("activation energy", *_shown(energy, "kJ/mol"))]))
    elif isinstance(law, shifts.WLF):
        c1, c2 = found.constants
        blocks.append(an.Table(heads=heads, rows=[("c1", *_shown(c1)), ("c2", *_shown(c2, "K"))]))
    return blocks


def _summary(found: Fitted) -> list[str]:
    """Sentences on the residuals."""
    unit = f" {found.measured.unit}" if found.measured.unit else ""
    rms, count = found.solved.rms * found.scale, found.solved.residuals.size
    chosen = "by the Bayesian information criterion" if len(found.tried) > 1 else "as given"
    return [
        f"{counted(found.terms, 'term')}, {chosen}; residuals: root mean square {rms:.3g}{unit}, "
        f"{rms / found.instantaneous.value:.2g} of the instantaneous force; {count} values of "
        f"{counted(len(found.measured.curves), 'curve')}, {found.solved.response.size} parameters"
    ]


def _warnings(found: Fitted) -> list[str]:
    """Sentences on what the data do not determine."""
    at = "" if found.temperatures.size < 2 or found.reference is None else f" at {celsius(found.reference)}"
    said = []
    if len(found.tried) > 1 and found.terms == MOST_TERMS:
        said.append(f"the data ask for {MOST_TERMS} terms, the most that are tried")
    end, years = found.longest, YEARS * YEAR
    last = found.times[-1]
    if last.high > end:
        said.append(
            f"the longest relaxation time, {_time(last.value)} (95 % bound {_time(last.high)}), is not within the "
            f"longest time measured, {_time(end)}{at}: its share is not determined by the data alone; measure "
            "longer, or warmer"
        )
    if found.times[0].value < found.shortest:
        said.append(
            f"the shortest relaxation time, {_time(found.times[0].value)}, is below the first time measured after the "
            f"step, {_time(found.shortest)}{at}: its share, and the instantaneous force, hang on the first rows"
        )
    if years > end:
        share, then = found.share_left(end).value, found.share_left(years).value
        slope = (share - found.share_left(1.001 * end).value) / math.log10(1.001)
        straight = max(share - slope * math.log10(years / end), 0.0)
        said.append(
            f"{YEARS:g} years are {years / end:.3g} times the longest time measured, {_time(end)}{at}: the share of "
            f"{then:.3g} that is left then is an extrapolation, as the series holds no relaxation at longer times"
            + (
                f"; a force that falls on in each decade of time as at the end of the data leaves {straight:.3g}"
                if straight < then
                else ""
            )
        )
    if found.left.low <= 0.0:
        said.append("the force that stays is not distinguished from 0: the data end before the force has settled")
    following = uncertainty.following(found.residuals)
    if following and not found.is_exact:
        said.append(following)
    if found.deviation is not None:
        ratio = found.solved.rms * found.scale / found.deviation
        if not 1.0 / _DIFFER < ratio < _DIFFER:
            said.append(f"the residuals are {ratio:.3g} times as large as the standard deviation that is given")
    if found.free is not None:
        over, first, second = found.overlap()
        if over < SHORT:
            said.append(
                f"the curves at {celsius(first)} and {celsius(second)} overlap by {over:.2g} decades of "
                "reduced time alone"
            )
        for T, one in zip(found.temperatures, found.decades(found.free), strict=True):
            if found.factor * one.error > VAGUE:
                said.append(
                    f"the data do not determine the shift at {celsius(T)}: {one.value:.2g} decades, standard "
                    f"uncertainty {one.error:.2g}"
                )
    return said


def to_dict(found: Fitted) -> dict[str, Any]:
    """Numbers and texts, as the JSON file has them."""

    def of(one: Value) -> dict[str, float]:
        return {"value": one.value, "standard_uncertainty": one.error, "low": one.low, "high": one.high}

    free = [None] * found.temperatures.size if found.free is None else [of(one) for one in found.decades(found.free)]
    return {
        "source": found.measured.source, "unit": found.measured.unit, "reference": found.reference,
        "terms": [
            {"share": of(share), "time": of(time)} for share, time in zip(found.shares, found.times, strict=True)
        ],
        "instantaneous_force": of(found.instantaneous), "equilibrium_force": of(found.equilibrium),
        "share_that_stays": of(found.left),
        "share_left": [
            {"time": time, **of(found.share_left(time))} for time in (found.longest, YEARS * YEAR)
        ],
        "shift": {
            "law": _shift_name(found), "constants": [of(one) for one in found.constants],
            "temperatures": [
                {"temperature": float(T), "decades": of(one), "without_a_law": other}
                for T, one, other in zip(found.temperatures, found.decades(), free, strict=True)
            ],
        },
        "covariance": found.covariance(found.solved), "longest_time": found.longest,
        "rms": found.solved.rms * found.scale,
        "tried": [
            {"terms": one.terms, "rms": one.rms * found.scale, "criterion": one.criterion} for one in found.tried
        ],
        "viscoelastic": found.viscoelastic.model_dump(mode="json", exclude_none=True),
        "warnings": [*found.warnings, *_warnings(found)], "notes": found.measured.notes,
    }  # fmt: skip


def _shift_name(found: Fitted) -> str | None:
    kind = type(found.solved.response.shift)
    return next((name for name, own in shifts.LAWS.items() if own is kind), None)
