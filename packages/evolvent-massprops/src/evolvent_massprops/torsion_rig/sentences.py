"""What is to be said of the records of a rig: which are wrong, which cannot be named, what the body cannot be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from evolvent_massprops.rounding import rounded, shown
from evolvent_massprops.torsion_rig.adjustment import Fit, Judged, deciding, fit, listed
from evolvent_massprops.torsion_rig.equations import Centre, Moments, directions


def of_judged(judged: Judged, widened: bool) -> tuple[list[str], list[str]]:
    """Warnings and notes on the records of one fit.

    Parameters
    ----------
    judged : Judged
    widened : bool, whether the records that are used scatter more than their uncertainties let expect
    """
    every, used = judged.every, judged.accepted
    what = "moments" if isinstance(every.of, Moments) else "lines and pendulums"
    if isinstance(every.of, Centre) and not every.of.swings:
        what = "lines"
    if every.redundancy < 1:
        return [], [_no_check(every, what)] if every.used.sum() > 1 else []
    if not judged.alarm:
        text = f"{what}: {every.used.sum()} records agree to {every.scatter:.2f} of their uncertainties"
        more = "; one that is wrong would be found, but not which" if every.redundancy == 1 else ""
        return [], [f"{text}{more}", *_predicted(used)]
    warnings, notes = [_wrong(judged, k) for k in judged.wrong], _predicted(used)
    if judged.wrong:
        warnings.append(f"without {_names(used, judged.wrong)} {_agreement(used)}")
    elif every.redundancy == 1:
        warnings.append(
            f"the {what} contradict one another by {_worst(every):.1f} standard uncertainties "
            f"({judged.critical:.1f} allowed), so that a record is wrong; {every.used.sum()} records cannot tell "
            f"which, one more would: none is left out; {_alternatives(judged)}{_telling(judged)}"
        )
    elif judged.suspects:
        best = judged.suspects[0]
        named = [_names(every, one) for one in sorted(judged.suspects)]
        others = f"{', '.join(named[:-1])} or {named[-1]}"
        warnings.append(
            f"the {what} contradict one another by {_worst(every):.1f} standard uncertainties "
            f"({judged.critical:.1f} allowed): {others} is wrong, which the records cannot tell, and none is left out; "
            f"{_alternatives(judged)}; the others agree best without {_names(every, best)}{_no_suspect(judged)}"
            f"{_telling(judged)}"
        )
    else:
        warnings.append(
            f"the {what} contradict one another, {every.scatter:.1f} times what their uncertainties let expect, and "
            f"leaving out no single one explains it; {_alternatives(judged)}"
        )
    if widened:
        warnings.append(
            f"{what}: the records that are used scatter {used.scatter:.1f} times what their uncertainties let expect, "
            "and u is widened by it; state what a mounting repeats to in stand.remounting"
        )
    return warnings, notes


def _predicted(one: Fit) -> list[str]:
    """How well an orientation that is left out is predicted."""
    if not isinstance(one.of, Moments) or one.redundancy < 1:
        return []
    rms, weighted = one.period_errors
    return [
        f"an orientation that is left out is predicted to {100.0 * rms:.2g} % rms of its period, to "
        f"{100.0 * weighted:.2g} % weighted by the uncertainties of the predictions"
    ]


def _no_check(one: Fit, what: str) -> str:
    """That nothing tests the records."""
    count, asked = int(one.used.sum()), listed(one.of.parameters)
    if isinstance(one.of, Moments) and not one.of.round:
        return (
            f"{count} orientations give {asked} without redundancy, so that no record is tested: a fourth shows that "
            "one is wrong, a fifth which"
        )
    return f"{what}: {count} records give {asked} without redundancy, so that no record is tested"


def _wrong(judged: Judged, k: int) -> str:
    """The sentence that names a wrong record."""
    used = judged.accepted
    one = used.equations[k]
    deviation, std = (float(row[k]) for row in used.left_out)
    others, times = int(used.used.sum()), abs(deviation) / std
    measured, predicted = float(used.measured[k]), float(used.measured[k]) - deviation
    place = math.sqrt(max(std**2 - float(used.variance[k, k]), 0.0))
    if one.kind == "line":
        text = (
            f"{one.name} has a wrong line: its distance, {1e3 * measured:.1f} mm, is {1e3 * abs(deviation):.1f} mm off "
            f"what the other {others} records give ({times:.0f} standard uncertainties"
        )
    elif one.kind == "moment":
        text = (
            f"{one.name} is wrong: its moment is {rounded(measured, place)} kg m², "
            f"{100.0 * abs(deviation / measured):.1f} % off the {shown(predicted, place)} kg m² that the other "
            f"{others} orientations give ({times:.0f} standard uncertainties"
        )
    else:
        text = (
            f"{one.name} is wrong: it is {abs(deviation):.3g} kg m² off what the other records give ({times:.0f} "
            "standard uncertainties"
        )
    return f"{text}, {judged.critical:.1f} allowed); it is left out{_impossible(used, k)}"


def _impossible(one: Fit, k: int) -> str:
    """That a moment is none that the body has about any line of the plane; '' where it is."""
    if not isinstance(one.of, Moments) or one.of.round:
        return ""
    angles = np.linspace(0.0, np.pi, 721)
    G = directions(angles)
    J, u = G @ one.values, np.sqrt(np.einsum("ni,ij,nj->n", G, one.own_covariance, G))
    low, high = float(np.min(J - 3.0 * u)), float(np.max(J + 3.0 * u))
    if low <= one.measured[k] <= high:
        return ""
    return f", and no line of the plane has such a moment ({float(J.min()):.3g} to {float(J.max()):.3g} kg m²)"


def _agreement(one: Fit) -> str:
    """How well the records that are used agree."""
    if isinstance(one.of, Moments):
        rms = math.sqrt(float(np.mean((one.residual[one.used] / one.measured[one.used]) ** 2)))
        text = f"the others agree to {100.0 * rms:.2g} % rms"
    else:
        text = "the others agree"
    return f"{text}, {one.scatter:.2g} of their uncertainties" if one.redundancy > 0 else f"{text}, without redundancy"


def _alternatives(judged: Judged) -> str:
    """Every record beside what the others predict."""
    one = judged.every
    deviation, std = one.left_out
    parts = []
    for k in np.flatnonzero(np.isfinite(deviation)):
        times = abs(float(deviation[k])) / float(std[k])
        e = one.equations[k]
        if e.kind == "moment":
            parts.append(f"{e.name} {100.0 * abs(float(deviation[k] / one.measured[k])):.1f} % ({times:.0f} u)")
        elif e.kind == "line":
            parts.append(f"{e.name} {1e3 * abs(float(deviation[k])):.1f} mm ({times:.1f} u)")
        else:
            parts.append(f"{e.name} {abs(float(deviation[k])):.2g} kg m² ({times:.1f} u)")
    return f"off what all others predict: {', '.join(parts)}"


def _no_suspect(judged: Judged) -> str:
    """That a record which is far off explains nothing: without it the others contradict one another as before."""
    every, suspects = judged.every, {k for group in judged.suspects for k in group}
    deviation, std = every.left_out
    others = [k for k in np.flatnonzero(np.isfinite(deviation)) if k not in suspects]
    relative = {int(k): abs(float(deviation[k] / every.measured[k])) for k in others if every.measured[k] != 0.0}
    far = {k: share for k, share in relative.items() if abs(deviation[k]) > judged.critical * std[k]}
    if not far:
        return ""
    k = max(far, key=lambda one: far[one])
    rest = every.used.copy()
    rest[k] = False
    without = fit(every.of, rest)
    if without.redundancy < 1:
        return ""
    name = every.equations[k].name
    return (
        f"; {name} alone does not explain it: without {name} the others still contradict one another by "
        f"{_worst(without):.1f} standard uncertainties"
    )


def _telling(judged: Judged) -> str:
    """The missing orientation that would distinguish the suspects; '' where there is none."""
    found = deciding(judged)
    if found is None:
        return ""
    moments = ", ".join(
        f"{moment:.3g} kg m² without {_names(judged.every, out)}"
        for moment, out in zip(found.moments, judged.suspects, strict=True)
    )
    return (
        f"; what is missing is an orientation near {found.angle:.0f} deg: it has {moments}, {found.apart:.1f} standard "
        "uncertainties apart or more"
    )


def _worst(one: Fit) -> float:
    deviation, std = (row[one.used] for row in one.left_out)
    return float(np.nanmax(np.abs(deviation) / std))


def _names(one: Fit, records: Sequence[int]) -> str:
    return listed([one.equations[k].name for k in records])


def of_body(found: Mapping[str, float], covariance: Mapping[tuple[str, str], float]) -> list[str]:
    """Warnings where the moments are those of no body, by more than three times their uncertainty.

    Parameters
    ----------
    found : mapping, output -> value
    covariance : mapping, pair of outputs -> covariance
    """
    warnings = []

    def above(sizes: Mapping[str, float]) -> tuple[float, bool]:
        """A sum of outputs, and whether it is surely above 0."""
        total = sum(size * found[key] for key, size in sizes.items())
        square = sum(a * b * covariance[i, j] for i, a in sizes.items() for j, b in sizes.items())
        return total, total > 3.0 * math.sqrt(max(square, 0.0))

    if "I2" in found and above({"I2": -1.0})[1]:
        warnings.append(
            f"the smallest moment in the plane is {found['I2']:.3g} kg m², which no body has: a record is wrong"
        )
    if "Iyy" not in found or "Ixx" not in found:
        return warnings
    plane = {"Ixx": -2.0} if "Izz" not in found else {"Ixx": -1.0, "Izz": -1.0}
    text = "which no body has: a mass, a length or a record is wrong"
    off, wrong = above({"Iyy": 1.0, **plane})
    if wrong:
        warnings.append(
            f"Iyy is {found['Iyy']:.4g} kg m², {off:.2g} kg m² above the sum of the two moments in the plane, {text}"
        )
    if "I1" in found:
        off, wrong = above({"Iyy": -1.0, "I1": 1.0, "I2": -1.0})
        if wrong:
            warnings.append(
                f"Iyy is {found['Iyy']:.4g} kg m², {off:.2g} kg m² below the difference of the moments in the plane, "
                f"{text}"
            )
    return warnings
