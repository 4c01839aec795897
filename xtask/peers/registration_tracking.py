"""Streams: one frame after the other."""

import numpy as np

from registration_data import Frames, timed
from registration_frames import REACH, VOXELS

# KISS-ICP's map. With 5 cm it took three times as long for a path 15 % better.
MAP_VOXEL = 0.1


def kiss_icp(voxel):
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    config = KISSConfig()
    config.data.deskew = False
    config.data.min_range, config.data.max_range = 0.3, 20.0
    config.mapping.voxel_size = voxel
    config.registration.max_num_threads = 1
    # Its own default of 2 m belongs to cars.
    config.adaptive_threshold.initial_threshold = 0.2
    config.adaptive_threshold.min_motion_th = 0.01
    odometry = KissICP(config)

    def work(points):
        odometry.register_frame(points, np.zeros(len(points)))
        return odometry.last_pose

    return work


def frame_to_frame():
    """small_gicp's GICP with each frame prepared once; the next motion is expected to be the last one."""
    import small_gicp

    state = {"pose": np.eye(4), "motion": np.eye(4), "last": None}

    def work(points):
        cloud, tree = small_gicp.preprocess_points(points, VOXELS["medium"], num_threads=1)
        if state["last"]:
            result = small_gicp.align(
                *(state["last"][0], cloud, state["last"][1]), state["motion"], registration_type="GICP",
                max_correspondence_distance=REACH, num_threads=1, max_iterations=50,
            )  # fmt: skip
            state["motion"] = result.T_target_source
            state["pose"] = state["pose"] @ state["motion"]
        state["last"] = cloud, tree
        return state["pose"]

    return work


def position_error_mm(found, truth):
    """Root of the mean squared distance after the best rigid motion."""
    found, truth = (np.array([pose[:3, 3] for pose in poses]) for poses in (found, truth))
    a, b = found - found.mean(0), truth - truth.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = np.diag([1, 1, np.linalg.det(vt.T @ u.T)])
    return float(1e3 * np.sqrt(np.mean(np.sum((a @ (vt.T @ turn @ u.T).T - b) ** 2, axis=1))))


def tracking(folder):
    frames, answer = Frames(folder), {}
    for name, work in (("kiss_icp", kiss_icp(MAP_VOXEL)), ("gicp", frame_to_frame())):
        found, spent = [], 0.0
        for k in range(len(frames.poses)):
            points = frames.points(k)
            pose, ms = timed(lambda: work(points))
            found.append(np.array(pose))
            spent += ms
        answer[name] = {"ms": spent / len(found), "mm": position_error_mm(found, frames.poses)}
    return answer
