"""Where a simulated vehicle truly flies for a mission, and where it believes to be.

Commands run as ArduCopter runs them (AP_Mission): the DO and CONDITION items that follow a waypoint start
when the vehicle leaves it, one after the other; CONDITION_YAW holds back those behind it until the nose is
within 2°; what is still waiting when the next waypoint is reached is dropped. Without a commanded yaw the
nose turns along the path, and without a commanded speed it flies at its own. A mission that orders its items
badly therefore takes bad photos here too, and one that does not stop at a waypoint rounds the corner.

Time is virtual: everything depends on the mission, the vehicle and the seed alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.camera import CameraPose
from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin
from schemas.mission import MissionItem
from schemas.vehicle import Vehicle

Array = npt.NDArray[np.float64]

STEP_S = 0.02  # of the simulation, also one turn of the autopilot's mission loop
LAG_S = 0.12  # of each of the two first-order stages with which the vehicle follows its reference
SHUTTER_DELAY_S = 0.05  # from the trigger to the exposure
GIMBAL_RATE_DEG_S = 45.0
OWN_SPEED_M_S = 10.0  # ArduCopter's WPNAV_SPEED as delivered
ROUNDING_M = 2.0  # its WPNAV_RADIUS as delivered
YAW_REACHED_DEG = 2.0  # ArduCopter's verify_yaw
TOUCHDOWN_S = 1.0  # from the ground contact to the motors' stop
BIAS_S, JITTER_S = 60.0, 0.5  # memory of the slow position error, which walks over minutes, and of the quick
GUST_M, GUST_S = 0.02, 1.0  # the vehicle sees where gusts push it and steers against
COMPASS_DEG, NOSE_DEG, NOSE_S = 0.9, 0.3, 0.5  # unseen heading error (as slow as the bias) and seen swaying
GIMBAL_DEG, GIMBAL_S = 0.3, 5.0  # unseen error of pitch and roll
NAVIGATION = (mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_LAND)
DO = (
    mavlink.MAV_CMD_CONDITION_YAW,
    mavlink.MAV_CMD_DO_CHANGE_SPEED,
    mavlink.MAV_CMD_DO_MOUNT_CONTROL,
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
)


@dataclass(frozen=True)
class TrueShot:
    """One exposure. Poses are the camera's; the log carries the estimated one."""

    photo: str | None
    time_s: float  # since arming
    true_pose: CameraPose
    estimated_pose: CameraPose
    velocity_m_s: Vector3  # true, world ENU


@dataclass(frozen=True)
class Flown:
    """The flight, sampled every STEP_S seconds from arming to disarming."""

    time_s: Array  # (N,)
    true_m: Array  # (N, 3) world ENU
    estimated_m: Array  # (N, 3)
    true_yaw_deg: Array  # (N,) not wrapped
    estimated_yaw_deg: Array  # (N,)
    shots: tuple[TrueShot, ...]
    reached: tuple[tuple[int, float], ...]  # mission item and when it was reached


class _Axis:
    """A rate-limited angle as knots of a piecewise linear function of time."""

    def __init__(self, rate_deg_s: float) -> None:
        self.rate_deg_s = rate_deg_s
        self.time_s, self.angle_deg = [0.0], [0.0]

    def turn(self, at_s: float, target_deg: float) -> float:
        """Turn the short way from `at_s` on; returns when the target is reached."""
        now = float(np.interp(at_s, self.time_s, self.angle_deg))
        while self.time_s[-1] > at_s:  # a new command overrides the running one
            self.time_s.pop(), self.angle_deg.pop()
        change = (target_deg - now + 180.0) % 360.0 - 180.0
        done = at_s + abs(change) / self.rate_deg_s
        self.time_s += [at_s, done]
        self.angle_deg += [now, now + change]
        return done

    def sample(self, time_s: Array) -> Array:
        return np.asarray(np.interp(time_s, self.time_s, self.angle_deg))


