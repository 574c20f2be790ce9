"""What a page fetches by address: motions, and files to keep."""

from __future__ import annotations

import io
import pathlib
import re
import tempfile
import zipfile
from typing import TYPE_CHECKING

from fastapi import FastAPI
from fastapi.responses import FileResponse, Response

from evolvent.animation import VIEWER
from evolvent.errors import EvolventError
from evolvent.studio.state import Studio

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
            return Response("there is no such mode", status_code=404, media_type="text/plain")
        return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})

    def modes(ref: str) -> Response:
        path = studio.path(ref)
        return FileResponse(path, filename=f"{_plain(studio.name(ref))}-modes.nc", media_type="application/x-netcdf")

    def start(ref: str) -> Response:
        content = studio.start_of(ref)
        if content is None:
            return Response("this start is kept no longer", status_code=404, media_type="text/plain")
        return Response(content, media_type="application/octet-stream", headers={"Cache-Control": "no-cache"})

    def run(ref: str) -> Response:
        path = studio.load(ref).path
        return FileResponse(path, filename=f"{_plain(studio.name(ref))}.nc", media_type="application/x-netcdf")

    def case(ref: str) -> Response:
        return _named(studio.case_text(ref).encode(), f"{_plain(studio.name(ref))}.yaml", "application/yaml")

    def figures(ref: str) -> Response:
        return _named(_drawn(studio, ref), f"{_plain(studio.name(ref))}-figures.zip", "application/zip")

    def certificate(ref: str) -> Response:
        path = studio.path(ref)
        if path.name != "certificate.html":
            return Response("this is no certificate", status_code=404, media_type="text/plain")
        # a page without a script of its own; nothing in it may run one
        headers = {"Content-Security-Policy": "sandbox; script-src 'none'"}
        return FileResponse(path, media_type="text/html", headers=headers)

    for name, answer in (("motion", motion), ("start", start), ("run", run), ("case", case), ("figures", figures)):
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


def _plain(name: str) -> str:
    return re.sub(r"[^\w.-]+", "-", name.removesuffix(".nc"), flags=re.ASCII).strip("-.") or "run"


def _drawn(studio: Studio, ref: str) -> bytes:
    """Figures and animation of a run, zipped."""
    from evolvent import animation
    from evolvent.exports import drawings

    found = studio.load(ref)
    motion = animation.of_run(found.run)
    with tempfile.TemporaryDirectory(prefix="evolvent-figures-") as folder:
        paths = drawings.write(found.run, found.figures, motion, folder)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in paths:
                archive.write(path, pathlib.Path(path).name)
    return packed.getvalue()
