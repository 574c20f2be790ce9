"""A run as one HTML page that needs nothing else: no network, no file beside it."""

from __future__ import annotations

import base64
import dataclasses
import datetime
import html
import io
import json
import pathlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolvent import animation, cases, plots
from evolvent.exports.pictures import pictures
from evolvent.exports.request import counted
from evolvent.results import WELL, made_with, statistics_of, unfinished, writing

if TYPE_CHECKING:
    from evolvent.figures import Figure

#: Largest figure that is kept as lines; a larger one is kept as points, bytes.
_LARGEST_SVG = 250_000
#: Stills that stand for the animation on paper.
_STILLS = 3
#: Units of what is conserved, or accounted for.
_ACCOUNTS = {"J": "Energy", "kg m2 s-1": "Angular momentum", "kg m s-1": "Linear momentum"}
_STYLE = pathlib.Path(__file__).with_name("report.css")


def write(run: Any, path: str, *, date: datetime.datetime | None = None) -> int:
    """Write the report of a run; returns its size, bytes.

    Parameters
    ----------
    run : xarray.Dataset
    path : str
    date : the moment that it states; now unless given

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = _page(run, date or datetime.datetime.now(datetime.UTC)).encode()
    with writing(path) as temporary:
        pathlib.Path(temporary).write_bytes(page)
    return len(page)


def _page(run: Any, date: datetime.datetime) -> str:
    module = cases.presenter(run)
    figures = module.figures(run)
    title = _title(run)
    sections = [
        ("results", "Results", _results(run, module)),
        ("animation", "Animation", _animation(run)),
        ("figures", "Figures", "".join(figure_html(f) for f in figures)),
        ("balances", "Balances", _balances(run)),
        ("case", "Case", _case(run)),
        ("provenance", "Provenance", _provenance(run, date)),
    ]
    held = [(key, name, content) for key, name, content in sections if content]
    links = " ".join(f'<a href="#{key}">{name}</a>' for key, name, _ in held)
    body = "".join(f'<section id="{key}"><h2>{name}</h2>{content}</section>\n' for key, name, content in held)
    return plain_page(title, f"{_head(run, title)}{_notes(run)}<nav>{links}</nav>\n{body}")


def plain_page(title: str, body: str) -> str:
    """A page with the report's style around `body`."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{_STYLE.read_text(encoding='utf-8')}</style></head>\n<body><main>\n"
        f"{body}</main></body></html>\n"
    )


# ------------------------------------------------------------------------------------------------ parts


def escaped(value: object) -> str:
    """Text for a page."""
    return html.escape(str(value))


def table(rows: Iterable[Sequence[str]], head: Sequence[str] = (), *, words: int = 1) -> str:
    """A table; the first `words` columns hold words, the others numbers."""
    top = "".join(f"<th{'' if k < words else ' class=n'}>{escaped(c)}</th>" for k, c in enumerate(head))
    body = "".join(
        "<tr>"
        + "".join(f"<td{'' if k < words else ' class=n'}>{escaped(c)}</td>" for k, c in enumerate(row))
        + "</tr>\n"
        for row in rows
    )
    return f"<table>{f'<thead><tr>{top}</tr></thead>' if head else ''}<tbody>{body}</tbody></table>"


def _title(run: Any) -> str:
    motion = cases.presenter(run).motion(run)
    system: str = run.attrs["system"].replace("-", " ").capitalize()
    if motion is None or motion.title.startswith(system):
        return system
    return f"{system}: {motion.title[:1].lower()}{motion.title[1:]}"


def _head(run: Any, title: str) -> str:
    attrs = run.attrs
    good = attrs["status"] in WELL
    end = float(run.time.values[-1])
    facts = [
        f'<span class="status {"good" if good else "bad"}">{escaped(attrs["status"])}</span>',
        f"{counted(run.sizes['time'], 'sample')} to {end:.6g} s",
        escaped(attrs["solver"]),
        escaped(_day(attrs["date"]) if "date" in attrs else "date not recorded"),
    ]
    listed = " &middot; ".join(facts)
    return f'<header><p class="kind">Report of a simulation</p><h1>{escaped(title)}</h1><p>{listed}</p></header>\n'


def _day(date: str) -> str:
    try:
        moment = datetime.datetime.fromisoformat(date)
        return f"{moment.day} {moment:%B %Y, %H:%M %Z}".strip(" ,")
    except ValueError:
        return date


def _notes(run: Any) -> str:
    """What a reader must know first: that the run is not whole, and its warnings."""
    attrs, parts = run.attrs, []
    if unfinished(run):
        what = {"failed": "This run failed", "interrupted": "This run was interrupted"}[attrs["status"]]
        message = attrs["message"].removeprefix(attrs["status"]).strip(" :")
        parts.append(
            f'<section class="failure"><h2>{what}</h2><p>{escaped(message)}</p><p>What follows covers the run up to '
            f"{float(run.time.values[-1]):.6g} s and is no result of the whole case.</p></section>\n"
        )
    elif attrs["status"] != "success":
        parts.append(f'<section class="note"><p>{escaped(attrs["message"])}</p></section>\n')
    if attrs.get("warning"):
        parts.append(f'<section class="warning"><h2>Warning</h2><p>{escaped(attrs["warning"])}</p></section>\n')
    if attrs.get("latches"):
        parts.append(f'<section class="note"><p>Latches: {escaped(attrs["latches"])}.</p></section>\n')
    laws = json.loads(attrs["laws"])
    if laws:
        named = ", ".join(f"{key}: {law}" for key, law in laws.items())
        said = f"Laws of the user took part that the case cannot hold: {escaped(named)}."
        parts.append(f'<section class="note"><p>{said}</p></section>\n')
    return "".join(parts)


