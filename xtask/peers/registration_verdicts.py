"""What peers say of a pose beside the pose itself."""

import numpy as np

from registration_data import Frames, error
from registration_frames import REACH, VOXELS


def align(kind, target, source):
    import small_gicp

    return small_gicp.align(
        target, source, registration_type=kind, downsampling_resolution=VOXELS["medium"],
        max_correspondence_distance=REACH, num_threads=1, max_iterations=50,
    )  # fmt: skip


def twist(found, truth):
    """The rotation vector and the translation that the truth lies off, along the axes of the source."""
    off = np.linalg.inv(found) @ truth
    skew = (off[:3, :3] - off[:3, :3].T) / 2
    # Small angles only.
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0], *off[:3, 3]])


def covariance(folder):
    """Medians of the normalised squared error: 6 parameters, so 5.3 if the covariance were true."""
    frames, answer = Frames(folder), {}
    for kind, residuals_of_a_point in (("PLANE_ICP", 1), ("GICP", 3)):
        plain, scaled = [], []
        for target, source in frames.pairs(2):
            result = align(kind, frames.points(target), frames.points(source))
            off = twist(result.T_target_source, frames.truth(target, source))
            plain.append(off @ result.H @ off)
            freedom = residuals_of_a_point * result.num_inliers - 6
            scaled.append(plain[-1] / (2 * result.error / freedom))
        answer[f"gicp_{kind}"] = {"plain": float(np.median(plain)), "scaled": float(np.median(scaled))}
    return answer


def degenerate(folder):
    """Whether a pose that the geometry leaves open was called converged, and how far it is off."""
    frames, answer = Frames(folder), {}
    for kind in ("GICP", "VGICP", "PLANE_ICP"):
        for name, (target, source) in zip(("wall", "edge"), frames.pairs(2)):
            result = align(kind, frames.points(target), frames.points(source))
            deg, mm = error(result.T_target_source, frames.truth(target, source))
            answer[f"{kind}_{name}"] = {"converged": float(result.converged), "deg": deg, "mm": mm}
    return answer
