"""A measurement as one HTML page that needs nothing else: no network, no script."""

from __future__ import annotations

import datetime
import html
import json
import os
import pathlib
from collections.abc import Iterable, Sequence

import numpy as np
import scipy.stats

from evolvent import __version__, cases
from evolvent.errors import InputError
from evolvent.massprops import pictures
from evolvent.massprops.description import OnSprings
from evolvent.massprops.estimates import Evaluation, MassProperties
from evolvent.massprops.rounding import rounded, shown
from evolvent.results import writing

#: Quantities beside one another in a table of the budget.
_WIDE = 3
_SIGNATURES = '<section class="sign"><p>Measured by, date</p><p>Checked by, date</p></section>'
_STYLE = pathlib.Path(__file__).with_name("certificate.css")


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
    if not found.certain:
        method = found.description.identification.method
        raise InputError(
            f"identification.method is {method!r}, which gives no uncertainty; a certificate takes 'varpro'"
        )
    if not (np.all(np.isfinite(found.values)) and np.all(np.isfinite(found.std)) and np.all(found.std > 0.0)):
        raise InputError("the data give no finite uncertainty; nothing is certified")
    page = _page(found, date or datetime.datetime.now().astimezone())
    with writing(path) as temporary:
        pathlib.Path(temporary).write_text(page, encoding="utf-8")
    return os.fspath(path)


def _page(found: MassProperties, date: datetime.datetime) -> str:
    given = found.description
    title = given.title or f"Mass properties of {given.body.name}"
    several = len(found.evaluations) > 1
    sections = [
        _head(found, title),
        _result(found),
        _warnings(found),
        _measurement(found, date),
        _recordings(found) if several else "",
        _budget(found),
        *(_recording(found, e) for e in found.evaluations),
        _how(found),
        _assumptions(found.evaluations[0]),
        _SIGNATURES,
        _description(found),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_text(title)}</title><style>{_STYLE.read_text(encoding='utf-8')}</style></head>\n<body><main>\n"
        + "\n".join(s for s in sections if s)
        + "\n</main></body></html>\n"
    )


# ------------------------------------------------------------------------------------------------ parts


def _text(value: object) -> str:
    return html.escape(str(value))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], *, text: int = 1) -> str:
    """A table; the first `text` columns hold words, the others numbers."""
    cells = "".join(f"<th{'' if k < text else ' class=n'}>{_text(c)}</th>" for k, c in enumerate(head))
    body = "".join(
        "<tr>" + "".join(f"<td{'' if k < text else ' class=n'}>{_text(c)}</td>" for k, c in enumerate(row)) + "</tr>\n"
        for row in rows
    )
    top = f"<thead><tr>{cells}</tr></thead>" if any(head) else ""
    return f"<table>{top}<tbody>{body}</tbody></table>"


def _figure(image: str, caption: str) -> str:
    return f"<figure>{image}<figcaption>{_text(caption)}</figcaption></figure>"


def _head(found: MassProperties, title: str) -> str:
    """The title and the values with their expanded uncertainties."""
    values = "".join(
        f"<dt>{_text(o.key)}</dt><dd>{rounded(found.values[k], found.expanded[k])} ± "
        f"{rounded(found.expanded[k], found.expanded[k])} {_text(o.unit)}</dd>"
        for k, o in enumerate(found.outputs)
    )
    return (
        f'<header><p class="kind">Record of a measurement of mass properties</p><h1>{_text(title)}</h1>'
        f'<dl class="values">{values}</dl></header>'
    )


def _measurement(found: MassProperties, date: datetime.datetime) -> str:
    """What was measured, when, and the files."""
    given = found.description
    kind = f"springs, {given.stand.support}" if isinstance(given, OnSprings) else f"{given.stand.kind} pendulum"
    rows = [("body", given.body.name), ("stand", kind), ("date", date.isoformat(sep=" ", timespec="minutes"))]
    rows.append(("evaluated by", f"evolvent {__version__}, evolvent identify"))
    if given.remarks:
        rows.append(("remarks", given.remarks))
    files = _table(
        ("file", "format", "samples", "rate Hz", "sensors", "SHA-256"),
        [
            (
                os.path.basename(s.path),
                s.format,
                str(len(e.modal.reading.time)),
                f"{e.modal.reading.rate:.6g}",
                ", ".join(e.modal.reading.names),
                s.sha256,
            )
            for s, e in zip(found.signals, found.evaluations, strict=True)
        ],
        text=2,
    ).replace("<table>", '<table class="files">')
    facts = "".join(f"<dt>{_text(k)}</dt><dd>{_text(v)}</dd>" for k, v in rows)
    return f"<section><h2>Measurement</h2><dl>{facts}</dl>{files}</section>"


