"""A measurement as one HTML page that needs nothing else: no network, no script."""

from __future__ import annotations

import datetime
import json
import os
from typing import Any

import numpy as np
import scipy.stats

from evolvent_base import __version__, pages, texts
from evolvent_base.errors import InputError
from evolvent_base.files import write_file
from evolvent_massprops import pictures
from evolvent_massprops.description import OnSprings
from evolvent_massprops.estimates import Evaluation, MassProperties
from evolvent_massprops.rounding import rounded, shown

#: Quantities beside one another in a table of the budget.
_WIDE = 3


def write(found: MassProperties, path: str | os.PathLike[str], *, date: datetime.datetime | None = None) -> str:
    """Write the certificate; returns its path.

    Parameters
    ----------
    found : MassProperties
    path : str
    date : the moment that it states; now unless given

    Raises
    ------
    InputError
        If a number has no uncertainty, or the file cannot be written; nothing is written then.
    """
    if not found.has_uncertainties:
        method = found.description.identification.method
        raise InputError(
            f"identification.method is {method!r}, which gives no uncertainty; a certificate takes 'varpro'"
        )
    if not (np.all(np.isfinite(found.values)) and np.all(np.isfinite(found.std)) and np.all(found.std > 0.0)):
        raise InputError("the data give no finite uncertainty; no certificate is written")
    page = _page(found, date or datetime.datetime.now().astimezone())
    write_file(path, page)
    return os.fspath(path)


def _page(found: MassProperties, date: datetime.datetime) -> str:
    given = found.description
    first = found.evaluations[0]
    several = len(found.evaluations) > 1
    return pages.render(
        "certificate.html",
        title=given.title or f"Mass properties of {given.body.name}",
        facts=_facts(found, date),
        files=_files(found),
        result=_result(found),
        values=[
            (o.key, rounded(found.values[k], U), rounded(U, U), o.unit)
            for k, (o, U) in enumerate(zip(found.outputs, found.expanded, strict=True))
        ],
        warnings=found.cautions,
        notes=found.notes,
        several=several,
        comparison=_comparison(found) if several else None,
        budget=_budget(found),
        recordings=[_recording(found, e) for e in found.evaluations],
        steps=_steps(found),
        assumed=[row for row in first.assumed if not (several and row[0] == "mounting")],
        cannot=first.cannot,
        numbers=_numbers(found),
        description=_description(found),
    )


# ------------------------------------------------------------------------------------------------ parts


def _facts(found: MassProperties, date: datetime.datetime) -> list[tuple[str, str]]:
    """Body, stand, date, program and remarks."""
    given = found.description
    kind = f"springs, {given.stand.support}" if isinstance(given, OnSprings) else f"{given.stand.kind} pendulum"
    rows = [("body", given.body.name), ("stand", kind), ("date", date.isoformat(sep=" ", timespec="minutes"))]
    rows.append(("evaluated by", f"evolvent {__version__}, evolvent identify"))
    return [*rows, ("remarks", given.remarks)] if given.remarks else rows


def _files(found: MassProperties) -> list[tuple[str, ...]]:
    """Rows of the files of signals."""
    return [
        (
            os.path.basename(s.path),
            s.format,
            str(len(e.modal.reading.time)),
            f"{e.modal.reading.rate:.6g}",
            ", ".join(e.modal.reading.names),
            s.sha256,
        )
        for s, e in zip(found.signals, found.evaluations, strict=True)
    ]


def _result(found: MassProperties) -> dict[str, Any]:
    """Values with their uncertainties, and their correlation."""
    probability = 2.0 * scipy.stats.norm.cdf(found.description.uncertainty.coverage_factor) - 1.0
    rows = []
    for k, o in enumerate(found.outputs):
        u, U = found.std[k], found.expanded[k]
        dof = "∞" if not np.isfinite(found.dof[k]) else f"{found.dof[k]:.0f}"
        low, high = (rounded(x, U) for x in found.interval[:, k])
        relative = f"{100.0 * u / abs(found.values[k]):.2g} %" if abs(found.values[k]) > u else "-"
        rows.append(
            (
                o.label if o.key == o.label else f"{o.key}: {o.label}",
                rounded(found.values[k], u),
                o.unit,
                rounded(u, u),
                relative,
                dof,
                f"{found.factor[k]:.2f}",
                rounded(U, U),
                f"{low} … {high}",
            )
        )
    draws = found.description.uncertainty.draws
    keys = [o.key for o in found.outputs]
    R = found.covariance / np.outer(found.std, found.std)
    return {
        "rows": rows,
        "probability": f"{100.0 * probability:.2f}",
        "interval": "value ± U"
        if found.evaluations[0].draws is None
        else f"the quantiles of a Monte Carlo of {draws} draws (JCGM 101:2008)",
        "names": keys,
        "correlation": [(key, *(f"{x:+.3f}" for x in row)) for key, row in zip(keys, R, strict=True)]
        if len(keys) > 1
        else [],
    }


