"""Discs as OpenCV finds them, beside the lines of the example `peers_circles` (standard input): circles_peers.py FOLDER."""
import json
import sys

import cv2
import numpy as np


def blobs(image):
    """Centres of SimpleBlobDetector, as findCirclesGrid uses it, for bright discs of any size and tilt."""
    options = cv2.SimpleBlobDetector_Params()
    options.filterByColor, options.blobColor = True, 255
    options.minArea, options.maxArea = 6, 1e5
    options.filterByInertia = options.filterByConvexity = options.filterByCircularity = False
    options.minDistBetweenBlobs = 5
    return np.array([point.pt for point in cv2.SimpleBlobDetector_create(options).detect(image)]).reshape(-1, 2)


def ellipses(image):
    """Centres of ellipses fitted to the contours at Otsu's threshold."""
    _, bright = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.array([cv2.fitEllipse(points)[0] for points in contours if len(points) >= 5]).reshape(-1, 2)


def summary(errors):
    errors = np.array(errors)
    found = errors[np.isfinite(errors)]
    return {"found": len(found) / len(errors), "rms": float(np.sqrt(np.mean(found**2))), "worst": float(found.max())}


rows = [line.split() for line in sys.stdin]
discs = [(int(row[1]), *map(float, row[2:])) for row in rows if row and row[0] == "disc"]
errors = {"ours": [], "blobs": [], "ellipses": []}
for k in sorted({disc[0] for disc in discs}):
    image = cv2.imread(f"{sys.argv[1]}/{k}.pgm", cv2.IMREAD_GRAYSCALE)
    found = {"blobs": blobs(image), "ellipses": ellipses(image)}
    for _, col, row, own_col, own_row, _ in (disc for disc in discs if disc[0] == k):
        errors["ours"].append(np.hypot(own_col - col, own_row - row))
        for name, points in found.items():
            near = np.hypot(*(points - [col, row]).T).min() if len(points) else np.nan
            errors[name].append(near if near < 2 else np.nan)
squares = [disc[5] for disc in discs if np.isfinite(disc[5])]
times = [float(row[2]) for row in rows if row and row[0] == "ms"]
answer = {name: summary(values) for name, values in errors.items()}
print(json.dumps(answer | {"normalised squared error": float(np.mean(squares)), "ms": float(np.median(times))}))