def fly_mission(
    items: tuple[MissionItem, ...], origin: GeoOrigin, home_m: Vector3, vehicle: Vehicle, seed: int
) -> Flown:
    """Fly the mission: straight legs, limited acceleration and yaw rate, at the speed that the mission
    commands. Take-off climbs at the vehicle's. A waypoint without a hold before another is flown past: as in
    ArduCopter (SCurve::advance_target_along_track) the next leg starts while this one brakes."""
    yaw, pitch = _Axis(vehicle.yaw_rate_deg_s), _Axis(GIMBAL_RATE_DEG_S)
    position = np.asarray(home_m, dtype=float)
    reference = [position[None]]
    triggers: list[tuple[MissionItem, float]] = []
    reached: list[tuple[int, float]] = []
    now, speed_m_s, braking = 0.0, OWN_SPEED_M_S, 0
    climbs = False
    for before, item in _legs(items):
        for command in before:
            if command.command == mavlink.MAV_CMD_DO_CHANGE_SPEED and not climbs:
                speed_m_s = _single(command.param2)  # right after a climb Copter 4.1 to 4.4 forgets it
        climbs = item.command == mavlink.MAV_CMD_NAV_TAKEOFF
        top_m_s = vehicle.speed_m_s if climbs else speed_m_s
        target = _target(item, position, origin, home_m)
        over = np.array([target[0], target[1], max(position[2], target[2])])
        landing = item.command == mavlink.MAV_CMD_NAV_LAND  # flies over the place, then comes down
        corners = [position, over, target] if landing else [position, target]
        leg = np.vstack([_ramp(a, b, top_m_s, vehicle.acceleration_m_s2) for a, b in pairwise(corners)])
        waypoint = item.command == mavlink.MAV_CMD_NAV_WAYPOINT
        hold_s = (item.param1 or 0.0) if waypoint else 0.0
        ramp = _ramp_steps(float(np.linalg.norm(target - position)), top_m_s, vehicle.acceleration_m_s2)
        if braking and waypoint:
            both = min(braking, ramp)
            reference[-1][-both:] += leg[:both] - position
            leg, now = leg[both:], now - both * STEP_S
            reached[-1] = (reached[-1][0], now)
        braking = ramp if waypoint and hold_s == 0.0 else 0
        if landing:
            hold_s = TOUCHDOWN_S
        leg = np.vstack([leg, np.repeat(target[None], round(hold_s / STEP_S), axis=0)])
        end = now + len(leg) * STEP_S
        along = target[:2] - position[:2]
        if np.hypot(*along) > 0.3:
            yaw.turn(now, float(np.degrees(np.arctan2(along[0], along[1]))))
        loop = now
        for command in before:
            if loop >= end:
                break
            if command.command == mavlink.MAV_CMD_CONDITION_YAW:
                done = yaw.turn(loop, origin.yaw_deg(_single(command.param1)))
                loop = max(loop, done - YAW_REACHED_DEG / vehicle.yaw_rate_deg_s)
            elif command.command == mavlink.MAV_CMD_DO_MOUNT_CONTROL:
                pitch.turn(loop, _single(command.param1))
                yaw.turn(loop, origin.yaw_deg(_single(command.param3)))  # as Copter up to 4.5 does
            elif command.command == mavlink.MAV_CMD_DO_DIGICAM_CONTROL and command.x == 1:
                triggers.append((command, loop + SHUTTER_DELAY_S))
            loop += STEP_S
        reference.append(leg)
        reached.append((item.seq, end))
        position, now = target, end
    return _with_errors(np.vstack(reference), yaw, pitch, triggers, tuple(reached), vehicle, seed)


def _legs(items: tuple[MissionItem, ...]) -> Iterator[tuple[list[MissionItem], MissionItem]]:
    """Each navigation item with the commands that run on the way to it. Item 0 is home."""
    before: list[MissionItem] = []
    for item in items[1:]:
        if item.command in NAVIGATION:
            yield before, item
            before = []
        else:
            before.append(item)


def _target(item: MissionItem, position: Array, origin: GeoOrigin, home_m: Vector3) -> Array:
    if item.x == 0 and item.y == 0:  # no position given: where it is
        east, north = position[0], position[1]
    else:
        east, north, _ = origin.to_enu(item.x / 1e7, item.y / 1e7, 0.0)
    if item.command == mavlink.MAV_CMD_NAV_TAKEOFF:  # ArduCopter climbs straight up, whatever it is told
        east, north = position[0], position[1]
    height = 0.0 if item.command == mavlink.MAV_CMD_NAV_LAND else _single(item.z)
    up = home_m[2] + height
    if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and height == 0.0:  # no height given: its own
        up = position[2]
    return np.array([east, north, up])


def _ramp_steps(distance_m: float, speed_m_s: float, acceleration_m_s2: float) -> int:
    """Steps of a leg's acceleration, as of its braking, of which two legs can share as many at a corner."""
    ramp_s = min(speed_m_s / acceleration_m_s2, np.sqrt(distance_m / acceleration_m_s2))
    return int(min(ramp_s, 2 * np.sqrt(ROUNDING_M / acceleration_m_s2)) / STEP_S)


def _ramp(start: Array, end: Array, speed_m_s: float, acceleration_m_s2: float) -> Array:
    """(n, 3) positions every STEP_S of a straight leg: accelerate, cruise, brake. Excludes the start."""
    distance = float(np.linalg.norm(end - start))
    if distance < 1e-9:
        return np.empty((0, 3))
    a = acceleration_m_s2
    ramp_s = min(speed_m_s / a, np.sqrt(distance / a))
    top = a * ramp_s
    total_s = 2 * ramp_s + (distance - a * ramp_s**2) / top
    t = np.minimum(np.arange(1, int(np.ceil(total_s / STEP_S)) + 1) * STEP_S, total_s)
    rising = 0.5 * a * np.minimum(t, ramp_s) ** 2
    cruising = top * np.clip(t - ramp_s, 0.0, total_s - 2 * ramp_s)
    braking = np.maximum(t - (total_s - ramp_s), 0.0)
    travelled = rising + cruising + top * braking - 0.5 * a * braking**2
    return np.asarray(start + np.outer(travelled / distance, end - start))


