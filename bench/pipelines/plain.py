"""What the manual of pymeshlab suggests for a mesh to be printed, every filter with its defaults.

Load, duplicate vertices and faces, null faces, non-manifold edges and vertices, close holes, orient, save. A filter that
refuses the mesh (close holes does while an edge is not manifold) is named on standard error and skipped. With
--self-intersections the result's self-intersecting faces are selected before it is saved, which is how pymeshlab finds them.
"""

import sys

import pymeshlab
from shared import run

FILTERS = (
    "meshing_remove_duplicate_vertices",
    "meshing_remove_duplicate_faces",
    "meshing_remove_null_faces",
    "meshing_repair_non_manifold_edges",
    "meshing_repair_non_manifold_vertices",
    "meshing_close_holes",
    "meshing_re_orient_faces_coherently",
)


def repair(source, target, stages, self_intersections):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(source)
    stages.end("load")
    for name in FILTERS:
        try:
            meshes.apply_filter(name)
        except pymeshlab.PyMeshLabException as refusal:
            print(f"{name} skipped: {refusal}", file=sys.stderr)
        stages.end(name.removeprefix("meshing_").replace("_", " "))
    if self_intersections:
        meshes.apply_filter("compute_selection_by_self_intersections_per_face")
        stages.facts["self-intersecting"] = meshes.current_mesh().selected_face_number()
        stages.end("self-intersections")
    meshes.save_current_mesh(target, binary=True)
    stages.end("save")


run(repair, "self-intersections")
