"""Which Mitsuba runs here: one choice per process, made before Mitsuba is imported.

This is the only module that calls `mi.set_variant`.
"""

import warnings
from dataclasses import dataclass
from typing import Any

from lightpaint.errors import BackendError
from lightpaint.keywords import keywords
from lightpaint.scene.runtime.llvm import INSTALL_LLVM, OLDEST_LLVM, Llvm, prepare_llvm
from lightpaint.scene.runtime.plugins import loaded_plugins
from lightpaint.signals import interruptible_between_pieces

FAST_VARIANT = "llvm_ad_rgb"
PLAIN_VARIANT = "scalar_rgb"


class SlowBackendWarning(UserWarning):
    """Renders will take many times longer than they need to."""


@dataclass(frozen=True)
class Backend:
    """The Mitsuba variant of this process and, where it compiles with LLVM, the library."""

    variant: str
    llvm: Llvm | None = None
    note: str = ""

    @property
    def is_jit(self) -> bool:
        """Whether Python integrators run at full speed: not so in scalar variants."""
        return not self.variant.startswith("scalar")


_current: Backend | None = None


@keywords()
def use_variant(wanted: str | None = None) -> Backend:
    """Set up Mitsuba once, as `wanted` or as the fastest RGB variant that works here.

    Later calls return the same backend.

    Args:
        wanted: Like `llvm_ad_rgb`; None for the fastest.

    Raises:
        BackendError: If Mitsuba is missing, if `wanted` is no RGB variant of this installation, or
            if another one is already in use.

    Examples:
        >>> lp.use_variant().variant
        '..._rgb'
    """
    global _current
    if _current is not None:
        _check_still(_current)
        if wanted not in (None, _current.variant):
            raise BackendError(
                f"this process already renders with {_current.variant}: "
                f"start a new one for {wanted}"
            )
        return _current

    # An interrupt while modules in C++ begin ends the process otherwise than it should.
    with interruptible_between_pieces():
        _current = _begun(wanted)
    return _current


def _begun(wanted: str | None) -> Backend:
    needs_llvm = wanted is None or wanted.startswith("llvm")
    llvm = prepare_llvm() if needs_llvm else None
    try:
        import mitsuba as mi
    except ImportError as error:
        raise BackendError(f"Mitsuba cannot be imported ({error}): pip install mitsuba") from error

    # Somebody (a notebook, a script) may have set a variant already; it is theirs to choose.
    present = mi.variant()
    if present is not None and wanted in (None, present):
        _check_is_rgb(present)
        if present.startswith("llvm"):
            import drjit as dr

            _check_llvm_in_use(dr, present)
        backend = Backend(present)
    elif wanted is None:
        backend = _choose(mi, llvm)
    else:
        backend = _set(mi, wanted, llvm)
    mi.set_log_level(mi.LogLevel.Error)
    loaded_plugins()  # before any scene says where files are
    return backend


def _check_still(backend: Backend) -> None:
    import mitsuba as mi

    if mi.variant() != backend.variant:
        raise BackendError(
            f"mi.set_variant({mi.variant()!r}) was called after lightpaint had begun with "
            f"{backend.variant}: set that before the first scene is loaded, and keep it"
        )


def _choose(mi: Any, llvm: Llvm | None) -> Backend:
    if llvm is not None:
        try:
            return _set(mi, FAST_VARIANT, llvm)
        except BackendError as error:
            problem = str(error)
    else:
        problem = f"no usable LLVM {OLDEST_LLVM} or newer"
    backend = _set(mi, PLAIN_VARIANT, None)
    note = f"{problem}: rendering with {PLAIN_VARIANT}, many times slower; {INSTALL_LLVM}"
    warnings.warn(note, SlowBackendWarning, stacklevel=5)
    return Backend(backend.variant, note=note)


def _set(mi: Any, variant: str, llvm: Llvm | None) -> Backend:
    _check_is_rgb(variant)
    if variant not in mi.variants():
        raise BackendError(
            f"Mitsuba here has no variant {variant}: it has {', '.join(mi.variants())}"
        )
    if variant.startswith("llvm") and llvm is None:
        raise BackendError(f"{variant} needs LLVM {OLDEST_LLVM} or newer: {INSTALL_LLVM}")
    try:
        mi.set_variant(variant)
        if not variant.startswith("scalar"):
            # The first array starts the backend; failing here is better than mid-render.
            import drjit as dr

            _check_llvm_in_use(dr, variant)
            dr.eval(mi.Float(0) + 1)
    except BackendError:
        raise
    except Exception as error:
        raise BackendError(f"Mitsuba's {variant} does not start here: {error}") from error
    return Backend(variant, llvm)


def _check_llvm_in_use(dr: Any, variant: str) -> None:
    """Raise BackendError if Dr.Jit has taken an LLVM that would bring the process down."""
    if variant.startswith("llvm") and (version := dr.detail.llvm_version())[0] < OLDEST_LLVM:
        raise BackendError(
            f"Mitsuba was imported before lightpaint had a say and took LLVM {version[0]}, which "
            f"cannot run it: load a scene or call lightpaint.use_variant() before "
            f"`import mitsuba`, or set DRJIT_LIBLLVM_PATH to LLVM {OLDEST_LLVM} or newer"
        )


def _check_is_rgb(variant: str) -> None:
    if not variant.endswith("_rgb"):
        raise BackendError(
            f"variant {variant} is not supported: weights per colour channel are only linear in "
            f"RGB variants, such as {FAST_VARIANT} or {PLAIN_VARIANT}"
        )
