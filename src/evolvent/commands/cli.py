"""The command line: list, show, parts, schema, run, modes, equilibrium, sweep, identify, studio, info, plot and so on.

All that a user asked for is left on disk even where nobody reads what is printed.
"""

from __future__ import annotations

import contextlib
import inspect
import itertools
import json
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, NoReturn, Protocol, get_args, get_origin, runtime_checkable

import click

from evolvent import __version__
from evolvent.base import progress, startup
from evolvent.base.console import echo, figure_format, note, once, showing_progress
from evolvent.base.errors import EvolventError, InputError, RunFailed, abbreviated, nearest, visible
from evolvent.commands.analysis import equilibrium, modes
from evolvent.commands.calibrate import calibrate
from evolvent.commands.claims import claims
from evolvent.commands.export import export, report
from evolvent.commands.figure import figure
from evolvent.commands.fmu import fmu
from evolvent.commands.massprops import identify
from evolvent.commands.studio import studio
from evolvent.commands.sweep import sweep

if TYPE_CHECKING:
    import xarray as xr

    from evolvent.base.schema import Section

#: Exit codes: a run that failed, input that cannot be used, a run that was interrupted.
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
#: Commands that work with arrays of Dask.
_WITH_DASK = ("sweep", "studio")


def main() -> NoReturn:
    """Run the command line; every error is one line on stderr."""
    if "numpy" not in sys.modules:
        startup.prepare_process()
    try:
        code = commands.main(standalone_mode=False)
    except (click.ClickException, EvolventError) as error:
        code = _complain(error)
    except (click.Abort, KeyboardInterrupt):
        echo("evolvent: interrupted", err=True)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone away
        _discard_output()
        code = 0
    except OSError as error:
        _discard_output()
        about = f" {error.filename!r}" if error.filename else " the output"
        echo(f"evolvent: cannot write{about}: {(error.strerror or str(error)).lower()}", err=True)
        code = FAILED
    sys.exit(code if isinstance(code, int) else 0)


