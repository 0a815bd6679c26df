"""Mitsuba integrators that the one-pass renderer replaces, and their parameters.

It traces the paths of `path`. Some other integrators estimate the same picture from other samples;
their basis is then the same up to noise.
"""

from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.luminaires import POINT_PLUGIN
from lightpaint.scene import ENVIRONMENTS, Integrator, Scene
from lightpaint.scene.runtime.variant import FAST_VARIANT, use_variant
from lightpaint.sentences import Hint, Word

#: Integrators that end after one bounce.
DIRECT = ("direct", "direct_projective")
#: Integrators that ignore participating media.
ON_SURFACES = ("path", "prb", "prb_projective", *DIRECT)
#: Size of the planes of all lights in float32, in bytes, up to which indirect light is split off.
SPLIT_MAX_BYTES = 2**29
#: Emitters at a point.
WITHOUT_SIZE = ("point", "spot", "projector", POINT_PLUGIN)
#: Integrators that hide emitters from the camera in another way than `path`.
HIDING_OTHERWISE = ("volpath", "prb_projective", "direct_projective")


def why_not_one_pass(scene: Scene) -> str | None:
    """Return briefly why `scene` cannot use the one-pass renderer; None if it can."""
    variant = use_variant()
    if not variant.is_jit:
        return f"the variant is {variant.variant}"
    integrator = scene.integrator
    plugin = integrator.plugin
    if plugin not in ("volpath", *ON_SURFACES):
        return f"the integrator is {plugin}"
    if plugin == "volpath" and scene.has_media:
        return "the integrator volpath renders fog, smoke or liquids (participating media)"
    if plugin == "volpath" and scene.has_null:
        return "the integrator volpath lights what is behind masks, thin glass or null surfaces"
    if integrator.hide_emitters and plugin in HIDING_OTHERWISE:
        return f"the integrator {plugin} hides emitters in a way of its own (hide_emitters)"
    if integrator.samples != (1, 1):
        # It would count lights without a size once per sample.
        return "the integrator direct takes other than one sample (emitter_samples, bsdf_samples)"
    return None


def check_renders_spectra(scene: Scene) -> None:
    """Raise SceneError for a scene that cannot be rendered with spectra."""
    if (reason := why_not_one_pass(scene)) is not None:
        needed: tuple[str | Hint, ...] = (Hint("integrator", "path"),)
        if not use_variant().is_jit:
            needed = (Hint("variant", Word(FAST_VARIANT)), " or another that is not scalar")
        text = f"{reason}, and spectra are only rendered where one pass renders all lights: use "
        raise SceneError(text, *needed)
    if "hair" in scene.materials:
        raise SceneError(
            f"{scene.path} has hair, whose fibres scatter each wavelength in its own direction: "
            "renders with spectra cannot show it"
        )


def remark_on_separate_renders(scene: Scene) -> str | None:
    """Return a remark on the cost of separate renders; None if it is not needed."""
    count = len(scene.lights)
    if (reason := why_not_one_pass(scene)) is None or count == 1:
        return None
    if use_variant().is_jit:
        alternative = "the integrator path, where it shows the same,"
    else:
        alternative = "a variant like llvm_ad_rgb"
    return (
        f"{reason}: each of the {count} lights is rendered by itself, {count} times the work; "
        f"{alternative} renders all in one pass"
    )


def depth_limit(integrator: Integrator) -> int:
    """Return the maximum number of vertices after the camera. Mitsuba's −1 means no limit."""
    return 2 if integrator.plugin in DIRECT else integrator.max_depth % 2**32


def has_indirect_planes(scene: Scene) -> bool:
    """Return whether the one pass stores indirect light separately from direct light.

    That doubles the memory, which is affordable for small pictures, the ones shown to people.
    Measurements at points are no pictures, and are not denoised: there it is a choice.
    """
    if scene.points is not None:
        return scene.points.is_split and depth_limit(scene.integrator) > 2
    height, width = scene.size
    is_small = 12 * len(scene.lights) * height * width <= SPLIT_MAX_BYTES
    return is_small and depth_limit(scene.integrator) > 2


def plane_count(scene: Scene) -> int:
    """Return the number of planes that the one pass fills: one or two for each light."""
    return len(scene.lights) * (2 if has_indirect_planes(scene) else 1)


def needs_a_bounce(scene: Scene) -> bool:
    """Return True if paths that meet only null surfaces must be black.

    `path` treats such a path as one that hit nothing, and discards the light that it gathered on
    masks, unless an environment is visible behind them.
    """
    if scene.points is not None:
        return False  # each path begins with a bounce
    sees_backdrop = any(x.plugin in ENVIRONMENTS for x in scene.emitters)
    is_hidden = scene.integrator.hide_emitters or not sees_backdrop
    return scene.integrator.plugin == "path" and scene.has_null and is_hidden


def remark_on_fog(scene: Scene) -> str | None:
    """Return a remark on lights without a size in fog; None without either.

    Light that scatters at a distance d from such a light has the factor 1/d². Free paths are
    sampled without regard to it, and the variance, of ∫ d⁻⁴ dV, has no bound: a basis that has not
    met a path close to the light does not know of it.
    """
    names = [
        light.name
        for light in scene.lights
        if any(member.plugin in WITHOUT_SIZE for member in light.members)
    ]
    if not names or not scene.has_media or scene.integrator.plugin in ON_SURFACES:
        return None
    is_one = len(names) == 1
    return (
        f"{some_names(names)} {'has' if is_one else 'have'} no size: light that scatters in fog "
        f"close to {'it' if is_one else 'them'} comes by rare bright paths, so that "
        f"{'its' if is_one else 'their'} ± may be too small; small balls of light have none of them"
    )
