"""Pairs without a guess: features, matches, a pose that many of them agree on, and point to plane steps at the end.

TEASER++ is not on the package index; its successor's solver (pruning of a graph of matches, then graduated
non-convexity) gets the same features here.
"""

import numpy as np

from registration_data import Frames, error, open3d, summary, timed

# Of 5, 8 and 10 cm; with larger ones everyone lost more pairs.
VOXEL = 0.05
# Features reach so many voxels; of 5 and 8.
WIDE = {"ransac": 5, "graph": 8}
# What counts: 5 degrees and 10 cm.
LIMITS = (5.0, 100.0)


def features(o3d, points, wide):
    way = o3d.pipelines.registration
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(VOXEL)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * VOXEL, 30))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return cloud, way.compute_fpfh_feature(cloud, o3d.geometry.KDTreeSearchParamHybrid(wide * VOXEL, 100))


def refined(o3d, source, target, pose):
    way = o3d.pipelines.registration
    for reach in (4 * VOXEL, 2 * VOXEL):
        estimation = way.TransformationEstimationPointToPlane(way.TukeyLoss(reach))
        criteria = way.ICPConvergenceCriteria(max_iteration=30)
        pose = way.registration_icp(source, target, reach, pose, estimation, criteria).transformation
    return pose


def ransac(o3d, target, source):
    way = o3d.pipelines.registration
    reach = 1.5 * VOXEL
    checks = [way.CorrespondenceCheckerBasedOnEdgeLength(0.9), way.CorrespondenceCheckerBasedOnDistance(reach)]
    return way.registration_ransac_based_on_feature_matching(
        source[0], target[0], source[1], target[1], True, reach, way.TransformationEstimationPointToPoint(False), 3,
        checks, way.RANSACConvergenceCriteria(100000, 0.999),
    ).transformation  # fmt: skip


def graph(o3d, target, source):
    matches = np.asarray(o3d.pipelines.registration.correspondences_from_features(source[1], target[1], True))
    ends = (np.asarray(cloud.points)[matches[:, side]].T for side, cloud in enumerate((source[0], target[0])))
    return pose_of(matcher().solve(*(np.ascontiguousarray(end) for end in ends)))


def matcher():
    import kiss_matcher

    return kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(voxel_size=VOXEL))


def pose_of(solution):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = solution.rotation, np.ravel(solution.translation)
    return pose


def ways(o3d):
    def with_features(name, solve):
        def work(target, source):
            target, source = (features(o3d, points, WIDE[name]) for points in (target, source))
            return refined(o3d, source[0], target[0], solve(o3d, target, source))

        return work

    def whole(target, source):
        pose = pose_of(matcher().estimate(source.astype(np.float32), target.astype(np.float32)))
        target, source = (
            o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(VOXEL)
            for points in (target, source)
        )
        target.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * VOXEL, 30))
        return refined(o3d, source, target, pose)

    return {"ransac": with_features("ransac", ransac), "graph": with_features("graph", graph), "kiss_matcher": whole}


def coarse(folder):
    frames, o3d, answer = Frames(folder), open3d(), {}
    o3d.utility.random.seed(1)
    pairs = [(pair, [frames.points(k) for k in pair]) for pair in frames.pairs(2)]
    for name, work in ways(o3d).items():
        runs = []
        for pair, points in pairs:
            found, ms = timed(lambda: work(*points))
            runs.append((ms, *error(found, frames.truth(*pair))))
        answer[name] = summary(runs, LIMITS)
    return answer
