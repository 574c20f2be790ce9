"""A measurement as an answer: the certificate is its page."""

from __future__ import annotations

import dataclasses
import datetime
import json
import os

import numpy as np
import scipy

from evolvent_base import __version__, answer as an, texts
from evolvent_base.errors import InputError
from evolvent_base.showing import Shown
from evolvent_massprops import pictures
from evolvent_massprops.description import OnSprings
from evolvent_massprops.estimates import Estimates, Evaluation, Stated
from evolvent_massprops.rounding import rounded, shown

#: Quantities beside one another in a table of the budget, and its inputs that the screen shows.
_WIDE, _MOST_ROWS = 3, 6
#: Degrees of freedom that count as infinitely many.
_MANY = 1e6
_WITHOUT = "the method gives no uncertainty of the frequencies; use varpro for a certificate"


@dataclasses.dataclass(frozen=True, eq=False)
class MassProperties(Estimates, Shown):
    """The result of a measurement: estimates with what shows them; attributes as of `estimates.Estimates`."""

    named = "mass properties"

    def answer(self) -> an.Answer:
        """Values with their uncertainties, modes, budget, and on the page all that they rest on."""
        return answer_of(self)

    def report(self, path: str | os.PathLike[str], *, date: datetime.datetime | None = None) -> str:
        """Write the certificate.

        Parameters
        ----------
        path : str or path, of the page
        date : the moment that it states; now unless given

        Returns
        -------
        str, the path

        Raises
        ------
        InputError
            If a number has no uncertainty, or the file cannot be written; nothing is written then.
        """
        check(self)
        return super().report(path, date=date)


def check(found: MassProperties) -> None:
    """Refuse a certificate of numbers without uncertainty.

    Raises
    ------
    InputError
    """
    if not found.has_uncertainties:
        method = found.description.identification.method
        raise InputError(
            f"identification.method is {method!r}, which gives no uncertainty; a certificate takes 'varpro'"
        )
    if not (np.all(np.isfinite(found.values)) and np.all(np.isfinite(found.std)) and np.all(found.std > 0.0)):
        raise InputError("the data give no finite uncertainty; no certificate is written")


