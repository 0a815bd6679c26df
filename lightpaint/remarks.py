"""What is worth saying to a person before a job is run, in plain text."""

from lightpaint.basis.render.render import memory_needed, why_not_one_pass
from lightpaint.images.denoise import LACKING, is_there
from lightpaint.scene.scene import Scene
from lightpaint.scene.variant import use_variant
from lightpaint.screen import some_names
from lightpaint.settings import Settings
from lightpaint.target.target import Target

#: Bytes of memory from which on a basis is worth a word.
MUCH_MEMORY = 2e9


def remarks_of_scene(scene: Scene, *, is_rendered: bool = True) -> list[str]:
    """What is worth knowing of its lights and, where it is to be rendered, of how that is done."""
    remarks = []
    if scene.lights_file is not None:
        remarks.append(f"lights and groups as in {scene.lights_file}")
    if scene.instead is not None:
        remarks.append(f"rendered by {scene.instead}, not by the scene's own integrator")
    if obstacles := [f"{x.name!r} {x.obstacle}" for x in scene.emitters if x.obstacle]:
        remarks.append(f"left as it is: {some_names(obstacles, '; ')}")
    # Python gets the same as a warning.
    if note := use_variant().note:
        remarks.append(note)
    elif is_rendered and (reason := why_not_one_pass(scene)):
        remarks.append(
            f"{reason}: every light is rendered separately, {len(scene.lights)} times the work"
        )
    return remarks


def remarks_of_pictures() -> list[str]:
    """Says so where pictures are denoised less well than they could be."""
    return [] if is_there() else [LACKING]


def remarks_of_memory(scene: Scene) -> list[str]:
    """Says so where the basis of `scene` takes much memory."""
    if (needed := memory_needed(scene)) <= MUCH_MEMORY:
        return []
    return [
        f"{len(scene.lights)} lights of {scene.size[1]}x{scene.size[0]} pixels: "
        f"{needed / 1e9:.1f} GB of memory at most"
    ]


def remarks_of_target(
    target: Target, size: tuple[int, int], scene: Scene | None, fit: Settings
) -> list[str]:
    """How `target` was read. size: of the basis that it is solved on. fit: with all decided."""
    remarks = []
    if scene is not None and target.content not in ("", scene.content):
        remarks.append("the scene has changed since its template was made")
    (height, width), (mine_h, mine_w) = size, target.size
    is_asked_for = fit.resize or fit.resolution or fit.quality
    if size != target.size and not is_asked_for:
        remarks.append(f"{mine_w}x{mine_h} pixels averaged to the basis's {width}x{height}")
    name = "srgb" if target.transform is None else target.transform.name
    if fit.space == "linear" and name not in ("srgb", "linear"):
        remarks.append(
            f"painted through {name}, whose highlights stand for very much light and rule the "
            'fit: space="display" fits what the eye sees'
        )
    remarks += target.notes
    if target.not_finite:
        remarks.append(f"{target.not_finite} pixels hold NaN or Inf and count nothing")
    return [f"{target.name}: {remark}" for remark in remarks]
