"""Peers of the crate adjust: Ceres on a problem of bundle adjustment in the large, OpenCV on a checkerboard.

usage: adjust_peers.py corners IMAGES CORNERS.csv     finds the corners with OpenCV, calibrates with it, prints JSON
       adjust_peers.py bal PROBLEM [ceres tolerance]  solves with Ceres' dense Schur on one thread, prints JSON
"""

import glob
import json
import os
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np


def corners(images, table):
    import cv2

    cv2.setNumThreads(1)
    board = np.zeros((54, 3), np.float32)
    board[:, :2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2) * 25
    found = []
    for name in sorted(glob.glob(os.path.join(images, "left*.jpg"))):
        image = cv2.imread(name, cv2.IMREAD_GRAYSCALE)
        seen, points = cv2.findChessboardCorners(image, (9, 6), None)
        if not seen:
            raise SystemExit(f"{name}: no checkerboard")
        found.append(cv2.cornerSubPix(image, points, (11, 11), (-1, -1), (3, 100, 1e-6)))
    with open(table, "w") as out:
        out.write("image,x,y,col,row\n")
        for index, points in enumerate(found):
            for (x, y, _), (col, row) in zip(board, points.reshape(-1, 2)):
                out.write(f"{index},{x:.17g},{y:.17g},{col:.17g},{row:.17g}\n")
    times = []
    for _ in range(5):
        # OpenCV's own stopping rule; it leaves the parameters 1e-3 deviations from the optimum.
        start = time.process_time()
        cv2.calibrateCameraExtended([board] * len(found), found, (640, 480), None, None)
        times.append(time.process_time() - start)
    rms, matrix, lens, turns, shifts, deviations, _, _ = cv2.calibrateCameraExtended(
        [board] * len(found), found, (640, 480), None, None, criteria=(3, 200, 1e-14)
    )
    # What the deviations have to be: sigma0 and the inverse normal matrix, from OpenCV's own derivatives.
    rows, squares = [], 0.0
    for index, (turn, shift, points) in enumerate(zip(turns, shifts, found)):
        model, slope = cv2.projectPoints(board.astype(float), turn, shift, matrix, lens)
        block = np.zeros((108, 9 + 6 * len(found)))
        block[:, :9] = slope[:, 6:15]
        block[:, 9 + 6 * index : 15 + 6 * index] = slope[:, :6]
        rows.append(block)
        squares += np.sum((points.reshape(-1, 2).astype(float) - model.reshape(-1, 2)) ** 2)
    design = np.vstack(rows)
    redundancy = design.shape[0] - design.shape[1]
    scale = np.linalg.norm(design, axis=0)
    cofactor = np.linalg.inv((design / scale).T @ (design / scale))
    right = np.sqrt(squares / redundancy * np.diag(cofactor)) / scale
    names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]
    values = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *lens.ravel()[:5]]
    print(
        json.dumps(
            {
                "version": cv2.__version__,
                "seconds": min(times),
                "rms": rms,
                "sigma0": float(np.sqrt(squares / redundancy)),
                "parameters": dict(zip(names, map(float, values))),
                "deviations_stated": dict(zip(names, map(float, deviations.ravel()[:9]))),
                "deviations_right": dict(zip(names, map(float, right[:9]))),
            }
        )
    )


def turn(vector):
    angle = np.linalg.norm(vector)
    return np.concatenate([np.sin(angle / 2) * vector / angle, [np.cos(angle / 2)]])


def bal(path, tolerance):
    import pyceres
    import pycolmap
    from pycolmap import cost_functions

    data = open(path).read().split()
    cameras, points, count = map(int, data[:3])
    observed = np.array(data[3 : 3 + 4 * count], float).reshape(-1, 4)
    parameters = np.array(data[3 + 4 * count :], float)
    start = parameters[: 9 * cameras].reshape(cameras, 9)
    points = [point.copy() for point in parameters[9 * cameras :].reshape(points, 3)]
    # The problem looks along -z with y up; COLMAP's camera looks along z with y down: half a turn about x.
    quaternions, shifts, lenses = [], [], []
    for camera in start:
        x, y, z, w = turn(camera[:3])
        quaternions.append(np.array([w, -z, y, -x]))
        shifts.append(camera[3:6] * np.array([1.0, -1.0, -1.0]))
        lenses.append(np.array([camera[6], 0.0, 0.0, camera[7], camera[8]]))
    problem = pyceres.Problem()
    for camera, point, x, y in observed:
        camera, point = int(camera), int(point)
        cost = cost_functions.ReprojErrorCost(pycolmap.CameraModelId.RADIAL, np.array([x, -y]))
        problem.add_residual_block(cost, None, [quaternions[camera], shifts[camera], points[point], lenses[camera]])
    for quaternion, lens in zip(quaternions, lenses):
        problem.set_manifold(quaternion, pyceres.EigenQuaternionManifold())
        problem.set_manifold(lens, pyceres.SubsetManifold(5, [1, 2]))
    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.DENSE_SCHUR
    options.num_threads = 1
    options.max_num_iterations = 100
    options.function_tolerance = tolerance
    summary = pyceres.SolverSummary()
    begin = time.process_time()
    pyceres.solve(options, problem, summary)
    seconds = time.process_time() - begin
    print(
        json.dumps(
            {
                "seconds": seconds,
                "cost": summary.final_cost,
                "iterations": summary.num_successful_steps + summary.num_unsuccessful_steps,
                "linear_solver_seconds": summary.linear_solver_time_in_seconds,
                "jacobian_seconds": summary.jacobian_evaluation_time_in_seconds,
                "residual_seconds": summary.residual_evaluation_time_in_seconds,
            }
        )
    )


if __name__ == "__main__":
    if sys.argv[1] == "corners":
        corners(sys.argv[2], sys.argv[3])
    else:
        bal(sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 1e-6)
