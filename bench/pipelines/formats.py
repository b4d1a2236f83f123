"""Libraries read one file of a mesh format, or write one from a binary STL.

The stage `load` is the library's load call alone: every import, those that the library would make on its first call too, is before it. Without
--write, OUT is not made. With --write, IN is the STL; each library welds vertices of equal position while it loads that, and `save` is its save call.
Normals, colours and the like, of which the STL says nothing, are not written where a library lets one choose.
"""

import sys

from shared import run


def with_trimesh(source, is_stl):
    # Without processing, trimesh keeps vertices as a file has them; with it, it welds.
    loaded = trimesh.load(source, process=is_stl)
    meshes = list(loaded.geometry.values()) if isinstance(loaded, trimesh.Scene) else [loaded]
    return sum(len(mesh.faces) for mesh in meshes), loaded.export


def with_lib3mf(source, is_stl):
    model = WRAPPER.CreateModel()
    model.QueryReader("stl" if is_stl else "3mf").ReadFromFile(source)
    meshes, triangles = model.GetMeshObjects(), 0
    while meshes.MoveNext():
        triangles += meshes.GetCurrentMeshObject().GetTriangleCount()
    return triangles, model.QueryWriter("3mf").WriteToFile


def with_pymeshlab(source, is_stl):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(source)

    def save(target):
        # Of PLY it leaves normals out by itself, of 3MF it cannot write any.
        plain = {"save_vertex_normal": False} if target.endswith((".obj", ".off")) else {}
        meshes.save_current_mesh(target, **plain)

    return meshes.current_mesh().face_number(), save


def with_meshlib(source, is_stl):
    mesh = mrmeshpy.loadMesh(source)
    return mesh.topology.numValidFaces(), lambda target: mrmeshpy.saveMesh(mesh, target)


LIBRARIES = {"trimesh": with_trimesh, "lib3mf": with_lib3mf, "pymeshlab": with_pymeshlab, "meshlib": with_meshlib}


def exchange(source, target, stages, write, **chosen):
    (name,) = [name for name, is_chosen in chosen.items() if is_chosen]
    triangles, save = LIBRARIES[name](source, write)
    stages.end("load")
    stages.facts["triangles"] = triangles
    if write:
        save(target)
        stages.end("save")


if "--trimesh" in sys.argv:
    # Its readers import these at their first call.
    import lxml.etree
    import networkx
    import trimesh
elif "--lib3mf" in sys.argv:
    import lib3mf

    WRAPPER = lib3mf.get_wrapper()
elif "--pymeshlab" in sys.argv:
    import pymeshlab
elif "--meshlib" in sys.argv:
    from meshlib import mrmeshpy

run(exchange, "write", *LIBRARIES)
