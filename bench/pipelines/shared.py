"""What every pipeline here shares: its arguments, binary STL as arrays, and the seconds of its stages.

A pipeline is called with IN OUT, or with a folder of inputs and a folder for outputs: then one process works through them all. The
seconds of each stage, summed, go to standard output as the last line, one JSON object.
"""

import argparse
import json
import pathlib
import sys
import time

import numpy

RECORD = numpy.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class Stages:
    """Seconds by the name of the stage that they ended."""

    def __init__(self):
        self.seconds, self.facts, self.last = {}, {}, time.perf_counter()

    def end(self, name):
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self.last
        self.last = now


def run(repair, *flags, values=()):
    """Calls `repair(source, target, stages, **flags, **values)` for the input, or for each of a folder; a failure is named, then the next."""
    parser = argparse.ArgumentParser()
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("target", type=pathlib.Path)
    for flag in flags:
        parser.add_argument("--" + flag, action="store_true")
    for value in values:
        parser.add_argument("--" + value, required=True)
    chosen = vars(parser.parse_args())
    source, target = chosen.pop("source"), chosen.pop("target")
    files = [(source, target)]
    if source.is_dir():
        target.mkdir(exist_ok=True)
        files = [(path, target / path.name) for path in sorted(source.iterdir())]
    stages, failed = Stages(), 0
    for path, result in files:
        try:
            repair(str(path), str(result), stages, **chosen)
        except Exception as problem:
            print(f"{path.name}: {problem}", file=sys.stderr)
            failed += 1
    listed = [{"name": name, "seconds": seconds} for name, seconds in stages.seconds.items()]
    print(json.dumps({"stages": listed, "facts": stages.facts}))
    sys.exit(1 if failed else 0)


def read_corners(path):
    """The finite triangles of a binary STL, n × 3 × 3."""
    records = numpy.fromfile(path, RECORD, offset=84)
    corners = records["corners"]
    return corners[numpy.isfinite(corners).all((1, 2))]


def weld(corners):
    """Vertices of exactly equal position, and the triangles as three of their numbers."""
    points = numpy.ascontiguousarray(corners.reshape(-1, 3) + numpy.float32(0))
    _, first, numbers = numpy.unique(points.view("V12").ravel(), return_index=True, return_inverse=True)
    return points[first], numbers.reshape(-1, 3)


def edge_around_holes(corners):
    """Median length of the edges that have one end on the border of a mesh."""
    points, triangles = weld(corners)
    edges = numpy.sort(numpy.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, uses = numpy.unique(edges, axis=0, return_counts=True)
    on_border = numpy.zeros(len(points), bool)
    on_border[edges[uses == 1]] = True
    beside = edges[on_border[edges].sum(axis=1) == 1]
    ends = points[beside].astype(numpy.float64)
    return float(numpy.median(numpy.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)))


def write_corners(path, corners):
    """Writes n × 3 × 3 coordinates as binary STL, normals left to be computed by whoever reads them."""
    records = numpy.zeros(len(corners), RECORD)
    records["corners"] = corners
    with open(path, "wb") as file:
        file.write(bytes(80) + len(corners).to_bytes(4, "little"))
        records.tofile(file)
