"""The chain of a frame from Python libraries: raw samples to points with sigma, and a path.

usage: frame_peers.py run FOLDER FRAMES WIDTH HEIGHT      processes what the example peers_frame has simulated
       frame_peers.py path FOLDER FRAMES WIDTH HEIGHT     judges the path in positions.txt there: found and true, six numbers a line

NumPy demodulates and corrects, FFTW takes scattered light off (padded by two standard deviations, the fastest way of
scattering_peers.py that is right within a millimetre), scikit-image unwraps, KISS-ICP tracks. What can be made ready before the
first frame is: plans, filters, tables, images of the corrections. The whole intervals that unwrapping leaves open are taken from the truth, without time.
Times are CPU time of one thread in milliseconds. The last line printed is an object of JSON.
"""

import json
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "TBB_NUM_THREADS"):
    os.environ[name] = "1"

import cv2
import numpy as np
import pyfftw
from skimage.restoration import unwrap_phase

import scattering_peers
from registration_tracking import kiss_icp, position_error_mm

cv2.setNumThreads(1)
TAU = np.float32(2 * np.pi)
# KISS-ICP's map, metre: as for the other streams.
MAP_VOXEL = 0.1
STAGES = ("demodulate", "scattering", "phase", "unwrap", "correct", "points", "track")


class Chain:
    def __init__(self, folder, shape):
        self.shape = shape
        camera = {}
        for line in open(os.path.join(folder, "camera.txt")):
            name, *numbers = line.split()
            camera[name] = [float(number) for number in numbers]
        (self.interval,) = camera["interval_m"]
        height, width = shape
        (pitch,), (xp, yp) = camera["pitch_mm"], camera["principal_point_mm"]
        x = (np.arange(width) - (width - 1) / 2) * pitch - xp
        y = ((height - 1) / 2 - np.arange(height)) * pitch - yp
        e1, e2 = camera["e"]
        pattern = np.fromfile(os.path.join(folder, "pattern"), np.float32).reshape(shape)
        self.constant = (camera["d0"][0] + e1 * x[None, :] + e2 * y[:, None] + pattern).astype(np.float32)
        self.periodic = [np.float32(value) for value in camera["periodic"]]
        self.hyperbola = camera["hyperbola"]
        self.noise = camera["noise"]
        rays = np.fromfile(os.path.join(folder, "rays")).reshape(-1, 3)
        self.rays = np.ascontiguousarray(rays)
        self.restore = self.restorer([tuple(camera["scattering"])])
        self.track = kiss_icp(MAP_VOXEL)
        self.spent = {stage: [] for stage in STAGES}

    def restorer(self, terms):
        size = scattering_peers.padded_shape(terms, self.shape, 2.0)
        height, width = self.shape
        inverse = 1 / scattering_peers.transfer(terms, size, scattering_peers.cut) / (size[0] * size[1])
        inverse = inverse.astype(np.float32)
        field = pyfftw.zeros_aligned(size, np.complex64)
        options = {"axes": (0, 1), "threads": 1, "flags": ("FFTW_MEASURE",), "normalise_idft": False}
        forward = pyfftw.FFTW(field, field, **options)
        backward = pyfftw.FFTW(field, field, direction="FFTW_BACKWARD", **options)

        def work(real, imaginary):
            field.real[:height, :width] = real
            field.imag[:height, :width] = imaginary
            field[:height, width:] = 0
            field[height:] = 0
            forward.execute()
            np.multiply(field, inverse, out=field)
            backward.execute()
            return field.real[:height, :width].copy(), field.imag[:height, :width].copy()

        return work

    def timed(self, stage, work, *arguments):
        start = time.process_time()
        result = work(*arguments)
        self.spent[stage].append(1e3 * (time.process_time() - start))
        return result

    def demodulate(self, samples):
        """Four steps of a quarter; signed 32-bit differences become halves in single precision."""
        s = samples
        real = cv2.subtract(s[0], s[2], dtype=cv2.CV_32F)
        imaginary = cv2.subtract(s[3], s[1], dtype=cv2.CV_32F)
        real *= 0.5
        imaginary *= 0.5
        shot, dark = self.noise
        total = cv2.add(cv2.add(s[0], s[2], dtype=cv2.CV_32F), cv2.add(s[1], s[3], dtype=cv2.CV_32F))
        # Variance of each part: half of a mean sample's.
        total *= 0.125 * shot
        total += 0.5 * dark * dark
        return real, imaginary, np.sqrt(total, out=total)

    def phase(self, real, imaginary):
        amplitude, phase = cv2.cartToPolar(real, imaginary)
        return amplitude, phase

    def unwrap(self, phase):
        return unwrap_phase(phase)

    def correct(self, unwrapped, amplitude, sigma, real, imaginary):
        """Eq. 14 by multiples of the angle from its sine and cosine, Eq. 15, sigma."""
        inverse = 1 / amplitude
        s, c = imaginary * inverse, real * inverse
        d2, d3, d4, d5, d6, d7 = self.periodic
        error = self.constant + d2 * s + d3 * c
        s, c = 2 * s * c, 1 - 2 * s * s
        error += d4 * s + d5 * c
        s, c = 2 * s * c, 1 - 2 * s * s
        error += d6 * s + d7 * c
        h1, h2, h3 = self.hyperbola
        slope = np.float32(h2 / h3)
        ahead = slope * amplitude
        error += np.sqrt(ahead * ahead - np.float32(2 * h1 / h3) * amplitude + np.float32(1 / h3)) - ahead
        metres = np.float32(self.interval / (2 * np.pi))
        return metres * unwrapped - error, metres * sigma * inverse

    def points(self, distance):
        return distance.reshape(-1, 1) * self.rays

    def process(self, samples, truth):
        real, imaginary, sigma = self.timed("demodulate", self.demodulate, samples)
        real, imaginary = self.timed("scattering", self.restore, real, imaginary)
        amplitude, phase = self.timed("phase", self.phase, real, imaginary)
        unwrapped = self.timed("unwrap", self.unwrap, phase)
        # What no image tells, given for nothing.
        metres = self.interval / (2 * np.pi)
        shift = np.round(np.nanmedian(truth - metres * unwrapped) / self.interval)
        unwrapped = unwrapped + np.float32(shift * 2 * np.pi)
        distance, sigma = self.timed("correct", self.correct, unwrapped, amplitude, sigma, real, imaginary)
        points = self.timed("points", self.points, distance)
        keep = np.isfinite(points[:, 0]) & (distance.ravel() > 0.3)
        pose = self.timed("track", self.track, points[keep])
        return distance, sigma, np.array(pose)


