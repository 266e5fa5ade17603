"""Mission upload that survives a lossy link, and the read-back that must match before anyone arms."""

import time

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.mission import MissionItem
from schemas.problem import BadInput
from tasks.flight.link import Link, LinkLost

RESEND_S = 0.25
BASE_S, ITEM_S = 20.0, 0.5  # an upload may take this long, and this long an item
CLEAR_S = 12.0  # ArduPilot clears nothing until 8 s after the last item of an upload that stopped halfway
WINDOW = 8  # items asked for at once when reading back
ACCEPTED, ERROR = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR
OUT_OF_ORDER, CANCELLED = mavlink.MAV_MISSION_INVALID_SEQUENCE, mavlink.MAV_MISSION_OPERATION_CANCELLED
ANSWERS = ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK")
PLACES = (mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_LAND)


def upload_mission(link: Link, items: tuple[MissionItem, ...]) -> None:
    """Put the mission on the vehicle and prove by reading it back that it is there, whole and as meant.

    Raises BadInput, and then the vehicle holds no mission at all: a truncated one would fly.
    """
    try:
        clear_mission(link)
        _send(link, items)
        found = read_back(link)
        differences = compare(items, found)
        if differences:
            raise BadInput(
                link.url,
                f"the vehicle holds another mission than was sent: {'; '.join(differences[:3])}",
                "Try again; if it stays, the autopilot does not support this mission (ArduCopter 4 does)",
            )
    except BaseException:
        abandon_mission(link)
        raise


def clear_mission(link: Link) -> bool:
    """Empty the vehicle's mission; says whether the vehicle confirmed."""
    until = time.monotonic() + CLEAR_S
    while time.monotonic() < until:
        link.mav.mission_clear_all_send(*link.target)
        ack = link.expect(("MISSION_ACK",), RESEND_S, lambda m: m.type == ACCEPTED)
        if ack is not None:
            return True
    return False


def abandon_mission(link: Link) -> None:
    """Clear the mission where something has gone wrong already: as well as the link allows."""
    try:
        clear_mission(link)
    except LinkLost:
        return


def _send(link: Link, items: tuple[MissionItem, ...]) -> None:
    """Send items as they are asked for. After RESEND_S without a request the item asked for last and the next
    one are sent again, and one more each time in vain: whichever requests, items or answers were lost, the
    vehicle gets the one it waits for, and ignores the others. From the first loss on each request is answered
    with two items, since the next request may be lost too."""
    last = len(items) - 1
    until = time.monotonic() + BASE_S + ITEM_S * len(items)
    asked: int | None = None
    sent, in_vain, spare = -1, 0, 0
    resend = time.monotonic() + RESEND_S
    link.mav.mission_count_send(*link.target, len(items))
    while time.monotonic() < until:
        message = link.expect(ANSWERS, max(0.0, resend - time.monotonic()))
        if message is None:
            if asked is None:
                link.mav.mission_count_send(*link.target, len(items))
            else:
                in_vain, spare = in_vain + 1, 1
                sent = _send_items(link, items[asked : asked + 1 + in_vain], sent)
            resend = time.monotonic() + RESEND_S
        elif message.get_type() != "MISSION_ACK":
            if message.seq <= last and (asked is None or message.seq >= asked):
                asked, in_vain = message.seq, 0
                sent = _send_items(link, items[asked : asked + 1 + spare], sent)
                resend = time.monotonic() + RESEND_S
        elif message.type == OUT_OF_ORDER or (message.type == ACCEPTED and sent < last):
            continue  # answers to what was sent twice, the clearing too
        elif message.type == ACCEPTED or (message.type == ERROR and sent == last):
            return  # after the last item an error can mean that the acceptance was lost: reading back decides
        elif message.type in (ERROR, CANCELLED):  # just booted, or it gave up: once more from the start
            asked, sent, in_vain = None, -1, 0
            link.expect((), 1.0)
            link.mav.mission_count_send(*link.target, len(items))
        else:
            raise _refused(link, message.type, len(items), asked)
    raise BadInput(
        link.url,
        f"the upload came to item {asked or 0} of {len(items)} and no further",
        "Bring the ground station closer to the vehicle, or use a better link",
    )


