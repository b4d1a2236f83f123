"""MeshLib makes triangles fewer by its decimation: quadric error, no bound but the count, as many parts as there are threads."""

import os

from meshlib import mrmeshpy
from shared import run


def simplify(source, target, stages, triangles):
    mesh = mrmeshpy.loadMesh(source)
    stages.end("load")
    settings = mrmeshpy.DecimateSettings()
    settings.strategy = mrmeshpy.DecimateStrategy.MinimizeError
    settings.maxError = 1e30
    settings.maxDeletedFaces = max(0, mesh.topology.numValidFaces() - int(triangles))
    settings.subdivideParts = max(1, os.cpu_count() or 1)
    settings.packMesh = True
    mrmeshpy.decimateMesh(mesh, settings)
    stages.end("simplify")
    mrmeshpy.saveMesh(mesh, target)
    stages.end("save")


run(simplify, values=("triangles",))
