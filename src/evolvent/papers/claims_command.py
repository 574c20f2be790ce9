"""The command `evolvent claims`."""

from __future__ import annotations

import click

from evolvent.console import echo, note, showing_progress


@click.command()
@click.argument("name", metavar="[PAPER|CLAIM]", required=False)
@click.option("--markdown", is_flag=True, help="Print the ledger of a PAPER as a Markdown table.")
def claims(name: str | None, markdown: bool) -> None:
    """List the claims of a PAPER with verdicts, or compute the numbers of a CLAIM again.

    Without a name it counts the claims of every paper. The exit code is 1 where a number no longer agrees with the
    stored one.
    """
    from evolvent import papers
    from evolvent.errors import InputError
    from evolvent.papers import ledger

    if name is None:
        if markdown:
            raise InputError(f"--markdown needs a PAPER; give one of {', '.join(papers.CLAIMS_OF)}")
        for short, (paper, _) in papers.CLAIMS_OF.items():
            echo(f"{short}  {paper}: {ledger.counts(ledger.claims(short))}")
    elif name in papers.CLAIMS_OF:
        if markdown:
            echo(ledger.markdown(name))
            return
        for one in ledger.claims(name):
            echo(f"{one.name}  {one.verdict}: {one.claim}")
        echo(f"{ledger.counts(ledger.claims(name))}; evolvent claims CLAIM computes one again")
    else:
        one = ledger.claim(name)
        if markdown:
            raise InputError(
                f"--markdown needs a PAPER, {name!r} is a claim; give one of {', '.join(papers.CLAIMS_OF)}"
            )
        _show(one)


def _show(one: object) -> None:
    """Print a claim, and measure it where there is something to measure."""
    from evolvent.papers.ledger import Claim

    assert isinstance(one, Claim)
    echo(f"{one.where}: {one.claim}")
    echo(f"verdict: {one.verdict}")
    echo(f"paper: {one.paper or 'no number'}")
    echo(f"stored result: {one.text()}")
    if one.command:
        echo(f"shown by: {one.command}")
    if one.measure is None:
        return
    note(f"measuring, about {max(one.seconds, 1)} s of CPU time")
    with showing_progress():
        values = one.measure()
    echo(f"measured now: {one.text(values)}")
    differences = one.differences(values)
    for sentence in differences:
        note(sentence)
    if differences:
        raise click.exceptions.Exit(1)
