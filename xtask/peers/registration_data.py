"""Folders of frames as the example registration_peers writes them, and what all peers need."""

import os
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

# From the frames' axes (x right, y up, looking along -z) to those of images (y down, z forwards), and back.
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
# A pair counts as good below these.
GOOD_DEG, GOOD_MM = 1.0, 30.0


def open3d():
    """Open3D; the library of USB devices that its sensors' part wants comes from another package."""
    import ctypes

    import libusb_package

    ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    import open3d

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    return open3d


class Frames:
    """Frames of one camera with their true poses."""

    def __init__(self, folder):
        self.folder = folder
        width, height, *pinhole = np.loadtxt(os.path.join(folder, "camera.txt"))
        self.shape, self.pinhole = (int(height), int(width)), pinhole
        self.poses = poses(os.path.join(folder, "poses.txt"))

    def image(self, frame):
        """Points in the camera's frame, one a pixel."""
        return np.fromfile(os.path.join(self.folder, f"{frame:03}.f32"), np.float32).reshape(-1, 3)

    def points(self, frame):
        """Those that there are, as most peers want them."""
        points = self.image(frame).astype(float)
        return np.ascontiguousarray(points[np.isfinite(points[:, 0])])

    def pairs(self, stride):
        return [(first, first + 1) for first in range(0, len(self.poses) - 1, stride)]

    def truth(self, target, source):
        return np.linalg.inv(self.poses[target]) @ self.poses[source]


def poses(path):
    rows = np.loadtxt(path, ndmin=2).reshape(-1, 3, 4)
    return [np.vstack([pose, [0, 0, 0, 1]]) for pose in rows]


def write(folder, camera, frames, truths):
    os.makedirs(folder, exist_ok=True)
    np.savetxt(os.path.join(folder, "camera.txt"), [camera], "%.10g")
    np.savetxt(os.path.join(folder, "poses.txt"), [np.ravel(pose[:3]) for pose in truths], "%.17g")
    for index, points in enumerate(frames):
        np.asarray(points, np.float32).tofile(os.path.join(folder, f"{index:03}.f32"))


def angle_deg(rotation):
    sine = np.linalg.norm([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return float(np.degrees(np.arctan2(sine, np.trace(rotation) - 1)))


def error(found, truth):
    """Angle in degrees and distance in mm between two poses."""
    return angle_deg(found[:3, :3].T @ truth[:3, :3]), float(1e3 * np.linalg.norm(found[:3, 3] - truth[:3, 3]))


def timed(work):
    """The result and CPU milliseconds of the whole process."""
    start = time.process_time()
    result = work()
    return result, 1e3 * (time.process_time() - start)


def summary(runs, limits=(GOOD_DEG, GOOD_MM)):
    """Medians over pairs of (ms, degrees, mm), and how many of them are good."""
    ms, deg, mm = np.array(runs).T
    good = int(np.sum((deg < limits[0]) & (mm < limits[1])))
    return {"ms": float(np.median(ms)), "deg": float(np.median(deg)), "mm": float(np.median(mm)), "good": good}
