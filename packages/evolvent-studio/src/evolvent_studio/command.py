"""The command `evolvent studio`."""

from __future__ import annotations

import importlib.util
import os
import secrets
import tempfile

import click

from evolvent_base.errors import InputError

#: Port that is taken unless another is given.
PORT = 8421
#: Environment variable with the secret, which other users cannot read, as they can a command line.
TOKEN = "EVOLVENT_STUDIO_TOKEN"


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to bind to.")
@click.option(
    "--port", type=click.IntRange(0, 65535), default=PORT, show_default=True, help="Port; 0 takes any that is free."
)
@click.option(
    "--token",
    metavar="TOKEN",
    envvar=TOKEN,
    show_envvar=True,
    help="The secret that the page requires, 8 characters or more.  [default: a new one, in the link that is printed]",
)
@click.option("--no-token", is_flag=True, help="Let every user and program of this machine open the page.")
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
def studio(host: str, port: int, token: str | None, no_token: bool, no_browser: bool) -> None:
    """Open a page in the browser: cases, runs in 3-D, charts, identification, studies.

    It works in the current folder and opens no file outside it. The page needs the secret of the link that is printed.
    """
    from evolvent_studio import gate  # help does without nicegui

    if no_token and token is not None:
        raise InputError("--token and --no-token are both given; leave one of them out")
    if token is None and not no_token:
        token = secrets.token_urlsafe(24)
    gate.check(host, token)
    gate.free(host, port)  # before much is loaded; asked again when it is
    if importlib.util.find_spec("nicegui") is None:
        raise InputError("the studio needs the package nicegui; install it with: pip install nicegui")
    root = os.getcwd()
    # nothing that the folder holds is picked up by Python or a library as its own: neither modules nor settings
    with tempfile.TemporaryDirectory(prefix="evolvent-studio-") as empty:
        os.chdir(empty)
        try:
            from evolvent_studio import server  # help does without nicegui

            server.serve(root, host=host, port=port, token=token, browser=not no_browser)
        finally:
            os.chdir(root)
