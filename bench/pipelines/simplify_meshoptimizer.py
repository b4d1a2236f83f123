"""meshoptimizer makes triangles fewer by its simplifier: borders locked, no bound but the count."""

import meshoptimizer
import numpy
from shared import read_corners, run, weld, write_corners

ANY_ERROR = 1e30


def simplify(source, target, stages, triangles):
    points, faces = weld(read_corners(source))
    points = numpy.ascontiguousarray(points, numpy.float32)
    indices = numpy.ascontiguousarray(faces.ravel(), numpy.uint32)
    stages.end("load")
    made = numpy.zeros_like(indices)
    count = meshoptimizer.simplify(
        made,
        indices,
        points,
        target_index_count=3 * int(triangles),
        target_error=ANY_ERROR,
        options=meshoptimizer.SIMPLIFY_LOCK_BORDER,
    )
    stages.end("simplify")
    write_corners(target, points[made[:count].reshape(-1, 3)])
    stages.end("save")


run(simplify, values=("triangles",))
