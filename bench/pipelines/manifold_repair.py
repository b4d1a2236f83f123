"""manifold3d: merge vertices, make a manifold of it, save. It takes only what is manifold already, or nearly so.

With --union all parts are united, so that none stands in another."""

import manifold3d
import numpy
from shared import read_corners, run, write_corners


def repair(source, target, stages, union):
    corners = read_corners(source)
    mesh = manifold3d.Mesh(
        vert_properties=numpy.ascontiguousarray(corners.reshape(-1, 3)),
        tri_verts=numpy.arange(3 * len(corners), dtype=numpy.uint32).reshape(-1, 3),
    )
    stages.end("load")
    mesh.merge()
    stages.end("weld")
    body = manifold3d.Manifold(mesh)
    if body.status() != manifold3d.Error.NoError:
        raise ValueError(f"refused: {body.status().name}")
    stages.end("manifold")
    if union:
        parts = body.decompose()
        if len(parts) > 1:
            body = manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)
        stages.end("union")
    result = body.to_mesh()
    write_corners(target, result.vert_properties[:, :3][result.tri_verts])
    stages.end("save")


run(repair, "union")
