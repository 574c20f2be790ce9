"""The command `evolvent claims`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import click
import lazy_loader as lazy

from evolvent_base import files
from evolvent_base.console import INTERRUPTED, echo, note, once, showing_progress
from evolvent_base.errors import InputError

if TYPE_CHECKING:
    from evolvent_papers.papers.ledger import Claim

ledger = lazy.load("evolvent_papers.papers.ledger", suppress_warning=True)
papers = lazy.load("evolvent_papers.papers", suppress_warning=True)


@click.command()
@click.argument("name", metavar="[PAPER|CLAIM]", required=False)
@click.option("--markdown", is_flag=True, help="Print the ledger of a PAPER as Markdown tables.")
@click.option(
    "--all", "every", is_flag=True, help="Measure all claims again, or those of a PAPER, which takes minutes."
)
@click.option("-o", "--output", multiple=True, callback=once, metavar="FILE",
              help="Write what is measured to FILE (JSON), beside what it holds.")  # fmt: skip
def claims(name: str | None, markdown: bool, every: bool, output: str | None) -> None:
    """List the claims of a PAPER with verdicts, or measure the numbers of a CLAIM again.

    Without a name it counts the claims of every paper. The exit code is 1 where a number or a verdict no longer agrees
    with the stored one.
    """
    known = name in papers.CLAIMS_OF
    if markdown and (every or not known):
        what = f", {name!r} is a claim" if name is not None and not known and ledger.claim(name) else ""
        raise InputError(f"--markdown needs a PAPER{what}; give one of {', '.join(papers.CLAIMS_OF)}")
    if output is not None and not every and (name is None or known):
        raise InputError("-o needs --all or a CLAIM: without them nothing is measured")
    if every:
        found = ledger.every() if name is None else ledger.claims(name) if known else [ledger.claim(name)]
        _measure([one for one in found if one.measure], output)
    elif name is None:
        for short, paper in papers.CLAIMS_OF.items():
            echo(f"{short}  {paper}: {ledger.counts(ledger.claims(short))}")
    elif markdown:
        echo(ledger.markdown(name))
    elif known:
        for one in ledger.claims(name):
            echo(f"{one.name}  {one.verdict()}: {one.claim}")
        echo(f"{ledger.counts(ledger.claims(name))}; evolvent claims CLAIM measures one again")
    else:
        one = ledger.claim(name)
        _show(one)
        if one.measure:
            _measure([one], output)


def _show(one: Claim) -> None:
    """Print a claim with its stored result."""
    echo(f"{one.where} ({one.source}): {one.claim}")
    echo(f"verdict: {one.verdict()}")
    if one.rule:
        echo(" ".join((f"rule: {one.rule}", *one.limits)))
    echo(f"paper: {one.paper or 'no number'}")
    echo(f"stored result{f' of {one.measured.date}' if one.measured else ''}: {one.text()}")
    if one.undecided:
        echo(f"open: {one.undecided}")
    if one.command:
        echo(f"shown by: {one.command}")


def _measure(found: Iterable[Claim], path: str | None) -> None:
    """Measure claims, print what is found, and keep it where a file is given; leave with 1 where anything differs."""
    found = list(found)
    if path is not None:
        ledger.read(files.check_writable(path))
    note(f"measuring, about {max(sum(one.seconds for one in found), 1)} s of CPU time")
    measured, differ, interrupted = {}, 0, False
    try:
        for one in found:
            with showing_progress():
                measurement = one.run()
            measured[one.name] = measurement
            head = f"{one.name}  {one.verdict(measurement.values)}" if len(found) > 1 else "measured now"
            echo(f"{head}: {one.text(measurement.values)}")
            differences = one.differences(measurement.values)
            for sentence in differences:
                note(f"{one.name}: {sentence}" if len(found) > 1 else sentence)
            differ += bool(differences)
    except KeyboardInterrupt:
        interrupted = True
        note(f"interrupted after {len(measured)} of {len(found)} claims; what was measured is kept")
    if path is not None and measured:
        ledger.keep(measured, path)
        note(f"written to {path}")
    if len(found) > 1:
        echo(f"{len(measured)} measured, {differ} differ from the stored values")
    if interrupted or differ:
        raise click.exceptions.Exit(INTERRUPTED if interrupted else 1)
