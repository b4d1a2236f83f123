"""pymeshlab closes the holes of an otherwise sound mesh, patches refined to the edges around them."""

import pymeshlab
from shared import edge_around_holes, read_corners, run

LARGEST_HOLE_EDGES = 10_000


def close(source, target, stages):
    edge = edge_around_holes(read_corners(source))
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(source)
    meshes.meshing_remove_duplicate_vertices()
    stages.end("load")
    meshes.meshing_close_holes(
        maxholesize=LARGEST_HOLE_EDGES,
        selfintersection=False,
        refinehole=True,
        refineholeedgelen=pymeshlab.PureValue(edge),
    )
    stages.end("close")
    meshes.save_current_mesh(target, binary=True)
    stages.end("save")


run(close)
