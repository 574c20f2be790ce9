"""What a page fetches by address: motions, and files to keep."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import FastAPI
from fastapi.responses import FileResponse, Response

from evolvent.base.errors import EvolventError
from evolvent.studio.state import Studio, plain
from evolvent.studio.worker import CERTIFICATE, MODES
from evolvent.view.animation import VIEWER

if TYPE_CHECKING:
    from collections.abc import Callable


def install(app: FastAPI, studio: Studio) -> None:
    """Add the addresses to an application."""

    def guarded(answer: Callable[[str], Response]) -> Callable[[str], Response]:
        def route(ref: str) -> Response:
            try:
                return answer(ref)
            except EvolventError as error:
                return Response(str(error), status_code=404, media_type="text/plain")

        return route

    def motion(ref: str) -> Response:
        content = studio.motion(ref)
        if content is None:
            return Response("this run holds too little to move", status_code=404, media_type="text/plain")
        return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})

    def mode(ref: str) -> Response:
        content = studio.mode(ref)
        if content is None:
            return Response("mode not found", status_code=404, media_type="text/plain")
        return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})

    def modes(ref: str) -> Response:
        path = studio.path(ref)
        if not ref.startswith("job:") or path.name != MODES:
            return Response("modes not found", status_code=404, media_type="text/plain")
        return FileResponse(path, filename=f"{plain(studio.name(ref))}-modes.nc", media_type="application/x-netcdf")

    def start(ref: str) -> Response:
        content = studio.start_of(ref)
        if content is None:
            return Response("initial state not found", status_code=404, media_type="text/plain")
        return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})

    def run(ref: str) -> Response:
        path = studio.load(ref).path
        return FileResponse(path, filename=f"{plain(studio.name(ref))}.nc", media_type="application/x-netcdf")

    def case(ref: str) -> Response:
        return _named(studio.case_text(ref).encode(), f"{plain(studio.name(ref))}.yaml", "application/yaml")

    def export(ref: str) -> Response:
        found = studio.exports.ready(ref)
        if found is None:
            return Response("download not found", status_code=404, media_type="text/plain")
        return FileResponse(found.path, filename=found.name, media_type="application/octet-stream")

    def certificate(ref: str) -> Response:
        path = studio.path(ref)
        if not ref.startswith("job:") or path.name != CERTIFICATE:
            return Response("certificate not found", status_code=404, media_type="text/plain")
        # a page without its own script; nothing in it may run one
        headers = {"Content-Security-Policy": "sandbox; script-src 'none'"}
        return FileResponse(path, media_type="text/html", headers=headers)

    for name, answer in (("motion", motion), ("start", start), ("run", run), ("case", case), ("export", export)):
        app.get(f"/studio/{name}", include_in_schema=False)(guarded(answer))
    for name, answer in (("mode", mode), ("modes", modes)):
        app.get(f"/studio/{name}", include_in_schema=False)(guarded(answer))
    app.get("/studio/certificate", include_in_schema=False)(guarded(certificate))

    @app.get("/studio/viewer/{name}", include_in_schema=False)
    def viewer(name: str) -> Response:
        path = next((path for path in VIEWER if path.name == name), None)
        if path is None:
            return Response("there is no such file", status_code=404, media_type="text/plain")
        return FileResponse(path, media_type="text/javascript", headers={"Cache-Control": "no-cache"})


def _named(content: bytes, name: str, kind: str) -> Response:
    return Response(content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'})
