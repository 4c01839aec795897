"""Pairs and streams of real captures: what each pair gives, for settings that the caller seeks.

A method is `gicp:VOXEL:REACH`, `plane:VOXEL:REACH`, `vgicp:VOXEL:CELL` (small_gicp), `multi:VOXEL` (Open3D, three scales
down to VOXEL) or `projective` (Open3D's odometry of depth images); lengths in metre.
"""

import numpy as np

from registration_data import Frames, angle_deg, error, open3d, timed
from registration_frames import open3d_projective, small_gicp_result
from registration_tracking import kiss_icp, position_error_mm

# Open3D: iterations from the coarsest scale to the finest, and pairs no farther apart than so many voxels.
ITERATIONS = (50, 30, 20)
REACH_VOXELS = 3


def small_gicp(kind, voxel, reach):
    """VGICP looks up cells; the others know a farthest neighbour."""
    which = {"cell": reach} if kind == "vgicp" else {"reach": reach}
    work = small_gicp_result({"plane": "PLANE_ICP"}.get(kind, kind.upper()), voxel, **which)

    def told(target, source):
        result = work(target, source)
        return result.T_target_source, result.converged

    return told


def multi_scale(voxel):
    o3d = open3d()
    way = o3d.t.pipelines.registration
    voxels = [4 * voxel, 2 * voxel, voxel]
    criteria = [way.ICPConvergenceCriteria(max_iteration=count) for count in ITERATIONS]
    numbers = o3d.utility.DoubleVector

    def cloud(points):
        cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points)).voxel_down_sample(voxel)
        cloud.estimate_normals(20)
        return cloud

    def work(target, source):
        result = way.multi_scale_icp(
            cloud(source), cloud(target), numbers(voxels), criteria, numbers([REACH_VOXELS * v for v in voxels]),
            o3d.core.Tensor(np.eye(4)), way.TransformationEstimationPointToPlane(),
        )  # fmt: skip
        return result.transformation.numpy(), result.converged

    return work


def projective(frames):
    """It has no word on whether it succeeded."""
    work = open3d_projective(frames, (10, 15, 30))
    return lambda target, source: (work(target, source), True)


def method(frames, name):
    """What aligns two frames, and whether it wants images."""
    kind, *settings = name.split(":")
    if kind == "projective":
        return projective(frames), True
    if kind == "multi":
        return multi_scale(*map(float, settings)), False
    return small_gicp(kind, *map(float, settings)), False


def answer_of(work, target, source):
    """Some methods give up where their equations are singular."""
    try:
        return work(target, source)
    except RuntimeError:
        return None, False


def pairs(folder, list_of_pairs, *names):
    """By method a row a pair: ms, degrees and mm off, whether it called itself sure, degrees and mm of the motion."""
    frames = Frames(folder)
    methods = {name: method(frames, name) for name in names}
    rows = {name: [] for name in names}
    numbers = np.loadtxt(list_of_pairs, int, ndmin=2)
    # What is loaded and reserved once counts for nobody.
    for work, wants_images in methods.values():
        answer_of(work, *((frames.image if wants_images else frames.points)(k) for k in numbers[0]))
    # Pair by pair, so that no method gets the quiet minutes of the machine.
    for target, source in numbers:
        truth = frames.truth(target, source)
        moved = [angle_deg(truth), float(1e3 * np.linalg.norm(truth[:3, 3]))]
        images, points = [frames.image(k) for k in (target, source)], [frames.points(k) for k in (target, source)]
        for name, (work, wants_images) in methods.items():
            (found, sure), ms = timed(lambda: answer_of(work, *(images if wants_images else points)))
            off = (np.inf, np.inf) if found is None else error(found, truth)
            rows[name].append([ms, *off, float(sure), *moved])
    return rows


def streams(folder, first, count, *voxels):
    """By voxel, ms of each frame and how far off the path is, mm."""
    frames = Frames(folder)
    numbers = range(int(first), int(first) + int(count))
    answer = {}
    for voxel in voxels:
        work, found, times = kiss_icp(float(voxel)), [], []
        for k in numbers:
            points = frames.points(k)
            pose, ms = timed(lambda: work(points))
            found.append(np.array(pose))
            times.append(ms)
        answer[voxel] = {"ms": times, "mm": position_error_mm(found, [frames.poses[k] for k in numbers])}
    return answer
