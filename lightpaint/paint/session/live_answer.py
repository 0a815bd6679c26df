"""What is asked in a session beside the paint, and the answer that follows both under the hand."""

from collections.abc import Sequence

from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.fit import resolve_fit
from lightpaint.lighting.linear_problem import reduced_by
from lightpaint.lighting.live.live import Live
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.pipeline.settings import Settings


class Answering:
    """Wishes, and the weights that come closest under them. Updated in place.

    settings, constraints: what was asked before the session began. transform: what is painted
    through.

    Attributes:
        wishes: What is asked now, also by a slider that still moves.
        kept: What was asked before it moved; None where none moves.
        weights: (n, 3), the last answer.
    """

    def __init__(
        self,
        views: Sequence[LiveView],
        wishes: Wishes,
        *,
        settings: Settings,
        constraints: Constraints,
        transform: ViewTransform,
    ) -> None:
        self.wishes = wishes
        self.kept: Wishes | None = None
        self.weights = views[0].basis.present_weights
        self._settings, self._given, self._transform = settings, constraints, transform
        self.begin(views)

    def begin(self, views: Sequence[LiveView]) -> None:
        """Go on with these views."""
        self._basis = views[0].basis
        self._live = Live(views, fit=self.fit, constraints=self._constraints(self.wishes))
        self._live.prepare()

    @property
    def at_rest(self) -> Wishes:
        """What is asked but for a slider that still moves."""
        return self.kept or self.wishes

    @property
    def mode(self) -> str:
        """In which space answers are found."""
        return self._live.mode

    @property
    def fit(self) -> Settings:
        """What it is to be close, with nothing left open."""
        return self._fit(self.wishes)

    def settings(self, wishes: Wishes | None = None) -> Settings:
        """The same of `wishes`, of those there are by default, with all that follows from the
        painting left open.
        """
        return (wishes or self.wishes).settings(self._settings)

    def constraints(self, wishes: Wishes | None = None) -> Constraints:
        """What these ask of the lights, beside what their scene asks."""
        return self._given.and_then((wishes or self.wishes).constraints())

    @property
    def basis(self) -> Basis:
        """Whose lights are asked: those of all views."""
        return self._basis

    def check(self, wishes: Wishes) -> None:
        """Raise LightpaintError for what cannot be asked, before anything is changed."""
        reduced_by(self._constraints(wishes), self._basis.lights, self._fit(wishes))

    def ask(self, wishes: Wishes) -> None:
        """This from now on; a slider that moved has come to rest."""
        self._ask(wishes)
        self.kept = None

    def _ask(self, wishes: Wishes) -> None:
        self.wishes = wishes
        self._live.asks(self.fit, self._constraints(wishes))

    def move(self, wishes: Wishes) -> None:
        """This, as long as a slider moves. Raises LightpaintError, and changes nothing then."""
        self.check(wishes)
        self.kept = self.at_rest
        self._ask(wishes)

    def move_back(self) -> bool:
        """Whether there was a slider that somebody has left; what was asked before is asked."""
        if self.kept is None:
            return False
        self.ask(self.kept)
        return True

    def solve(self) -> None:
        """The weights, as the paint is now."""
        self.weights = self._live.answer(self.weights)

    def _fit(self, wishes: Wishes) -> Settings:
        settings = wishes.settings(self._settings)
        return resolve_fit(
            settings, over_look=True, through_view=True, display=lambda: self._transform
        )

    def _constraints(self, wishes: Wishes) -> Constraints:
        asked = constraints_of(self._basis.requests).and_then(self._given)
        return asked.and_then(wishes.constraints())
