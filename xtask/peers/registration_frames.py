"""Pairs of frames from raw points to a pose, from the identity."""

import numpy as np

from registration_data import FLIP, Frames, error, open3d, summary, timed

# Pairs farther apart than that are refused, m; of 25, 50 and 100 cm all did as well.
REACH = 0.5
# Down-sampling, m. 2.5 cm keeps the most points, 8 cm gives the best poses for the time; of real frames 5 cm did best.
VOXELS = {"fine": 0.025, "medium": 0.05, "coarse": 0.08}
# Of 10, 15, 20 and 40 cm: smaller cells lose pairs, larger ones precision.
CELL = 0.15
# Where Open3D was best; 2.5 cm took three to five times as long and was no better.
OPEN3D_VOXEL = 0.05


def small_gicp_result(kind, voxel, reach=REACH, cell=CELL, iterations=50):
    import small_gicp

    options = {
        "registration_type": kind,
        "voxel_resolution": cell,
        "downsampling_resolution": voxel,
        "max_correspondence_distance": reach,
        "num_threads": 1,
        "max_iterations": iterations,
    }
    return lambda target, source: small_gicp.align(target, source, **options)


def small_gicp(kind, voxel):
    work = small_gicp_result(kind, voxel)
    return lambda target, source: work(target, source).T_target_source


def cloud_of(o3d, points, voxel=OPEN3D_VOXEL, neighbours=20):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(voxel)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(neighbours))
    return cloud


def open3d_clouds(kind, iterations=50):
    o3d = open3d()
    way = o3d.pipelines.registration
    ways = {
        "gicp": way.TransformationEstimationForGeneralizedICP,
        "plane": way.TransformationEstimationPointToPlane,
        "tukey": lambda: way.TransformationEstimationPointToPlane(way.TukeyLoss(0.05)),
    }
    criteria = way.ICPConvergenceCriteria(max_iteration=iterations)
    step = way.registration_generalized_icp if kind == "gicp" else way.registration_icp

    def work(target, source):
        target, source = (cloud_of(o3d, points) for points in (target, source))
        return step(source, target, REACH / 2, np.eye(4), ways[kind](), criteria).transformation

    return work


def open3d_projective(frames, iterations):
    """Point to plane between depth images, no colour: its own odometry."""
    o3d = open3d()
    odometry = o3d.t.pipelines.odometry
    fx, fy, cx, cy = frames.pinhole
    intrinsic = o3d.core.Tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    criteria = [odometry.OdometryConvergenceCriteria(count) for count in iterations]
    start = o3d.core.Tensor(np.eye(4))
    method = odometry.Method.PointToPlane

    def image(points):
        depth = np.nan_to_num(-points[:, 2]).reshape(*frames.shape, 1)
        picture = o3d.t.geometry.RGBDImage()
        picture.depth = o3d.t.geometry.Image(o3d.core.Tensor(np.ascontiguousarray(depth)))
        picture.color = o3d.t.geometry.Image(o3d.core.Tensor(np.zeros((*frames.shape, 3), np.float32)))
        return picture

    def work(target, source):
        found = odometry.rgbd_odometry_multi_scale(
            image(source), image(target), intrinsic, start, 1.0, 10.0, criteria, method,
            odometry.OdometryLossParams(0.07),
        ).transformation.numpy()
        return FLIP @ found @ FLIP

    return work


def methods(frames):
    """By name, and whether a method wants images instead of lists of points."""
    every = {}
    for name, voxel in VOXELS.items():
        every[f"gicp_{name}"] = small_gicp("GICP", voxel), False
        every[f"vgicp_{name}"] = small_gicp("VGICP", voxel), False
    every["plane_fine"] = small_gicp("PLANE_ICP", VOXELS["fine"]), False
    for kind in ("gicp", "plane", "tukey"):
        every[f"open3d_{kind}"] = open3d_clouds(kind), False
    if frames.shape[0] > 1:
        every["open3d_projective"] = open3d_projective(frames, (10, 15, 30)), True
        every["open3d_projective_short"] = open3d_projective(frames, (6, 3, 1)), True
    return every


def found_by(work, target, source):
    """Some methods give up where their equations are singular."""
    try:
        return work(target, source)
    except RuntimeError:
        return None


def frames(folder, stride, first, count, *names):
    """Pairs `first` to `first + count`, by the methods whose names begin so, or all."""
    frames = Frames(folder)
    pairs = frames.pairs(int(stride))[int(first) :][: int(count)]
    chosen = {name: way for name, way in methods(frames).items() if name.startswith(names or "")}
    runs = {name: [] for name in chosen}
    # Pair by pair, so that no method gets the quiet minutes of the machine.
    for target, source in pairs:
        images, points = [frames.image(k) for k in (target, source)], [frames.points(k) for k in (target, source)]
        for name, (work, wants_images) in chosen.items():
            found, ms = timed(lambda: found_by(work, *(images if wants_images else points)))
            off = (np.inf, np.inf) if found is None else error(found, frames.truth(target, source))
            runs[name].append((ms, *off))
    return {name: summary(list_of) for name, list_of in runs.items()}
