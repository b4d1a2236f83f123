"""IN OUT: what the manual of pymeshlab suggests for a mesh to be printed, every filter with its defaults.

Load, duplicate vertices and faces, null faces, non-manifold edges and vertices, close holes, orient, save. A filter that
refuses the mesh (close holes does while an edge is not manifold) is named on standard error and skipped.
"""

import sys

import pymeshlab

source, target = sys.argv[1:3]
meshes = pymeshlab.MeshSet(verbose=False)
meshes.load_new_mesh(source)
for name in (
    "meshing_remove_duplicate_vertices",
    "meshing_remove_duplicate_faces",
    "meshing_remove_null_faces",
    "meshing_repair_non_manifold_edges",
    "meshing_repair_non_manifold_vertices",
    "meshing_close_holes",
    "meshing_re_orient_faces_coherently",
):
    try:
        meshes.apply_filter(name)
    except pymeshlab.PyMeshLabException as refusal:
        print(f"{name} skipped: {refusal}", file=sys.stderr)
meshes.save_current_mesh(target, binary=True)