def _discard_output() -> None:
    """Send what is still to be printed nowhere."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _say(text: str, *, styled: bool = False) -> None:
    """Print to stdout; a reader that has gone away is no reason to stop. A styled text hides nothing any more."""
    try:
        (click.echo if styled else echo)(text)
    except BrokenPipeError:
        _discard_output()


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
    """Simulate how cables, booms, ribs, blades and panels deploy from spacecraft.

    Start with: evolvent run heliogyro
    """
    if ctx.invoked_subcommand is None:
        raise click.UsageError(f"no command is given; {nearest('', commands.list_commands(ctx))}", ctx)
    if ctx.invoked_subcommand not in _WITH_DASK and "xarray" not in sys.modules:
        ctx.with_resource(startup.hidden(*startup.ARRAY_LIBRARIES))


@commands.command("list")
def list_cases() -> None:
    """List the built-in cases, and the studies for `evolvent sweep`."""
    from evolvent import cases
    from evolvent.design import studies

    found = cases.built_in() | {name: f"study: {what}" for name, what in studies.built_in().items()}
    width = max(len(name) for name in found)
    for name, what in found.items():
        echo(f"{name:<{width}}  {what}")
    _say_unusable(cases.unusable())


def _say_unusable(sentences: Iterable[str]) -> None:
    """Say why plug-ins cannot be used, unless that was said as they were loaded."""
    from evolvent.base import plugins

    for sentence in sentences:
        if sentence not in plugins.said:
            echo(f"evolvent: {sentence}", err=True)


@commands.command()
@click.argument("case", metavar="CASE|FILE")
def show(case: str) -> None:
    """Print a built-in CASE or study, to be kept in a file and edited; of a case FILE all keys, defaults included."""
    from evolvent import cases
    from evolvent.design import studies

    if case in studies.built_in():
        echo(studies.text(case), nl=False)
    elif case not in cases.built_in() and re.search(r"[./\\]", case):
        echo(cases.to_yaml(cases.load(case), cases.content_of(case)), nl=False)
    else:
        echo(cases.text(case), nl=False)


@commands.command("parts")
@click.argument("kind", required=False)
def list_parts(kind: str | None) -> None:
    """List the kinds of parts of a structure, or the keys of one KIND with units and defaults."""
    from evolvent.base.schema import descriptions, marks
    from evolvent.parts import registry

    if kind is None:
        _say_unusable(registry.unusable().values())
        _print_rows(
            [(name, inspect.cleandoc(part.__doc__ or "").splitlines()[0]) for name, part in registry.kinds().items()]
        )
        return
    part = registry.kinds().get(kind)
    if part is None:
        raise InputError(f"no part is of the kind {kind!r}; {registry.not_known(kind)}")
    rows: list[tuple[str, str]] = []
    texts = descriptions(part)
    for name, field in part.model_fields.items():
        if name == "kind":
            continue
        own = list(marks(field))
        unit = next((f" [{found}]" for mark in own if (found := _unit_of(mark))), "")
        default = field.get_default(call_default_factory=True)
        if field.is_required():
            value = ", required"
        else:
            value = "" if default in (None, (), {}, "") else f" = {_written(default)}"
        rows.append((f"{name}{unit}{value}", " ".join(filter(None, [texts[name], _choices(field.annotation, own)]))))
    _say(inspect.cleandoc(part.__doc__ or "").splitlines()[0])
    _print_rows(rows)


def _unit_of(mark: Any) -> str:
    """Unit of the values that an annotation reads, '' for none."""
    return str(getattr(getattr(mark, "quantity", mark), "unit", "") or "")


@runtime_checkable
class _WithKinds(Protocol):
    """An annotation of a key that holds one of several kinds of sections, by name."""

    kinds: Mapping[str, type[Section]]


def _choices(annotation: Any, own: Sequence[Any]) -> str:
    """The words, or the sections with their keys, that a key may take, as a sentence; '' of other keys."""
    from evolvent.parts.profile import KINDS, Profile

    if get_origin(annotation) is Literal:
        return f"One of {', '.join(map(str, get_args(annotation)))}."
    if _holds(annotation, Profile):
        return f"Rows [time, value], or one of {', '.join(KINDS)}."
    for mark in own:
        if isinstance(mark, _WithKinds):
            each = (f"{name}: {{{', '.join(kind.model_fields)}}}" for name, kind in mark.kinds.items())
            return f"One of {'; '.join(each)}."
    return ""


def _holds(annotation: Any, kind: type) -> bool:
    """Whether a class, or one derived from it, stands in an annotation."""
    own = isinstance(annotation, type) and issubclass(annotation, kind)
    return own or any(_holds(one, kind) for one in get_args(annotation))


def _written(default: Any) -> str:
    """A default as a case file has it."""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, tuple):
        return f"[{', '.join(map(_written, default))}]"
    return f"{default:g}" if isinstance(default, float) else str(default)


@commands.command()
@click.argument("system")
def schema(system: str) -> None:
    """Print the JSON schema of a SYSTEM's cases, for editors."""
    from evolvent import cases

    echo(json.dumps(cases.json_schema(system), indent=2))


@commands.command()
@click.argument("case", metavar="CASE|FILE")
@click.option("--set", "assignments", multiple=True, metavar="KEY.PATH=VALUE", help="Change a key of the case.")
@click.option(
    "-o",
    "--output",
    multiple=True,
    callback=once,
    metavar="RUN.NC",
    help="File of the results (NetCDF).  [default: run.nc in the new folder CASE-run]",
)
@click.option(
    "--figures",
    multiple=True,
    callback=once,
    metavar="DIR",
    help="Folder for figures and animation.  [default: RUN-figures, or CASE-run]",
)
@click.option("--no-figures", is_flag=True, help="Write the results only: no figures, animation or report.")
@figure_format
@click.option("--quiet", is_flag=True, help="Print no table and no progress.")
def run(
    case: str,
    assignments: tuple[str, ...],
    output: str | None,
    figures: str | None,
    no_figures: bool,
    kind: str,
    quiet: bool,
) -> None:
    """Run a built-in CASE or a case FILE, print its results and draw figures.

    Without -o the new folder CASE-run keeps all of it: run.nc, figures, animation.html and report.html. Ctrl-C ends the
    run and keeps what was computed.
    """
    from evolvent import cases

    loaded = cases.load(case, cases.parse_assignments(assignments))
    module = cases.system(loaded.system)
    targets = _targets(case, output, figures, no_figures)
    _refuse_input(loaded, output)
    plan = module.plan(loaded)
    if plan.note and not quiet:
        note(plan.note)
    with showing_progress(quiet=quiet or not plan.solver):
        found = plan.run(lambda reached: progress.report("running", reached, plan.duration, "s"))
    _store(found, targets, kind, quiet)
    status, message = found.attrs["status"], found.attrs["message"]
    if status == "failed":
        raise RunFailed(message, found)
    if status == "interrupted":
        note(message)
        raise click.exceptions.Exit(INTERRUPTED)


