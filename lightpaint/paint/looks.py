"""Looks of a session: a painting and its answer, kept under a name."""

import time
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.images.blocks import block_mean
from lightpaint.paint.frames import Message
from lightpaint.paint.pictures import Pictures
from lightpaint.paint.protocol import CopyLook, DropLook, LoadLook, MixLooks, RenameLook, SaveLook
from lightpaint.paint.session import Session
from lightpaint.paint.steps import KeptLook, Pixels
from lightpaint.paint.wishes import Wishes

#: Pixels of a thumbnail's longer side, about, and characters of a name.
THUMBNAIL, LONGEST = 192, 80

Said = SaveLook | RenameLook | CopyLook | MixLooks | DropLook


class Looks:
    """The looks of a session, in its store, and their thumbnails among its pictures."""

    def __init__(self, session: Session, pictures: Pictures) -> None:
        self._session, self._pictures = session, pictures
        for look in session.store.looks():
            self._offer(look)

    def listed(self) -> list[dict[str, Any]]:
        """What a page is told of each."""
        return [
            {
                "id": look.id,
                "name": look.fields["name"],
                "stamp": look.fields["stamp"],
                "delta_e": look.fields.get("delta_e"),
                "weights": np.asarray(look.arrays["weights"]).tolist(),
                "thumbnail": f"look/{look.id}",
            }
            for look in self._session.store.looks()
        ]

    def said(self, message: Said) -> Message:
        """What has come of a message. Raises PaintError for a look that there is none of."""
        store = self._session.store
        match message:
            case SaveLook(name):
                self._put(self._now(self._named(name)))
            case RenameLook(number, name):
                look = self._look(number)
                fields = {**look.fields, "name": self._named(name)}
                self._put(KeptLook(look.id, fields, look.arrays))
            case CopyLook(number):
                look = self._look(number)
                fields = {**look.fields, "name": f"{look.fields['name']} copy"[:LONGEST]}
                self._put(KeptLook(self._free(), fields, look.arrays))
            case MixLooks():
                self._put(self._between(message))
            case DropLook(number):
                store.drop_look(self._look(number).id)
                self._pictures.withdraw(f"look/{number}")
        return Message("looks", {"looks": self.listed(), "resources": self._pictures.named()})

    def load(self, message: LoadLook) -> Message:
        """Go on from a look."""
        look = self._look(message.look)
        image, importance = (np.asarray(look.arrays[x]) for x in ("image", "importance"))
        wishes = Wishes.of(look.fields["wishes"])
        return self._session.load(image, importance, wishes, f"look {look.fields['name']}")

    def _now(self, name: str) -> KeptLook:
        session = self._session
        painting = session.image.copy(), session.importance.copy()
        return self._made(name, painting, session.wishes, session.weights.copy())

    def _between(self, message: MixLooks) -> KeptLook:
        """Both paintings, each as far as it counts, and the lights held between the answers."""
        part, name = message.part, self._named(message.name)
        if not 0 <= part <= 1:
            raise PaintError(f"part is {part:g}: expected 0 for the first look to 1 for the second")
        arrays = [self._look(k).arrays for k in (message.first, message.second)]
        shares = 1 - part, part
        weights = sum(s * np.asarray(x["weights"]) for s, x in zip(shares, arrays, strict=True))
        counts = [s * np.asarray(x["importance"]) for s, x in zip(shares, arrays, strict=True)]
        total = counts[0] + counts[1]
        whole = np.where(total > 0, total, 1)[..., None]
        image = np.zeros((*total.shape, 3), np.float32)
        for count, its in zip(counts, arrays, strict=True):
            image += (count[..., None] / whole * np.asarray(its["image"])).astype(np.float32)
        lights = self._session.basis.lights
        held = {
            light.name: {"lock": float(w[0]) if light.is_scalar else w.tolist()}
            for light, w in zip(lights, np.asarray(weights), strict=True)
            if not light.is_fixed
        }
        return self._made(
            name, (image, total.astype(np.float32)), Wishes(held), np.asarray(weights)
        )

    def _made(
        self, name: str, painting: Pixels, wishes: Wishes, weights: npt.NDArray[Any]
    ) -> KeptLook:
        fields = {"name": name, "stamp": time.time(), "wishes": wishes.as_json()}
        look = self._session.basis.mix(weights)
        factor = max(1, round(max(look.shape[:2]) / THUMBNAIL))
        rows, columns = (n // factor * factor for n in look.shape[:2])
        shown = self._session.transform.encode(block_mean(look[:rows, :columns], factor))
        arrays: dict[str, npt.NDArray[Any]] = {
            "image": np.asarray(painting[0], np.float32),
            "importance": np.asarray(painting[1], np.float32),
            "weights": weights,
            "thumbnail": np.round(shown * 255).astype(np.uint8),
        }
        return KeptLook(self._free(), fields, arrays)

    def _put(self, look: KeptLook) -> None:
        self._session.store.put_look(look)
        self._offer(look)

    def _offer(self, look: KeptLook) -> None:
        self._pictures.offer(f"look/{look.id}", lambda: np.asarray(look.arrays["thumbnail"]))

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
