"""Looks of a session: a painting and its answer, kept under a name."""

import time
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.images.blocks import block_mean
from lightpaint.paint.pictures import Pictures
from lightpaint.paint.protocol import CopyLook, DropLook, LoadLook, Message, RenameLook, SaveLook
from lightpaint.paint.session import Session
from lightpaint.paint.steps import KeptLook
from lightpaint.paint.wishes import Wishes

#: Pixels of a thumbnail's longer side, about, and characters of a name.
THUMBNAIL, LONGEST = 192, 80

Said = SaveLook | RenameLook | CopyLook | DropLook


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
        fields = {"name": name, "stamp": time.time(), "wishes": session.wishes.as_json()}
        look = session.basis.mix(session.weights)
        factor = max(1, round(max(look.shape[:2]) / THUMBNAIL))
        rows, columns = (n // factor * factor for n in look.shape[:2])
        shown = session.transform.encode(block_mean(look[:rows, :columns], factor))
        arrays: dict[str, npt.NDArray[Any]] = {
            "image": session.image.copy(),
            "importance": session.importance.copy(),
            "weights": session.weights.copy(),
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
