"""MeshLib: findSelfCollidingTriangles alone, timed by itself over a mesh that is loaded. Writes nothing."""

from meshlib import mrmeshpy
from shared import run


def detect(source, _, stages):
    mesh = mrmeshpy.loadMesh(source)
    stages.end("load")
    pairs = mrmeshpy.findSelfCollidingTriangles(mesh)
    stages.end("self-intersections")
    stages.facts["pairs"] = stages.facts.get("pairs", 0) + pairs.size()
    stages.facts["triangles"] = stages.facts.get("triangles", 0) + mesh.topology.numValidFaces()


run(detect)
