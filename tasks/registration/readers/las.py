"""LAS and LAZ: integer coordinates with scale and offset, read as float64."""

import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import laspy
import numpy as np

from schemas.utm import zone_in, zone_of_epsg
from tasks.registration.readers.file_scan import BLOCK, FileScan, Unreadable

UNIT_OF_GEOKEY_M = {9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937}  # EPSG: metre, foot, US survey foot
STATE_PLANES_IN_FEET = (range(2222, 2290), range(2867, 2931), range(26729, 26814), range(32001, 32059))
STATE_PLANES_IN_EITHER = (range(3465, 3554), range(6355, 6628))  # EPSG's, feet and metres by turns
LINEAR_UNITS_KEY = 3076  # GeoTIFF ProjLinearUnitsGeoKey
PROJECTED_SYSTEM_KEY = 3072  # GeoTIFF ProjectedCSTypeGeoKey
MOST_PACKED = 1000  # times; real points pack to a tenth


def count(path: Path) -> int:
    return 1


def read(path: Path, index: int) -> Iterator[FileScan]:
    with _opened(path) as las:
        announced = las.header.point_count
        found = 0
        for points in las.chunk_iterator(BLOCK):
            block = np.column_stack([points.x, points.y, points.z]).astype(np.float64)
            found += len(block)
            yield FileScan(block)
    if found < announced:
        raise Unreadable(f"it is cut short: {announced} points are announced and {found} follow")


def stated_unit_m(path: Path) -> float | None:
    """Metres per unit as the file's coordinate system states it, or has it by its EPSG number alone; None
    where it states none that we know. Raises Unreadable for a number that leaves feet and metres open.

    The two feet are 2 ppm apart, 0.1 mm in 50 m: the survey foot stands for both where the number says feet.
    """
    with _opened(path) as las:
        records = las.header.vlrs
    for record in records:
        text = getattr(record, "string", "")
        projected = text[text.find("PROJCS") :].split("VERT_CS")[0] if "PROJCS" in text else ""
        if units := re.findall(r'UNIT\["[^"]*",\s*([0-9.eE+-]+)', projected):
            return float(units[-1])  # the angular unit of its GEOGCS stands before the linear one
        for key in getattr(record, "geo_keys", ()):
            if key.id == LINEAR_UNITS_KEY and key.value_offset in UNIT_OF_GEOKEY_M:
                return UNIT_OF_GEOKEY_M[key.value_offset]
    keys = (key for record in records for key in getattr(record, "geo_keys", ()))
    system = next((key.value_offset for key in keys if key.id == PROJECTED_SYSTEM_KEY), 0)
    if any(system in codes for codes in STATE_PLANES_IN_EITHER):
        raise Unreadable(
            f"it states the state plane EPSG:{system} without a unit, feet or metres: give `unit: ft`, or,"
            " where they are metres, export it with the unit in its header"
        )
    return UNIT_OF_GEOKEY_M[9003] if any(system in codes for codes in STATE_PLANES_IN_FEET) else None


def stated_utm_zone(path: Path) -> str | None:
    """Of its coordinate system; None where that is no UTM."""
    with _opened(path) as las:
        records = las.header.vlrs
    for record in records:
        if zone := zone_in(getattr(record, "string", "")):
            return zone
        for key in getattr(record, "geo_keys", ()):
            if key.id == PROJECTED_SYSTEM_KEY and (zone := zone_of_epsg(key.value_offset)):
                return zone
    return None


@contextmanager
def _opened(path: Path) -> Iterator[laspy.LasReader]:
    _check_sizes(path)
    try:
        with laspy.open(path) as las:
            yield las
    except (KeyboardInterrupt, SystemExit, GeneratorExit, Unreadable):
        raise
    except BaseException as error:  # the LAZ decoder panics with a BaseException of its own
        raise Unreadable(f"laspy refuses it: {str(error).strip() or type(error).__name__}") from error


def _check_sizes(path: Path) -> None:
    """Hold the header's numbers against the file's size before anything is read by them: laspy would loop
    over billions of records, and the LAZ decoder ends the whole process where memory is short."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(375)
        if len(head) < 227 or head[:4] != b"LASF":
            raise Unreadable("it has no LAS header")
        data_at, records, kind, bytes_each, points = struct.unpack_from("<IIBHI", head, 96)
        if head[25] >= 4 and len(head) >= 255:  # version 1.4
            extended, points = struct.unpack_from("<IQ", head, 243)
            records += extended
        packed = bool(kind & 0x80)
        if data_at > size or records * 54 > size:
            raise Unreadable("its LAS header is damaged")
        if points * bytes_each > (size - data_at) * (MOST_PACKED if packed else 1):
            raise Unreadable(f"it is cut short: {points} points do not fit into its {size} bytes")
        if packed and points:
            _check_chunks(path, data_at, size)


def _check_chunks(path: Path, data_at: int, size: int) -> None:
    with path.open("rb") as stream:
        stream.seek(data_at)
        (table_at,) = struct.unpack("<q", stream.read(8))
        if table_at == -1:  # written to a stream: the place of the table stands at the end
            stream.seek(-8, 2)
            (table_at,) = struct.unpack("<q", stream.read(8))
        if not 0 < table_at <= size - 8:
            raise Unreadable("the chunk table of its LAZ points is damaged")
        stream.seek(table_at)
        _, chunks = struct.unpack("<II", stream.read(8))
        if chunks > size:
            raise Unreadable("the chunk table of its LAZ points is damaged")
