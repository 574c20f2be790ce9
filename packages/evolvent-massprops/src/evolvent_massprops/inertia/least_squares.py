"""Nonlinear least squares of a `InertiaProblem`: its starts, the search, and checks of what it finds."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from evolvent_base.errors import InputError
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.linear_equations import refuse_mass, six_mode_properties, vertical_properties
from evolvent_massprops.inertia.problem import BODY_NAMES, InertiaProblem, undetermined, value_of
from evolvent_massprops.inertia.stand import MOMENTS, Body, Stand, inertia_defect
from evolvent_massprops.inertia.statics import Y
from evolvent_massprops.inertia.three_frequencies import candidates
from evolvent_massprops.inertia.uncertainty import Candidate, Inertia, with_budget

CENTRE_SHARE, PRODUCT_SHARE = 1e-2, 1e-3  # nudges off a symmetric start, of the unknown's scale


def starts(p: InertiaProblem, stand: Stand, body: Body) -> list[np.ndarray]:
    """Where a search may begin: the given body, off its symmetries, and what the direct ways find."""
    base = p.initial_estimate
    nudge = np.array(
        [CENTRE_SHARE if n in ("ex", "h", "ez") else PRODUCT_SHARE * (n in ("Ixy", "Ixz", "Iyz")) for n in p.unknown]
    )
    result = [base + nudge * p.scale]
    guesses: list[dict[str, float]] = []
    if p.shapes is None:
        return result
    if len(p.frequency) < 3:  # which motions these are is open
        places = [p.unknown.index(name) for name in ("Ixx", "Izz") if name in p.unknown]
        for factors in itertools.product((0.3, 1.0, 3.0), repeat=len(places)):
            result.append(result[0].copy())
            result[-1][places] *= factors
    try:
        if len(p.frequency) == 3 and {"Ixx", "Izz"} <= set(p.unknown):
            vertical = not np.any(p.directions - Y)
            for c in candidates(stand, body, p.frequency):
                guesses.append({"stiffness": c.stiffness, "Ixx": c.Ixx, "Izz": c.Izz, "mass": float(p.base.mass)})
            if vertical:
                guesses.append({"stiffness": float(p.base.stiffness.mean()), **vertical_properties(p)})
        elif len(p.frequency) == 6:
            guesses.append({"stiffness": float(p.base.stiffness.mean()), **six_mode_properties(p)})
    except InputError:
        pass
    for guess in guesses:
        # frequencies keep when mass, moments and stiffness change together
        ratio = 1.0
        if "stiffness" not in p.unknown:
            ratio = float(p.base.stiffness.mean()) / guess["stiffness"]
        elif "mass" not in p.unknown:
            ratio = float(p.base.mass) / guess["mass"]
        for name in ("stiffness", "mass", *MOMENTS):
            if name in guess:
                guess[name] *= ratio
        result.append(np.array([guess.get(n, v) for n, v in zip(p.unknown, result[0], strict=True)]))
    return result


def solve(
    p: InertiaProblem | Combined, method: str, begin: Sequence[np.ndarray], *, inputs: Mapping[str, float] | None = None
) -> Inertia:
    """Least squares of a problem from the best of several starts."""
    scale = p.scale

    def residual(x: np.ndarray) -> np.ndarray:
        try:
            r = p.residual(x * scale)
        except (InputError, np.linalg.LinAlgError):
            return np.full(rows, 1e9)
        return np.where(np.isfinite(r), r, 1e9)

    rows = sum(len(group) for group in p.groups.values())
    given = begin[0]
    begin = sorted(begin, key=lambda values: float(np.sum(residual(values / scale) ** 2)))
    first = begin[0]
    if np.all(residual(first / scale) >= 1e9):
        p.residual(given)  # says why
        raise InputError(
            "the search has no start at which the stand supports the body; give a body nearer to the true one"
        )
    if rows < len(p.unknown):
        raise InputError(_too_little(undetermined(p.jacobian(first), p.unknown, scale)))

    def search(start: np.ndarray) -> Any:
        return scipy.optimize.least_squares(
            residual,
            start / scale,
            jac=lambda x: p.jacobian(x * scale) * scale,
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=200,
        )

    found = search(first)
    if found.status == 0:
        raise InputError("the search for mass and inertia does not converge; give a body nearer to the true one")
    try:
        return finish(p, found.x * scale, method, inputs=inputs)
    except InputError as error:
        for start in begin[1:] if p.has_shapes else []:  # another that fits as well, and that a body has
            other = search(start)
            if other.status > 0 and other.cost < 2.0 * found.cost + rows:
                with contextlib.suppress(InputError):
                    return finish(p, other.x * scale, method, inputs=inputs)
        raise error


def _too_little(reasons: Sequence[str]) -> str:
    """The sentence on unknowns that the data do not determine."""
    return f"the data do not determine the unknowns: {'; '.join(reasons)}"


def finish(
    p: InertiaProblem | Combined,
    values: np.ndarray,
    method: str,
    *,
    inputs: Mapping[str, float] | None = None,
    found: tuple[Candidate, ...] = (),
    warnings: Sequence[str] = (),
) -> Inertia:
    """The result, once it is sure that the data determine it and that a body can have it."""
    warnings = list(warnings)
    if reasons := undetermined(p.jacobian(values), p.unknown, p.scale):
        raise InputError(_too_little(reasons))
    full = p.assigned(values)
    named = {name: float(value_of(full, name)) for name in BODY_NAMES}
    named.update(zip(p.unknown, values.tolist(), strict=True))
    refuse_mass(named["mass"])
    for name in p.unknown:
        if name in ("Ixx", "Iyy", "Izz") and not named[name] > 0.0:
            raise InputError(f"the data give {name} = {named[name]:.6g} kg m2; no body has it, check the data")
        if (name == "stiffness" or name[0] == "k") and not named[name] > 0.0:
            raise InputError(f"the data give {name} = {named[name]:.6g} N/m; no spring has it, check the data")
        if name in ("a", "b") and not named[name] > 0.0:
            raise InputError(f"the data give {name} = {named[name]:.6g} m; no stand has it, check the data")
    r = p.residual(values)
    free = len(r) - p.free_scales - len(values)
    misfit = float(np.sqrt(r @ r / free)) if free > 0 else float("nan")
    if p.weighted and misfit > 3.0:
        warnings.append(f"the model misses the data by {misfit:.1f} of their standard deviations")
    result = Inertia(
        values=named,
        identified=p.unknown,
        covariance=np.full((len(values), len(values)), np.nan),
        method=method,
        problem=p,
        candidates=found,
        misfit=misfit,
    )
    if not method.endswith("linear"):
        result = with_budget(result, inputs or {})
    reason = inertia_defect(result.tensor)
    if reason:
        moments = np.linalg.eigvalsh(result.tensor)
        spread = 3.0 * np.sqrt(np.nansum([result.std.get(n, 0.0) ** 2 for n in ("Ixx", "Iyy", "Izz")]))
        held = [n for n in MOMENTS if n not in p.unknown]
        because = f" with {', '.join(held)} assumed" if held else ""
        if moments[0] <= 0.0 or moments[2] - moments[0] - moments[1] > spread:
            raise InputError(
                f"the data give an inertia tensor{because} that no body has: {reason}; check the data "
                "and the stand's description"
            )
        warnings.append(f"the inertia tensor{because} is at the limit of what a rigid body can have: {reason}")
    return dataclasses.replace(result, warnings=tuple(warnings))
