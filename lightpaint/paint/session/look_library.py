"""Looks of a session: a painting and its answer, kept under a name."""

import math
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import as_rgb
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.paint.protocol import (
    CopyLook,
    DropLook,
    LoadLook,
    LookInfo,
    LookList,
    Message,
    MixLooks,
    Propose,
    RenameLook,
    SaveLook,
)
from lightpaint.paint.session.picture_table import Pictures, small_picture
from lightpaint.paint.session.session import Session
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.paint.store.steps import KeptLook, of_view
from lightpaint.screen import some_names

#: Characters of a name, at most.
LONGEST = 80

#: Proposals of observers among the looks, at most: each keeps a painting of all views.
MOST_PROPOSALS = 16

#: What says where brighter is as good.
MARKS = "at_least"

OfLooks = SaveLook | RenameLook | CopyLook | MixLooks | DropLook | Propose


class Looks:
    """The looks of a session, in its store, and their thumbnails among its pictures."""

    def __init__(self, session: Session, pictures: Pictures) -> None:
        self._session, self._pictures = session, pictures
        try:
            self.listed()
        except (LightpaintError, LookupError, TypeError, ValueError):
            if not session.store.is_kept:
                raise
            session.store.mend()
        for look in session.store.looks():
            self._offer(look)

    def listed(self) -> tuple[LookInfo, ...]:
        """Return what clients are told of each."""
        return tuple(
            LookInfo(
                id=look.id,
                name=look.fields["name"],
                stamp=look.fields.get("stamp"),
                weights=tuple(map(as_rgb, np.asarray(look.arrays["weights"]))),
                thumbnail=f"look/{look.id}",
                is_proposal=bool(look.fields.get("is_proposal", False)),
            )
            for look in self._session.store.looks()
        )

    def said(self, message: OfLooks) -> Message:
        """What has come of a message. Raises PaintError for a look that there is none of."""
        store = self._session.store
        match message:
            case SaveLook(name):
                self._put(self._now(self._named(name)))
            case RenameLook(number, name):
                look = self._look(number)
                fields = {**look.fields, "name": self._named(name), "is_proposal": False}
                self._put(KeptLook(look.id, fields, look.arrays))
            case CopyLook(number):
                look = self._look(number)
                fields = {**look.fields, "name": f"{look.fields['name']} copy"[:LONGEST]}
                fields["is_proposal"] = False
                self._put(KeptLook(self._free(), fields, look.arrays))
            case MixLooks():
                self._put(self._between(message))
            case Propose():
                self._put(self._proposal(message))
            case DropLook(number):
                store.drop_look(self._look(number).id)
                for k in range(len(self._session.views)):
                    self._pictures.withdraw(of_view(f"look/{number}", k))
        return LookList(looks=self.listed(), resources=self._pictures.named())

    def load(self, message: LoadLook) -> list[Message]:
        """Go on from a look."""
        look = self._look(message.look)
        paintings = dict(enumerate(self._paintings(look)))
        wishes = Wishes.of(look.fields["wishes"])
        weights = np.asarray(look.arrays["weights"], np.float64)
        return self._session.load(paintings, wishes, f"look {look.fields['name']}", weights)

    def _paintings(self, look: KeptLook) -> list[Pixels]:
        """What is painted in each view; of one that came later as before it was painted."""
        arrays, found = look.arrays, []
        names = set(arrays)
        for k, view in enumerate(self._session.views):
            if of_view("image", k) in names:
                image, importance = (arrays[of_view(x, k)] for x in ("image", "importance"))
                marks = arrays[name] > 0 if (name := of_view(MARKS, k)) in names else None
                found.append(Pixels(image, importance, marks))
            else:
                found.append(Pixels.unpainted(view.present))
        return found

    def _now(self, name: str) -> KeptLook:
        session = self._session
        paintings = [view.pixels(view.whole) for view in session.views]
        return self._made(name, paintings, session.wishes, session.weights.copy())

    def _between(self, message: MixLooks) -> KeptLook:
        """Both paintings, each as far as it counts, and the lights held between the answers."""
        part, name = message.part, self._named(message.name)
        if not 0 <= part <= 1:
            raise PaintError(f"part is {part:g}: expected 0 for the first look to 1 for the second")
        looks = [self._look(k) for k in (message.first, message.second)]
        shares = 1 - part, part
        weights = sum(
            s * np.asarray(x.arrays["weights"]) for s, x in zip(shares, looks, strict=True)
        )
        both = zip(*(self._paintings(look) for look in looks), strict=True)
        paintings = [_mixed(pair, shares) for pair in both]
        return self._made(name, paintings, self._held(np.asarray(weights)), np.asarray(weights))

    def _held(self, weights: npt.NDArray[Any]) -> Wishes:
        """Return wishes that hold every light at a lighting, (n, 3)."""
        lights = self._session.basis.lights
        held = {
            light.name: {"lock": float(w[0]) if light.is_scalar else w.tolist()}
            for light, w in zip(lights, weights, strict=True)
            if not light.is_fixed
        }
        return Wishes(held)

    def _proposal(self, message: Propose) -> KeptLook:
        """Return the painting as it is with a lighting that somebody proposes."""
        name, session = self._named(message.name), self._session
        weights, lights = session.weights.copy(), session.basis.lights
        names = list(session.basis.names)
        for light, emission in message.lights.items():
            if light not in names:
                raise PaintError(
                    f"no light is called {light!r}: expected one of {some_names(names)}"
                )
            its = lights[names.index(light)]
            if its.is_fixed:
                raise PaintError(f"{light} is kept as it is: leave it out of the proposal")
            if not all(math.isfinite(x) and x >= 0 for x in emission):
                raise PaintError(f"{light} is proposed at {list(emission)}: expected numbers >= 0")
            if its.is_scalar and len(set(emission)) > 1:
                raise PaintError(f"{light} has one number for all channels: give it three times")
            weights[names.index(light)] = emission
        kept = [look for look in session.store.looks() if look.fields.get("is_proposal")]
        same = [look for look in kept if look.fields["name"] == name]
        if not same and len(kept) >= MOST_PROPOSALS:
            raise PaintError(f"{len(kept)} proposals are there already: let who paints drop some")
        paintings = [view.pixels(view.whole) for view in session.views]
        made = self._made(name, paintings, self._held(weights), weights)
        number = same[0].id if same else made.id
        return KeptLook(number, {**made.fields, "is_proposal": True}, made.arrays)

    def _made(
        self, name: str, paintings: Sequence[Pixels], wishes: Wishes, weights: npt.NDArray[Any]
    ) -> KeptLook:
        fields = {"name": name, "stamp": time.time(), "wishes": wishes.as_json()}
        arrays: dict[str, npt.NDArray[Any]] = {"weights": weights}
        for view, (image, importance, marks) in zip(self._session.views, paintings, strict=True):
            its: dict[str, npt.NDArray[Any]] = {
                "image": np.asarray(image, np.float32),
                "importance": np.asarray(importance, np.float32),
                "thumbnail": small_picture(view.basis.mix(weights), self._session.transform),
            }
            if marks is not None:
                its[MARKS] = marks.view(np.uint8)
            arrays |= {of_view(key, view.view): value for key, value in its.items()}
        return KeptLook(self._free(), fields, arrays)

    def _put(self, look: KeptLook) -> None:
        self._session.store.put_look(look)
        self._offer(look)

    def _offer(self, look: KeptLook) -> None:
        views = len(self._session.views)
        for k in range(views):
            make = partial(self._thumbnail, look, k)
            self._pictures.offer(of_view(f"look/{look.id}", k), make)

    def _thumbnail(self, look: KeptLook, k: int) -> npt.NDArray[Any]:
        """Return the small picture of a view: as kept, or made anew of the look's lights."""
        try:
            return look.arrays[of_view("thumbnail", k)]
        except (LightpaintError, LookupError):
            weights = np.asarray(look.arrays["weights"])
            return small_picture(self._session.views[k].basis.mix(weights), self._session.transform)

    def _free(self) -> int:
        return 1 + max((look.id for look in self._session.store.looks()), default=0)

    def _look(self, number: int) -> KeptLook:
        for look in self._session.store.looks():
            if look.id == number:
                return look
        raise PaintError(f"there is no look {number}")

    @staticmethod
    def _named(name: str) -> str:
        shown = " ".join(name.split())[:LONGEST]
        if not shown:
            raise PaintError("a look needs a name")
        return shown


def _mixed(pair: tuple[Pixels, Pixels], shares: tuple[float, float]) -> Pixels:
    """Two paintings of a view, each as far as it counts."""
    counts = [share * its.importance for share, its in zip(shares, pair, strict=True)]
    total = counts[0] + counts[1]
    whole = np.where(total > 0, total, 1)[..., None]
    image = np.zeros((*total.shape, 3), np.float32)
    for count, its in zip(counts, pair, strict=True):
        image += (count[..., None] / whole * its.image).astype(np.float32)
    # Brighter than the mean is as good where it is of all that counts there.
    unsure = np.zeros(image.shape, bool)
    for count, its in zip(counts, pair, strict=True):
        fixed = True if its.at_least is None else ~its.at_least
        unsure |= fixed & (count > 0)[..., None]
    at_least = ~unsure & (total > 0)[..., None]
    return Pixels(image, total.astype(np.float32), at_least if at_least.any() else None)
