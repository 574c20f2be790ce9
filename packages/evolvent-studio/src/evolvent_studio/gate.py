"""Which requests the server takes: for its own address, from its own page, with the token if there is one, and small.

Names, cookies and addresses come from outside and are never assumed to be well formed: what cannot be read counts as
absent or foreign.
"""

from __future__ import annotations

import hmac
import ipaddress
import os
import re
import socket
import urllib.parse
from collections.abc import Awaitable, Callable, Iterator, MutableMapping
from typing import Any

from evolvent_base import pages
from evolvent_base.errors import InputError
from evolvent_studio.places import LARGEST_SIGNALS

#: Cookie that holds the token once it was given; the port follows, for cookies are those of all ports of a host.
COOKIE = "evolvent-studio"
#: Largest request, bytes: a file and what a browser puts around it.
LARGEST_BODY = LARGEST_SIGNALS + 100_000
TOO_LARGE = f"this is too large; a file may have {LARGEST_SIGNALS // 1_000_000} MB at most"
#: The page loads nothing from elsewhere and sends nothing there; NiceGUI's own scripts are inside it and are evaluated.
_POLICY = (
    "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; object-src 'none'; base-uri 'self'; "
    "form-action 'self'; frame-ancestors 'self'"
)
#: Headers of every answer: no page of another address may show it inside itself, or load a part of it.
_HEADERS = [(b"x-frame-options", b"SAMEORIGIN"), (b"cross-origin-resource-policy", b"same-origin"),
            (b"referrer-policy", b"same-origin"), (b"x-content-type-options", b"nosniff"),
            (b"content-security-policy", _POLICY.encode())]  # fmt: skip
_HOST = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]+)(:[0-9]*)?")
_LOCAL = ("localhost", "127.0.0.1", "::1")

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]


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
            f"--host {host} is an address that others can reach; it needs --token TOKEN, a secret of 8 characters or "
            f"more, or the one that is made where --no-token is left out"
        )


def free(host: str, port: int) -> int:
    """The port to take; 0 stands for any that is free.

    Raises
    ------
    InputError
        If there is none, or the address is not this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            if os.name != "nt":
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise InputError(f"cannot listen on {host}, port {port}: {reason}; give another with --port") from None


class Gate:
    """ASGI middleware.

    Parameters
    ----------
    app : the application behind it
    host : str, the address that the server is bound to
    token : str or None, the secret
    once : str, a secret that opens the page once, '' for none: that of the browser which is started, since its command
        line can be seen by others
    """

    def __init__(self, app: App, *, host: str, token: str | None, once: str = "") -> None:
        self.app, self.token, self.once = app, token, once
        # who binds to all addresses is reached by names that are not known here; the token stands guard there
        self.hosts = {*_LOCAL, host} if is_loopback(host) else None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = _headers(scope)
        host = headers.get("host", "")
        if self.hosts is not None and _name(host) not in self.hosts:
            await _refuse(scope, receive, send, 421, "requests must use this server's own address")
            return
        if _is_foreign(headers, host):
            await _refuse(scope, receive, send, 403, "the request comes from another page")
            return
        if self.token is not None and not any(self._same(given) for given in _cookies(headers, _cookie(scope))):
            await self._ask(scope, receive, send)
            return
        if _length(headers) > LARGEST_BODY:
            await _refuse(scope, receive, send, 413, TOO_LARGE)
            return
        answered, taken = False, 0

        async def answer(message: MutableMapping[str, Any]) -> None:
            nonlocal answered
            if message["type"] == "http.response.start":
                answered = True
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        async def bounded() -> MutableMapping[str, Any]:
            nonlocal taken
            message = await receive()
            if message["type"] == "http.request":
                taken += len(message.get("body", b""))
                if taken > LARGEST_BODY:
                    raise _TooLarge
            return message

        try:
            await self.app(scope, bounded, answer)
        except _TooLarge:
            if not answered:
                await _refuse(scope, receive, send, 413, TOO_LARGE)
        except RuntimeError as error:  # of a middleware inside, where the browser has gone before the answer
            if str(error) != "No response returned.":
                raise

    def _same(self, given: str) -> bool:
        return self.token is not None and hmac.compare_digest(given.encode("utf-8", "replace"), self.token.encode())

    async def _ask(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Take the token from the address, or ask for it."""
        query = urllib.parse.parse_qs(scope.get("query_string", b"").decode("latin-1"))
        given = query.get("token", [""])[0]
        is_once = bool(self.once) and hmac.compare_digest(given.encode("utf-8", "replace"), self.once.encode())
        if scope["type"] == "http" and scope["method"] == "GET" and (self._same(given) or is_once):
            self.once = "" if is_once else self.once
            value = urllib.parse.quote(str(self.token), safe="")
            cookie = f"{_cookie(scope)}={value}; HttpOnly; SameSite=Strict; Path=/"
            headers = [(b"location", b"/"), (b"set-cookie", cookie.encode("latin-1")), (b"cache-control", b"no-store")]
            await send({"type": "http.response.start", "status": 303, "headers": headers})
            await send({"type": "http.response.body", "body": b""})
            return
        await _refuse(scope, receive, send, 401, pages.render("token.html", title="evolvent studio"))


class _TooLarge(Exception):
    """A request is larger than `LARGEST_BODY`."""


def _headers(scope: Scope) -> dict[str, str]:
    """Headers by their names in small letters; values of one name are joined."""
    found: dict[str, str] = {}
    for raw, value in scope["headers"]:
        name, text = raw.decode("latin-1").lower(), value.decode("latin-1")
        found[name] = f"{found[name]}; {text}" if name in found else text
    return found


def _is_foreign(headers: dict[str, str], host: str) -> bool:
    """Whether a request comes from a page of another address; following a link from there to the page is none."""
    origin = headers.get("origin")
    if origin is not None:
        scheme, _, netloc = origin.partition("://")
        return scheme.lower() not in ("http", "https") or netloc.lower() != host.lower()
    site, mode = headers.get("sec-fetch-site", "none"), headers.get("sec-fetch-mode", "")
    return site not in ("none", "same-origin") and mode != "navigate"


def _cookie(scope: Scope) -> str:
    """Name of this server's cookie."""
    server = scope.get("server")
    return f"{COOKIE}-{server[1]}" if server else COOKIE


def _cookies(headers: dict[str, str], name: str) -> Iterator[str]:
    """Values of all cookies of a name; those of other programs may be anything."""
    for one in headers.get("cookie", "").split(";"):
        key, _, value = one.partition("=")
        if key.strip() == name:
            yield urllib.parse.unquote(value.strip().strip('"'), errors="replace")


def _length(headers: dict[str, str]) -> int:
    """The length that a request states, 0 where it states none."""
    text = headers.get("content-length", "")
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 20 else 0


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    found = _HOST.fullmatch(host)
    return found[1].strip("[]").lower() if found else ""


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, text: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    kind = b"text/html; charset=utf-8" if text.startswith("<") else b"text/plain; charset=utf-8"
    headers = [(b"content-type", kind), (b"cache-control", b"no-store"), *_HEADERS]
    if status == 413:  # the rest of the request is not read
        headers.append((b"connection", b"close"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": text.encode()})
