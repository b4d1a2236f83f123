"""Repair from arrays of numpy and back, as a program calls a library: vertices and faces in memory, no file on the way.

The input's vertices of equal position are one vertex already, whoever is called. Only the stage `arrays` is the library's: from arrays that numpy
made to arrays that numpy can read. With --suture, the faces are compared with those of the file that the same package writes.
"""

import os
import sys
import tempfile

import numpy
from shared import Stages, read_corners, run, weld, write_corners


def with_suture(vertices, faces):
    fixed = suture.repair(vertices, faces)
    return fixed.vertices, fixed.faces


def with_pymeshlab(vertices, faces):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    competent.Repair(meshes, Stages()).complete()
    return meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()


def with_meshlib(vertices, faces):
    mesh = mrmeshnumpy.meshFromFacesVerts(faces, vertices)
    mrmeshpy.findSelfCollidingTrianglesBS(mesh)
    meshlib_repair.fill(mesh)
    mesh.pack()
    return mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology)


def with_pymeshfix(vertices, faces):
    mesh = pymeshfix.PyTMesh()
    mesh.set_quiet(True)
    mesh.load_array(vertices, faces)
    meshfix.fill_and_clean(mesh, Stages())
    return mesh.return_arrays()


def with_trimesh(vertices, faces):
    mesh = trimesh.Trimesh(vertices, faces, process=True)
    trimesh_repair.mend(mesh, Stages())
    return mesh.vertices, mesh.faces


# By flag: what does it, and the types that it takes without a conversion.
LIBRARIES = {
    "suture": (with_suture, numpy.float32, numpy.uint32),
    "pymeshlab": (with_pymeshlab, numpy.float64, numpy.int32),
    "meshlib": (with_meshlib, numpy.float32, numpy.int32),
    "pymeshfix": (with_pymeshfix, numpy.float64, numpy.int32),
    "trimesh": (with_trimesh, numpy.float64, numpy.int64),
}


def faces_unlike_the_files(source, corners):
    """Faces of a result that differ from those of the file that `repair_file` writes, in order."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "out.stl")
        suture.repair_file(source, path)
        written = read_corners(path)
    if len(written) != len(corners):
        return max(len(written), len(corners))
    return int((written != corners).any((1, 2)).sum())


def repair(source, target, stages, **chosen):
    (name,) = [name for name, is_chosen in chosen.items() if is_chosen]
    work, number, index = LIBRARIES[name]
    vertices, faces = weld(read_corners(source))
    vertices, faces = vertices.astype(number), faces.astype(index)
    stages.end("load")
    vertices, faces = work(vertices, faces)
    stages.end("arrays")
    corners = numpy.asarray(vertices, numpy.float32)[numpy.asarray(faces, numpy.int64)]
    write_corners(target, corners)
    stages.end("save")
    if name == "suture":
        stages.facts["faces unlike the file's"] = faces_unlike_the_files(source, corners)


if "--suture" in sys.argv:
    import suture
elif "--pymeshlab" in sys.argv:
    import competent
    import pymeshlab
elif "--meshlib" in sys.argv:
    import meshlib_repair
    from meshlib import mrmeshnumpy, mrmeshpy
elif "--pymeshfix" in sys.argv:
    import meshfix
    import pymeshfix
elif "--trimesh" in sys.argv:
    import trimesh
    import trimesh_repair

run(repair, *LIBRARIES)
