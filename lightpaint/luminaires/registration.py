"""Adds the emitters of luminaires to Mitsuba, for the variant that is set and for later ones."""

import importlib
import sys
from typing import Any

from lightpaint.errors import BackendError

_MODULE = "lightpaint.luminaires.emitter_plugins"

#: Variants that have the emitters, and keep them while another is set.
_registered: set[str] = set()


def can_have_luminaires(variant: str) -> bool:
    """Return whether a variant of Mitsuba runs these emitters at full speed: the variants of Dr.Jit
    do."""
    return variant.endswith(("_rgb", "_spectral")) and not variant.startswith("scalar")


def check_can_have_luminaires(variant: str) -> None:
    """Raise BackendError unless a variant has these emitters."""
    if not can_have_luminaires(variant):
        raise BackendError(
            f"luminaires need a variant of Dr.Jit, such as llvm_ad_rgb, and this is {variant}"
        )


def register_luminaires() -> None:
    """Add the emitters to Mitsuba in the present variant, if there is one that can have them."""
    import mitsuba as mi

    variant = mi.variant()
    if variant is None or not can_have_luminaires(variant):
        return
    module = sys.modules.get(_MODULE)
    if variant in _registered:
        return
    if module is None:
        importlib.import_module(_MODULE)
    else:
        importlib.reload(module)  # its base class is the class of the variant
    _registered.add(variant)


def register_luminaires_always() -> None:
    """Add the emitters to Mitsuba now, and whenever a variant is set."""
    import mitsuba as mi

    def follow(old: Any, new: Any) -> None:
        register_luminaires()

    mi.detail.add_variant_callback(follow)
    register_luminaires()
