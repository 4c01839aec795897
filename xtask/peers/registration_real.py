"""Real captures as folders of frames."""

import glob
import os

import numpy as np

from registration_data import FLIP, open3d, write


def real(folder, capture):
    """Depth images in mm with the poses of their camera."""
    o3d = open3d()
    names = sorted(glob.glob(os.path.join(capture, "frame-*.depth.png")))
    intrinsic = np.loadtxt(os.path.join(capture, "camera-intrinsics.txt"))
    fx, fy, cx, cy = intrinsic[0, 0], intrinsic[1, 1], intrinsic[0, 2], intrinsic[1, 2]
    frames, poses = [], []
    for name in names:
        depth = np.asarray(o3d.io.read_image(name)).astype(float)
        depth[(depth == 0) | (depth == 65535)] = np.nan
        row, col = np.mgrid[0 : depth.shape[0], 0 : depth.shape[1]]
        z = depth / 1e3
        frames.append(np.stack([(col - cx) / fx * z, (cy - row) / fy * z, -z], -1).reshape(-1, 3))
        poses.append(FLIP @ np.loadtxt(name.replace(".depth.png", ".pose.txt")) @ FLIP)
    height, width = depth.shape
    write(folder, [width, height, fx, fy, cx, cy], frames, poses)
    path = sum(np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(poses, poses[1:]))
    return {"real": {"frames": len(names), "metres": path}}


def scans(folder, target, source, reference):
    """Two lists of points as text, and the pose of the second in the first."""
    clouds = [points(name) for name in (target, source)]
    write(folder, [len(clouds[0]), 1, 1, 1, 0, 0], clouds, [np.eye(4), np.loadtxt(reference)])
    return {"scans": {"points": len(clouds[0])}}


def points(name):
    """Lines of three or more numbers; all others are left out."""
    rows = []
    for line in open(name, errors="replace"):
        try:
            row = [float(word) for word in line.split()]
        except ValueError:
            continue
        if len(row) >= 3:
            rows.append(row[:3])
    return np.array(rows)
