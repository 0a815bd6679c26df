"""A session whose lights are moved, aimed, added and removed at random, without a renderer."""

import sys
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from layered_sessions import bases_of, identity_of

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.paint import protocol
from lightpaint.paint.rig.added_lights import light_of_new, new_emitter
from lightpaint.paint.rig.lamp_rig import one_light_basis, with_planes_of
from lightpaint.paint.session.moved_lights import Placed, added_names
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.session_file import Store
from lightpaint.pipeline.job.settings import Settings


class InventedPlanes:
    """Planes that follow from the places of lights, and show nothing real."""

    outdated: tuple[str, ...] = ()

    def check(self, placed: Placed) -> None:
        """All places are possible."""

    def lights(self, lights: Lights, placed: Placed) -> Lights:
        added = [light_of_new(new_emitter(name, placed[name])) for name in added_names(placed)]
        return Lights((*lights, *added), lights.requests)

    def bases(self, bases: Sequence[Basis], placed: Placed) -> list[Basis]:
        if not placed:
            return list(bases)
        lights = self.lights(bases[0].lights, placed)
        names = [light.name for light in lights]
        return [
            with_planes_of(
                basis,
                {
                    names.index(name): one_light_basis(
                        basis, lights[names.index(name)], invented(basis.size, values)
                    )
                    for name, values in placed.items()
                },
                in_memory=True,
            )
            for basis in bases
        ]


def invented(size: tuple[int, int], values: Mapping[str, Any]) -> Any:
    x = np.linspace(0, 1 + abs(values["position"][0]), size[1], dtype=np.float32)
    return np.broadcast_to(np.exp(-(x**2))[None, :, None], (*size, 3)).copy()


def open_moved_session(store: Store) -> Session:
    """A session on what a store holds."""
    bases = bases_of(1)
    return Session(
        bases,
        [basis.current_look for basis in bases],
        store,
        settings=Settings(),
        transform=lp.ViewTransform(),
        plane_source=InventedPlanes(),
    )


class RandomMover:
    """Moves lights at random, the same for the same seed. states: requests after each step."""

    def __init__(self, seed: int, session: Session) -> None:
        self.rng, self.session = np.random.default_rng(seed), session
        self.states = [session.requests.placed]
        session.handle(
            protocol.Paint(0, (0, 9, 0, 9), True),
            {"image": np.ones((9, 9, 3), np.float32), "importance": np.ones((9, 9), np.float32)},
        )
        self.states.append(session.requests.placed)

    def act(self) -> None:
        """Do what becomes one step, after a drag that does not."""
        names, added = self.session.basis.names, list(self.session.requests.added)
        action = ("move", "move", "add", "place", "remove")[self.rng.integers(5)]
        place = [float(x) for x in self.rng.uniform(-2, 2, 3)]
        new = {"kind": "point", "position": place, "emission": [1.0, 1.0, 1.0]}
        if action == "remove" and added:
            self.session.handle(protocol.RemoveLight(added[0]), {})
        elif action == "add" and len(added) < 3:
            name = f"point_{len(self.states)}"
            self.session.hang_lights(f"add {name}", {name: new})
        elif action == "place":  # a search moves several lights and adds one, in one step
            name = f"found_{len(self.states)}"
            others = {name: new} if len(added) < 3 else {}
            moved = {x: {"position": place} for x in ("a", "b")}
            self.session.hang_lights("move a, b", {**moved, **others})
        else:
            name = names[self.rng.integers(len(names))]
            for is_final in (False, True):
                place[0] += 0.5
                pose = {name: {"position": list(place)}}
                self.session.handle(protocol.MoveLights(pose, is_final), {})
        self.states.append(self.session.requests.placed)


def main() -> None:
    """Move lights in a session file until somebody ends this process; print each kept step."""
    with Store.open(Path(sys.argv[1]), identity_of(1)) as store:
        mover = RandomMover(5, open_moved_session(store))
        for _ in count():
            print(store.position, flush=True)
            mover.act()


if __name__ == "__main__":
    main()
