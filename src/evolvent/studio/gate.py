"""Who may talk to the server: requests for its own address alone, from its own page, with the token if there is one."""

from __future__ import annotations

import hmac
import http.cookies
import ipaddress
import urllib.parse
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from evolvent.errors import InputError

#: Cookie that holds the token once it was given.
COOKIE = "evolvent-studio"
#: Said with what the studio answers: no page of another address may show it inside itself, or load a part of it.
_HEADERS = [(b"x-frame-options", b"SAMEORIGIN"), (b"cross-origin-resource-policy", b"same-origin"),
            (b"referrer-policy", b"same-origin"), (b"x-content-type-options", b"nosniff")]  # fmt: skip
_LOCAL = ("localhost", "127.0.0.1", "::1")

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

_ASK = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>evolvent studio</title></head>
<body style="font:16px/1.5 system-ui,sans-serif;max-width:30em;margin:15vh auto;padding:0 1em">
<h1 style="font-size:1.2em">evolvent studio</h1><p>This studio needs its token.</p>
<form><input name="token" type="password" autofocus aria-label="token" style="font:inherit">
<button style="font:inherit">Enter</button></form></body></html>"""


def is_loopback(host: str) -> bool:
    """Whether an address is this machine's own and nobody else's."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check(host: str, token: str | None) -> None:
    """Refuse an open address without a token, or a token that is easily guessed.

    Raises
    ------
    InputError
    """
    if token is not None and len(token) < 8:
        raise InputError("--token is too short; it must have 8 characters or more")
    if token is None and not is_loopback(host):
        raise InputError(
            f"--host {host} is an address that others can reach; "
            f"it needs --token TOKEN, a secret of 8 characters or more"
        )


class Gate:
    """ASGI middleware.

    Parameters
    ----------
    app : the application behind it
    host : str, the address that the server is bound to
    token : str or None
    """

    def __init__(self, app: App, *, host: str, token: str | None) -> None:
        self.app, self.token = app, token
        # who binds to all addresses is reached by names that are not known here; the token stands guard there
        self.hosts = {*_LOCAL, host} if is_loopback(host) else None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        host = headers.get("host", "")
        if self.hosts is not None and _name(host) not in self.hosts:
            await _refuse(scope, receive, send, 421, "this server answers to its own address alone")
            return
        origin = headers.get("origin")
        if origin is not None and urllib.parse.urlsplit(origin).netloc.lower() != host.lower():
            await _refuse(scope, receive, send, 403, "the request comes from another page")
            return
        if self.token is not None and not self._known(headers):
            await self._ask(scope, receive, send)
            return

        async def answer(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        try:
            await self.app(scope, receive, answer)
        except RuntimeError as error:  # of a middleware inside, where the browser has gone before the answer
            if str(error) != "No response returned.":
                raise

    def _known(self, headers: dict[str, str]) -> bool:
        found = http.cookies.SimpleCookie()
        try:
            found.load(headers.get("cookie", ""))
        except http.cookies.CookieError:
            return False
        return COOKIE in found and self._same(urllib.parse.unquote(found[COOKIE].value))

    def _same(self, given: str) -> bool:
        return self.token is not None and hmac.compare_digest(given.encode(), self.token.encode())

    async def _ask(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Take the token from the address, or ask for it."""
        query = urllib.parse.parse_qs(scope.get("query_string", b"").decode("latin-1"))
        given = query.get("token", [""])[0]
        if scope["type"] == "http" and scope["method"] == "GET" and self._same(given):
            cookie = f"{COOKIE}={urllib.parse.quote(given, safe='')}; HttpOnly; SameSite=Strict; Path=/"
            headers = [(b"location", b"/"), (b"set-cookie", cookie.encode("latin-1")), (b"cache-control", b"no-store")]
            await send({"type": "http.response.start", "status": 303, "headers": headers})
            await send({"type": "http.response.body", "body": b""})
            return
        await _refuse(scope, receive, send, 401, _ASK)


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    try:
        return urllib.parse.urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, text: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    kind = b"text/html; charset=utf-8" if text.startswith("<") else b"text/plain; charset=utf-8"
    headers = [(b"content-type", kind), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": text.encode()})
