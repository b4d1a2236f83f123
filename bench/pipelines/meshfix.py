"""pymeshfix: fill all boundaries, then clean, as its clean_from_file does.

The file is read and written with numpy, which is faster than the reader and the text writer that come with it.
"""

import pymeshfix
import numpy
from shared import read_corners, run, weld, write_corners


def fill_and_clean(mesh, stages):
    mesh.fill_small_boundaries()
    stages.end("fill boundaries")
    mesh.clean(max_iters=10, inner_loops=3)
    stages.end("clean")


def repair(source, target, stages):
    mesh = pymeshfix.PyTMesh()
    mesh.set_quiet(True)
    vertices, faces = weld(read_corners(source))
    stages.end("load")
    mesh.load_array(vertices.astype(numpy.float64), faces.astype(numpy.int32))
    stages.end("connect")
    fill_and_clean(mesh, stages)
    vertices, faces = mesh.return_arrays()
    write_corners(target, vertices[faces])
    stages.end("save")


if __name__ == "__main__":
    run(repair)
