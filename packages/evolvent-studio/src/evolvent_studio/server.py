"""The server: bound to one address, guarded, and quiet."""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import urllib.parse

from nicegui import app, background_tasks, ui

from evolvent_base import safe_open
from evolvent_base.console import echo
from evolvent_studio import gate, page, routes, warm
from evolvent_studio.folder import Folder
from evolvent_studio.state import Studio

#: The involute of a circle.
_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32" fill="none" stroke="#0b63a5" stroke-width="3">'
    '<circle cx="14" cy="17" r="5"/><path d="M19 17C19 10 14 6 8 8C1 11 1 24 9 28C17 32 29 27 29 15"/></svg>'
)


def serve(root: str, *, host: str, port: int, token: str | None, browser: bool) -> None:
    """Serve the studio of a folder until Ctrl-C.

    Raises
    ------
    InputError
        If the address cannot be bound to.
    """
    port = gate.free(host, port)
    studio = Studio(Folder(root))
    os.environ[safe_open.ONLY_BELOW] = str(studio.folder.root)
    if studio.jobs.note:
        echo(f"evolvent studio: {studio.jobs.note}", err=True)
    warm.server().begin()
    routes.install(app, studio)
    page.install(studio)
    once = secrets.token_urlsafe(24) if token is not None and browser else ""
    app.add_middleware(gate.Gate, host=host, token=token, once=once)
    app.on_shutdown(studio.jobs.stop)
    app.on_shutdown(warm.server().end)
    shown = f"[{host}]" if ":" in host else host
    query = f"?token={urllib.parse.quote(token, safe='')}" if token is not None else ""
    address = f"http://{shown}:{port}/{query}"
    line = f"evolvent studio: {address}  (folder {studio.folder.root}; Ctrl-C ends it)"
    app.on_startup(lambda: background_tasks.create(_announce(host, port, line)))
    with contextlib.suppress(KeyboardInterrupt):
        ui.run(
            host=host,
            port=port,
            title="evolvent studio",
            favicon=_ICON,
            dark=None,
            show=f"/{once and '?token='}{once}" if browser else False,
            reload=False,
            tailwind=False,
            show_welcome_message=False,
            reconnect_timeout=20.0,
            uvicorn_logging_level="warning",
            server_header=False,
        )


async def _announce(host: str, port: int, line: str) -> None:
    """Print a line as soon as the server accepts connections: it binds to its address only after it has started."""
    reachable = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    while True:
        try:
            _, writer = await asyncio.open_connection(reachable, port)
        except OSError:
            await asyncio.sleep(0.02)
            continue
        writer.close()
        echo(line)
        return
