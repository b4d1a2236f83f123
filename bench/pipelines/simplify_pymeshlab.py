"""pymeshlab makes triangles fewer by quadric edge collapse: borders and topology preserved, the optimal position, normals not turned."""

import pymeshlab
from shared import run


def simplify(source, target, stages, triangles):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(source)
    # The reader of STL welds equal positions already; said here, so that it is so whatever its default.
    meshes.meshing_remove_duplicate_vertices()
    stages.end("load")
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=int(triangles), preserveboundary=True, preservenormal=True, preservetopology=True, optimalplacement=True
    )
    stages.end("simplify")
    meshes.save_current_mesh(target, binary=True)
    stages.end("save")


run(simplify, values=("triangles",))
