"""Looks of a session: paintings and answers, kept by name."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, as_rgb
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.session.moved_lights import Placed
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable, display_thumbnail
from lightpaint.paint.store.history_steps import Pixels, StoredLook, mix_pixels, name_in_view
from lightpaint.paint.store.session_requests import SessionRequests

#: Maximum length of a look's name.
MAX_NAME_LENGTH = 80

#: Maximum number of observers' proposals among the looks: each stores a painting of all views.
MAX_PROPOSALS = 16

#: Name of the array of "at least" marks.
MARKS_ARRAY = "at_least"

LookRequest = (
    protocol.SaveLook
    | protocol.RenameLook
    | protocol.CopyLook
    | protocol.MixLooks
    | protocol.DropLook
    | protocol.Propose
)


@dataclass(frozen=True)
class LookLighting:
    """The lighting of a look. placed: places of its lights. emissions: (3,) by name of light."""

    placed: Placed
    emissions: Mapping[str, Doubles]


class LookLibrary:
    """The looks of a session, in its store, and their thumbnails among its pictures."""

    def __init__(self, session: Session, pictures: PictureTable) -> None:
        self._session, self._pictures = session, pictures
        self._last_id = 0  # no number returns, since pages may still have pictures of its look
        try:
            self.infos()
        except (LightpaintError, LookupError, TypeError, ValueError):
            if not session.store.has_file:
                raise
            session.store.recover()
        for look in session.store.looks():
            self._offer_thumbnails(look)
            self._renew_drives(look)

    def infos(self) -> tuple[protocol.LookInfo, ...]:
        """Return the descriptions of looks for clients."""
        return tuple(
            protocol.LookInfo(
                id=look.id,
                name=look.fields["name"],
                stamp=look.fields.get("stamp"),
                lights=self._names(look),
                weights=tuple(map(as_rgb, self._output(look))),
                places=_requests(look).place_key,
                thumbnail=f"look/{look.id}",
                is_proposal=bool(look.fields.get("is_proposal", False)),
            )
            for look in self._session.store.looks()
        )

    def handle(self, message: LookRequest) -> protocol.Message:
        """Handle a request about looks. Raises PaintError for a look that does not exist."""
        store = self._session.store
        match message:
            case protocol.SaveLook(name):
                self._store(self._current_look(self._clean_name(name)))
            case protocol.RenameLook(number, name):
                look = self._find(number)
                fields = {**look.fields, "name": self._clean_name(name), "is_proposal": False}
                self._store(StoredLook(look.id, fields, look.arrays))
            case protocol.CopyLook(number):
                look = self._find(number)
                fields = {**look.fields, "name": f"{look.fields['name']} copy"[:MAX_NAME_LENGTH]}
                fields["is_proposal"] = False
                self._store(StoredLook(self._next_id(), fields, look.arrays))
            case protocol.MixLooks():
                self._store(self._mixed_look(message))
            case protocol.Propose():
                self._store(self._proposed_look(message))
            case protocol.DropLook(number):
                store.drop_look(self._find(number).id)
                for k in range(len(self._session.views)):
                    self._pictures.withdraw(name_in_view(f"look/{number}", k))
        return protocol.LookList(looks=self.infos(), resources=self._pictures.stable_generations())

    def lighting(self, number: int) -> LookLighting:
        """Return the lighting of a look. Raises PaintError for a look that does not exist."""
        look = self._find(number)
        emissions = dict(zip(self._names(look), self._output(look), strict=True))
        return LookLighting(_requests(look).placed, emissions)

    def load(self, message: protocol.LoadLook) -> list[protocol.Message]:
        """Replace painting, requests and places by a look's, as a step of undo."""
        look = self._find(message.look)
        paintings = dict(enumerate(self._paintings(look)))
        requests = _requests(look)
        weights = np.asarray(look.arrays["weights"], np.float64)
        stored = look.fields.get("layers")
        layers = None if stored is None else LayeredPaintings.from_fields(stored, look.arrays)
        label, names = f"look {look.fields['name']}", self._names(look)
        return self._session.load(paintings, requests, label, weights, names=names, layers=layers)

    def _names(self, look: StoredLook) -> tuple[str, ...]:
        """Return the names of the lights in a look."""
        return (*self._session.bases[0].names, *_requests(look).added)

    def _output(self, look: StoredLook) -> Doubles:
        """Return the weights that the lights of a look shine at."""
        weights = np.asarray(look.arrays["weights"], np.float64)
        return self._output_of(weights, _requests(look))

    def _output_of(self, weights: Doubles, requests: SessionRequests) -> Doubles:
        """Return what lights with these weights shine at, those that requests add being last."""
        is_fixed = self._session.bases[0].is_fixed
        return requests.output(weights, np.append(is_fixed, [False] * len(requests.added)))

    def _light_of(self, weights: Doubles, requests: SessionRequests) -> list[Floats]:
        """Return the picture of a lighting, by view. weights: of the lights under `requests`."""
        weights = self._output_of(weights, requests)
        session = self._session
        names = (*session.bases[0].names, *requests.added)
        emissions = dict(zip(names, weights, strict=True))
        is_here = requests.place_key == session.requests.place_key
        bases = [x.basis for x in session.views] if is_here else session.bases_at(requests.placed)
        return [basis.mix(np.array([emissions[x] for x in basis.names])) for basis in bases]

    def _paintings(self, look: StoredLook) -> list[Pixels]:
        """Return the paintings of all views; a view that was added later is unpainted."""
        arrays, paintings = look.arrays, []
        names = set(arrays)
        for k, view in enumerate(self._session.views):
            if name_in_view("image", k) in names:
                image, importance = (arrays[name_in_view(x, k)] for x in ("image", "importance"))
                marks = (
                    arrays[name] > 0 if (name := name_in_view(MARKS_ARRAY, k)) in names else None
                )
                paintings.append(Pixels(image, importance, marks))
            else:
                paintings.append(Pixels.unpainted(view.current))
        return paintings

    def _current_look(self, name: str) -> StoredLook:
        session = self._session
        paintings = [view.pixels(view.full_region) for view in session.views]
        look = self._make_look(name, paintings, session.requests, session.weights.copy())
        return self._with_layers(look)

    def _with_layers(self, look: StoredLook) -> StoredLook:
        """Return a look of the current painting, with its layers; a plain painting has none."""
        if self._session.views.layers == LayerStack():
            return look
        layers, pixels = LayeredPaintings.of(self._session.views).as_fields()
        return StoredLook(look.id, {**look.fields, "layers": layers}, {**look.arrays, **pixels})

    def _mixed_look(self, message: protocol.MixLooks) -> StoredLook:
        """Return a mix of two looks: both paintings, weighted, and the lights locked between the
        answers.
        """
        part, name = message.part, self._clean_name(message.name)
        if not 0 <= part <= 1:
            raise PaintError(f"part is {part:g}: expected 0 for the first look to 1 for the second")
        looks = [self._find(k) for k in (message.first, message.second)]
        shares = 1 - part, part
        requests = [_requests(x) for x in looks]
        if requests[0].placed != requests[1].placed:
            first, second = (x.fields["name"] for x in looks)
            raise PaintError(
                f"{first} and {second} hang lights in different places: no lighting lies between "
                "them; go on from one of the two"
            )
        weights = sum(s * self._output(x) for s, x in zip(shares, looks, strict=True))
        locks = self._lock_all(np.asarray(weights), self._names(looks[0]), requests[0])
        pairs = zip(*(self._paintings(look) for look in looks), strict=True)
        paintings = [mix_pixels(pair, shares) for pair in pairs]
        return self._make_look(name, paintings, locks, np.asarray(weights))

    def _lock_all(
        self, weights: npt.NDArray[Any], names: Sequence[str], requests: SessionRequests
    ) -> SessionRequests:
        """Return requests that lock lights at a lighting, (n, 3), at their places in `requests`."""
        lights = {light.name: light for light in self._session.bases[0].lights}
        locks = {
            name: {"lock": float(w[0]) if name in lights and lights[name].is_scalar else w.tolist()}
            for name, w in zip(names, weights, strict=True)
            if name not in lights or not lights[name].is_fixed
        }
        return replace(SessionRequests(locks), poses=requests.poses, added=requests.added)

    def _proposed_look(self, message: protocol.Propose) -> StoredLook:
        """Return a look of the current painting with a proposed lighting."""
        name, session = self._clean_name(message.name), self._session
        lights = session.basis.lights
        weights = session.requests.output(session.weights, session.basis.is_fixed)
        names = list(session.basis.names)
        for light, emission in message.lights.items():
            if light not in names:
                raise PaintError(
                    f"no light is called {light!r}: expected one of {some_names(names)}"
                )
            basis_light = lights[names.index(light)]
            if basis_light.is_fixed:
                raise PaintError(f"{light} is fixed: leave it out of the proposal")
            if not all(math.isfinite(x) and x >= 0 for x in emission):
                raise PaintError(f"{light} is proposed at {list(emission)}: expected numbers >= 0")
            if basis_light.is_scalar and len(set(emission)) > 1:
                raise PaintError(f"{light} has one number for all channels: give it three times")
            weights[names.index(light)] = emission
        proposals = [look for look in session.store.looks() if look.fields.get("is_proposal")]
        same = [look for look in proposals if look.fields["name"] == name]
        if not same and len(proposals) >= MAX_PROPOSALS:
            raise PaintError(
                f"{len(proposals)} proposals exist: the person who paints has to delete some"
            )
        paintings = [view.pixels(view.full_region) for view in session.views]
        look_ = self._with_layers(
            self._make_look(
                name, paintings, self._lock_all(weights, names, session.requests), weights
            ),
        )
        number = same[0].id if same else look_.id
        return StoredLook(number, {**look_.fields, "is_proposal": True}, look_.arrays)

    def _make_look(
        self,
        name: str,
        paintings: Sequence[Pixels],
        requests: SessionRequests,
        weights: npt.NDArray[Any],
    ) -> StoredLook:
        fields = {"name": name, "stamp": time.time(), "wishes": requests.as_json()}
        if drives := self._drives_of(np.asarray(weights, np.float64), requests):
            fields["drives"] = drives
        arrays: dict[str, npt.NDArray[Any]] = {"weights": weights}
        pictures = self._light_of(weights, requests)
        for view, picture, (image, importance, marks) in zip(
            self._session.views, pictures, paintings, strict=True
        ):
            arrays_of_view: dict[str, npt.NDArray[Any]] = {
                "image": np.asarray(image, np.float32),
                "importance": np.asarray(importance, np.float32),
                "thumbnail": display_thumbnail(picture, self._session.transform),
            }
            if marks is not None:
                arrays_of_view[MARKS_ARRAY] = marks.view(np.uint8)
            arrays |= {name_in_view(key, view.view): value for key, value in arrays_of_view.items()}
        return StoredLook(self._next_id(), fields, arrays)

    def _renew_drives(self, look: StoredLook) -> None:
        """Keep the drives of a look if they are others, as after its lamps were measured anew."""
        weights = np.asarray(look.arrays["weights"], np.float64)
        drives = self._drives_of(weights, _requests(look))
        if drives != look.fields.get("drives", {}):
            fields = {**look.fields, "drives": drives}
            self._session.store.put_look(StoredLook(look.id, fields, look.arrays))

    def _drives_of(
        self, weights: Doubles, requests: SessionRequests
    ) -> dict[str, dict[str, float]]:
        """Return the drives of the lamps of emitters, by name, of lights with these weights."""
        return self._session.live_answer.named_drives(self._output_of(weights, requests))

    def _store(self, look: StoredLook) -> None:
        self._session.store.put_look(look)
        self._offer_thumbnails(look)

    def _offer_thumbnails(self, look: StoredLook) -> None:
        views = len(self._session.views)
        for k in range(views):
            make = partial(self._thumbnail, look, k)
            self._pictures.offer(name_in_view(f"look/{look.id}", k), make)

    def _thumbnail(self, look: StoredLook, k: int) -> npt.NDArray[Any]:
        """Return the thumbnail of a view: the stored one, or a new one from the look's lights."""
        try:
            return look.arrays[name_in_view("thumbnail", k)]
        except (LightpaintError, LookupError):
            weights = np.asarray(look.arrays["weights"], np.float64)
            picture = self._light_of(weights, _requests(look))[k]
            return display_thumbnail(picture, self._session.transform)

    def _next_id(self) -> int:
        ids = [look.id for look in self._session.store.looks()]
        self._last_id = max(self._last_id, *ids, 0) + 1
        return self._last_id

    def _find(self, number: int) -> StoredLook:
        for look in self._session.store.looks():
            if look.id == number:
                return look
        raise PaintError(f"there is no look {number}")

    @staticmethod
    def _clean_name(name: str) -> str:
        cleaned = " ".join(name.split())[:MAX_NAME_LENGTH]
        if not cleaned:
            raise PaintError("a look needs a name")
        return cleaned


def _requests(look: StoredLook) -> SessionRequests:
    """Return the requests of a look; empty if its file has none."""
    return SessionRequests.of(look.fields.get("wishes", {}))
