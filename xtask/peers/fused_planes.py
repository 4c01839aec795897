"""How fused points scatter about the planes that they lie on, over their stated deviations: fused_planes.py CLOUD.

CLOUD is the `cloud.ply` that `rangecam fuse` wrote. Large planes are found in it by samples of single fused points, the largest first:
fused points within TOLERANCE and ANGLE, connected over cells of CELL. On each, planes are fitted within RADIUS about every third point,
so that what bends a whole wall is no scatter. Prints for each plane, and for all together, the robust scatter in millimetres, and
robust and root mean square scatter over the stated deviations (1: as stated).
"""
import re
import sys

import numpy as np

TOLERANCE, ANGLE, CELL, RADIUS = 0.02, np.cos(np.radians(20)), 0.08, 0.3
LEAST, MOST_PLANES, SAMPLES, FEWEST = 60, 12, 400, 12


def fused_points(path):
    with open(path, "rb") as file:
        text = b""
        while not text.endswith(b"end_header\n"):
            text += file.readline()
        types = {"float": "<f4", "double": "<f8", "ushort": "<u2", "uint": "<u4"}
        fields = [(name, types[kind]) for kind, name in re.findall(r"property (\w+) (\w+)", text.decode())]
        count = int(re.search(r"element vertex (\d+)", text.decode())[1])
        cloud = np.frombuffer(file.read(), dtype=fields, count=count)
    columns = lambda names: np.stack([cloud[name] for name in names], 1).astype(float)
    normals = [name for name in cloud.dtype.names if re.fullmatch("n[xyz]|normal_[xyz]", name)]
    return columns("xyz"), columns(normals), cloud["sigma"].astype(float)


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
    """Distances from the planes about every third point, and the same over the stated deviations."""
    distances, standardised = [], []
    for centre in points[::3]:
        near = ((points - centre) ** 2).sum(1) < RADIUS**2
        count = near.sum()
        if count >= FEWEST:
            # What the plane itself takes of them.
            off = off_plane(points[near], 1 / sigma[near] ** 2) * np.sqrt(count / (count - 3))
            distances.extend(off)
            standardised.extend(off / sigma[near])
    return np.array(distances), np.array(standardised)


def line(name, distances, standardised):
    robust = lambda values: 1.4826 * np.median(np.abs(values - np.median(values)))
    square = np.sqrt(np.mean(standardised**2))
    print(f"{name}: {1e3 * robust(distances):.2f} mm, over stated {robust(standardised):.2f} (root mean square {square:.2f})")


def main(path):
    points, normals, sigma = fused_points(path)
    all_planes = [(part, scatter(points[part], sigma[part])) for part in planes(points, normals)]
    for part, (distances, standardised) in all_planes:
        if len(distances):
            centre = ", ".join(f"{value:.2f}" for value in points[part].mean(0))
            line(f"{len(part)} fused points about ({centre})", distances, standardised)
    line("all", *(np.concatenate([found[at] for _, found in all_planes]) for at in (0, 1)))


main(*sys.argv[1:])
