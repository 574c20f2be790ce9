"""Requests that attack the studio: of other pages, with odd headers, with paths that leave the folder, too large."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import os
import shutil
import socket
import time
import urllib.error
import urllib.parse
import urllib.request

import pytest

from evolvent_studio import gate
from studio.serving import SHORT, WAIT, part, serving

TOKEN = "long enough"
QUOTED = urllib.parse.quote(TOKEN)
HERE = {"host": "127.0.0.1:8421"}
MINE = f"evolvent-studio-8421={QUOTED}"
#: Cookies of other programs on the same address, as they occur: JSON, quotes, letters outside ASCII, no value, no name.
ODD = ('x={"a":1}', 'x={"a":1, "b":[2]}', 'y="unclosed', "z=a b c", "é=ü", "=", "x", "x==;;;", "a[b]=1", "n\x01=2",
       "x=" + "y" * 60_000, "x=\\", "$Version=1", "evolvent-studio=other", "evolvent-studio-8421=%ff%00",
       "evolvent-studio-8421=é")  # fmt: skip


def knocked(headers, *, token=None, host="127.0.0.1", query=b"", kind="http", method="GET", bodies=(), path="/"):
    """What the gate does with a request: its status, 200 where it was let through, and what the application read."""
    seen, taken, left = [], [], list(bodies)

    async def app(scope, receive, send):
        while left:
            taken.append(len((await receive()).get("body", b"")))
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        if message["type"] != "http.response.body":
            seen.append((message.get("status", message.get("code")), dict(message.get("headers", ()))))

    async def receive():
        if kind == "websocket":
            return {"type": "websocket.connect"}
        return {"type": "http.request", "body": left.pop(0) if left else b"", "more_body": bool(left)}

    pairs = headers.items() if isinstance(headers, dict) else headers
    lines = [(name.encode("latin-1"), value.encode("utf-8", "surrogateescape")) for name, value in pairs]
    scope = {"type": kind, "method": method, "headers": lines, "query_string": query, "path": path,
             "server": ("127.0.0.1", 8421)}  # fmt: skip
    asyncio.run(gate.Gate(app, host=host, token=token)(scope, receive, send))
    return seen[0][0], seen[0][1], sum(taken)


def knock(headers, **options):
    return knocked(headers, **options)[0]


# ------------------------------------------------------------------------------------------------ cookies


@pytest.mark.parametrize("odd", ODD, ids=range(len(ODD)))
def test_cookies_of_other_programs_lock_nobody_out(odd):
    for text in (f"{odd}; {MINE}", f"{MINE}; {odd}", f"{odd};{MINE};{odd}"):
        assert knock(HERE | {"cookie": text}, token=TOKEN) == 200
    assert knock([*HERE.items(), ("cookie", odd), ("cookie", MINE)], token=TOKEN) == 200
    assert knock(HERE | {"cookie": odd}, token=TOKEN) == 401
    assert knock(HERE | {"cookie": odd}, token=TOKEN, kind="websocket") == 1008


@pytest.mark.parametrize("given", ["", "long", TOKEN + "x", "é", "%00", "LONG ENOUGH", '"', "*", "\udcff"])
def test_another_token_is_refused(given):
    quoted = urllib.parse.quote(given.encode("utf-8", "surrogateescape"))
    assert knock(HERE | {"cookie": f"evolvent-studio-8421={quoted}"}, token=TOKEN) == 401
    assert knock(HERE, token=TOKEN, query=f"token={quoted}".encode()) == 401


def test_the_token_is_kept_in_a_cookie_that_no_script_and_no_other_page_uses():
    status, headers, _ = knocked(HERE, token=TOKEN, query=f"token={QUOTED}".encode())
    assert status == 303
    cookie = headers[b"set-cookie"].decode()
    assert cookie.startswith(MINE)
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(cookie.split("; "))
    assert knock(HERE, token=TOKEN, query=f"token={QUOTED}".encode(), kind="websocket") == 1008
    assert knock(HERE, token=TOKEN, query=f"token={QUOTED}".encode(), method="POST") == 401


def test_tokens_are_compared_in_constant_time(monkeypatch):
    compared = []
    monkeypatch.setattr(gate.hmac, "compare_digest", lambda a, b: bool(compared.append((a, b))))
    assert knock(HERE | {"cookie": MINE}, token=TOKEN) == 401
    assert compared[0] == (TOKEN.encode(), TOKEN.encode())


# ------------------------------------------------------------------------------------------------ origin and host


@pytest.mark.parametrize(
    "origin",
    ["http://[", "http://[::1", "http://]", "[", "http://", "", "null", "file://", "é", "http://evil.example",
     "http://127.0.0.1:8421@evil.example", "http://127.0.0.1:9999", "http://127.0.0.1:8421.evil.example",
     "javascript:1", "http://127.0.0.1:8421/..", "//127.0.0.1:8421", "http://" + "a" * 10_000],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_other_origins_are_refused(origin, kind):
    assert knock(HERE | {"origin": origin}, kind=kind) == (403 if kind == "http" else 1008)
    assert knock(HERE | {"origin": origin, "cookie": MINE}, kind=kind, token=TOKEN) == (403 if kind == "http" else 1008)


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:8421", "127.0.0.1.evil.example", "127.0.0.1@evil.example", "", "[", "[::1", "é",
     "localhost.evil.example", "evil.example/127.0.0.1", "127.0.0.1:8421/x", "127.0.0.1#.evil.example",
     "evil.example?127.0.0.1", "0.0.0.0:8421"],
)  # fmt: skip
def test_other_names_of_this_machine_are_refused(host):
    """A name of another that resolves to this machine (DNS rebinding) makes its page one of the same origin."""
    assert knock({"host": host}) == 421
    assert knock({"host": host, "origin": f"http://{host}"}) == 421
    assert knock({"host": host}, kind="websocket") == 1008
    assert knock([("host", "127.0.0.1:8421"), ("host", host)]) == 421


def test_parts_of_another_page_are_refused_and_links_to_this_one_followed():
    for site in ("cross-site", "same-site"):
        for mode in ("no-cors", "cors", "websocket"):
            assert knock(HERE | {"sec-fetch-site": site, "sec-fetch-mode": mode}) == 403
        assert knock(HERE | {"sec-fetch-site": site, "sec-fetch-mode": "navigate"}) == 200
    for site in ("same-origin", "none"):
        assert knock(HERE | {"sec-fetch-site": site, "sec-fetch-mode": "cors"}) == 200


def test_every_answer_has_its_headers():
    for status, headers, _ in (
        knocked(HERE), knocked({"host": "evil.example"}), knocked(HERE | {"origin": "null"}),
        knocked(HERE, token=TOKEN),
    ):  # fmt: skip
        assert headers[b"x-content-type-options"] == b"nosniff", status
        assert headers[b"x-frame-options"] == b"SAMEORIGIN"
        assert b"frame-ancestors 'self'" in headers[b"content-security-policy"]


# ------------------------------------------------------------------------------------------------ sizes


def test_a_request_that_grows_too_large_is_ended():
    status, _, taken = knocked(HERE, method="POST", bodies=[bytes(1_000_000)] * 700)
    assert status == 413
    assert taken <= 200_100_000
    assert knock(HERE, method="POST", bodies=[bytes(1_000_000)] * 200) == 200


@pytest.mark.parametrize(
    ("length", "status"), [("700000000", 413), ("200100001", 413), ("1000", 200), ("-1", 200), ("²", 200), ("x", 200)]
)
def test_a_request_that_states_too_large_a_size_is_not_read(length, status):
    found, _, taken = knocked(HERE | {"content-length": length}, method="POST", bodies=[b"x"])
    assert found == status
    assert taken == (1 if status == 200 else 0)


# ------------------------------------------------------------------------------------------------ a server


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A studio that others can reach, with a token, and a secret beside its folder."""
    place = tmp_path_factory.mktemp("gate")
    (place / "secret.txt").write_text("the secret")
    folder = place / "work"
    folder.mkdir()
    (folder / ".env").write_text("the secret")
    (folder / "certificate.html").write_text("the secret")
    (folder / "short.yaml").write_text(SHORT)
    (place / "temporary").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(place / "state"))
        patch.setenv("TMPDIR", str(place / "temporary"))
        with serving(folder, "--host", "0.0.0.0", "--token", TOKEN) as started:
            yield started
    assert "Traceback" not in started.log.read_text()


