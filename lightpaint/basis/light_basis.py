"""The basis: one image per light at unit emission, and its origin."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, read_only
from lightpaint.basis.lights import Lights
from lightpaint.basis.plane_results import array_name, array_once, forget_results
from lightpaint.basis.planes import IndirectLight, Planes, as_planes, relative_variances
from lightpaint.basis.working_primaries import check_primaries, mixes_in, picture_at, response_in
from lightpaint.colour import choose_exposure, luminance
from lightpaint.dataframes import CHANNELS, pandas, xarray
from lightpaint.display_text import Shown, some_names, some_of
from lightpaint.errors import BasisError
from lightpaint.images import Estimate, Features, Objects, SurfaceFilter
from lightpaint.keywords import keywords
from lightpaint.scene.lights.lights_file import SceneRequests
from lightpaint.validation import BRIGHTEST, check_shape
from lightpaint.version import __version__

#: Maximum number of samples per pixel, beyond the number of any render.
MAX_SAMPLES = 2**40

#: Prefix of the method of light groups, before the name of the renderer; and the plugin of the
#: light that holds what these lack of the whole picture.
LIGHT_GROUPS, REST = "light groups of ", "rest"

#: Method of a basis that is a picture of the scene alone, until its lights are rendered.
PLAIN_LOOK = "plain look"


@dataclass(frozen=True)
class Origin:
    """The origin of a basis, which decides whether bases are comparable and samples can be added.

    halves: samples per pixel of each of the two halves; a light rendered alone until it was as
    clean as the others counts as having theirs. passes: number of passes of each half.
    each_light: samples of halves A and B and passes of A and B for each light, if these numbers
    differ because separate renders were interrupted or come from several runs; `halves` and
    `passes` are then the minimum over all lights.
    integrator: the integrator that replaced the scene's; "" if that was used.
    is_composed: whether planes come from several renders, some of them of other states of the
    scene, so that no single render reproduces the basis exactly.
    extra_spp: mean number of additional samples per pixel where a painting needed them (see
    `Basis.extra`).
    observer: what sees it, of a basis with spectra; "" for RGB.
    primaries: CIE xy of red, green, blue and white of the primaries in which the renderer of light
    groups multiplies lights, if it works in others than Rec.709; see `Basis.mix`.
    """

    scene: str
    scene_identity: str
    sensor: str
    seed: int
    method: str
    halves: tuple[int, int]
    passes: tuple[int, int]
    lightpaint: str = __version__
    each_light: tuple[tuple[int, int, int, int], ...] = ()
    integrator: str = ""
    is_composed: bool = False
    extra_spp: float = 0.0
    observer: str = ""
    primaries: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.extra_spp <= MAX_SAMPLES:
            raise BasisError(f"{self.extra_spp} extra samples are not 0 or more")
        if (
            max(max(counts) for counts in (self.halves, self.passes, *self.each_light))
            > MAX_SAMPLES
        ):
            raise BasisError(f"{self.halves} samples are more than any render has")
        if self.primaries:
            check_primaries(self.primaries)

    @property
    def spp(self) -> int:
        """Samples per pixel in both halves together."""
        return sum(self.halves)

    @property
    def mean_spp(self) -> float:
        """Mean samples per pixel, including extra ones."""
        return self.spp + self.extra_spp

    @property
    def samples_text(self) -> str:
        """The number of samples in words, such as `16 samples per pixel`."""
        text = f"{self.spp} samples per pixel"
        if not self.extra_spp:
            return text
        return f"{text} and, on average, {self.extra_spp:.3g} more where a painting needed them"

    @property
    def is_light_groups(self) -> bool:
        """True if another renderer made the picture, which then has no template."""
        return self.method.startswith(LIGHT_GROUPS)

    @property
    def is_plain_look(self) -> bool:
        """True if the planes only sum to a picture of the scene: no light is known yet."""
        return self.method == PLAIN_LOOK


@keywords()
@dataclass(frozen=True)
class Basis(Shown):
    """The images of a scene lit by one light at a time.

    Attributes:
        lights: The table of n lights, or a sequence of lights. All other attributes follow their
            order.
        planes: Linear Rec.709 radiance of each light at unit emission; may be given as an array (n,
            h, w, 3) float32, which `images` returns.
        noise: Half the difference of two independent halves of the samples, which estimates the
            noise of `planes`; given in the same form. If an interrupted render left the halves
            unequal, it overstates the noise a little. Zeros if the noise is unknown (see
            `knows_noise`). `half_differences` is the array.
        emitters_seen: (h, w) bool, pixels in which the camera sees an emitter, directly or through
            clear glass.
        origin: Scene, sensor, seed and samples that it was made from.
        guide_table: (2, cells, emitters) float32, the importance of each emitter in each cell of
            space as learned by the renderer, or None. Only needed to render more samples.
        features: Albedo, normals and positions of the visible surfaces, for denoising, or None.
        objects: The map of visible objects, or None.
        indirect: The indirect part of `planes` and `noise`, for denoising; None if it was not
            stored separately.
        extra: (h, w), number of samples of each half beyond the samples of the origin, where a
            painting needed them; None if there are none. The number in a pixel never depends on the
            light of that pixel, so the images stay unbiased. Only needed to continue rendering.
        source: Path of the file that it was read from or of the scene that it was rendered from,
            for display; not stored.
        sums: The undivided sums of both halves of the samples, (n or 2n, h, w, 3) float32 each,
            from which `planes`, `noise` and `indirect` are computed. Present only if more samples
            are to be added, so that the result has the bits of a single render; not stored.
        former: The look of the scene before its lights were moved, with its noise: the picture that
            was painted over. None if no light was moved; not stored.
        render_s: Seconds that this process spent rendering it; None if unknown, for example if a
            part comes from the cache; not stored.

    Examples:
        >>> basis.names
        ('panel', 'bulb')
        >>> basis.image("bulb").shape
        (16, 16, 3)
    """

    lights: Lights
    planes: Planes
    noise: Planes
    emitters_seen: Bools
    origin: Origin
    guide_table: Floats | None = None
    features: Features | None = None
    objects: Objects | None = None
    indirect: IndirectLight | None = None
    extra: Indices | None = None
    source: str = field(default="", compare=False)
    sums: tuple[Floats, Floats] | None = field(default=None, compare=False)
    former: Estimate | None = field(default=None, compare=False)
    render_s: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        n = len(self.lights)
        object.__setattr__(self, "lights", Lights.of(self.lights))
        for name in ("planes", "noise"):
            value = getattr(self, name)
            shape = value.shape if isinstance(value, np.ndarray) else (value.count, *value.size, 3)
            if len(shape) != 4 or shape[0] != n or shape[3] != 3:
                raise BasisError(f"images of shape {shape} for {n} lights: need (n, h, w, 3)")
            object.__setattr__(self, name, as_planes(value))
        if self.noise.size != self.planes.size:
            raise BasisError("half differences and images differ in shape")
        self._check_pictures()
        if self.indirect is not None:
            parts = self.indirect.planes, self.indirect.noise
            if any((part.count, part.size) != (n, self.size) for part in parts):
                raise BasisError("indirect light and images differ in shape")
        if (self.extra is None) != (self.origin.extra_spp == 0):
            raise BasisError("extra samples go with a picture of their numbers")
        if len(self.origin.each_light) not in (0, n):
            raise BasisError(f"samples of {len(self.origin.each_light)} lights for {n} lights")

    def _check_pictures(self) -> None:
        """Raise BasisError for a picture that has another size than the images."""
        features, objects, extra = self.features, self.objects, self.extra
        for name, size in (
            ("the mask of seen emitters has", self.emitters_seen.shape),
            ("albedo and normals have", None if features is None else features.size),
            ("the picture of objects has", None if objects is None else objects.size),
            ("the numbers of extra samples have", None if extra is None else extra.shape),
        ):
            if size is not None and size != self.size:
                raise BasisError(f"{name} another size than the images")

    def __repr__(self) -> str:
        (height, width), origin = self.size, self.origin
        samples = f"{origin.spp} spp" if self.knows_noise else "noise unknown"
        if origin.extra_spp:
            samples += f" and {origin.extra_spp:.3g} in the mean"
        summary = f"{len(self.lights)} lights, {width}x{height}, {samples}, of {origin.scene}"
        return f"Basis({summary}: {some_of(self.names, room=400)})"

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame with one row for each light, indexed by name.

        red, green, blue: its current emission, linear Rec.709 in `unit`. mean: luminance of its
        image at that emission, averaged over all pixels. Raises LightpaintError without pandas.
        """
        pixels = self.size[0] * self.size[1]
        means = self.totals / pixels * self.current_weights
        rows = [
            light.to_row(float(luminance(mean)))
            for light, mean in zip(self.lights, means, strict=True)
        ]
        return pandas().DataFrame(rows, index=pandas().Index(self.names, name="light"))

    def to_xarray(self) -> Any:
        """Return an xarray.Dataset of the images and their noise, with lights by name.

        images, half_differences: (light, y, x, channel), the arrays of the properties, not copied.
        current: (light, channel), weights of the current look. emitters_seen: (y, x). Raises
        LightpaintError without xarray.
        """
        planes = ("light", "y", "x", "channel")
        return xarray().Dataset(
            {
                "images": (planes, self.images),
                "half_differences": (planes, self.half_differences),
                "current": (("light", "channel"), self.current_weights),
                "emitters_seen": (("y", "x"), self.emitters_seen),
            },
            coords={"light": list(self.names), "channel": list(CHANNELS)},
            attrs={
                "scene": self.origin.scene,
                "sensor": self.origin.sensor,
                "spp": self.origin.spp,
                "seed": self.origin.seed,
            },
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the lights, in the order of the images."""
        return self.lights.names

    def image(self, name: str) -> Floats:
        """Return the image of a light by name, (h, w, 3). Raises BasisError if there is none."""
        if name not in self.names:
            raise BasisError(f"no light {name!r} in the basis: it has {some_names(self.names)}")
        return self.planes.plane(self.names.index(name))

    @property
    def images(self) -> Floats:
        """All planes as one array, (n, h, w, 3) float32: for interactive use and small images."""
        return self.planes.array()

    @property
    def half_differences(self) -> Floats:
        """The noise of all planes as one array, (n, h, w, 3) float32."""
        return self.noise.array()

    def on_pixels(
        self,
        planes: Planes | Floats,
        noise: Planes | Floats,
        emitters_seen: Bools,
        former: Estimate | None = None,
    ) -> "Basis":
        """Return a basis of the same lights on other pixels: some, or the pixels of several views.

        Parts that describe the pixels as one image are dropped. Parameters are the attributes.
        """
        return replace(
            self,
            planes=as_planes(planes),
            noise=as_planes(noise),
            emitters_seen=emitters_seen,
            guide_table=None,
            features=None,
            objects=None,
            indirect=None,
            sums=None,
            extra=None,
            former=former,
            origin=replace(self.origin, extra_spp=0.0),
        )

    def without_cached_values(self) -> "Basis":
        """Return this basis without the values cached from its planes, which have changed since."""
        for planes in (self.planes, self.noise):
            forget_results(planes)
        return replace(self)

    def with_requests(self, requests: SceneRequests) -> "Basis":
        """Return this basis with other requests for its lights."""
        if self.requests == requests:
            return self
        return replace(self, lights=self.lights.with_requests(requests))

    @property
    def requests(self) -> SceneRequests:
        """The requests in the scene's lights file, by light."""
        return self.lights.requests

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.planes.size

    @property
    def knows_noise(self) -> bool:
        """True if `half_differences` estimate the noise, since the number of samples is known."""
        return min(self.origin.halves) > 0 or bool(self.origin.each_light)

    @property
    def current_weights(self) -> Doubles:
        """Weights of the current scene, (n, 3)."""
        return self.lights.current_weights

    @cached_property
    def current_look(self) -> npt.NDArray[np.float32]:
        """The scene as it is now, (h, w, 3), or as it was before its lights were moved."""
        if self.former is not None:
            return read_only(self.former.image)
        weights = self.current_weights
        name = array_name("look", weights)
        return read_only(array_once(self.planes, name, lambda: self.mix(weights)))

    @property
    def current_noise(self) -> Floats:
        """The half difference of `current_look`, (h, w, 3)."""
        if self.former is not None:
            return self.former.half_difference
        return self.noise.mix(self.current_weights)

    @property
    def surface_filter(self) -> SurfaceFilter | None:
        """The filter that averages light along visible surfaces; None if these are unknown."""
        return self.surfaces(1)[1]

    def surfaces(self, factor: int) -> tuple[Features | None, SurfaceFilter | None]:
        """Return features and surface filter of pictures reduced to blocks of factor × factor
        pixels, made once; None where they are unknown.
        """
        if factor not in self._surfaces:
            features = self.features and self.features.reduced(factor)
            surface_filter = None
            if features is not None and features.position is not None:
                surface_filter = SurfaceFilter(features)
            self._surfaces[factor] = features, surface_filter
        return self._surfaces[factor]

    @cached_property
    def _surfaces(self) -> dict[int, tuple[Features | None, SurfaceFilter | None]]:
        return {}

    @property
    def is_fixed(self) -> Bools:
        """(n,), True for lights that stay as they are, with weight 1."""
        return self.lights.is_fixed

    @cached_property
    def relative_variances(self) -> Doubles:
        """Σ noise² / Σ light² of each light, (n,), without stray pixels; falls as 1 / samples."""
        return read_only(relative_variances(self.planes, self.noise))

    @cached_property
    def power(self) -> Doubles:
        """‖Φᵢ‖² over the pixels in which no emitter is seen, (n, 3) float64."""
        return read_only(self._power_and_totals[0])

    @cached_property
    def totals(self) -> Doubles:
        """Σ_pixels Φᵢ, (n, 3) float64, over the whole picture."""
        return read_only(self._power_and_totals[1])

    @cached_property
    def _power_and_totals(self) -> tuple[Doubles, Doubles]:
        """Power and totals, (n, 3) each, computed in one walk over the planes."""
        planes, seen = self.planes, self.emitters_seen
        name = array_name("power and totals", seen)
        power, totals = array_once(planes, name, lambda: np.stack(planes.power_and_totals(~seen)))
        return power, totals

    def set_power_and_totals(self, power: Doubles, totals: Doubles) -> None:
        """Set `power` and `totals` to known values, so that no walk over the planes computes them.

        power, totals: (n, 3) float64, for exactly these planes. Must be called before either is
        read. Raises BasisError for other shapes.
        """
        for name, values in (("power", power), ("totals", totals)):
            check_shape(name, values, (len(self.lights), 3), "a row per light", error=BasisError)
        vars(self)["_power_and_totals"] = power, totals  # where cached_property stores its value

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return the image Σ w_i Φ_i, (h, w, 3) float32; of light groups whose renderer multiplies
        in other primaries, what that shows.

        weights: (n, 3), as lights are ordered, finite. Raises BasisError for others.
        """
        return np.asarray(self.mixes(np.asarray(weights)[None])[0])

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several mixes, (k, h, w, 3), in one walk.

        weights: (k, n, 3). Raises BasisError as `mix` does.
        """
        for each in weights:
            self._check_weights(each)
        if self.origin.primaries:
            return mixes_in(self.origin.primaries, self.planes, weights)
        return self.planes.mixes(weights)

    def _check_weights(self, weights: Doubles) -> None:
        """Raise BasisError unless there are three weights for each light, real and bounded."""
        expected = (len(self.lights), 3)
        if np.shape(weights):
            check_shape("weights", weights, expected, "a row per light", error=BasisError)
        if not np.isfinite(weights).all():
            raise BasisError("weights that are infinite or no numbers: expected amounts of light")
        if np.iscomplexobj(weights) or np.abs(weights).max(initial=0) > BRIGHTEST:
            raise BasisError(f"weights that are complex or beyond {BRIGHTEST:g}")

    def predict(self, weights: Doubles) -> Estimate:
        """Return the image Σ w_i Φ_i with its noise, read-only. weights: (n, 3).

        The last result is kept, since an analysis and a report ask for the same weights many times.
        """
        self._check_weights(weights)
        key = np.asarray(weights, np.float64).tobytes()
        estimate = self._predicted.get(key)
        if estimate is None:
            estimate = Estimate(read_only(self.mix(weights)), read_only(self.noise.mix(weights)))
            self._predicted.clear()
            self._predicted[key] = estimate
        return estimate

    @cached_property
    def _predicted(self) -> dict[bytes, Estimate]:
        return {}


def can_be_multiplied(basis: Basis) -> bool:
    """Return whether the renderer of light groups multiplies lights in other primaries than
    Rec.709.
    """
    return bool(basis.origin.primaries) and any(light.plugin == REST for light in basis.lights)


def channel_responses(basis: Basis) -> Planes:
    """Return planes that say what a change of a single channel changes in this channel; of the
    lights that stay those as they are. See `as_multiplied`.
    """
    adjusted = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    planes = {k: response_in(basis.origin.primaries, basis.planes.plane(k)) for k in adjusted}
    return basis.planes.replaced(planes)


def as_multiplied(basis: Basis, weights: Doubles, planes: Planes | None = None) -> Basis:
    """Return a basis whose planes add up to the `mix` of another at some weights, (n, 3): what
    multiplying in the renderer's primaries changes there is in the lights and, where they are off,
    in the `rest`. Its current look stays.

    planes: of the lights, such as `channel_responses`, by default their pictures at `weights`.
    """
    planes = _planes_at(basis, weights) if planes is None else planes
    rest = next(k for k, light in enumerate(basis.lights) if light.plugin == REST)
    change = basis.mix(weights) - planes.mix(weights)
    return replace(
        basis,
        planes=planes.replaced({rest: planes.plane(rest) + change}),
        origin=replace(basis.origin, primaries=()),
        former=Estimate(basis.current_look, basis.current_noise),
    )


def _planes_at(basis: Basis, weights: Doubles) -> Planes:
    """Return planes that add up to what the renderer shows of each light at weights (n, 3)."""
    primaries, planes = basis.origin.primaries, basis.planes
    adjusted = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    return planes.replaced(
        {k: picture_at(primaries, planes.plane(k), weights[k]) for k in adjusted}
    )


def meter_exposure(image: Floats, *bases: Basis) -> float:
    """Return the exposure in stops at which to show a picture mixed from `bases`.

    image: (h, w, 3) linear; for several bases, their pixels in one row, (1, p, 3). Visible emitters
    are ignored, except in light groups, which do not say where they are.
    """
    if not all(basis.knows_noise or basis.origin.is_plain_look for basis in bases):
        return choose_exposure(image)
    is_emitter = [basis.emitters_seen.ravel() for basis in bases]
    return choose_exposure(image, np.concatenate(is_emitter).reshape(image.shape[:2]))
