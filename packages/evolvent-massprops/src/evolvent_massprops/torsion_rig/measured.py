"""A measurement on a torsion rig: mass properties with their uncertainties, and records that were found wrong."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.estimates import Output, Share, coverage_factors, degrees
from evolvent_massprops.torsion_rig.adjustment import Fit, Judged, judge
from evolvent_massprops.torsion_rig.answer import RigProperties
from evolvent_massprops.torsion_rig.equations import Centre, Moments, stiffness
from evolvent_massprops.torsion_rig.inputs import Inputs
from evolvent_massprops.torsion_rig.keys import OnRig, load
from evolvent_massprops.torsion_rig.sentences import of_body, of_judged

_LABELS = {
    "k": ("stiffness of the bar", "N m/rad"),
    "Ixx": ("moment about x through the centre of mass", "kg m²"),
    "Ixz": ("product, element of the tensor", "kg m²"),
    "Izz": ("moment about z through the centre of mass", "kg m²"),
    "Iyy": ("moment about the normal y through the centre of mass", "kg m²"),
    "x": ("centre of mass, from the origin", "m"),
    "z": ("centre of mass, from the origin", "m"),
    "I1": ("largest moment in the plane", "kg m²"),
    "I2": ("smallest moment in the plane", "kg m²"),
    "angle": ("angle of the line with the largest moment", "deg"),
    "Ixx_origin": ("moment about x through the origin", "kg m²"),
    "Ixz_origin": ("product about the origin", "kg m²"),
    "Izz_origin": ("moment about z through the origin", "kg m²"),
}


def evaluate(stand: str | os.PathLike[str] | Mapping[str, Any] | OnRig, overrides: Mapping[str, Any] | None = None,
             ) -> RigProperties:  # fmt: skip
    """Mass properties of a part on a torsion rig.

    Parameters
    ----------
    stand : path, mapping or OnRig, the description of rod, part, orientations and pendulums
    overrides : mapping, dotted key -> value, put in place of the description's own

    Raises
    ------
    InputError
        One sentence, for anything that does not support a result.

    Notes
    -----
    The stiffness k of the bar follows from the rod, the moment k T^2 / (2 pi)^2 about the bar's line from the period of
    an orientation, and J(a) = Ixx cos^2 a - 2 Ixz sin a cos a + Izz sin^2 a from three of them. The lines pass the
    centre of mass, x sin a + z cos a = d. More of them are adjusted by least squares, weighted by their uncertainties.
    The law of propagation (GUM, 2008) gives the covariance of all results.
    """
    given = load(stand, overrides)
    inputs = Inputs(given)
    moments, centre = problems(given, inputs)
    alarms = given.uncertainty.false_alarms
    asked = [None if one is None else judge(one, alarms) for one in (moments, centre)]
    return _stated(given, inputs, *asked)


def problems(given: OnRig, inputs: Inputs) -> tuple[Moments | None, Centre | None]:
    """What the records of a rig determine.

    Raises
    ------
    InputError
        Too few of them.
    """
    moments, least = Moments(given, inputs), 1 if given.body.shape == "round" else 3
    count = len(moments.equations)
    if 0 < count < least:
        raise InputError(
            f"orientations has {count} with the bar's line in the plane; the planar tensor needs three or more whose "
            "angles differ"
        )
    distances = sum(one.distance is not None for one in given.orientations)
    if distances < 2 and any(one.pivot is not None for one in given.pendulums):
        raise InputError(
            "a pendulum with a pivot needs the centre of mass; give the distances of two orientations or more, or its "
            "length"
        )
    centre = Centre(given, inputs, lines=distances >= 2)
    if not count and not centre.equations:
        raise InputError("orientations are missing; a torsion rig needs a period of torsion in each")
    return moments if count else None, centre if centre.equations else None


def _stated(given: OnRig, inputs: Inputs, moments: Judged | None, centre: Judged | None) -> RigProperties:
    """The results, with the law of propagation through both fits."""
    fits = [None if one is None else one.accepted for one in (moments, centre)]
    y, std = inputs.values, inputs.std
    sizes = [0 if one is None else len(one.values) for one in fits]
    p = np.concatenate([np.empty(0), *(one.values for one in fits if one is not None)])
    influence = np.concatenate([np.zeros((0, y.size)), *(one.influence for one in fits if one is not None)])
    keys = [key for one in fits if one is not None for key in one.of.parameters]
    outputs = _outputs(given, keys)
    derived = [one.key for one in outputs]
    turning = np.array([key == "angle" for key in derived])  # the angle of a line counts modulo 180 degrees

    def results(p: np.ndarray, y: np.ndarray) -> np.ndarray:
        return _results(derived, keys, p, y, inputs)

    shares = []
    for j in np.flatnonzero(std > 0.0):
        shift = np.zeros(y.size)
        shift[j] = 0.5 * std[j]
        step = influence @ shift
        change = results(p + step, y + shift) - results(p - step, y - shift)
        change[turning] = (change[turning] + 90.0) % 180.0 - 90.0
        one = inputs.listed[j]
        shares.append(Share(one.label, one.unit, one.value, one.std, change, one.own, one.dof))
    C = np.array([one.contribution for one in shares]).reshape(len(shares), len(outputs))
    covariance = C.T @ C
    start = 0
    for judged, size in zip((moments, centre), sizes, strict=True):
        if judged is not None and _widened(judged):
            extra = _scatter(judged.accepted, lambda p: results(p, y), p, start)
            covariance = covariance + extra
            label = "scatter of the moments" if isinstance(judged.accepted.of, Moments) else "scatter of the lines"
            shares.append(Share(label, "", np.nan, np.nan, np.sqrt(np.diag(extra)), True, judged.accepted.redundancy))
        start += size
    dof = degrees(shares, np.diag(covariance))
    values = results(p, y)
    at = {key: k for k, key in enumerate(derived)}
    pairs = {(i, j): float(covariance[m, n]) for i, m in at.items() for j, n in at.items()}
    warnings, notes = list[str](), list[str]()
    for judged in (moments, centre):
        if judged is not None:
            warned, noted = of_judged(judged, _widened(judged))
            warnings += warned
            notes += noted
    return RigProperties(
        description=given, moments=moments, centre=centre, outputs=outputs, values=values, covariance=covariance,
        shares=tuple(shares), dof=dof, factor=coverage_factors(given.uncertainty.coverage_factor, dof),
        warnings=(*warnings, *of_body({key: float(values[k]) for key, k in at.items()}, pairs)), notes=tuple(notes),
    )  # fmt: skip


def _widened(judged: Judged) -> bool:
    """Whether the records that are used scatter more than their uncertainties let expect, at 0.5 %."""
    one = judged.accepted
    return one.redundancy > 0 and one.chi2 > float(scipy.stats.chi2.isf(0.005, one.redundancy))


def _scatter(one: Fit, results: Any, p: np.ndarray, start: int) -> np.ndarray:
    """Covariance of the results by a scatter of the records beyond what is stated, (results, results)."""
    own = one.of.inputs.std**2 * one.of.inputs.own
    part = (one.influence * own) @ one.influence.T * (one.scatter**2 - 1.0)
    size = len(one.values)
    h = 1e-4 * np.sqrt(np.maximum(np.diag(part), 1e-300))
    slope = []
    for k in range(size):
        step = np.zeros(p.size)
        step[start + k] = h[k]
        slope.append((results(p + step) - results(p - step)) / (2.0 * h[k]))
    G = np.array(slope).T
    return np.asarray(G @ part @ G.T)


def _outputs(given: OnRig, keys: list[str]) -> tuple[Output, ...]:
    found = ["k", *keys]
    if "Ixz" in keys:
        found += ["I1", "I2", "angle"]
        if "x" in keys and given.body.mass is not None:
            found += ["Ixx_origin", "Ixz_origin", "Izz_origin"]
    return tuple(Output(key, *_LABELS[key]) for key in found)


def _results(derived: list[str], keys: list[str], p: np.ndarray, y: np.ndarray, inputs: Inputs) -> np.ndarray:
    """Values of the outputs by parameters and measured numbers."""
    at = dict(zip(keys, p, strict=True)) | {"k": float(stiffness(y, inputs))}
    if "I1" in derived:
        middle, half = 0.5 * (at["Ixx"] + at["Izz"]), 0.5 * (at["Ixx"] - at["Izz"])
        radius = float(np.hypot(half, at["Ixz"]))
        at |= {"I1": middle + radius, "I2": middle - radius, "angle": math.degrees(0.5 * math.atan2(-at["Ixz"], half))}
    if "Ixx_origin" in derived:
        m, x, z = float(y[inputs.place["body.mass"]]), at["x"], at["z"]
        at |= {
            "Ixx_origin": at["Ixx"] + m * z * z, "Ixz_origin": at["Ixz"] - m * x * z,
            "Izz_origin": at["Izz"] + m * x * x,
        }  # fmt: skip
    return np.array([at[key] for key in derived])
