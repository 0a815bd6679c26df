"""The messages between a session and its clients, in both directions, each a frozen dataclass.

`message_frames.py` says how they travel. Lights, views and objects are known by their place in what
`state` lists. A region is rows and columns of a picture, `[top, bottom, left, right]`, the ends not
included. Colours are linear Rec.709.

Pictures are fetched, and not sent: `resources` of `state` and of later messages say which there
are, the pictures of views but the first as `plane/3@1`.
"""

# fmt: off
from lightpaint.paint.protocol.answer_parts import (
    Advice, AnswerChoice, AnswerColors, Closeness, Findings, LightAnswer, PlaneLight, PlanesReading,
    PlaneWish, WishDelivery,
)
from lightpaint.paint.protocol.base import Event, Message, Request
from lightpaint.paint.protocol.events import (
    Acknowledgement, AnswerChoices, AnswerUpdate, CanvasPatch, Closing, ConsoleState, DraggedPlane,
    Failure, LookList, MixedPicture, Notice, PictureData, PictureUpdate, PreviousAnswer,
    ReferenceList, Rig, SelectionUpdate, SessionPending, SessionState, StepList,
)
from lightpaint.paint.protocol.light_requests import (
    AddLight, ConstrainLight, ConstrainLights, EstimatePlaces, MoveLights, PlaceLights, PointLight,
    RemoveLight, SetMaster, ShowRig, StartFromLamps, TieLights,
)
from lightpaint.paint.protocol.message_parts import (
    Camera, ConsoleInfo, EditState, EmitterInfo, HistoryInfo, ImageInfo, LayerInfo, LayerList,
    LightInfo, LightPlace, LookInfo, MeasuredPlane, Place, PlacePair, PlanesInfo, PlanObject,
    PresetInfo, ReferenceInfo, RenderInfo, ResolvedFit, SampleCount, SearchInfo, SelectionInfo,
    SkyAxes, StepInfo, TableInfo, Tone, TransformInfo, ViewInfo,
)
from lightpaint.paint.protocol.painting_requests import (
    ANSWER_SLOT, AddReference, ApplyPreset, ChangeLayers, ClearPainting, CompareLooks, CopyLook,
    DropLook, DropReference, DropStroke, GoToStep, ImportLayers, ListSteps, LoadLook, LookLike,
    MixLights, MixLooks, Paint, Propose, Redo, RenameLook, SaveLook, Select, ShowPrevious,
    StartOver, Undo,
)
from lightpaint.paint.protocol.requests import (
    VERSION, BlackOut, ChangeSettings, DropRender, Explain, Export, Fetch, Hello, Observe, Preview,
    RenderFinal, StopRender, SwitchConsole, TakeOver, Verify,
)
from lightpaint.paint.protocol.task_events import (
    Explanation, ExportResult, PlacingEstimate, PlacingResult, PreviewResult, ProgressReport,
    RenderList, TaskStarted, TaskStopped, TrialPlaces, VerificationResult,
)
# fmt: on
