"""Options that several commands share."""

from __future__ import annotations

import click


def once(ctx: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> str | None:
    """The value of an option that may be given once."""
    if len(values) > 1:
        name = max(parameter.opts, key=len)
        raise click.UsageError(f"{name} is given {len(values)} times, as {', '.join(map(repr, values))}", ctx)
    return values[0] if values else None
