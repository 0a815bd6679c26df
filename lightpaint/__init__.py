"""lightpaint: paint how a scene should look; get the lighting that comes closest.

The method of "Painting with Light" (Schoeneman, Dorsey, Smits, Arvo, Greenberg, SIGGRAPH
1993) in image space on Mitsuba 3. Data walks through five rooms in one direction:

    call                        in → out                             question
    load_scene                  scene XML → Scene                    which lights are there?
    render_basis, read_basis    Scene → Basis                        what does each do alone?
    read_light_groups           another renderer's EXR → LightGroups the same
    render_template             Scene → a folder to paint on
    read_target                 painting → Target                    what is wanted, and where?
    solve                       Basis, Target → Solution             which lighting is closest?
    combine                     Basis, Lighting → Estimate           what will it look like?
    relight                     Scene, Lighting → relit Scene        write it into the scene
    verify                      Estimate, relit Scene → Verification does it look like that?

`paint_with_light` is all of it in one call, for one view or several: a `Job`, and a `run` of it;
`solve_views` takes several views. Importing this sets no Mitsuba variant; that
happens when the first scene is loaded.
"""

from lightpaint.basis.basis import Basis, read_basis, write_basis
from lightpaint.basis.lightgroups.read import LightGroups, read_light_groups
from lightpaint.basis.render.render import render_basis
from lightpaint.colour.view import View
from lightpaint.errors import LightpaintError
from lightpaint.images.estimate import Estimate
from lightpaint.images.png import display_picture
from lightpaint.job import Job
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import read_constraints
from lightpaint.lighting.lighting import Lighting, combine, read_lighting, write_lighting
from lightpaint.lighting.solve import Solution, solve
from lightpaint.lighting.views import solve_views
from lightpaint.pipeline import paint_with_light, run
from lightpaint.placement.suggest import Suggestion, suggest_lights
from lightpaint.relit.export.exports import write_exports
from lightpaint.relit.relight import relight
from lightpaint.relit.verify import Verification, verify
from lightpaint.renders import render_template
from lightpaint.report.verdict import verdict
from lightpaint.results import Look
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.scene.variant import use_variant
from lightpaint.settings import Settings
from lightpaint.sources import Painting, SceneFile
from lightpaint.target.read import read_target
from lightpaint.target.target import Target
from lightpaint.version import __version__

__all__ = [
    "Basis",
    "Constraints",
    "Estimate",
    "Job",
    "LightGroups",
    "Lighting",
    "LightpaintError",
    "Look",
    "Painting",
    "Scene",
    "SceneFile",
    "Settings",
    "Solution",
    "Suggestion",
    "Target",
    "Verification",
    "View",
    "__version__",
    "combine",
    "display_picture",
    "load_scene",
    "paint_with_light",
    "read_basis",
    "read_constraints",
    "read_light_groups",
    "read_lighting",
    "read_target",
    "relight",
    "render_basis",
    "render_template",
    "run",
    "solve",
    "solve_views",
    "suggest_lights",
    "use_variant",
    "verdict",
    "verify",
    "write_basis",
    "write_exports",
    "write_lighting",
]
