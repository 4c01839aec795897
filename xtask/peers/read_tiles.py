"""Reads a cloud in tiles (COPC) with laspy and holds it against the PLY that it was made from; run by hand.

    pip install 'laspy[lazrs,laszip]' numpy
    python read_tiles.py cloud.ply cloud.copc.laz
"""

import sys
import time

import laspy
import numpy as np

TYPES = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4"}
NAMES = {"intensity": "amplitude", "nx": "NormalX", "ny": "NormalY", "nz": "NormalZ"}


def read_ply(path):
    with open(path, "rb") as file:
        fields, count = [], 0
        while (line := file.readline().split()) != [b"end_header"]:
            if line[0] == b"element":
                count = int(line[2])
            if line[0] == b"property":
                fields.append((line[2].decode(), TYPES[line[1].decode()]))
        return np.fromfile(file, dtype=fields, count=count)


def in_order(columns):
    """Rows of whole coordinates and values (as bits), in an order of their own."""
    rows = np.stack(columns, axis=1)
    return rows[np.lexsort(rows.T[::-1])]


def bits(values):
    return values.view(f"u{values.dtype.itemsize}").astype(np.int64) if values.dtype.kind == "f" else values.astype(np.int64)


def main(ply_path, tiles_path):
    ply = read_ply(ply_path)
    further = [name for name in ply.dtype.names if name not in "xyz"]
    for backend in [laspy.LazBackend.Lazrs, laspy.LazBackend.Laszip]:
        clock = time.process_time()
        las = laspy.read(tiles_path, laz_backend=backend)
        header = las.header
        whole = [np.round((ply[a].astype("f8") - o) / s).astype(np.int64) for a, o, s in zip("xyz", header.offsets, header.scales)]
        expected = in_order(whole + [bits(ply[name]) for name in further])
        found = [np.asarray(las[axis]).astype(np.int64) for axis in "XYZ"]
        found = in_order(found + [bits(np.ascontiguousarray(las[NAMES.get(name, name)])) for name in further])
        same = expected.shape == found.shape and (expected == found).all()
        print(f"{backend.name}: {len(found)} points, all values {', '.join(further)} as in the PLY: {same}, {time.process_time() - clock:.1f} s")
        if not same:
            return 1
    with laspy.CopcReader.open(tiles_path) as copc:
        levels = max(entry.key.level for entry in copc.root_page.entries.values())
        total = len(copc.query())
        print(f"CopcReader: {len(copc.root_page.entries)} nodes, {levels + 1} levels, {total} points")
        for level in range(levels + 1):
            print(f"  level {level}: {len(copc.query(level=level))} points")
        low, high = copc.header.mins, copc.header.maxs
        box = laspy.copc.Bounds(low + 0.25 * (high - low), low + 0.6 * (high - low))
        found = len(copc.query(box))
        # Points within a step of the border may be rounded to either side.
        surely, perhaps = np.ones(len(ply), bool), np.ones(len(ply), bool)
        for axis, step in enumerate(copc.header.scales):
            x = ply["xyz"[axis]].astype("f8")
            surely &= (x >= box.mins[axis] + step) & (x <= box.maxs[axis] - step)
            perhaps &= (x >= box.mins[axis] - step) & (x <= box.maxs[axis] + step)
        print(f"  in a box: {found} points, {surely.sum()} to {perhaps.sum()} of the PLY")
        return int(total != len(ply) or not surely.sum() <= found <= perhaps.sum())


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
