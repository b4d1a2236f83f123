"""MeshLib: load, find the triangles that collide with others, fill all holes, save."""

from meshlib import mrmeshpy
from shared import run


def fill(mesh):
    for hole in mesh.topology.findHoleRepresentiveEdges():
        settings = mrmeshpy.FillHoleParams()
        settings.metric = mrmeshpy.getUniversalMetric(mesh)
        mrmeshpy.fillHole(mesh, hole, settings)


def repair(source, target, stages):
    mesh = mrmeshpy.loadMesh(source)
    stages.end("load")
    colliding = mrmeshpy.findSelfCollidingTrianglesBS(mesh)
    stages.facts["self-intersecting"] = colliding.count()
    stages.end("self-intersections")
    fill(mesh)
    stages.end("fill holes")
    mesh.pack()
    mrmeshpy.saveMesh(mesh, target)
    stages.end("save")


if __name__ == "__main__":
    run(repair)