class _Targets(NamedTuple):
    """Where a run is kept: folder that is made for it, file of the results, folder of figures, file of the report."""

    folder: str | None
    results: str
    figures: str | None
    report: str | None


def _targets(case: str, output: str | None, figures: str | None, no_figures: bool) -> _Targets:
    """Where a run is kept; what could not be written is refused."""
    from evolvent import cases, results

    if no_figures and figures is not None:
        raise InputError(f"--figures {figures!r} and --no-figures are both given; give one of them")
    if output is None:
        folder = _unused(os.path.splitext(os.path.basename(case))[0] + "-run")
        for needed in (figures, folder):
            if needed is not None:
                results.check_writable_folder(needed)
        drawings = None if no_figures else folder if figures is None else figures
        report = None if no_figures else os.path.join(folder, "report.html")
        return _Targets(folder, os.path.join(folder, "run.nc"), drawings, report)
    results.check_writable(output)
    if case not in cases.built_in() and os.path.exists(output) and os.path.samefile(case, output):
        raise InputError(f"-o {output!r} is the case file itself; name another, such as 'run.nc'")
    if no_figures:
        return _Targets(None, output, None, None)
    drawings = _beside(output) if figures is None else figures
    try:
        results.check_writable_folder(drawings)
    except InputError as error:
        raise InputError(f"{error} (--no-figures draws none)") from None
    if os.path.realpath(output) in _with_parents(os.path.realpath(drawings)):
        raise InputError(f"--figures {drawings!r} cannot be a folder, for -o writes the file {output!r}")
    return _Targets(None, output, drawings, None)


def _unused(folder: str) -> str:
    """`folder`, or the first of `folder`-2, `folder`-3, ... that does not exist."""
    names = itertools.chain([folder], (f"{folder}-{k}" for k in itertools.count(2)))
    return next(name for name in names if not os.path.lexists(name))


def _refuse_input(case: Section, output: str | None) -> None:
    """Refuse to write over a file that the case reads, such as the run that it starts from."""
    if output is None or not os.path.exists(output):
        return
    for key, value in _words(case.model_dump()):
        if os.path.isfile(value) and os.path.samefile(value, output):
            raise InputError(f"-o {output!r} is the file that {key} names; name another, such as 'run.nc'")