@pytest.fixture
def asked(server):
    """Ask the server; returns status, headers and body."""
    port = urllib.parse.urlsplit(server.url).port
    mine = {"Cookie": f"evolvent-studio-{port}={QUOTED}"}

    def ask(path, method="GET", headers=None, body=None, chunked=False):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
        connection.putrequest(method, path, skip_accept_encoding=True)
        for name, value in {**mine, **(headers or {})}.items():
            connection.putheader(name, value)
        if chunked:
            connection.putheader("Transfer-Encoding", "chunked")
        connection.endheaders()
        with contextlib.suppress(ConnectionError):  # it is answered before all is sent
            for chunk in body or ():
                connection.send(b"%x\r\n%s\r\n" % (len(chunk), chunk) if chunked else chunk)
            if chunked:
                connection.send(b"0\r\n\r\n")
        with contextlib.closing(connection):
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    return ask


@pytest.mark.slow
def test_odd_headers_reach_a_server_that_answers(server, asked):
    port = urllib.parse.urlsplit(server.url).port
    for odd in ODD[:10]:
        if not odd.isprintable():
            continue
        cookie = f"{odd}; evolvent-studio-{port}={QUOTED}".encode()
        assert asked("/studio/case?ref=file:none.nc", headers={"Cookie": cookie})[0] == 404
    assert asked("/", headers={"Origin": "http://["})[0] == 403
    assert asked("/", headers={"Cookie": "x=" + "y" * 200_000})[0] in (400, 401, 431)
    with socket.create_connection(("127.0.0.1", port)) as raw:
        raw.sendall(b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\nCookie: \x80=\xff\r\n\r\n")
        assert raw.recv(100).split()[1] in (b"400", b"401", b"421")


@pytest.mark.slow
def test_the_link_that_is_printed_opens_the_page(server):
    base, _, secret = server.url.partition("?token=")
    assert secret == QUOTED
    with pytest.raises(urllib.error.HTTPError, match="401"):
        urllib.request.urlopen(base)
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    with opener.open(server.url) as answer:
        assert answer.status == 200
        assert answer.url == base


STEPS = ("../", "..%2f", "%2e%2e/", "..%5c", "..\\", "....//", "%252e%252e%252f", "..%c0%af", "/..;/")
ROUTES = ("run", "case", "export", "motion", "start", "mode", "modes", "report", "kept")


@pytest.mark.slow
def test_no_address_leaves_the_folder(server, asked):
    secret = server.folder.parent / "secret.txt"
    names = [f"{prefix}{step}secret.txt" for prefix in ("", "x/") for step in STEPS]
    names += [str(secret), f"//{secret}", f"file://{secret}", ".env", "%00", "short.yaml%00.nc", "certificate.html",
              "..", ".", "", "~/x", "/etc/passwd", "a" * 5000, "\\\\host\\share",
              ".evolvent-studio/queue.json"]  # fmt: skip
    for route in ROUTES:
        for name in names:
            for kind in ("file:", "job:", ""):
                path = f"/studio/{route}?ref={kind}{urllib.parse.quote(name, safe='%/.:')}"
                status, headers, body = asked(path)
                assert status == 404, path[:200]
                assert b"the secret" not in body, path
                assert headers["X-Content-Type-Options"] == "nosniff"
                assert headers["Content-Type"].startswith("text/plain")
    for base in ("/studio/viewer/", "/_nicegui/", "/_nicegui/3/resources/", "/static/", "/"):
        for step in STEPS:
            status, _, body = asked(f"{base}{step * 8}{urllib.parse.quote(str(secret)[1:])}")
            assert status in (400, 403, 404, 405), (base, step)
            assert b"the secret" not in body


def test_requests_without_what_they_need_are_no_error_of_the_server(asked):
    for path in (
        "/studio/run",
        "/studio/run?ref",
        "/studio/run?ref=a&ref=b",
        "/studio/mode?ref=job::",
        "/studio/nothing",
    ):
        for method in ("GET", "POST", "PUT", "DELETE", "OPTIONS", "HEAD"):
            assert asked(path, method)[0] in (400, 403, 404, 405, 422)


@pytest.fixture(scope="module")
def page(server, browser):
    """The page, opened by typing the token."""
    opened = browser.new_page()
    opened.goto(f"http://127.0.0.1:{urllib.parse.urlsplit(server.url).port}/")
    opened.fill("input[name=token]", TOKEN)
    opened.click("button")
    opened.wait_for_selector(part("tab-case"), timeout=WAIT)
    yield opened
    opened.close()


def test_the_token_is_asked_for_and_not_shown(asked, page):
    assert asked("/", headers={"Cookie": ""})[0] == 401
    assert "token" not in page.url


@pytest.fixture(scope="module")
def uploading(page, tmp_path_factory):
    """Addresses of an open page that cases and signals are uploaded to."""
    addresses, place = [], tmp_path_factory.mktemp("uploads")
    for tab, name, text in (("tab-case", "case-upload", SHORT), ("tab-measure", "signals", "1,2\n3,4\n")):
        page.click(part(tab))
        file = place / ("first.yaml" if tab == "tab-case" else "first.csv")
        file.write_text(text)
        with page.expect_request(lambda request: request.method == "POST" and "/upload/" in request.url) as sent:
            page.set_input_files(f"{part(name)} input[type=file]", file)
        addresses.append(urllib.parse.urlsplit(sent.value.url).path)
    return addresses


def form(name, chunks):
    """A form with one file."""
    yield f'--x\r\nContent-Disposition: form-data; name="f"; filename="{name}"\r\n\r\n'.encode()
    yield from chunks
    yield b"\r\n--x--\r\n"


def size_of(folder):
    """Size of all files below a folder, bytes."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("chunked", [True, False])
def test_an_upload_of_700_mb_is_refused_and_leaves_nothing(server, asked, uploading, chunked):
    address = uploading[1]
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    if not chunked:
        headers["Content-Length"] = "700000000"
    body = form("large.csv", (bytes(1_000_000) for _ in range(700)))
    before = size_of(server.folder.parent / "temporary")
    try:
        status, _, text = asked(address, "POST", headers, body, chunked=chunked)
    except (ConnectionError, http.client.BadStatusLine):  # closed while much was still to be sent
        status, text = 413, b"at most"
    assert status == 413
    assert b"at most" in text
    assert not list(server.folder.rglob("*large*"))
    assert size_of(server.folder.parent / "temporary") < before + 1_000_000
    assert asked("/studio/nothing")[0] == 404


def test_the_page_of_a_folder_is_served_with_its_policy(asked):
    status, headers, body = asked("/")
    assert status == 200
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    assert json.dumps(str(os.getcwd())) not in body.decode()


def test_a_report_of_the_folder_runs_and_loads_nothing(server, asked):
    place = server.folder / "spread"
    place.mkdir()
    for name in ("study.json", "dispersion.csv"):
        (place / name).write_text("")
    (place / "report.html").write_text("<p>spread</p>")
    status, headers, body = asked("/studio/report?ref=file:spread")
    assert (status, body) == (200, b"<p>spread</p>")
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("sandbox; default-src 'none'; img-src data:;")
    assert "script" not in policy
    assert asked("/studio/report?ref=file:../spread")[0] == 404
    (place / "report.html").unlink()
    assert asked("/studio/report?ref=file:spread")[0] == 404
    shutil.rmtree(place)


@pytest.mark.slow
def test_an_upload_above_the_limit_of_its_kind_is_not_kept(server, asked, uploading):
    """A YAML file may have 500 kB, whatever the browser says; a file of signals of that size is kept."""
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    case, signals = uploading
    place = server.folder / ".evolvent-studio" / "uploads"
    for address, name in ((signals, "kept.csv"), (case, "case.yaml")):
        body = form(name, [b"1,2\n" * 150_000])
        assert asked(address, "POST", headers, body, chunked=True)[0] == 200
        end = time.monotonic() + 60.0
        while name == "kept.csv" and not (place / name).exists() and time.monotonic() < end:
            time.sleep(0.1)
    time.sleep(1.0)
    names = {path.name for path in place.iterdir()}
    assert "kept.csv" in names
    assert "case.yaml" not in names
