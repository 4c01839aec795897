"""Peers of the crate scattering-deconvolution: the same image restored by Fourier transforms and by repeated blurring.

usage: scattering_peers.py scene FOLDER WIDTH HEIGHT WEIGHT SIGMA...     writes a scattered image, real.f32 and imaginary.f32
       scattering_peers.py restore FOLDER WIDTH HEIGHT WEIGHT SIGMA...   restores it, judges ours_*.f32, prints times

Planes are rows of numbers in the machine's own order; the last line printed is an object of JSON. Times are CPU time
of one thread in milliseconds, without plans, transfer functions and kernels, which serve every image.
"""

import json
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np
import scipy.fft

TAU = 2 * np.pi
# Range of one cycle at 20 MHz.
INTERVAL_M = 299792458 / 2 / 20e6
# Where sampled Gaussians end, standard deviations; beyond is 1.3e-4 of their weight.
CUT = 4.0
# Repetitions end after so many seconds.
SECONDS = 1.0


def measured(work):
    """The result of the last run and the least time, ms."""
    least, spent = np.inf, 0.0
    while spent < SECONDS:
        start = time.process_time()
        result = work()
        run = time.process_time() - start
        least, spent = min(least, run), spent + max(run, 1e-3)
    return result, 1e3 * least


def profile(sigma, reach):
    """A Gaussian at whole offsets; over all offsets it sums to one."""
    offsets = np.arange(-reach, reach + 1)
    return np.exp(-0.5 * (offsets / sigma) ** 2) / (sigma * np.sqrt(TAU))


def transfer(terms, shape, reach):
    """1 + H for transforms of `shape`; the profiles end at `reach(sigma)` and wrap round."""
    total = np.ones(shape)
    for weight, sigma in terms:
        sides = []
        for size in shape:
            ring, far = np.zeros(size), reach(sigma)
            np.add.at(ring, np.arange(-far, far + 1) % size, profile(sigma, far))
            sides.append(scipy.fft.fft(ring).real)
        total += weight * np.outer(sides[0], sides[1])
    return total


def cut(sigma):
    return int(np.ceil(CUT * sigma))


def padded_shape(terms, shape, sigmas):
    """As far as the widest Gaussian reaches, at most the image itself: then nothing wraps round."""
    widest = max(sigma for _, sigma in terms)
    return tuple(scipy.fft.next_fast_len(size + min(int(sigmas * widest), size - 1)) for size in shape)


