"""How fused points scatter about the planes that they lie on, over their stated deviations, and how the points of single frames do:
fused_planes.py CLOUD [RESULT].

CLOUD is the `cloud.ply` that `rangecam fuse` wrote. Large planes are found in it by samples of single fused points, the largest first:
fused points within TOLERANCE and ANGLE, connected over cells of CELL. On each, planes are fitted within RADIUS about every third point,
so that what bends a whole wall is no scatter, and what neighbours have in common neither. Prints for each plane, and for all together, the
robust scatter in millimetres, robust and root mean square scatter over the deviations that are stated of the points' own errors
(`sigma_own`; 1: as stated), and robust over those with what points have in common (`sigma`); then the robust scatter about the whole plane over
`sigma`: what points have in common is alike within RADIUS, and differs over a wall. With the `cloud.ply` that was fused as RESULT, also the robust
scatter of the points of single frames about planes of their own, fitted within RADIUS on the same walls: how thick a section is in one frame.
"""
import re
import sys

import numpy as np

TOLERANCE, ANGLE, CELL, RADIUS = 0.02, np.cos(np.radians(20)), 0.08, 0.3
LEAST, MOST_PLANES, SAMPLES, FEWEST = 60, 12, 400, 12
# Points of a single frame: farthest off the plane of the fused points, metre; fewest for a plane; places on a wall about which planes are
# fitted. A few places more or less decide where a small wall has a relief.
FARTHEST, FEWEST_OF_FRAME, CENTRES = 0.06, 300, 20


def read(path):
    with open(path, "rb") as file:
        text = b""
        while not text.endswith(b"end_header\n"):
            text += file.readline()
        types = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4"}
        fields = [(name, types[kind]) for kind, name in re.findall(r"property (\w+) (\w+)", text.decode())]
        count = int(re.search(r"element vertex (\d+)", text.decode())[1])
        return np.frombuffer(file.read(), dtype=fields, count=count)


def columns(cloud, names):
    return np.stack([cloud[name] for name in names], 1).astype(float)


def fused_points(path):
    cloud = read(path)
    normals = [name for name in cloud.dtype.names if re.fullmatch("n[xyz]|normal_[xyz]", name)]
    return columns(cloud, "xyz"), columns(cloud, normals), columns(cloud, ["sigma_own", "sigma"])


def points_of_frames(path):
    cloud = read(path)
    points = columns(cloud, "xyz")
    good = np.isfinite(points).all(1) & (cloud["flags"] == 0)
    return points[good], cloud["frame"][good]


def largest_part(points):
    """Of the points, those of the largest set of cells that touch each other."""
    cells = {}
    for index, cell in enumerate(map(tuple, np.floor(points / CELL).astype(int))):
        cells.setdefault(cell, []).append(index)
    steps = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    seen, largest = set(), []
    for start in cells:
        if start in seen:
            continue
        seen.add(start)
        waiting, part = [start], []
        while waiting:
            cell = waiting.pop()
            part += cells[cell]
            beside = {tuple(np.add(cell, step)) for step in steps} & cells.keys() - seen
            seen |= beside
            waiting += sorted(beside)
        largest = max(largest, part, key=len)
    return np.array(sorted(largest))


def planes(points, normals):
    random, free = np.random.default_rng(0), np.ones(len(points), bool)
    on = lambda centre, normal: free & (np.abs((points - centre) @ normal) < TOLERANCE) & (normals @ normal > ANGLE)
    for _ in range(MOST_PLANES):
        left = np.flatnonzero(free)
        if len(left) < LEAST:
            return
        tried = random.choice(left, min(SAMPLES, len(left)), replace=False)
        inside = max((on(points[at], normals[at]) for at in tried), key=np.sum)
        for _ in range(3):
            if inside.sum() < LEAST:
                break
            centre = points[inside].mean(0)
            normal = np.linalg.svd(points[inside] - centre, full_matrices=False)[2][2]
            normal *= np.sign(normal @ normals[inside].mean(0))
            inside = on(centre, normal)
        found = np.flatnonzero(inside)
        free[inside] = False
        part = found[largest_part(points[found])] if len(found) else found
        if len(part) >= LEAST:
            yield part