def _result(found: MassProperties) -> str:
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
    head = ("quantity", "value", "unit", "u", "u / value", "dof", "k", "U = k u", "coverage interval")
    parts = ["<section><h2>Result</h2>", _table(head, rows).replace("<table>", '<table class="result">')]
    how = (
        f"the quantiles of a Monte Carlo of {found.description.uncertainty.draws} draws (JCGM 101:2008)"
        if found.evaluations[0].draws is not None
        else "value ± U"
    )
    parts.append(
        f"<p>u is the standard uncertainty (JCGM 100:2008), dof its degrees of freedom, U the expanded "
        f"uncertainty with a coverage probability of {100.0 * probability:.2f} %; the coverage interval is {how}.</p>"
    )
    if len(found.outputs) > 1:
        R = found.covariance / np.outer(found.std, found.std)
        parts.append("<h3>Correlation of the results</h3>")
        keys = [o.key for o in found.outputs]
        parts.append(
            _table(("", *keys), [(key, *(f"{x:+.3f}" for x in row)) for key, row in zip(keys, R, strict=True)])
        )
    return "\n".join([*parts, "</section>"])


def _warnings(found: MassProperties) -> str:
    parts = []
    if not found.cautions:
        parts.append('<section class="good"><p>No warning: nothing in the data speaks against the model.</p></section>')
    for kind, title, sentences in (
        ("warning", "Warnings", found.cautions), ("note", "Notes on the recordings", found.notes),
    ):  # fmt: skip
        listed = "".join(f"<li>{_text(sentence)}</li>" for sentence in sentences)
        parts += [f'<section class="{kind}"><h2>{title}</h2><ul>{listed}</ul></section>'] if sentences else []
    return "\n".join(parts)


def _recordings(found: MassProperties) -> str:
    head = ["recording", "frequency used rad/s", "decay rate 1/s"]
    head += [f"{o.key} {o.unit}" for o in found.outputs]
    rows = []
    for s, e in zip(found.signals, found.evaluations, strict=True):
        m = e.modal.modes
        w = ", ".join(shown(e.modal.frequency[k], e.modal.frequency_std[k]) for k in e.used)
        d = ", ".join(shown(m.decay_rate[k], e.modal.widening[k] * m.decay_rate_std[k]) for k in e.used)
        rows.append((os.path.basename(s.path), w, d, *(shown(v, u) for v, u in zip(e.values, e.std, strict=True))))
    n = len(found.evaluations)
    said = (
        f"The result is the mean over {n} recordings. Each stands here with its own standard uncertainty; that of the "
        "mean takes the larger of their scatter and of what their noise and own inputs let expect, and what they share."
    )
    figure = _figure(pictures.recordings(found), "Values of the recordings, their mean and its expanded uncertainty.")
    return f"<section><h2>Recordings</h2><p>{said}</p>{_table(head, rows)}{figure}</section>"


def _budget(found: MassProperties) -> str:
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
        tables.append(f'<div class="wide">{_table(head, [*rows, last])}</div>')
    figure = _figure(pictures.budget(found), "Shares of the variance.")
    note = (
        "<p>Contribution of each input: the change of the result for a change of the input by its standard uncertainty "
        "(JCGM 100:2008, 5.1.3), with the second order where it counts (5.1.2, note); "
        "for groups the standard deviation that they give.</p>"
    )
    return f"<section><h2>Uncertainty budget</h2>{note}{''.join(tables)}{figure}</section>"


def _recording(found: MassProperties, e: Evaluation) -> str:
    several = len(found.evaluations) > 1
    modal, modes = e.modal, e.modal.modes
    name = os.path.basename(modal.reading.source.path)
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
    parts = [f"<section><h2>{'Recording ' + _text(name) if several else 'Modes'}</h2>"]
    parts.append(_table(("mode", "frequency rad/s", "Hz", "decay rate 1/s", "damping ratio"), rows))
    head = ["mode", "largest amplitude", "at", "in phase", *(["model rad/s", "MAC"] if compared else [])]
    parts.append(_table(head, more))
    parts.append(
        "<p>± is the standard uncertainty. In phase: 1 where all sensors move in phase or against it. "
        + ("MAC: agreement of the measured shape with the model's, at most 1. " if compared else "")
        + f"Whiteness of the residual: p = {modal.white:.2g}"
        + (f"; model and data agree to {e.consistency:.2f} of their deviations" if np.isfinite(e.consistency) else "")
        + ".</p>"
    )
    if not several or len(e.used) > 1:
        parts.append(_figure(pictures.poles(e), "Poles with their ellipses of 95 %."))
    if e.model_shapes is not None:
        parts.append(
            _figure(pictures.shapes(e), "Amplitudes at the sensors at the first sample, with 2 u, and the model's.")
        )
    if e.draws is not None:
        parts.append(_figure(pictures.draws(e, found), "Monte Carlo: distributions and coverage intervals."))
    parts.append(_figure(pictures.signals(modal), "Signals with the fit, and what it leaves."))
    parts.append(_figure(pictures.spectrum(modal), "Spectra, over the level of white noise of the same power."))
    parts.append(_choice(e))
    return "\n".join([*parts, "</section>"])


