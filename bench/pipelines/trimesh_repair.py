"""trimesh: merge vertices on loading, drop duplicate and degenerate faces, fill holes, fix winding and inversion, save."""

import trimesh
from shared import run


def mend(mesh, stages):
    mesh.update_faces(mesh.unique_faces() & mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    stages.end("bad faces")
    trimesh.repair.fill_holes(mesh)
    stages.end("fill holes")
    trimesh.repair.fix_normals(mesh, multibody=True)
    stages.end("orient")


def repair(source, target, stages):
    mesh = trimesh.load(source, file_type="stl", force="mesh", process=True)
    stages.end("load")
    mend(mesh, stages)
    mesh.export(target)
    stages.end("save")


if __name__ == "__main__":
    run(repair)
