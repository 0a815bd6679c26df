"""The variant of Mitsuba, which is chosen once per process, before Mitsuba is imported.

This is the only module that calls `mi.set_variant`.
"""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import FrameType
from typing import Any

from lightpaint.errors import BackendError
from lightpaint.files import first_line
from lightpaint.keywords import keywords
from lightpaint.luminaires.registration import register_luminaires
from lightpaint.scene.runtime.llvm import INSTALL_LLVM, OLDEST_LLVM, Llvm, prepare_llvm
from lightpaint.scene.runtime.plugins import loaded_plugins
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.sentences import Sentence
from lightpaint.signals import interruptible_between_pieces

FAST_VARIANT = "llvm_ad_rgb"
PLAIN_VARIANT = "scalar_rgb"
SPECTRAL = "_spectral"


class SlowBackendWarning(UserWarning):
    """A warning that renders take many times longer than necessary."""


@dataclass(frozen=True)
class Backend:
    """The Mitsuba variant of this process, and its LLVM library if it uses one."""

    variant: str
    llvm: Llvm | None = None
    note: str = ""

    @property
    def is_jit(self) -> bool:
        """True if Python integrators run at full speed, which they do not in scalar variants."""
        return not self.variant.startswith("scalar")


_current: Backend | None = None


@keywords()
def use_variant(requested: str | None = None) -> Backend:
    """Start Mitsuba with the variant `requested`, or with the fastest RGB variant that works here.

    Later calls return the same backend.

    Args:
        requested: A variant such as `llvm_ad_rgb`; None for the fastest.

    Raises:
        BackendError: If Mitsuba is missing, if this installation has no RGB variant of the name
            `requested`, or if another one is already in use.

    Examples:
        >>> lp.use_variant().variant
        '..._rgb'
    """
    global _current
    if _current is not None:
        _check_unchanged(_current)
        if requested not in (None, _current.variant):
            raise BackendError(
                f"this process already renders with {_current.variant}: "
                f"start a new one for {requested}"
            )
    else:
        # An interrupt while C++ modules initialise would crash the process.
        with interruptible_between_pieces():
            _current = _start(requested)
    if _current.note:
        _warn_of(_current)
    return _current


@contextmanager
def spectral_variant() -> Iterator[None]:
    """Make Mitsuba render spectra instead of RGB within the block.

    No other thread uses it meanwhile, except in RGB while this one lends its turn. Scenes belong to
    the variant in which they were loaded. Raises BackendError where there is no spectral variant
    that runs Python integrators.
    """
    with MITSUBA.acquired():
        backend = use_variant()
        if backend.variant.endswith(SPECTRAL):  # a block within another
            yield
            return
        import mitsuba as mi

        spectral = Backend(backend.variant.removesuffix("_rgb") + SPECTRAL, backend.llvm)
        if not backend.is_jit or spectral.variant not in mi.variants():
            raise BackendError(
                f"spectra need a variant like {FAST_VARIANT}, and this process renders with "
                f"{backend.variant}: {INSTALL_LLVM}"
            )
        try:
            _switch(spectral)
            register_luminaires()
            with MITSUBA.around_lending(partial(_meanwhile, backend, spectral)):
                yield
        finally:
            if MITSUBA.is_held:  # false if it was interrupted while its turn was lent
                _switch(backend)


@contextmanager
def _meanwhile(others: Backend, own: Backend) -> Iterator[None]:
    """Have Mitsuba render as others expect while they have the turn of this thread."""
    _switch(others)
    yield
    _switch(own)


def _switch(backend: Backend) -> None:
    """Make Mitsuba render with a backend.

    Mitsuba loads its Python integrators anew each time, which takes a tenth of a second, and after
    a hundred times Dr.Jit warns of so many functions that it transforms.
    """
    global _current
    import mitsuba as mi

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The AST-transforming decorator", RuntimeWarning)
        mi.set_variant(backend.variant)
    _current = backend


def is_in_spectra() -> bool:
    """Return whether Mitsuba renders spectra now, in a block of `spectral_variant`."""
    return use_variant().variant.endswith(SPECTRAL)


