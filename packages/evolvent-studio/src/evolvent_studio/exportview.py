"""What is shown while a download is written: what is being done, how far it is, and a button that cancels it."""

from __future__ import annotations

from nicegui import ui

from evolvent_studio.context import Context
from evolvent_studio.exports import Export

#: Seconds between two looks at the process.
_LOOK = 0.2


def write(page: Context, ref: str, kind: str, label: str) -> None:
    """Write a download of a run, and hand it to the browser when it is ready.

    Parameters
    ----------
    page : Context
    ref : str, of the run
    kind : str, of the download
    label : str, what it is called
    """
    started: list[Export] = []
    if not page.attempt(lambda: started.append(page.studio.export(ref, kind))):
        return
    export = started[0]
    with page.dialogs, ui.dialog(value=True).props("persistent") as dialog, ui.card() as card:
        card.style("min-width:min(380px,90vw)").props('data-testid="export"')
        ui.label(label).classes("ev-title")
        with ui.element("div").classes("ev-track"):
            bar = ui.element("div").style("width:0%")
        text = ui.label(export.text).classes("ev-sub")

        def close() -> None:
            timer.cancel()
            dialog.close()

        def cancel() -> None:
            close()
            page.studio.exports.cancel(export)

        ui.button("Cancel", on_click=cancel).props('flat color=primary data-testid="export-cancel"')

        def look() -> None:
            bar.style(f"width:{100.0 * export.share:.0f}%")
            text.set_text(export.text)
            if export.error:
                close()
                page.show_message(f"{label}: {export.error}")
            elif export.ready:
                close()
                ui.download(f"/studio/export?ref={export.key}", export.name)

        timer = ui.timer(_LOOK, look)