def _comparison(found: MassProperties) -> dict[str, Any]:
    """The recordings beside one another."""
    head = ["recording", "frequency used rad/s", "decay rate 1/s"]
    head += ["mounting", "misfit"] if found.combined else [f"{o.key} {o.unit}" for o in found.outputs]
    rows = []
    for s, e in zip(found.signals, found.evaluations, strict=True):
        m = e.modal.modes
        w = ", ".join(shown(e.modal.frequency[k], e.modal.frequency_std[k]) for k in e.used)
        d = ", ".join(shown(m.decay_rate[k], e.modal.widening[k] * m.decay_rate_std[k]) for k in e.used)
        values = [shown(v, u) for v, u in zip(e.values, e.std, strict=True)]
        misfit = f"{e.consistency:.2f}" if np.isfinite(e.consistency) else "-"
        own = [dict(e.assumed).get("mounting", "axes as the stand's"), misfit]
        rows.append((os.path.basename(s.path), w, d, *(own if found.combined else values)))
    text = (
        "All recordings are in one estimate. The misfit is the root mean square of a recording's residual over what "
        "noise and inputs let expect of it."
        if found.combined
        else f"The result is the mean over {len(rows)} recordings. Each is listed with its own standard uncertainty. "
        "That of the mean is the larger of their scatter and of what their noise and own inputs predict, combined with "
        "the uncertainty of the inputs that they share."
    )
    picture = None if found.combined else pictures.recordings(found)
    return {"head": head, "rows": rows, "text": text, "picture": picture}


def _budget(found: MassProperties) -> dict[str, Any]:
    """Contributions of the inputs, a few results a table."""
    part = np.array([s.contribution**2 for s in found.shares])
    percent = 100.0 * part / np.maximum(part.sum(axis=0), 1e-300)
    order = np.argsort(-percent.max(axis=1))
    tables = []
    for first in range(0, len(found.outputs), _WIDE):
        columns = range(first, min(first + _WIDE, len(found.outputs)))
        head = ["input", "value", "u", "unit"]
        last = ["all together", "", "", ""]
        for i in columns:
            head += [f"→ {found.outputs[i].key}, {found.outputs[i].unit}", "%"]
            last += [f"{found.std[i]:.2g}", ""]
        rows = []
        for k in order:
            s = found.shares[k]
            row = [s.label, rounded(s.value, s.std) if np.isfinite(s.value) else ""]
            row += [rounded(s.std, s.std) if np.isfinite(s.std) else "", s.unit]
            for i in columns:
                row += [f"{s.contribution[i]:.2g}", f"{percent[k, i]:.1f}"]
            rows.append(row)
        tables.append((head, [*rows, last]))
    return {"tables": tables, "picture": pictures.budget(found)}


