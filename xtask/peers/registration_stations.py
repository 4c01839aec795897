"""A ring of stations: pairs by small_gicp, then a chain of them, or Open3D's pose graph."""

import os

import numpy as np

from registration_data import Frames, open3d, poses, timed
from registration_frames import OPEN3D_VOXEL, VOXELS

# The stations are known to 3 cm; with 50 cm pairs that show little but one wall slide along it.
REACH = 0.1


def stations(folder):
    frames = Frames(folder)
    starts, count = poses(os.path.join(folder, "starts.txt")), len(frames.poses)
    pairs = [(k, (k + step) % count) for step in (1, 2) for k in range(count)]
    found, pair_ms = timed(lambda: all_pairs(frames, starts, pairs))
    chain = [np.eye(4)]
    for k in range(count - 1):
        chain.append(chain[-1] @ found[k])
    graph, graph_ms = pose_graph(frames, pairs, found, chain)
    answer = {
        "start": {"mm": off_mm(frames, [np.linalg.inv(starts[0]) @ pose for pose in starts])},
        "chain": {"mm": off_mm(frames, chain)},
        "graph": {"mm": off_mm(frames, graph), "ms": graph_ms},
    }
    answer["graph"]["whole_ms"] = pair_ms + graph_ms
    return answer


def all_pairs(frames, starts, pairs):
    import small_gicp

    prepared = [small_gicp.preprocess_points(frames.points(k), VOXELS["medium"]) for k in range(len(starts))]
    options = {"registration_type": "GICP", "max_correspondence_distance": REACH, "num_threads": 1}
    return [
        small_gicp.align(
            *(prepared[a][0], prepared[b][0], prepared[a][1]), np.linalg.inv(starts[a]) @ starts[b],
            max_iterations=50, **options,
        ).T_target_source  # fmt: skip
        for a, b in pairs
    ]


def pose_graph(frames, pairs, found, chain):
    o3d = open3d()
    way = o3d.pipelines.registration
    points = [o3d.utility.Vector3dVector(frames.points(k)) for k in range(len(chain))]
    clouds = [o3d.geometry.PointCloud(cloud).voxel_down_sample(OPEN3D_VOXEL) for cloud in points]
    graph = way.PoseGraph()
    graph.nodes.extend(way.PoseGraphNode(pose) for pose in chain)
    for (target, source), pose in zip(pairs, found):
        weight = way.get_information_matrix_from_point_clouds(clouds[source], clouds[target], OPEN3D_VOXEL, pose)
        # Any pair but those of the chain may be refused, as its users do it.
        loop = (source - target) % len(chain) != 1 or source == 0
        graph.edges.append(way.PoseGraphEdge(source, target, pose, weight, uncertain=loop))
    option = way.GlobalOptimizationOption(
        max_correspondence_distance=OPEN3D_VOXEL, edge_prune_threshold=0.25, reference_node=0
    )
    criteria = way.GlobalOptimizationConvergenceCriteria()
    method = way.GlobalOptimizationLevenbergMarquardt()
    _, ms = timed(lambda: way.global_optimization(graph, method, criteria, option))
    return [np.array(node.pose) for node in graph.nodes], ms


def off_mm(frames, found):
    """Root of the mean squared distance of positions, the first station held."""
    truth = [np.linalg.inv(frames.poses[0]) @ pose for pose in frames.poses]
    first = np.linalg.inv(found[0])
    off = [(first @ a)[:3, 3] - b[:3, 3] for a, b in zip(found, truth)]
    return float(1e3 * np.sqrt(np.mean(np.sum(np.array(off[1:]) ** 2, axis=1))))
