"""Makes docs/python.png: two bodies that cross, one of them with holes, and their repair, each face in the colour of its origin.

Needs suture-mesh and pyvista: pip install ./python pyvista; python docs/python.py
"""

from pathlib import Path

import numpy as np
import pyvista

import suture

COLOURS = {"input": "lightgrey", "part": "steelblue", "fill": "darkorange"}

ring = pyvista.ParametricTorus(ringradius=1.0, crosssectionradius=0.35, u_res=61, v_res=41, w_res=2).triangulate().clean()
for place in [(-0.8, -0.9, 0.2), (-1.2, 0.3, 0.2), (0.2, 1.1, 0.3), (0.3, -1.0, 0.33)]:
    ring = ring.remove_cells(np.linalg.norm(ring.cell_centers().points - place, axis=1) < 0.17)
ball = pyvista.Sphere(radius=0.55, center=(1.0, 0.0, 0.0), theta_resolution=40, phi_resolution=40)
broken = pyvista.merge([ring, ball], merge_points=False).extract_surface(algorithm=None)

repaired = suture.repair(*suture.from_pyvista(broken))
print(repaired.outcome, "-", repaired.report["verdict"]["statement"])
fixed = repaired.to_pyvista()

plotter = pyvista.Plotter(shape=(1, 2), off_screen=True, window_size=(1400, 560), border=False)
plotter.add_mesh(broken, color="lightgrey", backface_params={"color": "sienna"})
plotter.add_mesh(broken.extract_feature_edges(feature_edges=False, manifold_edges=False), color="red", line_width=3)
plotter.subplot(0, 1)
for name, colour in COLOURS.items():
    faces = fixed.extract_cells(repaired.origin_names == name)
    plotter.add_mesh(faces, color=colour, show_edges=name != "input", line_width=0.5)
plotter.link_views()
plotter.camera_position = [(-2.2, -3.6, 3.6), (0.1, 0.0, 0.0), (0.0, 0.0, 1.0)]
plotter.camera.zoom(1.12)
plotter.screenshot(Path(__file__).with_name("python.png"))