def _send_items(link: Link, items: tuple[MissionItem, ...], sent: int) -> int:
    """Returns the highest item sent so far."""
    for item in items:
        given = (item.param1, item.param2, item.param3, item.param4)
        params = (float("nan") if p is None else p for p in given)
        link.mav.mission_item_int_send(
            *link.target, item.seq, item.frame, item.command, 0, 1, *params, item.x, item.y, item.z
        )
        sent = max(sent, item.seq)
    return sent


def _refused(link: Link, result: int, count: int, asked: int | None) -> BadInput:
    if result == mavlink.MAV_MISSION_NO_SPACE:
        remedy = "Plan fewer photos or surfaces, and fly the rest as a second mission"
        return BadInput(link.url, f"the vehicle has no room for {count} mission items", remedy)
    name = mavlink.enums["MAV_MISSION_RESULT"][result].name.removeprefix("MAV_MISSION_").lower()
    return BadInput(
        link.url,
        f"the vehicle refused mission item {asked or 0} ({name.replace('_', ' ')})",
        "Check the plan's origin and heights; the mission is made for ArduCopter 4",
    )


def read_back(link: Link) -> tuple[MissionItem, ...]:
    """The mission that the vehicle holds, in its own words."""
    until = time.monotonic() + BASE_S
    answer = None
    while answer is None:
        if time.monotonic() > until:
            raise _no_read_back(link)
        link.mav.mission_request_list_send(*link.target)
        answer = link.expect(("MISSION_COUNT",), RESEND_S)
    items: dict[int, MissionItem] = {}
    until += ITEM_S * answer.count
    while missing := [seq for seq in range(answer.count) if seq not in items][:WINDOW]:
        if time.monotonic() > until:
            raise _no_read_back(link)
        for seq in missing:
            link.mav.mission_request_int_send(*link.target, seq)
        while any(seq not in items for seq in missing):
            message = link.expect(("MISSION_ITEM_INT",), RESEND_S)
            if message is None:
                break
            items[message.seq] = _item(message)
    link.mav.mission_ack_send(*link.target, ACCEPTED)
    return tuple(items[seq] for seq in sorted(items))


def _no_read_back(link: Link) -> BadInput:
    return BadInput(
        link.url,
        "the vehicle took the mission but does not read it back",
        "Bring the ground station closer to the vehicle, or use a better link",
    )


def _item(message: object) -> MissionItem:
    get = message.to_dict()  # type: ignore[attr-defined]
    params = {f"param{i}": None if (v := get[f"param{i}"]) != v else v for i in range(1, 5)}
    return MissionItem(
        seq=get["seq"],
        frame=get["frame"],
        command=get["command"],
        x=get["x"],
        y=get["y"],
        z=get["z"],
        **params,
    )


def compare(sent: tuple[MissionItem, ...], found: tuple[MissionItem, ...]) -> list[str]:
    """What differs in meaning, in words. ArduPilot legitimately tells another frame (6 as 3, 2 as 0), drops
    the acceptance radius and the mount mode, and puts its own home into item 0."""
    if len(sent) != len(found):
        return [f"{len(found)} items instead of {len(sent)}"]
    differences = []
    for mine, theirs in zip(sent[1:], found[1:], strict=True):
        what = f"item {mine.seq}"
        if mine.command != theirs.command:
            differences.append(f"{what} is command {theirs.command} instead of {mine.command}")
            continue
        place = mine.command in PLACES
        if place and theirs.frame not in (
            mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        ):
            differences.append(f"{what} is in frame {theirs.frame}: heights would not count from home")
        if (mine.x, mine.y) != (theirs.x, theirs.y):
            differences.append(f"{what} lies at ({theirs.x}, {theirs.y}) instead of ({mine.x}, {mine.y})")
        if place and abs(mine.z - theirs.z) > 0.011:
            differences.append(f"{what} is at {theirs.z:g} m instead of {mine.z:g} m")
        if abs((mine.param1 or 0.0) - (theirs.param1 or 0.0)) > 0.011:
            differences.append(f"{what} has parameter {theirs.param1} instead of {mine.param1}")
        if not place and abs((mine.param2 or 0.0) - (theirs.param2 or 0.0)) > 0.011:
            differences.append(f"{what} has parameter {theirs.param2} instead of {mine.param2}")
    return differences