def _warn_of(backend: Backend) -> None:
    """Warn of a slow backend at the line that called lightpaint: Python shows it once for each."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and _is_ours(frame):
        frame, level = frame.f_back, level + 1
    warnings.warn(backend.note, SlowBackendWarning, stacklevel=level)


def _is_ours(frame: FrameType) -> bool:
    """Return whether a frame is lightpaint's, or of a decorator around it."""
    module = str(frame.f_globals.get("__name__", ""))
    return module.startswith("lightpaint.") or module == "contextlib"


def _start(requested: str | None) -> Backend:
    needs_llvm = requested is None or requested.startswith("llvm")
    llvm = prepare_llvm() if needs_llvm else None
    try:
        import mitsuba as mi
    except ModuleNotFoundError as error:
        raise BackendError(f"Mitsuba cannot be imported ({error}): pip install mitsuba") from error
    except (ImportError, NameError, RuntimeError) as error:
        # Dr.Jit's own report of a failed start has a NameError in it.
        reason = first_line(error.__context__ or error)
        raise BackendError(
            f"Mitsuba is installed and cannot start ({reason}): close other programs, since it may "
            "lack memory; or pip install --force-reinstall mitsuba"
        ) from error

    # A notebook or a script may have set a variant already, which is respected.
    current = mi.variant()
    if current is not None and requested in (None, current):
        _check_is_rgb(current)
        if current.startswith("llvm"):
            import drjit as dr

            _check_llvm_in_use(dr, current)
        backend = Backend(current)
    elif requested is None:
        backend = _choose(mi, llvm)
    else:
        backend = _set(mi, requested, llvm)
    mi.set_log_level(mi.LogLevel.Error)
    loaded_plugins()  # before any scene adds search folders
    register_luminaires()
    return backend


def _check_unchanged(backend: Backend) -> None:
    import mitsuba as mi

    if mi.variant() != backend.variant:
        raise BackendError(
            f"mi.set_variant({mi.variant()!r}) was called after lightpaint had started with "
            f"{backend.variant}: set the variant before loading the first scene, and keep it"
        )


def _choose(mi: Any, llvm: Llvm | None) -> Backend:
    if llvm is not None:
        try:
            return _set(mi, FAST_VARIANT, llvm)
        except BackendError as error:
            problem = error.sentence
    else:
        problem = Sentence(f"no usable LLVM {OLDEST_LLVM} or newer")
    backend = _set(mi, PLAIN_VARIANT, None)
    note = problem + f": rendering with {PLAIN_VARIANT}, many times slower; {INSTALL_LLVM}"
    return Backend(backend.variant, note=note)


def _set(mi: Any, variant: str, llvm: Llvm | None) -> Backend:
    _check_is_rgb(variant)
    if variant not in mi.variants():
        raise BackendError(
            f"this Mitsuba has no variant {variant}: expected one of {', '.join(mi.variants())}"
        )
    if variant.startswith("llvm") and llvm is None:
        raise BackendError(f"{variant} needs LLVM {OLDEST_LLVM} or newer: {INSTALL_LLVM}")
    try:
        mi.set_variant(variant)
        if not variant.startswith("scalar"):
            # The first array starts the backend, which should fail here rather than in a render.
            import drjit as dr

            _check_llvm_in_use(dr, variant)
            dr.eval(mi.Float(0) + 1)
    except BackendError:
        raise
    except Exception as error:
        raise BackendError(f"Mitsuba's {variant} does not start here: {error}") from error
    return Backend(variant, llvm)


def _check_llvm_in_use(dr: Any, variant: str) -> None:
    """Raise BackendError if Dr.Jit has loaded an LLVM that would crash the process."""
    if variant.startswith("llvm") and (version := dr.detail.llvm_version())[0] < OLDEST_LLVM:
        raise BackendError(
            f"Mitsuba was imported before lightpaint and loaded LLVM {version[0]}, which "
            f"is too old for it: `import lightpaint` before `import mitsuba`, or set "
            f"DRJIT_LIBLLVM_PATH to LLVM {OLDEST_LLVM} or newer"
        )


def _check_is_rgb(variant: str) -> None:
    if not variant.endswith("_rgb"):
        raise BackendError(
            f"variant {variant} is not supported: weights per colour channel are only linear in "
            f"RGB variants, such as {FAST_VARIANT} or {PLAIN_VARIANT}"
        )
