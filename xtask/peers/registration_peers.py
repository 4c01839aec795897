"""Peers of the crate icp-registration, on folders of frames as the example registration_peers writes them.

usage: registration_peers.py real FOLDER CAPTURE                         writes frames of a depth camera
       registration_peers.py scans FOLDER TARGET SOURCE REFERENCE        writes two scans as a pair
       registration_peers.py frames FOLDER STRIDE FIRST COUNT [NAME...]  pairs of frames, from the identity
       registration_peers.py pairs FOLDER LIST METHOD...                 each pair of a list, by methods with settings
       registration_peers.py streams FOLDER FIRST COUNT VOXEL...         KISS-ICP on a part of a stream
       registration_peers.py covariance FOLDER                           normalised squared errors
       registration_peers.py degenerate FOLDER                           what is said where motions are undetermined
       registration_peers.py coarse FOLDER                               pairs without a guess
       registration_peers.py tracking FOLDER                             a stream
       registration_peers.py stations FOLDER                             a ring of stations

The last line printed is an object of JSON. Times are CPU time of one thread in milliseconds.
"""

import json
import math
import sys

from registration_coarse import coarse
from registration_frames import frames
from registration_pairs import pairs, streams
from registration_real import real, scans
from registration_stations import stations
from registration_tracking import tracking
from registration_verdicts import covariance, degenerate

COMMANDS = (real, scans, frames, pairs, streams, covariance, degenerate, coarse, tracking, stations)


def told(answer):
    """JSON knows no infinity."""
    if isinstance(answer, dict):
        return {name: told(value) for name, value in answer.items()}
    if isinstance(answer, list):
        return [told(value) for value in answer]
    return answer if math.isfinite(answer) else None


if __name__ == "__main__":
    name, *words = sys.argv[1:]
    print(json.dumps(told({command.__name__: command for command in COMMANDS}[name](*words))))
