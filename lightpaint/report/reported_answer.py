"""An answer with everything that its report contains: pages and numbers are made from it."""

from collections.abc import Sequence
from dataclasses import dataclass

from lightpaint.basis import Basis
from lightpaint.images import Estimate
from lightpaint.lighting import (
    Appearance,
    Choices,
    Diagnosis,
    PlanesAnswer,
    Solution,
    SurfaceColor,
    Uncertainty,
)
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.relit.verification import Verification
from lightpaint.report.rig.hung_lights import HungLights
from lightpaint.target import Target


@dataclass(frozen=True, kw_only=True)
class ReportedAnswer:
    """The answer to a painting, with its analysis as far as it is known.

    basis, target, solution: of one view. predicted: Σ w_i Φ_i. verification: None without a render
    that checks the prediction. command: the shell command that made the result. uncertainty,
    diagnosis, unconstrained, suggestions, hung: without them the report has no such section.
    turn: the turn of a spot that would help most, if any. appearance: the result of
    `compare_appearance`, if known. color_choices: the answers of other colours, if known. planes:
    what it gives on measuring planes, if there are any. surfaces: colours of objects under it, if
    it has spectra.
    """

    basis: Basis
    target: Target
    solution: Solution
    predicted: Estimate
    verification: Verification | None
    command: str = ""
    uncertainty: Uncertainty | None = None
    diagnosis: Diagnosis | None = None
    unconstrained: Solution | None = None
    suggestions: Sequence[Suggestion] | None = None
    turn: MoveSuggestion | None = None
    hung: HungLights | None = None
    appearance: Appearance | None = None
    color_choices: Choices = ()
    planes: PlanesAnswer | None = None
    surfaces: Sequence[SurfaceColor] = ()
