"""Peers of the crates phase-unwrap and range-image: unwrapping, several frequencies, demodulation.

usage: phase_peers.py unwrap FOLDER WIDTH HEIGHT PEER...          unwraps phase.f32, writes PEER.i32, prints times
       phase_peers.py frequencies FOLDER WIDTH HEIGHT METRES...   the remainder search over intervals, writes crt.i32
       phase_peers.py judge FOLDER WIDTH HEIGHT                   holds every count file against the truth
       phase_peers.py samples FOLDER WIDTH HEIGHT                 writes four samples a pixel
       phase_peers.py demodulate FOLDER WIDTH HEIGHT              demodulates them, judges phase_*.f32, prints times

Planes are rows of numbers in the machine's own order; the last line printed is an object of JSON. Times are CPU time
of one thread in milliseconds.
"""

import glob
import json
import os
import resource
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

TAU = 2 * np.pi
# Repetitions end after so many seconds, or so many runs.
SECONDS, RUNS = 1.0, 20


def read(folder, name, shape, kind=np.float32):
    return np.fromfile(os.path.join(folder, name), kind).reshape(shape)


def counts(unwrapped, phase):
    return np.round((unwrapped - phase) / TAU).astype(np.int32)


def status(name):
    for line in open("/proc/self/status"):
        if line.startswith(name):
            return 1024 * int(line.split()[1])


def children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(work, clock=time.process_time, runs=RUNS):
    """The last result, the least time of some runs in ms, growth of the peak of memory by the first in bytes."""
    with open("/proc/self/clear_refs", "w") as peak:
        peak.write("5")
    before = status("VmRSS:")
    least, spent, grown = np.inf, 0.0, None
    while runs > 0 and spent < SECONDS:
        start = clock()
        result = work()
        least = min(least, clock() - start)
        spent += clock() - start
        runs -= 1
        grown = grown or status("VmHWM:") - before
    return result, 1e3 * least, grown


def scikit_image(phase):
    from skimage.restoration import unwrap_phase

    return measured(lambda: unwrap_phase(phase))


def opencv(phase):
    import cv2

    cv2.setNumThreads(1)
    parameters = cv2.phase_unwrapping.HistogramPhaseUnwrapping.Params()
    parameters.height, parameters.width = phase.shape

    def work():
        # A new one each time: it keeps nothing that a second image could use.
        return cv2.phase_unwrapping.HistogramPhaseUnwrapping.create(parameters).unwrapPhaseMap(phase)

    return measured(work)


def snaphu(phase):
    """Its own process: only that counts, files read and written included. Its memory is not told apart from ours."""
    import snaphu

    image = np.exp(1j * phase).astype(np.complex64)
    # A coherence for noise of about a radian; its value changes nothing in this mode.
    coherence = np.full(phase.shape, 0.8, np.float32)
    sys.stdout.flush()
    talk = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        work = lambda: snaphu.unwrap(image, coherence, 1.0, cost="smooth", init="mst")[0]
        result, least, _ = measured(work, children)
    finally:
        os.dup2(talk, 1)
    return result, least, None


def kamui(phase):
    import kamui

    return measured(lambda: kamui.unwrap_dimensional(phase.astype(float)))


def unwrap(folder, shape, peers):
    phase = read(folder, "phase.f32", shape)
    # The peers expect (-pi, pi].
    wrapped = np.where(phase > np.pi, phase - np.float32(TAU), phase)
    answer = {}
    for peer in peers:
        result, least, grown = globals()[peer](wrapped)
        counts(result, phase).tofile(os.path.join(folder, f"{peer}.i32"))
        answer[peer] = {"ms": least, "bytes": grown and grown / phase.size}
    return answer


