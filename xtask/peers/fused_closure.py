"""How two fused clouds of the same place, made from other frames, differ over what is stated of both: fused_closure.py CLOUD CLOUD [POSE POSE].

Each CLOUD is the `cloud.ply` that `rangecam fuse` wrote. The second is brought onto the first by a rigid motion, since each has a frame of its
own; the motion starts from identity, or from POSE and POSE, files with the camera-to-world matrix of the frame that each cloud's coordinates
are those of, axes of computer vision. Fused points are partners that are each other's nearest within ASIDE along the surface and OFF across
it, and whose normals agree within ANGLE. Prints the robust and the root mean square distance of partners along their normals, over the deviations that both state from all sources (`sigma`; 1: as stated) and over
those of their own errors (`sigma_own`), which leave out what the points of one cloud have in common. What both clouds have in common, as a
pattern of the sensor, shows in neither.
"""
import sys

import numpy as np
from fused_planes import fused_points, robust

ASIDE, OFF, ANGLE = 0.03, 0.05, np.cos(np.radians(10))
ROUNDS, START = 60, 30  # Until then partners may be thrice as far off each other and twice as far aside.
PHOTOGRAMMETRIC = np.diag([1.0, -1.0, -1.0, 1.0])


def nearest(points, others):
    return np.concatenate([((part[:, None] - others) ** 2).sum(2).argmin(1) for part in np.array_split(points, 1 + len(points) // 500)])


def partners(first, second, wider):
    """Indices of partners, their normals and their distances along these."""
    (points, normals), (others, other_normals) = first, second
    of = nearest(points, others)
    at = np.flatnonzero(nearest(others, points)[of] == np.arange(len(points)))
    normal = normals[at] + other_normals[of[at]]
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-12)[:, None]
    difference = others[of[at]] - points[at]
    off = (difference * normal).sum(1)
    aside = np.linalg.norm(difference - off[:, None] * normal, axis=1)
    angle = np.cos(np.radians(20)) if wider else ANGLE
    good = (np.abs(off) < OFF * (3 if wider else 1)) & (aside < ASIDE * (2 if wider else 1))
    good &= (normals[at] * other_normals[of[at]]).sum(1) > angle
    return at[good], of[at][good], normal[good], off[good]


def brought_onto(first, second, sigma):
    """The second cloud by the rigid motion that brings it onto the first, by distances along normals, those far off with less weight."""
    for round_number in range(ROUNDS):
        at, of, normal, off = partners(first, second, round_number < START)
        if len(at) < 100:
            sys.exit(f"{len(at)} fused points have a partner: the clouds do not overlap, or start too far off each other; give both poses")
        stated = np.hypot(sigma[0][at], sigma[1][of])
        weight = (1 + (off / stated / 2) ** 2) ** -0.5 / stated
        points, normals = second
        equations = np.hstack([np.cross(points[of], normal), normal]) * weight[:, None]
        turn, shift = np.split(-np.linalg.lstsq(equations, off * weight, rcond=None)[0], 2)
        skew = np.cross(np.eye(3), turn)
        left, _, right = np.linalg.svd(np.eye(3) + skew)
        rotation = left @ right
        second = points @ rotation.T + shift, normals @ rotation.T
    return second


def main(first_path, second_path, *poses):
    (points, normals, sigma), (others, other_normals, other_sigma) = fused_points(first_path), fused_points(second_path)
    start = np.eye(4)
    if poses:
        first_pose, second_pose = map(np.loadtxt, poses)
        start = PHOTOGRAMMETRIC @ np.linalg.inv(first_pose) @ second_pose @ PHOTOGRAMMETRIC
    rotation = start[:3, :3]
    first = points, normals
    second = others @ rotation.T + start[:3, 3], other_normals @ rotation.T
    second = brought_onto(first, second, (sigma[:, 1], other_sigma[:, 1]))
    at, of, _, off = partners(first, second, False)
    print(f"{len(at)} of {len(points)} and {len(others)} fused points are partners, {1e3 * robust(off):.2f} mm from each other (robust)")
    for column, name in ((1, "all sources"), (0, "their own errors")):
        stated = np.hypot(sigma[at, column], other_sigma[of, column])
        over = off / stated
        print(f"{name}: {1e3 * np.median(stated):.2f} mm are stated (median), over stated {robust(over):.2f}, root mean square {np.sqrt(np.mean(over**2)):.2f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
