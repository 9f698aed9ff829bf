"""The site set that a command was asked for: written, and told."""

from pathlib import Path

from cyclopean.api.site import SiteFiles, SiteOptions, write_site
from cyclopean.cli.terminal import warn


def written_site(options: SiteOptions, files: SiteFiles | None) -> list[str]:
    """Write a set, if there is one, warn of what there is to know, and answer the line that tells of it."""
    if options.site is None or files is None:
        return []
    place = Path(options.site)
    for note in (*files.notes, *write_site(place, files)):
        warn(note)
    print_ = "site.pdf" if "site.pdf" in files.contents else "the SVG files"
    return [f"  site     {files.sheets} sheets in {place}; print {print_}"]