def frequencies(folder, shape, intervals):
    """Every count of the first frequency; the others take the nearest; the least spread, weighted, wins."""
    phases = [read(folder, f"phase{index}.f32", shape) for index in range(len(intervals))]
    rates = np.array([1 / metres for metres in intervals])
    # The interval after which all repeat: frequencies here are multiples of a megahertz.
    megahertz = np.round(rates * 299792458 / 2e6).astype(int)
    hypotheses = int(megahertz[0] // np.gcd.reduce(megahertz))

    def work():
        ranges = [np.float32(metres / TAU) * phase for metres, phase in zip(intervals, phases)]
        weights = (rates**2 / np.sum(rates**2)).astype(np.float32)
        best = np.full(shape, np.inf, np.float32)
        found = np.zeros(shape, np.int32)
        for count in range(hypotheses):
            first = ranges[0] + np.float32(count * intervals[0])
            mean, square = weights[0] * first, weights[0] * first * first
            for metres, weight, other in zip(intervals[1:], weights[1:], ranges[1:]):
                there = other + np.float32(metres) * np.round((first - other) / np.float32(metres))
                mean += weight * there
                square += weight * there * there
            spread = square - mean * mean
            better = spread < best
            best[better] = spread[better]
            found[better] = count
        return found

    found, least, grown = measured(work)
    found.tofile(os.path.join(folder, "crt.i32"))
    return {"ms": least, "bytes": grown / found.size}


def judge(folder, shape):
    """Right: the count that brings the phase next to the truth (`right`), or that was wrapped off (`exact`), up to one
    constant for the image; `absolute`: as `right`, without a constant."""
    phase = read(folder, "phase.f32", shape)
    truth = counts(read(folder, "truth.f32", shape), phase)
    exact = counts(read(folder, "noisy.f32", shape), phase)

    def agreement(one, other):
        difference = (one - other).ravel()
        return float(np.bincount(difference - difference.min()).max() / difference.size)

    reference = os.path.join(folder, "scikit_image.i32")
    reference = read(folder, "scikit_image.i32", shape, np.int32) if os.path.exists(reference) else None
    answer = {}
    for path in glob.glob(os.path.join(folder, "*.i32")):
        found = np.fromfile(path, np.int32).reshape(shape)
        answer[os.path.basename(path)[:-4]] = {
            "right": agreement(found, truth),
            "exact": agreement(found, exact),
            "absolute": float(np.mean(found == truth)),
            "equal": None if reference is None else agreement(found, reference),
        }
    return answer


def samples(folder, shape):
    """Twelve bits, four steps, ten to a hundred and fifty times the noise."""
    random = np.random.default_rng(5)
    phase = random.uniform(0, TAU, shape)
    amplitude = random.uniform(100, 1500, shape)
    steps = [2048 + amplitude * np.cos(phase + step * TAU / 4) + random.normal(0, 10, shape) for step in range(4)]
    values = np.clip(np.round(steps), 0, 4095)
    os.makedirs(folder, exist_ok=True)
    values.astype(np.uint16).tofile(os.path.join(folder, "samples.u16"))
    values.astype(np.float32).tofile(os.path.join(folder, "samples.f32"))
    return {}


def demodulate(folder, shape):
    import cv2

    cv2.setNumThreads(1)
    planes = {"u16": np.uint16, "f32": np.float32}
    planes = {kind: read(folder, f"samples.{kind}", (4, *shape), of) for kind, of in planes.items()}
    exact = planes["u16"].astype(float)
    exact = np.arctan2(exact[3] - exact[1], exact[0] - exact[2])
    real, imaginary, phase, amplitude = (np.empty(shape, np.float32) for _ in range(4))

    def error(found):
        return float(np.max(np.abs((found - exact + np.pi) % TAU - np.pi)))

    def with_numpy(s):
        np.subtract(s[0], s[2], out=real, dtype=np.float32)
        np.subtract(s[3], s[1], out=imaginary, dtype=np.float32)

    def with_opencv(s):
        cv2.subtract(s[0], s[2], dst=real, dtype=cv2.CV_32F)
        cv2.subtract(s[3], s[1], dst=imaginary, dtype=cv2.CV_32F)

    def polar_numpy():
        np.arctan2(imaginary, real, out=phase)
        np.hypot(real, imaginary, out=amplitude)

    def polar_opencv():
        cv2.cartToPolar(real, imaginary, amplitude, phase)

    answer = {}
    for peer, differences, polar in (("numpy", with_numpy, polar_numpy), ("opencv", with_opencv, polar_opencv)):
        times = {kind: measured(lambda: differences(s), runs=200)[1] for kind, s in planes.items()}
        times["polar"] = measured(polar, runs=200)[1]
        answer[peer] = {**times, "error": error(phase)}
    for kind in planes:
        path = os.path.join(folder, f"phase_{kind}.f32")
        if os.path.exists(path):
            answer[f"ours_{kind}"] = {"error": error(np.fromfile(path, np.float32).reshape(shape))}
    return answer


if __name__ == "__main__":
    command, folder, width, height, *rest = sys.argv[1:]
    shape = (int(height), int(width))
    if command == "unwrap":
        answer = unwrap(folder, shape, rest)
    elif command == "frequencies":
        answer = frequencies(folder, shape, [float(metres) for metres in rest])
    else:
        answer = {"judge": judge, "samples": samples, "demodulate": demodulate}[command](folder, shape)
    print(json.dumps(answer))
