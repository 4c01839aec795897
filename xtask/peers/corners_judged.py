"""Whose corners of a real checkerboard are the better ones: corners_judged.py FOLDER OBSERVATIONS.

FOLDER holds the images (opencv_left_chess), OBSERVATIONS is the table that `rangecam targets FOLDER --kind checkerboard 9x6 0.025`
wrote. Each set of corners is judged by cameras calibrated from it alone, by OpenCV: what no camera and no board explain is error
of the corners. OpenCV's are cornerSubPix with half windows of 5 and 8 pixels and, its best by what it leaves and by what is held out,
for each corner a third of the way to the next one. Prints, by set: distance from ours, then root mean squares of what is left
(pixel, both coordinates together) with a flat board of equal squares, with a board of any shape, the same with 14 lens
coefficients, and of the nodes of an image that had no part in camera, shape or pose (every image in turn, its pose from
every other node).
"""
import csv
import glob
import os
import sys

import cv2
import numpy as np

COLUMNS, ROWS, SQUARE = 9, 6, 25.0
HALVES = (5, 8)
BEST = "a third"
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-5)
FIT = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-10)
TWELVE = cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL
BOARD = np.zeros((COLUMNS * ROWS, 3), np.float32)
BOARD[:, :2] = np.mgrid[0:COLUMNS, 0:ROWS].T.reshape(-1, 2) * SQUARE


def in_order_of(corners, other):
    nearest = np.linalg.norm(corners[None] - other[:, None], axis=2).argmin(1)
    assert len(set(nearest)) == COLUMNS * ROWS
    return corners[nearest]


def opencv(images):
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    starts = [cv2.findChessboardCorners(image, (COLUMNS, ROWS), flags=flags)[1] for image in images]
    refine = lambda image, start, half: cv2.cornerSubPix(image, start.copy(), (half, half), (-1, -1), STOP).reshape(-1, 2)

    def thirds(image, start):
        start = start.reshape(-1, 1, 2)
        apart = np.linalg.norm(start - start.reshape(1, -1, 2), axis=2)
        np.fill_diagonal(apart, np.inf)
        halves = np.maximum(2, (apart.min(1) / 3).astype(int))
        return np.concatenate([refine(image, start[k : k + 1], int(half)) for k, half in enumerate(halves)])

    fixed = {half: [refine(i, s, half) for i, s in zip(images, starts)] for half in HALVES}
    return fixed | {BEST: [thirds(i, s) for i, s in zip(images, starts)]}


def ours(table, names, like):
    rows = list(csv.DictReader(open(table)))
    of = lambda name: np.array([[float(r["col"]), float(r["row"])] for r in rows if r["station"] == name])
    return [in_order_of(of(name), other) for name, other in zip(names, like)]


def rms(residuals):
    return float(np.sqrt((np.array(residuals) ** 2).sum(-1).mean()))


def calibrated(corners, size, is_free, flags=0):
    objects, points = [BOARD] * len(corners), [c.astype(np.float32).reshape(-1, 1, 2) for c in corners]
    # Three nodes settle the frame of a free board.
    fixed = COLUMNS - 1 if is_free else -1
    found = cv2.calibrateCameraRO(objects, points, size, fixed, None, None, flags=flags, criteria=FIT)
    _, camera, lens, turns, shifts, board = found[:6]
    board = board.reshape(-1, 3) if is_free else BOARD
    project = lambda turn, shift: cv2.projectPoints(board, turn, shift, camera, lens)[0].reshape(-1, 2)
    return camera, lens, board, [project(*pose) - seen for pose, seen in zip(zip(turns, shifts), corners)]


def held_out(corners, size):
    residuals = []
    even = (np.arange(COLUMNS * ROWS) % COLUMNS + np.arange(COLUMNS * ROWS) // COLUMNS) % 2 == 0
    for image, seen in enumerate(corners):
        camera, lens, board, _ = calibrated(corners[:image] + corners[image + 1 :], size, True)
        for half in (even, ~even):
            _, turn, shift = cv2.solvePnP(board[half], seen[half], camera, lens)
            residuals.extend(cv2.projectPoints(board[~half], turn, shift, camera, lens)[0].reshape(-1, 2) - seen[~half])
    return rms(residuals)


def main(folder, table):
    cv2.setNumThreads(1)
    paths = sorted(glob.glob(os.path.join(folder, "*.jpg")))
    images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in paths]
    size = images[0].shape[::-1]
    theirs = opencv(images)
    names = [os.path.splitext(os.path.basename(path))[0] for path in paths]
    sets = {"ours": ours(table, names, theirs[BEST])} | {f"cornerSubPix {half}": theirs[half] for half in (*HALVES, BEST)}
    print("| corners | distance | flat board | any board | 12 lens coefficients | held out |\n|---|---|---|---|---|---|")
    left = {}
    for name, corners in sets.items():
        distance = rms([a - b for a, b in zip(corners, sets["ours"])])
        flat = calibrated(corners, size, False)[3]
        left[name] = calibrated(corners, size, True)[3]
        wide = calibrated(corners, size, True, TWELVE)[3]
        figures = [distance, rms(flat), rms(left[name]), rms(wide), held_out(corners, size)]
        print(f"| {name} |", " | ".join(f"{figure:.3f}" for figure in figures), "|", flush=True)
    apart = np.linalg.norm(np.array(sets["ours"]) - np.array(theirs[BEST]), axis=2)
    radius = np.linalg.norm(np.array(theirs[BEST]) - np.array(size) / 2, axis=2)
    worst = np.quantile(apart, 0.9)
    parts = [("worst tenth of the distances", apart > worst), ("the rest", apart <= worst)]
    parts += [(f"{low} to {high} pixels from the middle", (radius >= low) & (radius < high))
              for low, high in ((0, 100), (100, 170), (170, 240), (240, 400))]
    print("\n| part (any board) | nodes | ours | cornerSubPix, a third | distance |\n|---|---|---|---|---|")
    for words, part in parts:
        figures = [rms(np.array(left[name])[part]) for name in ("ours", f"cornerSubPix {BEST}")]
        figures.append(float(np.sqrt((apart[part] ** 2).mean())))
        print(f"| {words} | {part.sum()} |", " | ".join(f"{figure:.3f}" for figure in figures), "|")
    print("\nby image:", " ".join(f"{n} {rms(o):.3f}/{rms(t):.3f}" for n, o, t in zip(names, left["ours"], left[f"cornerSubPix {BEST}"])))


main(*sys.argv[1:])