def _results(run: Any, module: Any) -> str:
    rows = [(n.label, n.value) for n in module.numbers(run) if n.label != "warning"]
    return table(rows, words=2).replace("<table>", '<table class="results">')


def _image(content: bytes, kind: str, caption: str) -> str:
    source = f"data:image/{kind};base64,{base64.b64encode(content).decode()}"
    return f'<img src="{source}" alt="{escaped(caption)}">'


def figure_html(figure: Figure) -> str:
    """A figure with its title."""
    content, kind = plots.picture(figure, "svg", title=False), "svg+xml"
    if len(content) > _LARGEST_SVG:
        points = plots.picture(figure, "png", dpi=150, title=False)
        content, kind = (points, "png") if len(points) < len(content) else (content, kind)
    return f"<figure><h3>{escaped(figure.title)}</h3>{_image(content, kind, figure.title)}</figure>"


def _animation(run: Any) -> str:
    """The page of the animation in a frame; on paper, stills."""
    motion = animation.of_run(run)
    if motion is None:
        return ""
    from PIL import Image

    page = animation.page(motion, playing=False)[0].decode()
    # a frame may run its script, and nothing else: no network, no access to this page
    inside = html.escape(page, quote=True)
    title = escaped(motion.title)
    moving = f'<iframe sandbox="allow-scripts" allow="fullscreen" title="{title}" srcdoc="{inside}"></iframe>'
    stills = []
    plain = dataclasses.replace(motion, title="")
    times = np.linspace(motion.time[0], motion.time[-1], _STILLS + 1)[1:]
    for picture in pictures(plain, times, size=(360, 270), inertial=True):
        content = io.BytesIO()
        Image.fromarray(picture[..., :3]).quantize(64, dither=Image.Dither.NONE).save(
            content, format="PNG", optimize=True
        )
        stills.append(_image(content.getvalue(), "png", motion.title))
    return f'{moving}<div class="stills">{"".join(stills)}</div>'


def _balances(run: Any) -> str:
    """How well the accounts close, and what they hold."""
    time = run.time.values
    defects: list[tuple[str, ...]] = []
    kept: dict[str, list[tuple[str, ...]]] = {}
    for name, variable in run.data_vars.items():
        if variable.dims[:1] != ("time",) or variable.dtype.kind != "f" or np.isnan(variable.values).all():
            continue
        values = variable.values.reshape(time.size, -1)
        if str(name).endswith(("_balance", "_defect")) and values.shape[1] == 1:
            k = int(np.nanargmax(np.abs(values[:, 0])))
            unit = variable.attrs.get("units", "1")
            long_name = variable.attrs.get("long_name", str(name)) + ("" if unit == "1" else f", {unit}")
            defects.append((long_name, f"{values[k, 0]:.2e}", f"{time[k]:.5g} s", f"{values[-1, 0]:.2e}"))
        elif variable.attrs.get("units") in _ACCOUNTS and values.shape[1] <= 12:
            kept.setdefault(variable.attrs["units"], []).extend(_account(run, str(name)))
    parts = []
    if defects:
        parts.append(table(defects, ("account", "largest defect", "at", "at the end")))
    for unit, rows in kept.items():
        shown = unit.replace("m2", "m²").replace("s-1", "s⁻¹")
        head = (f"{_ACCOUNTS[unit].lower()}, {shown}", "at the start", "least", "largest", "at the end")
        parts.append(f"<h3>{_ACCOUNTS[unit]}</h3>" + table(rows, head))
    return "".join(parts)


def _account(run: Any, name: str) -> list[tuple[str, ...]]:
    """Rows of one variable: what it is, first, least, largest, last; none for what is zero throughout."""
    variable = run[name]
    values = variable.values.reshape(variable.sizes["time"], -1)
    places = [""]
    for dimension in variable.dims[1:]:
        listed = run[dimension].values if dimension in run.coords else np.arange(1, run.sizes[dimension] + 1)
        places = [f"{before}, {x}".lstrip(", ") for before in places for x in listed]
    rows = []
    for k, place in enumerate(places):
        one = values[:, k]
        if np.any(np.nan_to_num(one)):
            what = variable.attrs.get("long_name", name)
            numbers = (one[0], np.nanmin(one), np.nanmax(one), one[-1])
            rows.append((f"{what}: {place}" if place else what, *(f"{x + 0.0:.4g}" for x in numbers)))
    return rows


def _case(run: Any) -> str:
    said = "Kept in a file, this case can be run again: <code>evolvent run case.yaml</code>."
    return f"<p>{said}</p><pre>{escaped(run.attrs['case'])}</pre>"


def _count(value: float) -> str:
    """Whole numbers with all their digits."""
    return f"{int(value):,}" if float(value).is_integer() and abs(value) < 1e15 else f"{value:.6g}"


def _provenance(run: Any, date: datetime.datetime) -> str:
    attrs = run.attrs
    statistics = {k: v for k, v in statistics_of(run).items() if v is not None}
    account = ", ".join(f"{name.replace('_', ' ')} {_count(value)}" for name, value in statistics.items())
    rows = [
        ("run on", _day(attrs["date"]) if "date" in attrs else "not recorded in the file"),
        ("run with", attrs.get("made_with", f"evolvent {attrs['version']}; the rest is not recorded in the file")),
        ("solver", f"{attrs['solver']}: {account}" if account else attrs["solver"]),
        ("time of the solve", f"{attrs['wall_time_s']:.3g} s, and {attrs['compile_time_s']:.3g} s to compile or load"),
        ("report written on", _day(date.isoformat())),
        ("report written with", made_with()),
    ]
    return table(rows, words=2).replace("<table>", '<table class="results">')
