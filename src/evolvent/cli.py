"""The command line: list, show, schema, run, info, plot."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NoReturn

import click

from evolvent import __version__
from evolvent.errors import EvolventError, RunFailed, nearest

if TYPE_CHECKING:
    import xarray as xr

#: Exit codes: a run that failed, input that cannot be used, a run that was interrupted.
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main() -> NoReturn:
    """Run the command line; every error is one line on stderr."""
    try:
        code = commands.main(standalone_mode=False)
    except (click.ClickException, EvolventError) as error:
        code = _complain(error)
    except (click.Abort, KeyboardInterrupt):
        click.echo("evolvent: interrupted", err=True)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone away
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code if isinstance(code, int) else 0)


def _complain(error: click.ClickException | EvolventError) -> int:
    """Print an error as one line; returns the exit code."""
    message = str(error)
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        known = [name for p in error.ctx.command.get_params(error.ctx) for name in p.opts if name.startswith("--")]
        message = f"no such option: {error.option_name}; {nearest(error.option_name, known)}"
    elif isinstance(error, click.ClickException):
        message = error.format_message()
    message = " ".join(message.split()).rstrip(".")
    click.echo(f"evolvent: {message[:1].lower() + message[1:]}", err=True)
    return FAILED if isinstance(error, RunFailed) else BAD_INPUT


class _Commands(click.Group):
    """A group that names the nearest command for an unknown one."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """As click does, with its own message."""
        if self.get_command(ctx, args[0]) is None:
            guess = nearest(args[0], self.list_commands(ctx))
            raise click.UsageError(f"no command is called {args[0]!r}; {guess}", ctx)
        return super().resolve_command(ctx, args)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]}, invoke_without_command=True)
@click.version_option(__version__, prog_name="evolvent", message="%(prog)s %(version)s")
@click.pass_context
def commands(ctx: click.Context) -> None:
    """How spacecraft structures are wound up, measured and deployed.

    Start with: evolvent run heliogyro --figures figures
    """
    if ctx.invoked_subcommand is None:
        raise click.UsageError(f"no command is given; {nearest('', commands.list_commands(ctx))}", ctx)


@commands.command("list")
def list_cases() -> None:
    """List the built-in cases."""
    from evolvent import cases

    found = cases.built_in()
    width = max(len(name) for name in found)
    for name, what in found.items():
        click.echo(f"{name:<{width}}  {what}")


@commands.command()
@click.argument("case")
def show(case: str) -> None:
    """Print a built-in CASE, to be kept in a file and edited."""
    from evolvent import cases

    click.echo(cases.text(case), nl=False)


@commands.command()
@click.argument("system")
def schema(system: str) -> None:
    """Print the JSON schema of a SYSTEM's cases, for editors."""
    from evolvent import cases

    click.echo(json.dumps(cases.json_schema(system), indent=2))


@commands.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the case.")
@click.option("-o", "--output", metavar="RUN.NC", help="Keep the results as NetCDF.")
@click.option("--figures", metavar="DIR", help="Draw figures and an animation into a folder.")
@click.option("--quiet", is_flag=True, help="Print no table and no progress.")
def run(case: str, assignments: tuple[str, ...], output: str | None, figures: str | None, quiet: bool) -> None:
    """Run a built-in CASE or a case FILE and print its results.

    Ctrl-C ends the run and keeps what was computed.
    """
    from evolvent import cases

    overrides = dict(cases.parse_assignment(assignment) for assignment in assignments)
    loaded = cases.load(case, overrides)
    module = cases.system(loaded.system)
    from evolvent import results

    if output is not None:
        results.claim(output)
    if figures is not None:
        results.claim_folder(figures)
    plan = module.plan(loaded)
    if plan.solver:
        from evolvent import jit

        if not jit.is_warm(plan.solver):
            click.echo("evolvent: compiling for this machine, once; this takes half a minute", err=True)
    with _progress(plan.duration, quiet) as progress:
        found = module.run(loaded, progress=progress)
    _keep(found, output, figures, quiet)
    status, message = found.attrs["status"], found.attrs["message"]
    if status == "failed":
        raise RunFailed(message, found)
    if status == "interrupted":
        click.echo(f"evolvent: {message}", err=True)
        raise click.exceptions.Exit(INTERRUPTED)


def _keep(found: xr.Dataset, output: str | None, figures: str | None, quiet: bool) -> None:
    """Table, results file and figures of a run."""
    from evolvent import results

    if not quiet:
        _table(found)
    if output is not None:
        results.save(found, output)
        if not quiet:
            click.echo(f"results: {output}")
    if figures is not None:
        _draw(found, figures, quiet)


def _draw(found: xr.Dataset, folder: str, quiet: bool) -> None:
    """Figures and animation of a run."""
    from evolvent import animation, cases, plots

    module = cases.system(found.attrs["system"])
    figures, scene = module.figures(found), module.scene(found)
    if not figures and scene is None:
        click.echo("evolvent: no figures, for the run holds too little to draw", err=True)
        return
    paths = plots.draw(figures, folder)
    if scene is not None:
        paths.append(animation.write(scene, os.path.join(folder, f"{scene.name}.html")))
    if not quiet:
        click.echo(f"figures: {', '.join(os.path.basename(p) for p in paths)} in {folder}")


def _table(found: xr.Dataset) -> None:
    """Print the results that a user wants to see at once."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from evolvent import cases

    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    status = found.attrs["status"]
    style = "green" if status in ("success", "stopped by event") else "bold red"
    message = "" if status == "success" else f": {found.attrs['message']}"
    table.add_row("status", Text.assemble((status, style), message))
    for number in cases.system(found.attrs["system"]).numbers(found):
        table.add_row(number.label, Text(number.value))
    Console(highlight=False).print(table)


@contextlib.contextmanager
def _progress(end: float, quiet: bool) -> Iterator[Callable[[float], None] | None]:
    """A progress bar on stderr if somebody watches; yields what to call with the time reached."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.completed:.1f} of {task.total:.1f} s"), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("run", total=end)
        yield lambda reached: bar.update(task, completed=reached)


@commands.command()
@click.argument("path", metavar="RUN.NC")
def info(path: str) -> None:
    """Print what a results file holds."""
    from evolvent import results

    found = results.open(path)
    click.echo(f"{found.attrs['title']}, version {found.attrs['version']}")
    _table(found)
    click.echo("\ncase:\n" + "".join(f"  {line}\n" for line in found.attrs["case"].splitlines()))
    width = max(len(str(name)) for name in found.variables)
    click.echo("variables:")
    for name, variable in found.variables.items():
        attrs = variable.attrs
        dims = ", ".join(str(d) for d in variable.dims)
        unit = attrs.get("units", "")
        click.echo(f"  {name!s:<{width}}  {unit:<10} ({dims})  {attrs.get('long_name', '')}".rstrip())


@commands.command()
@click.argument("path", metavar="RUN.NC")
@click.option("--figures", metavar="DIR", default="figures", show_default=True, help="Folder to draw into.")
def plot(path: str, figures: str) -> None:
    """Draw figures and an animation of a results file."""
    from evolvent import results

    found = results.open(path)
    results.claim_folder(figures)
    _draw(found, figures, quiet=False)