def answer_of(found: MassProperties) -> an.Answer:
    """Values with their uncertainties, modes, budget, and on the page all that they rest on."""
    given, first, several = found.description, found.evaluations[0], len(found.evaluations) > 1
    facts = [
        (o.key, f"{rounded(value, U)} ± {rounded(U, U)} {o.unit}")
        for o, value, U in zip(found.outputs, found.values, found.expanded, strict=True)
    ]
    assumed = [row for row in first.assumed if not (several and row[0] == "mounting")]
    without = [_WITHOUT] if not found.has_uncertainties else []
    good = an.Section(title="", blocks=["No warning: nothing in the data contradicts the model."], level=an.PAGE,
                      kind="good")  # fmt: skip
    return an.Answer(
        title=given.title or f"Mass properties of {given.body.name}",
        about="Record of a measurement of mass properties",
        facts=facts if found.has_uncertainties else [],
        warnings=[*found.cautions, *without],
        notes=[*found.notes, *(f"assumed: {text}" for what, text in first.assumed if what == "sampling")],
        sections=[
            *([] if found.cautions else [good]),
            _result(found),
            _comparison(found) if several else _modes(found, first),
            an.Section(title="Measurement", level=an.PAGE, blocks=[
                an.Table(heads=(), rows=_facts(found), words=2),
                an.Table(heads=("file", "format", "samples", "rate Hz", "sensors", "SHA-256"), rows=_files(found),
                         words=2, kind="files"),
            ]),
            *([budget(found)] if found.shares else []),
            an.Section(title="Figures", blocks=lambda: _pictures(found), level=an.PAGE),
            *(section for one in found.evaluations for section in _recording(found, one)),
            an.Section(title="Method", blocks=[an.Points(_steps(found), numbered=True)], level=an.PAGE),
            an.Section(title="Assumptions", blocks=[an.Table(heads=(), rows=assumed, words=2)], level=an.PAGE),
            *([an.Section(title="What these data do not determine",
                          blocks=[an.Table(heads=(), rows=first.cannot, words=2)])] if first.cannot else []),
            an.Section(title="", blocks=["Measured by, date", "Checked by, date"], level=an.PAGE, kind="sign"),
            an.Section(title="Numbers in full", blocks=lambda: [an.Listing(_numbers(found))], level=an.PAGE),
            an.Section(title="Description of the stand, as used", blocks=lambda: [an.Listing(_description(found))],
                       level=an.PAGE),
        ],
        made=f"evolvent {__version__}, evolvent identify", style="certificate.css",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ parts


def _facts(found: MassProperties) -> list[tuple[str, str]]:
    """Body, stand and remarks."""
    given = found.description
    kind = f"springs, {given.stand.support}" if isinstance(given, OnSprings) else f"{given.stand.kind} pendulum"
    rows = [("body", given.body.name), ("stand", kind)]
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


def result_table(found: Stated) -> an.Table:
    """Values with their uncertainties."""
    rows = []
    for k, o in enumerate(found.outputs):
        u, U, value = found.std[k], found.expanded[k], found.values[k]
        label = o.label if o.key == o.label else f"{o.key}: {o.label}"
        if not (found.has_uncertainties and u > 0.0):
            rows.append((label, f"{value:.6g}", o.unit, *6 * "-"))
            continue
        dof = "∞" if not found.dof[k] < _MANY else f"{found.dof[k]:.0f}"
        low, high = (rounded(x, U) for x in found.interval[:, k])
        relative = f"{100.0 * u / abs(value):.2g} %" if abs(value) > u else "-"
        rows.append((
            label, rounded(value, u), o.unit, rounded(u, u), relative, dof, f"{found.factor[k]:.2f}", rounded(U, U),
            f"{low} … {high}",
        ))  # fmt: skip
    heads = ("quantity", "value", "unit", "u", "u / value", "dof", "k", "U = k u", "coverage interval")
    return an.Table(heads=heads, rows=rows, kind="result")


def _result(found: MassProperties) -> an.Section:
    """Values with their uncertainties, and their correlation."""
    probability = 2.0 * scipy.stats.norm.cdf(found.description.uncertainty.coverage_factor) - 1.0
    draws = found.description.uncertainty.draws
    interval = "value ± U"
    if found.evaluations[0].draws is not None:
        interval = f"the quantiles of a Monte Carlo of {draws} draws (JCGM 101:2008)"
    blocks: list[an.Block] = [
        result_table(found),
        an.Remark(
            f"u is the standard uncertainty (JCGM 100:2008), dof its degrees of freedom, U the expanded uncertainty "
            f"with a coverage probability of {100.0 * probability:.2f} %; the coverage interval is {interval}."
        ),
    ]  # fmt: skip
    keys = [o.key for o in found.outputs]
    if len(keys) > 1 and found.has_uncertainties:
        R = found.covariance / np.outer(found.std, found.std)
        correlation = [(key, *(f"{x:+.3f}" for x in row)) for key, row in zip(keys, R, strict=True)]
        title = "Correlation of the results"
        blocks.append(an.Table(heads=("", *keys), rows=correlation, title=title, level=an.PAGE))
    return an.Section(title="Result", blocks=blocks)


def _comparison(found: MassProperties) -> an.Section:
    """The recordings beside one another."""
    first = found.evaluations[0]
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
    blocks: list[an.Block] = [an.Table(heads=head, rows=rows), an.Remark(text)]
    return an.Section(title="Recordings", blocks=[*blocks, *([first.why[-1]] if found.combined else [])])


def budget(found: Stated) -> an.Section:
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
        tables.append(an.Table(heads=head, rows=[last, *rows], most=_MOST_ROWS + 1, kind="budget"))
    text = (
        "Contribution of each input: the change of the result for a change of the input by its standard uncertainty "
        "(JCGM 100:2008, 5.1.3), with the second order where it matters (5.1.2, note); for groups the standard "
        "deviation that they give."
    )
    return an.Section(title="Uncertainty budget", blocks=[an.Remark(text), *tables])


def _pictures(found: MassProperties) -> list[an.Block]:
    """Shares of the variance, and the recordings beside one another."""
    values = "Values of the recordings, their mean and its expanded uncertainty."
    several = len(found.evaluations) > 1 and not found.combined
    return [
        *([an.Captioned(pictures.recordings(found), values)] if several else []),
        an.Captioned(pictures.budget(found), "Shares of the variance."),
    ]


def _modes(found: MassProperties, e: Evaluation) -> an.Section:
    """Frequencies and damping of one recording."""
    modal, modes, rows = e.modal, e.modal.modes, []
    for k in range(modes.order):
        wide = modal.widening[k]
        f, u = modes.frequency[k], wide * modes.frequency_std[k]
        label = f"{k + 1}" if k in e.used else f"{k + 1} (left out)"
        decay = shown(modes.decay_rate[k], wide * modes.decay_rate_std[k])
        ratio = shown(modes.damping_ratio[k], wide * modes.damping_ratio_std[k])
        rows.append((f"mode {label}", shown(f, u), shown(f / (2.0 * np.pi), u / (2.0 * np.pi)), decay, ratio))
    table = an.Table(heads=("", "frequency rad/s", "Hz", "decay rate 1/s", "damping ratio"), rows=rows)
    several = len(found.evaluations) > 1
    name = os.path.basename(modal.reading.source.path)
    level = an.PAGE if several else an.EVERYWHERE
    return an.Section(title=f"Recording {name}" if several else "Modes", blocks=[table], level=level)


def _recording(found: MassProperties, e: Evaluation) -> list[an.Section]:
    """Shapes, figures and reasons of one recording on pages; of one among several its modes before."""
    several, name = len(found.evaluations) > 1, os.path.basename(e.modal.reading.source.path)
    more = an.Section(title=f"Fit of {name}", blocks=lambda: _fit(found, e), level=an.PAGE)
    return [_modes(found, e), more] if several else [more]


def _fit(found: MassProperties, e: Evaluation) -> list[an.Block]:
    """Shapes, figures and reasons of one recording."""
    several = len(found.evaluations) > 1
    modal, modes = e.modal, e.modal.modes
    compared = e.model_frequency.size and np.all(np.isfinite(e.model_frequency))
    realness = modes.mode_shapes().realness
    more = []
    for k in range(modes.order):
        wide = modal.widening[k]
        c = int(np.argmax(modes.amplitude[k]))
        label = f"{k + 1}" if k in e.used else f"{k + 1} (left out)"
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
    heads = ["mode", "largest amplitude", "at", "in phase", *(["model rad/s", "MAC"] if compared else [])]
    text = "± is the standard uncertainty. In phase: 1 where all sensors move in phase or against it."
    text += " MAC: agreement of the measured shape with the model's, at most 1." if compared else ""
    text += f" Whiteness of the residual: p = {modal.white:.2g}"
    agree = f"; model and data agree to {e.consistency:.2f} of their deviations"
    text += f"{agree if np.isfinite(e.consistency) else ''}."
    orders = _orders(e)
    why = f"{modes.order} modes, as given in the description."
    if orders:
        why = (
            f"{modes.order} modes: the order of least description length (MDL), confirmed by BIC and by how white the "
            f"residual is; orders with a mode that cannot be distinguished from another or from the noise are excluded."
        )
    tried = ("modes tried", "MDL minus minimum", "BIC minus minimum", "whiteness p", "supported")
    blocks: list[an.Block] = [an.Table(heads=heads, rows=more), text, *(an.Captioned(*one) for one in figures), why]
    blocks += [an.Table(heads=tried, rows=orders)] if orders else []
    blocks += e.why
    if e.candidates:
        rows = [(f"{c.stiffness:.6g}", f"{c.Ixx:.6g}", f"{c.Izz:.6g}", f"{c.mac:.5f}") for c in e.candidates]
        blocks += [
            "All that three frequencies alone would allow for this mass and centre of mass, on the model of a level "
            "body; the mode shapes (MAC) show which:",
            an.Table(heads=("stiffness N/m", "Ixx kg m²", "Izz kg m²", "smallest MAC"), rows=rows, words=0),
        ]
    return blocks


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