def off_plane(points, weights):
    centre = (points * weights[:, None]).sum(0) / weights.sum()
    return (points - centre) @ np.linalg.svd((points - centre) * np.sqrt(weights)[:, None], full_matrices=False)[2][2]


def scatter(points, sigma):
    """Distances from the planes about every third point, and the same over both stated deviations."""
    distances, standardised, own = [], [], sigma[:, 0]
    for centre in points[::3]:
        near = ((points - centre) ** 2).sum(1) < RADIUS**2
        count = near.sum()
        if count >= FEWEST:
            # What the plane itself takes of them.
            off = off_plane(points[near], 1 / own[near] ** 2) * np.sqrt(count / (count - 3))
            distances.extend(off)
            standardised.extend(off[:, None] / sigma[near])
    return np.array(distances), np.array(standardised).reshape(-1, 2)


def robust(values):
    return 1.4826 * np.median(np.abs(values - np.median(values)))


def occupied(points, origin):
    return np.unique(np.floor((points - origin) / CELL).astype(int) @ np.array([1, 1 << 20, 1 << 40]))


def scatter_of_frames(part, points, frames):
    """Distances of points of single frames, on the walls of some fused points, from planes of their own."""
    low, high = part.min(0) - RADIUS, part.max(0) + RADIUS
    inside = ((points > low) & (points < high)).all(1)
    points, frames, distances = points[inside], frames[inside], []
    for centre in part[:: max(1, len(part) // CENTRES)]:
        about = part[((part - centre) ** 2).sum(1) < RADIUS**2]
        if len(about) < FEWEST:
            continue
        normal = np.linalg.svd(about - about.mean(0), full_matrices=False)[2][2]
        off = (points - about.mean(0)) @ normal
        near = (np.abs(off) < FARTHEST) & (((points - centre) ** 2).sum(1) < RADIUS**2)
        # Those whose foot lies where the wall is.
        feet = points[near] - off[near, None] * normal
        cells = np.floor((feet - low) / CELL).astype(int) @ np.array([1, 1 << 20, 1 << 40])
        on_wall = np.flatnonzero(near)[np.isin(cells, occupied(about, low))]
        for frame in np.unique(frames[on_wall]):
            own = points[on_wall[frames[on_wall] == frame]]
            if len(own) >= FEWEST_OF_FRAME:
                distances.extend(off_plane(own, np.ones(len(own))))
    return np.array(distances)


def line(name, distances, standardised, whole):
    own, all_sources = standardised.T
    square = np.sqrt(np.mean(own**2))
    over = f"over stated {robust(own):.2f} (root mean square {square:.2f}; with all sources {robust(all_sources):.2f}; about the whole plane {robust(whole):.2f})"
    return f"{name}: {1e3 * robust(distances):.2f} mm, {over}"


def main(path, result=None):
    points, normals, sigma = fused_points(path)
    given = points_of_frames(result) if result else None
    found = []
    for part in planes(points, normals):
        distances, standardised = scatter(points[part], sigma[part])
        if not len(distances):
            continue
        of_frames = scatter_of_frames(points[part], *given) if given else np.array([])
        centre = ", ".join(f"{value:.2f}" for value in points[part].mean(0))
        whole = off_plane(points[part], 1 / sigma[part, 0] ** 2) / sigma[part, 1]
        found.append((f"{len(part)} fused points about ({centre})", distances, standardised, whole, of_frames))
    found.append(("all", *(np.concatenate([plane[at] for plane in found]) for at in (1, 2, 3, 4))))
    for name, distances, standardised, whole, of_frames in found:
        single = f"; single frames {1e3 * robust(of_frames):.2f} mm" if len(of_frames) else ""
        print(line(name, distances, standardised, whole) + single)


if __name__ == "__main__":
    main(*sys.argv[1:])