def _recording(found: MassProperties, e: Evaluation) -> dict[str, Any]:
    """Modes, shapes, figures and reasons of one recording."""
    several = len(found.evaluations) > 1
    modal, modes = e.modal, e.modal.modes
    compared = e.model_frequency.size and np.all(np.isfinite(e.model_frequency))
    realness = modes.mode_shapes().realness
    rows, more = [], []
    for k in range(modes.order):
        wide = modal.widening[k]
        c = int(np.argmax(modes.amplitude[k]))
        f, u = modes.frequency[k], wide * modes.frequency_std[k]
        label = f"{k + 1}" if k in e.used else f"{k + 1} (left out)"
        poles = (
            (modes.decay_rate[k], wide * modes.decay_rate_std[k]),
            (
                modes.damping_ratio[k],
                wide * modes.damping_ratio_std[k],
            ),
        )
        rows.append((label, shown(f, u), shown(f / (2.0 * np.pi), u / (2.0 * np.pi)), *(shown(*x) for x in poles)))
        row = [label, f"{shown(modes.amplitude[k, c], wide * modes.amplitude_std[k, c])} {modal.reading.unit}"]
        row += [modes.names[c], f"{realness[k]:.3f}"]
        if compared:
            place = e.used.index(k) if k in e.used else -1
            row += [f"{e.model_frequency[place]:.7g}", f"{e.agreement[place]:.5f}"] if place >= 0 else ["", ""]
        more.append(row)
    figures = []
    if not several or len(e.used) > 1:
        figures.append((pictures.poles(e), "Poles with their ellipses of 95 %."))
    if e.model_shapes is not None:
        caption = "Amplitudes at the sensors at the first sample, with 2 u, and the model's."
        figures.append((pictures.shapes(e), caption))
    if e.draws is not None:
        figures.append((pictures.draws(e, found), "Monte Carlo: distributions and coverage intervals."))
    figures.append((pictures.signals(modal), "Signals with the fit, and the residual."))
    figures.append((pictures.spectrum(modal), "Spectra, over the level of white noise of the same power."))
    return {
        "name": os.path.basename(modal.reading.source.path),
        "modes": rows,
        "shapes": more,
        "shapes_head": ["mode", "largest amplitude", "at", "in phase", *(["model rad/s", "MAC"] if compared else [])],
        "compared": compared,
        "white": f"{modal.white:.2g}",
        "consistency": f"{e.consistency:.2f}" if np.isfinite(e.consistency) else "",
        "figures": figures,
        "order": modes.order,
        "orders": _orders(e),
        "why": e.why,
        "candidates": [(f"{c.stiffness:.6g}", f"{c.Ixx:.6g}", f"{c.Izz:.6g}", f"{c.mac:.5f}") for c in e.candidates],
    }


def _orders(e: Evaluation) -> list[tuple[str, ...]]:
    """Rows of the numbers of modes that were tried; none if the description gives the number."""
    found = e.modal.modes.criteria
    if found is None:
        return []
    base_mdl, base_bic = found.mdl.min(), found.bic.min()
    return [
        (f"{m}", f"{mdl - base_mdl:.1f}", f"{bic - base_bic:.1f}", f"{p:.2g}", "yes" if ok else "no")
        for m, mdl, bic, p, ok in zip(*found, strict=True)
    ]


def _steps(found: MassProperties) -> list[str]:
    """The methods, in their order."""
    given = found.description
    steps = [
        "Modes: x(t) = offset + Σ a exp(-δ t) cos(ω t + φ) with common poles at all sensors, maximum likelihood for "
        "white Gaussian noise (variable projection, Golub & Pereyra 1973) from a subspace start (ESPRIT); "
        "intervals from the Fisher information."
    ]
    if isinstance(given, OnSprings):
        steps.append(
            "Mass properties: least squares of frequencies and shapes on the rigid body's linear vibrations about its "
            "rest on the springs, with gravity, tensions and lateral stiffness (after Belyakov 2002)"
            + ("; tare and air move along, and the body as each recording has it mounted." if found.combined else ".")
        )
    elif given.stand.kind == "torsion":
        steps.append("Moment of inertia: I = κ / ω², minus the tare; ω the undamped frequency.")
    elif given.stand.kind == "compound":
        steps.append(
            "Moment of inertia about the pivot: I = M g d / ω², minus the tare, with M and d mass and centre "
            "of mass of "
            "all that swings, ω the undamped frequency at zero amplitude, fitted with the rate's change by the "
            "amplitude; about the body's own centre of mass M d² of the body less."
        )
    else:
        steps.append(
            "Moment of inertia: I = (M g R r / H + κ) / ω², minus the tare, with M all that hangs, R and r the wires' "
            "radii above and below, H the height of the wires, ω the undamped frequency at zero amplitude, fitted with "
            "the rate's change by the amplitude."
        )
    steps.append("Uncertainty: law of propagation (JCGM 100:2008) with the sensitivities of the whole evaluation.")
    return steps


def _numbers(found: MassProperties) -> str:
    """Values and covariance with all digits, one JSON value a line."""
    numbers = {
        "outputs": [o.key for o in found.outputs],
        "units": [o.unit for o in found.outputs],
        "values": found.values.tolist(),
        "covariance": found.covariance.tolist(),
        "coverage_factor": found.factor.tolist(),
        "interval": found.interval.tolist(),
        "version": __version__,
        "sha256": {os.path.basename(s.path): s.sha256 for s in found.signals},
    }
    return "\n".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in numbers.items())


def _description(found: MassProperties) -> str:
    """The description of the stand as YAML."""
    content = found.description.model_dump(mode="json", exclude_none=True)
    return texts.dump(content)