def _choice(e: Evaluation) -> str:
    """Why this order, these modes and this solution."""
    parts = ["<h3>Why these modes and this solution</h3>"]
    found = e.modal.modes.criteria
    if found is not None:
        parts.append(
            f"<p>{e.modal.modes.order} modes: the order of least description length (MDL), confirmed by BIC and by how "
            "white the residual is; orders with a mode that cannot be told from another or from the noise are out.</p>"
        )
        base_mdl, base_bic = found.mdl.min(), found.bic.min()
        rows = [
            (f"{m}", f"{mdl - base_mdl:.1f}", f"{bic - base_bic:.1f}", f"{p:.2g}", "yes" if ok else "no")
            for m, mdl, bic, p, ok in zip(*found, strict=True)
        ]
        parts.append(_table(("modes tried", "MDL - least", "BIC - least", "whiteness p", "supported"), rows))
    else:
        parts.append(f"<p>{e.modal.modes.order} modes, as the description asks.</p>")
    parts += [f"<p>{_text(why)}</p>" for why in e.why]
    if e.candidates:
        parts.append(
            "<p>All that three frequencies alone would allow for this mass and centre of mass, on the model of a level "
            "body; the mode shapes (MAC) tell which:</p>"
        )
        pairs = [(f"{c.stiffness:.6g}", f"{c.Ixx:.6g}", f"{c.Izz:.6g}", f"{c.mac:.5f}") for c in e.candidates]
        parts.append(_table(("stiffness N/m", "Ixx kg m²", "Izz kg m²", "least MAC"), pairs, text=0))
    return "\n".join(parts)


def _how(found: MassProperties) -> str:
    given = found.description
    steps = [
        "Modes: x(t) = offset + Σ a exp(-δ t) cos(ω t + φ) with common poles at all sensors, maximum likelihood for "
        "white Gaussian noise (variable projection, Golub & Pereyra 1973) from a subspace start (ESPRIT); "
        "intervals from the Fisher information."
    ]
    if isinstance(given, OnSprings):
        steps.append(
            "Mass properties: least squares of frequencies and shapes on the rigid body's linear vibrations about its "
            "rest on the springs, with gravity, tensions and lateral stiffness (after Belyakov 2002)."
        )
    elif given.stand.kind == "torsion":
        steps.append("Moment of inertia: I = κ / ω², less the tare; ω the undamped frequency.")
    elif given.stand.kind == "compound":
        steps.append(
            "Moment of inertia about the pivot: I = M g d / ω², less the tare, with M and d mass and centre of mass of "
            "all that swings, ω the undamped frequency of a small swing, that of a finite one corrected by the "
            "elliptic integral; about the body's own centre of mass M d² of the body less."
        )
    else:
        steps.append(
            "Moment of inertia: I = (M g R r / H + κ) / ω², less the tare, with M all that hangs, R and r the wires' "
            "radii above and below, H the height of the wires, ω the undamped frequency; at a finite amplitude the "
            "exact period."
        )
    steps.append("Uncertainty: law of propagation (JCGM 100:2008) with the sensitivities of the whole evaluation.")
    return "<section><h2>How it was done</h2><ol>" + "".join(f"<li>{_text(s)}</li>" for s in steps) + "</ol></section>"


def _assumptions(e: Evaluation) -> str:
    parts = ["<section><h2>What was taken as known</h2>", _table(("", ""), e.assumed, text=2)]
    if e.cannot:
        parts += ["<h2>What these data cannot tell</h2>", _table(("", ""), e.cannot, text=2)]
    return "\n".join([*parts, "</section>"])


def _description(found: MassProperties) -> str:
    content = found.description.model_dump(mode="json", exclude_none=True)
    source = cases.dump(content)
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
    return (
        "<section><h2>Numbers in full</h2><pre>"
        + _text("\n".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in numbers.items()))
        + "</pre><h2>Description of the stand, as used</h2><pre>"
        + _text(source)
        + "</pre></section>"
    )
