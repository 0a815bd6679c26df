"""A Mitsuba scene with named lights, which can be loaded repeatedly with different emissions.

The parsed XML is kept rather than the loaded scene: only one loaded scene should exist at a time,
and no reference to one of its emitters may outlive it.
"""

import gc
import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path, PurePath
from typing import Any, TypeVar

from lightpaint.arrays import RGB, Floats, Position
from lightpaint.colour import EYE, Lamp, Observer
from lightpaint.display_text import Listed, Shown, some_of, visible
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.luminaires import LUMINAIRE_PLUGINS
from lightpaint.scene.lights import new_emitter
from lightpaint.scene.lights.emitters import Emitter, find_emitters
from lightpaint.scene.lights.hung_luminaires import HungLuminaire
from lightpaint.scene.lights.image_split import with_split
from lightpaint.scene.lights.light import (
    Light,
    black_emitters,
    check_grouping,
    emitter_named,
    light_named,
    lights_of,
    lights_of_lamps,
    regrouped,
    settings_for,
)
from lightpaint.scene.lights.lights_file import SceneRequests, lights_file_beside
from lightpaint.scene.lights.texels.image_domains import GridSize
from lightpaint.scene.lights.texels.texel import TexelLayout
from lightpaint.scene.plane_identity import SceneHasher
from lightpaint.scene.properties.emission import ENVIRONMENTS, read_emitted_image
from lightpaint.scene.properties.film import (
    Film,
    MeasuringPoints,
    bands_of,
    camera_named,
    reduced,
    reduction,
)
from lightpaint.scene.properties.integrator import Integrator, IntegratorChoice
from lightpaint.scene.properties.pose import Pose, motion_of, upward_axis
from lightpaint.scene.properties.site import EmitterPlace, Site
from lightpaint.scene.runtime.kernel_threads import kernels
from lightpaint.scene.runtime.mitsuba_errors import mitsuba_errors, render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.scene.runtime.variant import is_in_spectra, spectral_variant
from lightpaint.scene.scene_tree import ParsedScene, with_elements, with_motions, with_settings

_Result_T = TypeVar("_Result_T")

#: A shape that is only visible through instances.
GROUP = "shapegroup"

#: Whether scenes that this process has loaded have null surfaces, by what they are without lights
#: (`SceneHasher.surroundings`).
_has_null: dict[str, bool] = {}


