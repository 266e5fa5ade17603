"""All scans made ready for registration, one after the other."""

from collections.abc import Callable, Sequence
from pathlib import Path

from schemas.problem import BadInput, LeftOut
from schemas.scan import Scan
from schemas.settings import RegistrationSettings
from tasks.registration.cloud_shelf import Shelf
from tasks.registration.read_scan import scan_blocks
from tasks.registration.station_site import Site, site

STAGE = "register"


def load_stations(
    scans: Sequence[tuple[Scan, Path]],
    settings: RegistrationSettings,
    shelf: Shelf,
    on_progress: Callable[[float], None],
) -> tuple[list[Site], list[LeftOut]]:
    """The stations, and by name the scans that cannot be read or are given twice. BadInput where none can be
    used."""
    sites: list[Site] = []
    left_out: list[LeftOut] = []
    seen: dict[tuple[str, int], str] = {}
    problem = BadInput("scans", "no scan is given", "Name at least one scan.")
    for k, (scan, path) in enumerate(scans):
        try:
            twin = seen.setdefault((scan.file.sha256, scan.index), scan.name)
            if twin != scan.name or any(s.name == scan.name for s in sites):
                raise BadInput(scan.name, f"it is the same scan as {twin}", "Give each scan once.")
            blocks = scan_blocks(path, scan.index, scan.unit_m, scan.name)
            sites.append(site(scan, blocks, settings.voxel_m, shelf))
        except BadInput as bad:
            problem = bad
            left_out.append(LeftOut.because(STAGE, bad))
        on_progress((k + 1) / len(scans))
    if not sites:
        if len(scans) <= 1:
            raise problem
        raise BadInput(
            ", ".join(item.item for item in left_out),
            "none of the scans can be used: " + "; ".join(f"{i.item}: {i.what}" for i in left_out),
            "Export the scans again.",
        )
    return sites, left_out