def _words(content: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Dotted keys and values of a case's words."""
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _words(value, f"{before}{key}.")
        elif isinstance(value, str):
            yield before + key, value


def _beside(path: str) -> str:
    """The folder of the figures of a run, beside its file."""
    return os.path.splitext(path)[0] + "-figures"


def _with_parents(path: str) -> list[str]:
    """`path` and all folders above it."""
    above = os.path.dirname(path)
    return [path] if above == path else [path, *_with_parents(above)]


def _store(found: xr.Dataset, targets: _Targets, kind: str, quiet: bool) -> None:
    """Table, results file, figures and report of a run: what is wanted first and is quick comes first."""
    from evolvent import results

    try:
        if not quiet:
            _table(found)
    finally:  # where it cannot be printed the results are kept all the same
        if targets.folder is not None:
            results.make_folder(targets.folder)
        results.save(found, targets.results)
    written = [] if targets.figures is None else _draw(found, targets.figures, kind, quiet)
    if targets.report is not None:
        from evolvent.exports import report

        with showing_progress(quiet=quiet):
            progress.report("writing the report")
            report.write(found, targets.report)
    if quiet:
        return
    if targets.folder is None:
        _say(f"results: {targets.results}")
        _list(written, targets.figures)
    elif targets.figures in (None, targets.folder):
        names = ["run.nc", *map(os.path.basename, written), *(["report.html"] if targets.report else [])]
        _say(f"results: {', '.join(names)} in {targets.folder}")
    else:
        _say(f"results: run.nc, report.html in {targets.folder}")
        _list(written, targets.figures)


def _list(written: Sequence[str], folder: str | None) -> None:
    """Print the names of figures."""
    if written:
        _say(f"figures: {', '.join(map(os.path.basename, written))} in {folder}")


def _draw(found: xr.Dataset, folder: str, kind: str, quiet: bool) -> list[str]:
    """Figures and animation of a run; returns the files' paths."""
    from evolvent import cases
    from evolvent.view import animation

    with showing_progress(quiet=quiet):
        progress.report("drawing figures")
        figures, motion = cases.presenter(found).figures(found), animation.of_run(found)
        if not figures and motion is None:
            note("no figures, for the run holds too little to draw")
            return []
        from evolvent.exports import drawings  # what draws takes longer to load than most runs take

        return drawings.write(found, figures, motion, folder, kind=kind)


def _table(found: xr.Dataset) -> None:
    """Print the results that a user wants to see at once."""
    from evolvent import cases

    status = found.attrs["status"]
    message = found.attrs["message"].removeprefix(status).lstrip()
    rows = [("status", status if status == "success" else f"{status}: {message}")]
    rows += [(number.label, number.value) for number in cases.presenter(found).numbers(found)]
    _print_rows(rows, status=status)


def _print_rows(rows: Sequence[tuple[str, str]], *, status: str = "") -> None:
    """Print labels and texts, which are wrapped beside them; a row labelled "status" is coloured."""
    wide = max(len(label) for label, _ in rows)
    room = max(shutil.get_terminal_size().columns - wide - 2, 20)
    plain = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
    well = status in ("success", "stopped by event")
    for label, value in rows:
        label, lines = visible(label), textwrap.wrap(visible(value), room, break_on_hyphens=False) or [""]
        if status and label == "status" and not plain:
            lines[0] = lines[0].replace(status, click.style(status, fg="green" if well else "red", bold=not well), 1)
        name = f"{label:<{wide}}" if plain else click.style(f"{label:<{wide}}", dim=True)
        for line in lines:
            _say(f"{name}  {line}", styled=True)
            name = " " * wide


@commands.command()
@click.argument("path", metavar="RUN.NC")
def info(path: str) -> None:
    """Print what a results file holds."""
    from evolvent import results

    found = results.open(path)
    _say(f"{found.attrs['title']}, version {found.attrs['version']}")
    _table(found)
    _say("\ncase:\n" + "".join(f"  {line}\n" for line in found.attrs["case"].splitlines()))
    _variables("variables:", found.variables)
    for name, group in getattr(found, "children", {}).items():
        _variables(f"{name} ({group.attrs['kind']}):", group.to_dataset(inherit=False).variables)


def _variables(title: str, variables: Mapping[Any, Any]) -> None:
    """Print names, units and dimensions of variables."""
    _say(title)
    width = max((len(str(name)) for name in variables), default=0)
    for name, variable in variables.items():
        attrs = variable.attrs
        dims = ", ".join(str(d) for d in variable.dims)
        unit = attrs.get("units", "")
        _say(f"  {name!s:<{width}}  {unit:<10} ({dims})  {attrs.get('long_name', '')}".rstrip())


@commands.command()
@click.argument("path", metavar="RUN.NC")
@click.option(
    "--figures", multiple=True, callback=once, metavar="DIR", help="Folder to draw into.  [default: RUN-figures]"
)
@click.option(
    "--variables", multiple=True, callback=once, metavar="NAME,NAME", help="Draw these variables alone, over time."
)
@figure_format
def plot(path: str, figures: str | None, variables: str | None, kind: str) -> None:
    """Draw figures and an animation of a results file, or the variables that are named.

    \b
    evolvent plot slew.nc
    evolvent plot slew.nc --variables hub.rate,boom.tip_deflection.y
    """  # noqa: D301
    from evolvent import results

    found = results.open(path)
    drawn = None
    if variables is not None:
        from evolvent.view import show

        drawn = show.figure(found, [name.strip() for name in variables.split(",") if name.strip()])
    folder = results.check_writable_folder(_beside(path) if figures is None else figures)
    if drawn is None:
        _list(_draw(found, folder, kind, quiet=False), folder)
        return
    from evolvent.view import plots

    _say(f"figures: {os.path.basename(plots.draw([drawn], folder, kind=kind)[0])} in {folder}")


commands.add_command(modes)
commands.add_command(equilibrium)
commands.add_command(sweep)
commands.add_command(figure)
commands.add_command(claims)
commands.add_command(calibrate)
commands.add_command(identify)
commands.add_command(export)
commands.add_command(report)
commands.add_command(fmu)
commands.add_command(studio)