def _with_errors(
    reference: Array,
    yaw: _Axis,
    pitch: _Axis,
    triggers: list[tuple[MissionItem, float]],
    reached: tuple[tuple[int, float], ...],
    vehicle: Vehicle,
    seed: int,
) -> Flown:
    """What the vehicle makes of the reference. Its controller brings the *estimated* position to the
    reference, late; the true position is off by the estimate's error."""
    rng = np.random.default_rng([seed, 0x466C79])
    steps = len(reference)
    time_s: Array = np.arange(steps, dtype=np.float64) * STEP_S
    slow, quick = vehicle.position_bias_m, vehicle.position_jitter_m
    sigma = np.array([slow] * 3 + [quick] * 3 + [GUST_M] * 3 + [COMPASS_DEG, NOSE_DEG] + [GIMBAL_DEG] * 2)
    memory_s = np.array([BIAS_S] * 3 + [JITTER_S] * 3 + [GUST_S] * 3 + [BIAS_S, NOSE_S] + [GIMBAL_S] * 2)
    walks = _walks(rng, steps, sigma, memory_s)
    bias, jitter, gusts, compass, wobble, gimbal = np.split(walks, [3, 6, 9, 10, 11], axis=1)
    bias = bias - [0.0, 0.0, bias[0, 2]]  # heights count from where it took off
    estimated = _lagged(reference) + gusts
    true = estimated - bias - jitter
    nose = yaw.sample(time_s) + wobble[:, 0]
    true_yaw = nose + compass[:, 0]
    velocity = np.gradient(true, STEP_S, axis=0) if steps > 1 else np.zeros((steps, 3))

    def at(series: Array, when_s: float) -> Array:
        columns = series.reshape(steps, -1).T
        return np.array([np.interp(when_s, time_s, column) for column in columns])

    def pose(position_m: Array, yaw_deg: float, pitch_deg: float, roll_deg: float) -> CameraPose:
        x, y, z = position_m
        return CameraPose(
            position_m=(float(x), float(y), float(z)),
            yaw_deg=float(yaw_deg) % 360.0,
            pitch_deg=float(np.clip(pitch_deg, -90.0, 90.0)),
            roll_deg=float(roll_deg),
        )

    shots = []
    for item, when in triggers:
        tilt = float(pitch.sample(np.array([when], dtype=np.float64))[0])
        shake = at(gimbal, when)
        vx, vy, vz = at(velocity, when)
        shots.append(
            TrueShot(
                photo=item.photo,
                time_s=when,
                true_pose=pose(at(true, when), at(true_yaw, when)[0], tilt + shake[0], shake[1]),
                estimated_pose=pose(at(estimated, when), at(nose, when)[0], tilt, 0.0),
                velocity_m_s=(float(vx), float(vy), float(vz)),
            )
        )
    return Flown(time_s, true, estimated, true_yaw, nose, tuple(shots), reached)


def _lagged(reference: Array) -> Array:
    """Two first-order stages: their kernel is positive and sums to one, so speed and acceleration limits of
    the reference hold for the result."""
    keep = np.full(3, np.exp(-STEP_S / LAG_S))
    lagged = reference - reference[0]
    for _ in range(2):
        lagged = _recursive((1 - keep) * lagged, keep, np.zeros(3))
    return np.asarray(lagged + reference[0])


def _walks(rng: np.random.Generator, steps: int, sigma: Array, memory_s: Array) -> Array:
    """(steps, n) of n stationary second-order Gauss-Markov processes: smooth enough to have a speed.

    Both poles lie at a = exp(−Δt/τ). Driven by unit noise the first stage has variance v = 1/(1 − a²), the
    second (v + 2a²c)/(1 − a²) with the covariance c = v/(1 − a²); the first state is drawn from these.
    """
    a = np.exp(-STEP_S / memory_s)
    v = 1 / (1 - a * a)
    c = v * v
    w = (v + 2 * a * a * c) * v
    first = np.sqrt(v) * rng.standard_normal(len(a))
    second = c / v * first + np.sqrt(w - c * c / v) * rng.standard_normal(len(a))
    driven = _recursive(rng.standard_normal((steps, len(a))), a, first)
    return np.asarray(sigma / np.sqrt(w) * _recursive(driven, a, second))


def _recursive(inputs: Array, keep: Array, state: Array) -> Array:
    """(N, n): y_k = keep · y_(k−1) + x_k. A loop, since importing scipy.signal takes the vehicle longer."""
    outputs = np.empty_like(inputs)
    for k, x in enumerate(inputs):
        outputs[k] = state = keep * state + x
    return outputs


def _single(value: float | None) -> float:
    """The value after a trip through a MAVLink message, so that both ways to fly a mission agree."""
    return float(np.float32(0.0 if value is None else value))
