"""What a page fetches by address: motions, and files to keep."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import FastAPI
from fastapi.responses import FileResponse, Response

from evolvent.view.animation import VIEWER
from evolvent_base.errors import EvolventError
from evolvent_studio.jobkinds import MODES
from evolvent_studio.state import Studio, plain

if TYPE_CHECKING:
    from collections.abc import Callable

#: What asks in a page whether the browser is dark, and what stands there where the studio is so, or is not.
_DARK = b"@media screen and (prefers-color-scheme: dark)"
_LOOKS = {"dark": b"@media screen", "light": b"@media not all"}
#: What a report may do, which may be of a folder from elsewhere: show its own pictures; it runs and loads nothing.
_REPORT = "sandbox; default-src 'none'; img-src data:; font-src data:; style-src 'unsafe-inline'"
#: Types of files that are kept beside results, by their endings.
_TYPES = {".csv": "text/csv", ".nc": "application/x-netcdf"}


def install(app: FastAPI, studio: Studio) -> None:
    """Add the addresses to an application."""

    def guarded(answer: Callable[[str], Response]) -> Callable[[str], Response]:
        def route(ref: str) -> Response:
            try:
                return answer(ref)
            except EvolventError as error:
                return _missing(str(error))

        return route

    def motion(ref: str) -> Response:
        return _packed(studio.motion(ref), "this run holds too little to move")

    def mode(ref: str) -> Response:
        return _packed(studio.mode(ref), "mode not found")

    def start(ref: str) -> Response:
        return _packed(studio.start_of(ref), "initial state not found")

    def modes(ref: str) -> Response:
        path = studio.path(ref)
        if not ref.startswith("job:") or path.name != MODES:
            return _missing("modes not found")
        return FileResponse(path, filename=f"{plain(studio.name(ref))}-modes.nc", media_type=_TYPES[path.suffix])

    def run(ref: str) -> Response:
        path = studio.load(ref).path
        return FileResponse(path, filename=f"{plain(studio.name(ref))}.nc", media_type=_TYPES[".nc"])

    def case(ref: str) -> Response:
        headers = {"Content-Disposition": f'attachment; filename="{plain(studio.name(ref))}.yaml"'}
        return Response(studio.case_text(ref).encode(), media_type="application/yaml", headers=headers)

    def export(ref: str) -> Response:
        found = studio.exports.ready(ref)
        if found is None:
            return _missing("download not found")
        return FileResponse(found.path, filename=found.name, media_type="application/octet-stream")

    def kept(ref: str) -> Response:
        of, _, name = ref.rpartition(":")
        if not of.startswith("job:") or name not in studio.jobs.get(of.removeprefix("job:")).sort.kept.values():
            return _missing("download not found")
        path = studio.beside(of, name)
        return FileResponse(path, filename=f"{plain(studio.name(of))}-{name}", media_type=_TYPES[path.suffix])

    for answer in (motion, mode, start, modes, run, case, export, kept):
        app.get(f"/studio/{answer.__name__}", include_in_schema=False)(guarded(answer))

    @app.get("/studio/report", include_in_schema=False)
    def report(ref: str, look: str = "") -> Response:
        try:
            path = studio.report(ref)
        except EvolventError as error:
            return _missing(str(error))
        headers = {"Content-Security-Policy": _REPORT}
        if look not in _LOOKS:
            return FileResponse(path, media_type="text/html", headers=headers)
        content = path.read_bytes().replace(_DARK, _LOOKS[look])
        return Response(content, media_type="text/html", headers=headers)

    @app.get("/studio/viewer/{name}", include_in_schema=False)
    def viewer(name: str) -> Response:
        path = next((path for path in VIEWER if path.name == name), None)
        if path is None:
            return _missing("there is no such file")
        return FileResponse(path, media_type="text/javascript", headers={"Cache-Control": "no-cache"})


def _missing(reason: str) -> Response:
    return Response(reason, status_code=404, media_type="text/plain")


def _packed(content: bytes | None, missing: str) -> Response:
    """A packed motion."""
    if content is None:
        return _missing(missing)
    return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})