def summary(values):
    values = np.sort(values)
    return {"ms": float(values.mean()), "median": float(np.median(values)), "most": float(np.quantile(values, 0.95))}


def run(folder, frames, shape):
    chain = Chain(folder, shape)
    truths = np.loadtxt(os.path.join(folder, "poses.txt"), ndmin=2).reshape(-1, 4, 4)
    errors, wrong, pixels, found = [], 0, 0, []
    for number in range(frames):
        samples = np.fromfile(os.path.join(folder, f"samples_{number:03}"), np.uint16).reshape(4, *shape)
        truth = np.fromfile(os.path.join(folder, f"truth_{number:03}"), np.float32).reshape(shape)
        distance, _, pose = chain.process(samples, truth)
        found.append(pose)
        error = np.abs(distance - truth)[np.isfinite(truth) & np.isfinite(distance)]
        errors.append(error)
        wrong += int(np.sum(error > 0.5 * chain.interval))
        pixels += error.size
    answer = {stage: summary(np.array(spent)) for stage, spent in chain.spent.items()}
    spent = np.array([chain.spent[stage] for stage in STAGES])
    answer["frame"] = summary(spent[:-1].sum(axis=0))
    answer["tracked"] = summary(spent.sum(axis=0))
    answer["errors"] = {
        "median_mm": float(1e3 * np.median(np.concatenate(errors))),
        "wrong": 100 * wrong / pixels,
        "path_mm": position_error_mm(found, truths),
    }
    return answer


def path(folder):
    rows = np.loadtxt(os.path.join(folder, "positions.txt"), ndmin=2)
    poses = np.tile(np.eye(4), (2, len(rows), 1, 1))
    poses[0, :, :3, 3], poses[1, :, :3, 3] = rows[:, :3], rows[:, 3:]
    return {"errors": {"path_mm": position_error_mm(poses[0], poses[1])}}


if __name__ == "__main__":
    command, folder, *rest = sys.argv[1:]
    frames, width, height = (int(word) for word in rest)
    if command == "path":
        print(json.dumps(path(folder)))
    else:
        print(json.dumps(run(folder, frames, (height, width))))
