"""What commands that show a live page share: its options, and its address on stderr."""

from __future__ import annotations

from pathlib import Path

from bristle.cli.output.manner import note
from hil import Page, PageSettings, PlantFile
from recordings import BadInput


def page_settings(
    page: str | None, expose: bool, token: Path | None, certificate: Path | None, key: Path | None
) -> PageSettings | None:
    """Where the page is served, by the options; None without --page. Raises BadInput for options that lead nowhere."""
    if page is None:
        for given, option in (
            (expose, "--expose"),
            (token, "--page-token"),
            (certificate, "--page-cert"),
            (key, "--page-key"),
        ):
            if given:
                raise BadInput(option, "there is no page that it is for", "give --page [HOST:]PORT, too")
        return None
    return PageSettings(page, expose, token, certificate, key, "--page")


def plant_page(plant: PlantFile) -> PageSettings | None:
    """Where a plant file wants its page; None where it wants none."""
    entry = plant.page
    if entry is None:
        return None
    files = (entry.token_file, entry.certificate, entry.key)
    token, certificate, key = (None if one is None else plant.path(one) for one in files)
    return PageSettings(entry.listen, entry.expose, token, certificate, key, f"{plant.file}: page")


def announce(page: Page) -> None:
    """Say where it is."""
    note(f"live page: {page.url}")
