"""The command line `evolvent`: commands are offered by packages, by entry points of the group ``evolvent.commands``.

All that a user asked for is left on disk even where nobody reads what is printed.
"""

from __future__ import annotations

import functools
import sys
from typing import TYPE_CHECKING, Any, NoReturn

import click

from evolvent_base import __version__, packages, plugins, startup
from evolvent_base.console import INTERRUPTED, discard_output, echo
from evolvent_base.errors import EvolventError, RunFailed, abbreviated, nearest, reason_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Group of entry points by which packages offer commands.
GROUP = "evolvent.commands"
#: Exit codes: a run that failed, input that cannot be used.
FAILED, BAD_INPUT = 1, 2
#: Commands that work with arrays of Dask.
_WITH_DASK = ("sweep", "disperse", "studio")


def main() -> NoReturn:
    """Run the command line; every error is one line on stderr."""
    is_own = "numpy" not in sys.modules
    if is_own:
        startup.prepare_process()
    try:
        code = commands.main(standalone_mode=False)
    except (click.ClickException, EvolventError) as error:
        code = _complain(error)
    except (click.Abort, KeyboardInterrupt):
        echo("evolvent: interrupted", err=True)
        code = INTERRUPTED
    except MemoryError:
        echo("evolvent: the memory of this process does not suffice", err=True)
        code = FAILED
    except BrokenPipeError:  # the reader of our output has gone away
        discard_output()
        code = 0
    except OSError as error:
        discard_output()
        about = f" {error.filename!r}" if error.filename else " the output"
        echo(f"evolvent: cannot write{about}: {reason_of(error)}", err=True)
        code = FAILED
    if is_own:
        startup.prepare_end()
    sys.exit(code if isinstance(code, int) else 0)


def _complain(error: click.ClickException | EvolventError) -> int:
    """Print an error as one line; returns the exit code."""
    message = str(error)
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        known = [name for p in error.ctx.command.get_params(error.ctx) for name in p.opts if name.startswith("--")]
        message = f"no such option: {error.option_name}; {nearest(error.option_name, known)}"
    elif isinstance(error, click.ClickException):
        message = error.format_message()
        message = message[:1].lower() + message[1:]  # click begins with a capital, and names stay as they are
        if isinstance(error, click.UsageError) and error.ctx is not None and error.ctx.command is not commands:
            message = f"{message.rstrip('.')}; {' '.join(error.ctx.get_usage().split()).replace('Usage', 'usage')}"
    message = abbreviated(" ".join(message.split()).rstrip("."))
    echo(f"evolvent: {message}", err=True)
    return FAILED if isinstance(error, RunFailed) else BAD_INPUT


@functools.cache
def _entries() -> dict[str, EntryPoint]:
    """Where each command is."""
    return {entry.name: entry for entry in plugins.entry_points(GROUP)}


class _Commands(click.Group):
    """The commands of the packages that are installed; each is loaded when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands."""
        return list(_entries())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command by its name; None where there is none."""
        entry = _entries().get(cmd_name)
        if entry is None:
            return None
        found: click.Command = plugins.load(entry, f"the command {cmd_name!r} of {entry.value!r}")
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each command with the whole first sentence of its help, which click cuts to a line."""
        found = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        rows = [(name, one.get_short_help_str(limit=1000)) for name, one in found.items() if one and not one.hidden]
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """As click does, with a message that names the package or the nearest command for one that is missing."""
        if args[0] not in _entries():
            missing = packages.lacking("command", args[0])
            guess = nearest(args[0], self.list_commands(ctx))
            raise click.UsageError(missing or f"no command is called {args[0]!r}; {guess}", ctx)
        return super().resolve_command(ctx, args)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]}, invoke_without_command=True)
@click.version_option(__version__, prog_name="evolvent", message="%(prog)s %(version)s")
@click.pass_context
def commands(ctx: click.Context) -> None:
    """Simulate how cables, booms, ribs, blades and panels deploy from spacecraft.

    Start with: evolvent run heliogyro
    """
    if ctx.invoked_subcommand is None:
        raise click.UsageError(f"no command is given; {nearest('', commands.list_commands(ctx))}", ctx)
    if ctx.invoked_subcommand not in _WITH_DASK and "xarray" not in sys.modules:
        ctx.with_resource(startup.array_libraries_hidden())