def truth(shape):
    """Range in metres and amplitude: a textured wall at 4 m, and a bright object at 0.8 m that two borders cut."""
    height, width = shape
    row, col = np.mgrid[0:height, 0:width]
    near = (8 * col < 3 * width) & (2 * row > height)
    texture = 1 + 0.3 * ((col * 40 // width + row * 30 // height) % 2)
    return np.where(near, 0.8, 4.0 + 0.5 * col / width), np.where(near, 3000.0, 60.0) * texture


def scene(folder, shape, terms):
    """Scattered in double precision, with Gaussians that end at the image's size only."""
    distance, amplitude = truth(shape)
    light = amplitude * np.exp(1j * TAU * distance / INTERVAL_M)
    twice = tuple(2 * size for size in shape)
    wide = transfer(terms, twice, lambda sigma: min(min(twice) // 2 - 1, int(20 * sigma)))
    observed = scipy.fft.ifft2(wide * scipy.fft.fft2(light, twice))[: shape[0], : shape[1]]
    os.makedirs(folder, exist_ok=True)
    observed.real.astype(np.float32).tofile(os.path.join(folder, "real.f32"))
    observed.imag.astype(np.float32).tofile(os.path.join(folder, "imaginary.f32"))
    return {"uncorrected": {"cm": error(observed)}}


def error(found):
    """Mean error of the range, cm."""
    distance, _ = truth(found.shape)
    return float(100 * np.mean(np.abs(np.angle(found * np.exp(-1j * TAU * distance / INTERVAL_M)))) * INTERVAL_M / TAU)


def with_scipy(observed, terms, size):
    shape = observed.shape
    inverse = (1 / transfer(terms, size, cut)).astype(np.float32)

    def work():
        spectrum = scipy.fft.fft2(observed, size, workers=1)
        spectrum *= inverse
        return scipy.fft.ifft2(spectrum, overwrite_x=True, workers=1)[: shape[0], : shape[1]]

    return measured(work)


def with_scipy_real(observed, terms, size):
    """Both parts as real images."""
    shape = observed.shape
    parts = np.stack([observed.real, observed.imag])
    inverse = (1 / transfer(terms, size, cut)).astype(np.float32)[:, : size[1] // 2 + 1]

    def work():
        spectrum = scipy.fft.rfft2(parts, size, workers=1)
        spectrum *= inverse
        return scipy.fft.irfft2(spectrum, size, overwrite_x=True, workers=1)[:, : shape[0], : shape[1]]

    parts, least = measured(work)
    return parts[0] + 1j * parts[1], least


def with_fftw(observed, terms, size):
    import pyfftw

    height, width = observed.shape
    inverse = (1 / transfer(terms, size, cut) / (size[0] * size[1])).astype(np.float32)
    field = pyfftw.zeros_aligned(size, np.complex64)
    options = {"axes": (0, 1), "threads": 1, "flags": ("FFTW_MEASURE",), "normalise_idft": False}
    forward = pyfftw.FFTW(field, field, **options)
    backward = pyfftw.FFTW(field, field, direction="FFTW_BACKWARD", **options)

    def work():
        field[:height, :width] = observed
        field[:height, width:] = 0
        field[height:] = 0
        forward.execute()
        np.multiply(field, inverse, out=field)
        backward.execute()
        return field[:height, :width]

    return measured(work)


def with_opencv(observed, terms):
    """z = y - P y + P P y, a Gaussian being blurred along rows and along columns."""
    import cv2

    cv2.setNumThreads(1)
    kernels = []
    for weight, sigma in terms:
        one = profile(sigma, cut(sigma)).astype(np.float32)
        kernels.append((weight, one))
    image = observed.view(np.float32).reshape(*observed.shape, 2)

    def scattered(image):
        total = np.zeros_like(image)
        for weight, one in kernels:
            blurred = cv2.sepFilter2D(image, -1, np.float32(weight) * one, one, borderType=cv2.BORDER_CONSTANT)
            cv2.add(total, blurred, total)
        return total

    def work():
        first = cv2.subtract(image, scattered(image))
        return cv2.subtract(image, scattered(first))

    result, least = measured(work)
    return np.ascontiguousarray(result).view(np.complex64)[..., 0], least


def restore(folder, shape, terms):
    plane = lambda name: np.fromfile(os.path.join(folder, name), np.float32).reshape(shape)
    observed = plane("real.f32") + np.complex64(1j) * plane("imaginary.f32")
    whole, short = padded_shape(terms, shape, CUT), padded_shape(terms, shape, 2.0)
    circular = tuple(scipy.fft.next_fast_len(size) for size in shape)
    ways = {
        "circular": lambda: with_scipy(observed, terms, circular),
        "scipy": lambda: with_scipy(observed, terms, whole),
        "scipy_short": lambda: with_scipy(observed, terms, short),
        "scipy_real": lambda: with_scipy_real(observed, terms, whole),
        "fftw": lambda: with_fftw(observed, terms, whole),
        "fftw_short": lambda: with_fftw(observed, terms, short),
        "opencv": lambda: with_opencv(observed, terms),
    }
    answer = {}
    for name, way in ways.items():
        found, least = way()
        answer[name] = {"ms": least, "cm": error(found)}
    for name in ("ours_every_pixel", "ours_automatic"):
        if os.path.exists(os.path.join(folder, f"{name}_real.f32")):
            found = plane(f"{name}_real.f32") + 1j * plane(f"{name}_imaginary.f32")
            answer[name] = {"cm": error(found)}
    return answer


if __name__ == "__main__":
    command, folder, width, height, *rest = sys.argv[1:]
    numbers = [float(word) for word in rest]
    terms = list(zip(numbers[::2], numbers[1::2]))
    print(json.dumps({"scene": scene, "restore": restore}[command](folder, (int(height), int(width)), terms)))
