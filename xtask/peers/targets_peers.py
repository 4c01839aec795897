"""OpenCV's checkerboards on the same images: targets_peers.py FOLDER COUNT.

Prints one object: by detector the share of images with a board, rms of the corners (pixel), wrong labels, and CPU
milliseconds (mean, median, 95 %).
"""
import json
import math
import sys
import time

import cv2
import numpy as np

COLUMNS, ROWS = 9, 6
# Half windows of cornerSubPix; 0 takes a third of the least distance of neighbours.
WINDOWS = (2, 3, 5, 8, 11, 0)


def truth_of(path):
    rows = np.loadtxt(path, delimiter=",", ndmin=2)
    nodes = np.full((ROWS, COLUMNS, 2), np.nan)
    for i, j, x, y, _ in rows:
        nodes[int(j), int(i)] = x, y
    return nodes


def least_step(corners):
    grid = corners.reshape(ROWS, COLUMNS, 2)
    along = np.linalg.norm(np.diff(grid, axis=1), axis=2).min()
    return min(along, np.linalg.norm(np.diff(grid, axis=0), axis=2).min())


def refined(image, corners, half):
    half = half or max(2, int(least_step(corners) / 3.0))
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-4)
    return cv2.cornerSubPix(image, corners.copy(), (half, half), (-1, -1), criteria)


def classic(image):
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE
    return cv2.findChessboardCorners(image, (COLUMNS, ROWS), flags=flags)


def sector_based(image, flags=0):
    return cv2.findChessboardCornersSB(image, (COLUMNS, ROWS), flags=flags)


def errors(corners, truth):
    """Distances to the true nodes, either way round (OpenCV's order is its own)."""
    grid = corners.reshape(ROWS, COLUMNS, 2)
    ways = [np.linalg.norm(way - truth, axis=2) for way in (grid, grid[::-1, ::-1])]
    return min(ways, key=lambda way: np.nanmedian(way) if np.isfinite(way).any() else np.inf)


class Tally:
    def __init__(self):
        self.found, self.squares, self.count, self.wrong, self.ms = 0, 0.0, 0, 0, []

    def add(self, corners, truth, ms):
        self.ms.append(ms)
        if corners is None:
            return
        self.found += 1
        distance = errors(corners, truth)
        good = distance < min(2.0, 0.2 * least_step(corners))
        self.wrong += int((~good).sum())
        self.squares += float((distance[good] ** 2).sum())
        self.count += int(good.sum())

    def figures(self, count):
        ms = sorted(self.ms)
        return {
            "found": self.found / count,
            "rms_px": math.sqrt(self.squares / self.count) if self.count else None,
            "wrong": self.wrong,
            "ms": sum(ms) / len(ms),
            "ms_median": ms[len(ms) // 2],
            "ms_95": ms[int(0.95 * (len(ms) - 1))],
        }


def timed(call, *arguments):
    start = time.process_time()
    found, corners = call(*arguments)
    return (corners if found else None), 1e3 * (time.process_time() - start)


def main():
    folder, count = sys.argv[1], int(sys.argv[2])
    cv2.setNumThreads(1)
    exhaustive = cv2.CALIB_CB_EXHAUSTIVE + cv2.CALIB_CB_ACCURACY + cv2.CALIB_CB_NORMALIZE_IMAGE
    tallies = {name: Tally() for name in ["sb", "sb_exhaustive", "classic"] + [f"subpix_{half}" for half in WINDOWS]}
    for k in range(count):
        image = cv2.imread(f"{folder}/{k}.pgm", cv2.IMREAD_GRAYSCALE)
        truth = truth_of(f"{folder}/{k}.csv")
        tallies["sb"].add(*(lambda c, ms: (c, truth, ms))(*timed(sector_based, image)))
        corners, ms = timed(sector_based, image, exhaustive)
        tallies["sb_exhaustive"].add(corners, truth, ms)
        corners, ms = timed(classic, image)
        tallies["classic"].add(corners, truth, ms)
        for half in WINDOWS:
            start = time.process_time()
            better = None if corners is None else refined(image, corners, half)
            tallies[f"subpix_{half}"].add(better, truth, ms + 1e3 * (time.process_time() - start))
    print(json.dumps({name: tally.figures(count) for name, tally in tallies.items()}))


if __name__ == "__main__":
    main()
