"""What a page fetches by address: motions, and files to keep."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import FastAPI
from fastapi.responses import FileResponse, Response

from evolvent.view.animation import VIEWER
from evolvent_base.errors import EvolventError
from evolvent_studio.state import Studio, plain
from evolvent_studio.worker import DISPERSED, MODES

if TYPE_CHECKING:
    from collections.abc import Callable


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
        return FileResponse(path, filename=f"{plain(studio.name(ref))}-modes.nc", media_type="application/x-netcdf")

    def run(ref: str) -> Response:
        path = studio.load(ref).path
        return FileResponse(path, filename=f"{plain(studio.name(ref))}.nc", media_type="application/x-netcdf")

    def case(ref: str) -> Response:
        headers = {"Content-Disposition": f'attachment; filename="{plain(studio.name(ref))}.yaml"'}
        return Response(studio.case_text(ref).encode(), media_type="application/yaml", headers=headers)

    def export(ref: str) -> Response:
        found = studio.exports.ready(ref)
        if found is None:
            return _missing("download not found")
        return FileResponse(found.path, filename=found.name, media_type="application/octet-stream")

    def dispersed(ref: str) -> Response:
        path = studio.beside(ref, DISPERSED)
        return FileResponse(path, filename=f"{plain(studio.name(ref))}.csv", media_type="text/csv")

    def report(ref: str) -> Response:
        path = studio.report(ref)
        # a page without its own script; nothing in it may run one
        headers = {"Content-Security-Policy": "sandbox; script-src 'none'"}
        return FileResponse(path, media_type="text/html", headers=headers)

    for answer in (motion, mode, start, modes, run, case, export, dispersed, report):
        app.get(f"/studio/{answer.__name__}", include_in_schema=False)(guarded(answer))

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
