"""What a crew knows of scans given as plain files: an inspection's keys `scans` and `targets`."""

from pathlib import Path

from pydantic import ValidationError

from flows.explain import explain
from flows.inspection_file import settings_in
from schemas.contract import Contract
from schemas.inspection import ScanInput
from schemas.problem import BadInput
from schemas.target import SiteTarget


class Survey(Contract):
    scans: tuple[ScanInput, ...] = ()
    targets: tuple[SiteTarget, ...] = ()

    def of(self, path: Path, unit: str) -> ScanInput:
        """What is known of a scan file, by its name; nothing but its unit where it is not named."""
        named = (scan for scan in self.scans if Path(scan.file).name == path.name)
        return next(named, ScanInput.model_validate({"file": path.name, "unit": unit}))


def read_survey(path: Path, scans: list[Path]) -> Survey:
    """Of a YAML file, which may be a whole inspection. BadInput where it names a scan that is not given."""
    content = settings_in(path)
    try:
        survey = Survey.model_validate({key: content[key] for key in Survey.model_fields if key in content})
    except ValidationError as problem:
        raise explain(str(path), problem, Survey) from None
    given = {scan.name for scan in scans}
    for scan in survey.scans:
        if Path(scan.file).name not in given:
            raise BadInput(str(path), f"names the scan {scan.file}, which is not given", "Correct its name")
    return survey