class SceneFiles:
    """The files of a `Scene`, which has these attributes and describes them."""

    path: Path
    files: tuple[Path, ...]
    lights_file: Path | None
    requests: SceneRequests
    parsed: ParsedScene

    @property
    def moved_elements(self) -> tuple[tuple[Path, int, Mapping[str, str]], ...]:
        """Elements in the files that `moved` changed.

        For each: its file, the byte offset of its `<`, and the child elements to set, as XML by
        name.
        """
        nodes = self.parsed.state.nodes
        return tuple(
            (self.files[nodes[k].file_index], int(nodes[k].offset) - 1, children)
            for k, children in self.parsed.moved.items()
        )

    @property
    def originals(self) -> tuple[Path, ...]:
        """All files of the scene: XML, meshes, textures, tables."""
        return (*self.files, *self.parsed.assets())

    @property
    def read_files(self) -> tuple[Path, ...]:
        """`originals`, and the lights file and its spectra if there are any."""
        lights_files = [] if self.lights_file is None else [self.lights_file]
        return (*self.originals, *lights_files, *self.requests.spectrum_files)

    @property
    def places(self) -> frozenset[Path]:
        """Paths of its files, and of files that would change the scene if they existed."""
        lights_path = self.lights_file or lights_file_beside(self.path)
        spectra = self.requests.spectrum_files
        return frozenset({*self.parsed.places(), lights_path, *spectra})

    @cached_property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the shapes, in the order of a loaded scene."""
        return shape_names(self.parsed)

    @property
    def replaced_integrators(self) -> tuple[tuple[Path, int], ...]:
        """The integrators that `instead` replaces: file, and byte offset of the element."""
        return tuple((self.files[file], offset) for file, offset in self.parsed.replaced)

    def emitted_image(self, emitter: Emitter) -> Floats:
        """Return the image that `emitter` emits, (h, w, 3) linear Rec.709, without its scale."""
        assert emitter.kind is not None
        return read_emitted_image(*self.parsed.image_file(emitter.node, emitter.kind.parameter))


@keywords()
@dataclass(frozen=True)
class Scene(SceneFiles, Shown):
    """A parsed scene, seen through one of its sensors.

    Attributes:
        path: The XML file.
        parameters: Values of the `$name` parameters.
        film: The film of its sensor.
        sensor_names: Ids of all sensors.
        spp: The scene's own number of samples per pixel.
        integrator: The parameters of its integrator.
        integrator_choice: The integrator that replaces the scene's own, or None.
        has_media: Whether it has participating media, such as fog.
        has_null: Whether it has null surfaces, which let rays pass unchanged.
        emitters: All emitters.
        lights: The lights to adjust, followed by the fixed light if there is one.
        files: All XML files.
        content: Hash of all XML files and assets, the parameters and the sensor, not of the film.
        unlit_content: Hash of everything that the image of each light depends on besides that
            light: the scene without its lights, but with the shapes of area lights.
        lights_file: The lights file that was used for `lights`, or None.
        requests: The constraints in the lights file.
        parsed: The nodes from Mitsuba's parser; internal to this package.
        chosen: Names of the lights selected by `only`; empty if all are present.
        split: Columns and rows, or layouts, of images that are split into texels, by light.
        symmetric: Those whose images are equal to their mirror images.
        map_size: Size of their images as written; None for a pixel per texel.
        added: Emitters of `with_new_emitters`, which are in no file.
        old_sites: Sites in the file of the emitters that `moved` has moved, by name.
        points: Points of `at_points`, which replace the film's pixels; None for a film.
        is_spectral: Whether it is rendered with spectra, from `with_lamps`.
        observer: What sees those: the eye, or a camera.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> [light.name for light in scene.lights]
        ['panel', 'bulb']
        >>> scene.light("bulb").emission
        (0.5, 0.6..., 0.69...)
    """

    path: Path
    parameters: Mapping[str, str]
    film: Film
    sensor_names: tuple[str, ...]
    spp: int
    integrator: Integrator
    integrator_choice: IntegratorChoice | None
    has_media: bool
    has_null: bool
    emitters: tuple[Emitter, ...]
    lights: tuple[Light, ...]
    files: tuple[Path, ...]
    content: str
    unlit_content: str
    lights_file: Path | None
    requests: SceneRequests
    parsed: ParsedScene
    chosen: tuple[str, ...] = ()
    split: Mapping[str, GridSize | TexelLayout] = field(default_factory=dict)
    symmetric: frozenset[str] = frozenset()
    map_size: GridSize | None = None
    added: tuple[new_emitter.NewEmitter, ...] = ()
    old_sites: Mapping[str, Site] = field(default_factory=dict)
    points: MeasuringPoints | None = None
    is_spectral: bool = False
    observer: Observer = EYE

    def __post_init__(self) -> None:
        for name in ("lights", "emitters"):
            object.__setattr__(self, name, Listed(getattr(self, name)))

    def __repr__(self) -> str:
        (height, width), names = self.size, [light.name for light in self.lights]
        summary = f"{len(names)} lights, {width}x{height} through {self.sensor_names[self.sensor]}"
        return f"Scene({self.path}, {summary}: {some_of(names, room=400)})"

    @property
    def identity(self) -> str:
        """Identity of its basis: `content`, how emitters are grouped, kept or split, if any, and
        its points.
        """
        content = self._seen(self.content)
        is_single = all(x.member_names == (x.name,) and not x.is_fixed for x in self.lights)
        if is_single and not self.split and not self.is_spectral:
            return content
        structure: list[Any] = [(x.name, x.member_names, x.is_fixed) for x in self.lights]
        if self.is_spectral:
            structure += [self._spectral_kind, *(x.spectrum for x in self.lights)]
        return hashlib.sha256(repr((content, structure)).encode()).hexdigest()[:32]

    @property
    def light_identities(self) -> tuple[str, ...]:
        """Identity of the image of each light; see `Light.identity`."""
        unlit_content = self._seen(self.unlit_content) + self._spectral_kind
        return tuple(light.identity(unlit_content) for light in self.lights)

    @property
    def _spectral_kind(self) -> str:
        """Text that tells its renders with spectra from others, for identities; "" for RGB."""
        if not self.is_spectral:
            return ""
        observer = self.observer
        return f"spectral{(observer.name, observer.sensitivities) if observer.is_camera else ''}"

    def _seen(self, content: str) -> str:
        """Return a hash of the scene as the hash of the scene seen at its points, if it has any."""
        return content if self.points is None else self.points.identify(content)

    @property
    def plane_of(self) -> Mapping[str, int]:
        """Index of each emitter's light, by the emitter's name; of a lamp's, the light of the
        first."""
        lights = reversed([*enumerate(self.lights)])
        return {m.name: k for k, light in lights for m in light.members}

    def with_lights(
        self, members: Mapping[str, Sequence[str]], fixed: Collection[str] = ()
    ) -> "Scene":
        """Return this scene with its emitters grouped into other lights.

        members: light name → names of its emitters. fixed: lights that stay as they are.
        Raises SceneError unless every emitter of the scene, and nothing else, is named once.
        """
        check_grouping(members, self.emitters, scene=str(self.path))
        return replace(self, lights=lights_of(self.emitters, members, fixed))

    def with_lamps(self, lamps: Mapping[str, Lamp], observer: Observer = EYE) -> "Scene":
        """Return this scene for renders with spectra, in which each emitter of a lamp is a light.

        lamps: by name of each light that is adjusted. observer: what sees it. Raises SceneError if
        one cannot be rendered with spectra.
        """
        lights = lights_of_lamps(self.lights, lamps, scene=str(self.path))
        return replace(self, lights=lights, is_spectral=True, observer=observer)

    def with_emission(self, emission: Mapping[str, RGB]) -> "Scene":
        """Return this scene with other current emissions of lights that are adjusted, by name."""
        settings = settings_for(self.lights, self.emitters, emission, scene=str(self.path))
        lights = tuple(
            light.with_emission(emission[light.name]) if light.name in emission else light
            for light in self.lights
        )
        now = {member.name: member for light in lights for member in light.members}
        emitters = tuple(now.get(x.name, x) for x in self.emitters)
        parsed = with_settings(self.parsed, settings)
        return replace(self, lights=lights, emitters=emitters, parsed=parsed)

    @property
    def materials(self) -> frozenset[str]:
        """Mitsuba's names of the kinds of its materials."""
        return self.parsed.materials()

    @property
    def rgb_metals(self) -> list[str]:
        """Names of its conductors whose indices of refraction are RGB colours."""
        return self.parsed.rgb_metals()

    @property
    def in_rgb(self) -> "Scene":
        """This scene for renders in RGB."""
        return replace(self, is_spectral=False) if self.is_spectral else self

    @property
    def sensor(self) -> int:
        """Index of its sensor."""
        return self.film.sensor

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the picture in pixels: the size of the film or its crop window."""
        width, height = self.film.pixels
        return height, width

    def light(self, name: str) -> Light:
        """Return the light called `name`. Raises SceneError if it does not exist."""
        return light_named(name, self.lights, scene=str(self.path))

    def reduced(self, resolution: str) -> "Scene":
        """Return this scene on a smaller film, on which each pixel is the mean of a square block.

        resolution: `1/4`, or `320x180`. Pixels at the right and bottom that do not fill a block are
        left out. Raises SceneError, listing possible sizes, if no blocks give that size.
        """
        return replace(self, film=reduced(self.film, reduction(self.film, resolution)))

    def at_points(self, points: MeasuringPoints) -> "Scene":
        """Return this scene as seen at points: its basis is the irradiance there, (1, p) pixels.

        Light is traced by the same rules as for a picture; a point counts as a surface seen.
        """
        film = Film(self.film.sensor, (len(points), 1), (len(points), 1), (0, 0))
        return replace(self, film=film, points=points)

    def camera(self, loaded: Any) -> Any:
        """Return the sensor of this scene in a scene that `load` returned."""
        return camera_named(loaded, self.sensor_names[self.sensor])

    def eye(self, loaded: Any) -> Any:
        """Return the position of the sensor, as an `mi.Point3f`, or a place beside all points."""
        if self.points is not None:
            return self.points.place_beside()
        return self.camera(loaded).world_transform().translation()

    def only(self, names: Collection[str]) -> "Scene":
        """Return this scene with only the lights `names`.

        The other emitters become black, belong to no light and are not sampled, but stay in place,
        so that they still block and reflect light. Raises SceneError if a light does not exist.
        """
        chosen_names = {self.light(name).name for name in names}
        lights = tuple(light for light in self.lights if light.name in chosen_names)
        emitters, dark = black_emitters(self.emitters, lights)
        names = tuple(light.name for light in lights)
        content = hashlib.sha256(repr((self.content, names)).encode()).hexdigest()[:32]
        return replace(
            self,
            emitters=emitters,
            lights=lights,
            content=content,
            chosen=names,
            parsed=with_settings(self.parsed, dark),
        )

    @MITSUBA.acquired()
    def moved(self, poses: Mapping[str, Pose]) -> "Scene":
        """Return this scene with lights at other positions, directions or cones.

        Nothing is written; `relight` writes the new poses together with the new emissions. A basis
        of the result only needs new planes for the moved lights, unless one of them has a shape,
        which blocks and reflects the light of the others. poses: by name of an emitter, or of a
        light with one emitter.

        Raises:
            SceneError: If a light does not exist or cannot be moved in this way.

        Examples:
            >>> scene = lp.load_scene("room.xml")
            >>> scene.moved({"bulb": lp.Pose(position=(0.5, 1, 0))}).light("bulb").form
            'at (0.50, 1.00, 0.00)'
        """
        motions, elements, added = {}, {}, {x.name: x for x in self.added}
        old_sites = dict(self.old_sites)
        for name, pose in poses.items():
            emitter = emitter_named(name, self.emitters, self.lights, scene=str(self.path))
            motion = motion_of(emitter.name, emitter.plugin, emitter.site, pose)
            if emitter.name in added:
                moved = new_emitter.moved_emitter(added[emitter.name], motion.site, motion.target)
                added[emitter.name] = moved
                elements[emitter.name] = "".join(moved.lines())
            else:
                motions[emitter.node] = motion
                old_sites.setdefault(emitter.name, emitter.site)
        parsed = with_elements(with_motions(self.parsed, motions), elements)
        moved_scene = self._inspected(parsed, ())
        return replace(moved_scene, added=tuple(added.values()), old_sites=old_sites)

    @property
    def emitter_places(self) -> tuple[EmitterPlace, ...]:
        """Places of the emitters that have a position or a direction."""
        return new_emitter.places_of(self.emitters, self.added, self.old_sites)

    @MITSUBA.acquired()
    def with_new_emitters(self, emitters: Sequence[new_emitter.NewEmitter]) -> "Scene":
        """Return this scene with emitters added, each as a separate light.

        Nothing is written; `relight` writes their elements after all others, with the new
        emissions. A basis of the result only needs new planes for added points and spots. A panel
        is a rectangle, which also blocks the light of the others.

        Raises:
            SceneError: If a name is taken.

        Examples:
            >>> key = lp.NewEmitter("key", "point", lp.Pose(position=(0, 1, 1)))
            >>> [x.name for x in lp.load_scene("room.xml").with_new_emitters([key]).lights]
            ['panel', 'bulb', 'key']
        """
        taken_names = {*(x.name for x in self.emitters), *(x.name for x in self.lights)}
        new_emitter.check_new_names(emitters, taken_names, scene=str(self.path))
        parsed = with_elements(self.parsed, {x.name: "".join(x.lines()) for x in emitters})
        extended = self._inspected(parsed, [x.name for x in emitters])
        return replace(extended, added=(*self.added, *emitters))

    def _inspected(self, parsed: ParsedScene, more: Sequence[str]) -> "Scene":
        """Return this scene with another parsed form. more: names of emitters without a light."""
        with mitsuba_errors(self.path):
            facts = inspect_scene(parsed, self.sensor)
            facts = with_split(facts, parsed, self.split, self.symmetric)
        lights = regrouped(self.lights, facts["emitters"], more)
        return replace(self, **facts | {"film": self.film}, lights=lights, parsed=parsed)

    @property
    def up(self) -> Position:
        """The up axis of the scene, estimated from its camera and its lights."""
        return up_of(self.parsed, self.sensor, self.emitters)

    @property
    def luminaires(self) -> tuple[HungLuminaire, ...]:
        """The luminaires of the lights file that hang in it."""
        return tuple(self.parsed.luminaires.values())

    @property
    def cd_per_unit(self) -> float | None:
        """Candelas of an intensity of 1, which a scene with luminaires has; None without any."""
        is_absolute = any(x.plugin in LUMINAIRE_PLUGINS for x in self.emitters)
        return self.requests.cd_per_unit if is_absolute else None

    def relocated(self, old: Path, new: Path) -> "Scene":
        """Return this scene after its folder `old` was moved to `new`.

        Raises SceneError for a folder that it is not in.
        """
        if not self.path.is_relative_to(old):
            raise SceneError(f"{visible(str(self.path))} is not in {visible(str(old))}")
        parsed = self.parsed.relocated(old, new)
        return replace(self, path=parsed.path, files=parsed.files, parsed=parsed)

    @MITSUBA.acquired()
    def load(
        self,
        emission: Mapping[str, RGB] | None = None,
        *,
        views: "Sequence[Scene]" = (),
        evenly: bool = False,
    ) -> Any:
        """Load the `mi.Scene` with lights set to `emission`; other lights stay as they are.

        The film is replaced by a box-filtered RGB float32 film of the same size, for basis and
        verification alike. A light set to black is never sampled. The scene and what refers to it
        must be released before another is loaded. Image lights and the rest are black or as
        authored, since other multiples need files. views: other sensors. evenly: for the one pass,
        which samples texels evenly (`with_texels`), and wavelengths by itself; other renders with
        spectra record what the observer sees.
        """
        named, path = emission or {}, str(self.path)
        settings = settings_for(self.lights, self.emitters, named, scene=path, evenly=evenly)
        films = (self.film, *(view.film for view in views))
        bands = None
        # Questions of geometry load it in RGB.
        if self.is_spectral and not evenly and is_in_spectra():
            emissions = [(x.node, x.kind.parameter) for x in self.emitters if x.kind is not None]
            bands = bands_of(self.parsed.state, emissions, self.observer)
        return self.parsed.instantiate(settings, *films, bands=bands)

    @MITSUBA.acquired()
    def while_loaded(
        self,
        work: Callable[[Any], _Result_T],
        emission: Mapping[str, RGB] | None = None,
        *,
        views: "Sequence[Scene]" = (),
    ) -> _Result_T:
        """Return the result of `work` on the loaded scene, which is released afterwards."""
        with self.variant():
            loaded = self.load(emission, views=views)
            try:
                with render_errors(self.path), kernels():
                    return work(loaded)
            finally:
                del loaded
                gc.collect()

    def variant(self) -> AbstractContextManager[None]:
        """Return a context in which Mitsuba loads and renders it with spectra, if it has them."""
        return spectral_variant() if self.is_spectral else nullcontext()


def up_of(parsed: ParsedScene, sensor: int, emitters: Sequence[Emitter]) -> Position:
    """Return the up axis of a scene, estimated from a sensor and its lights."""
    node = parsed.state.nodes[parsed.sensor_nodes[sensor]]
    shining = [x.site.direction for x in emitters if x.site.direction is not None]
    return upward_axis(node.props, shining)


def inspect_scene(parsed: ParsedScene, sensor: int) -> dict[str, Any]:
    """Return the fields of a `Scene` that require loading it.

    Of a scene that was loaded before with other lights, as a relit scene is, only lights and
    sensors are loaded: shapes and materials take most of the time.
    """
    has_null = _has_null.get(surroundings := SceneHasher.surroundings(parsed))
    loaded = (parsed if has_null is None else parsed.lights_alone()).instantiate({})
    hasher = SceneHasher(parsed)
    camera = camera_named(loaded, parsed.sensor_names[sensor])
    emitters, film = find_emitters(parsed, loaded, hasher), Film.of(camera, sensor)
    facts = {
        "emitters": emitters,
        "film": film,
        "spp": int(camera.sampler().sample_count()),
        "has_null": (has_null := _has_null_surfaces(loaded) if has_null is None else has_null),
    }
    del loaded, camera
    gc.collect()
    _has_null[surroundings] = has_null
    has_environment = any(emitter.plugin in ENVIRONMENTS for emitter in emitters)
    return {
        **facts,
        "sensor_names": parsed.sensor_names,
        "integrator": parsed.integrator(),
        "integrator_choice": parsed.integrator_choice,
        "has_media": parsed.has_media(),
        "files": parsed.files,
        "content": parsed.content(sensor),
        "unlit_content": hasher.unlit_content(
            film, has_environment=has_environment, has_null=has_null
        ),
    }


def _has_null_surfaces(loaded: Any) -> bool:
    import mitsuba as mi

    bsdfs = (shape.bsdf() for shape in loaded.shapes())
    return any(b is not None and mi.has_flag(b.flags(), mi.BSDFFlags.Null) for b in bsdfs)


def shape_names(parsed: ParsedScene) -> tuple[str, ...]:
    """Return names of a loaded scene's shapes, in order: id, or else mesh file, material or
    kind.
    """
    import mitsuba as mi

    shapes = parsed.children_of(0, mi.ObjectType.Shape)
    kinds = (parsed.state.nodes[k].props.plugin_name() for k in shapes)
    return tuple(
        next(filter(None, _names_of(parsed, k)))
        for k, kind in zip(shapes, kinds, strict=True)
        if kind != GROUP
    )


def _names_of(parsed: ParsedScene, node: int) -> Iterator[str]:
    """Yield possible names of a shape, best first."""
    import mitsuba as mi

    def ids(kind: Any) -> Iterator[str]:
        return (str(parsed.state.nodes[k].props.id()) for k in parsed.children_of(node, kind))

    props = parsed.state.nodes[node].props
    yield str(props.id())
    if "filename" in props:
        yield PurePath(str(props["filename"])).stem
    # An instance is named after its shape group.
    yield from ids(mi.ObjectType.Shape)
    yield from ids(mi.ObjectType.BSDF)
    yield str(props.plugin_name())
