"""Gives Dr.Jit an LLVM that works, in whatever order a script imports lightpaint and Mitsuba.

Dr.Jit takes the LLVM that it finds first, once, when it is imported, and the LLVM of the system may
be too old. A script whose imports are in order of the alphabet imports lightpaint first: then the
right one is chosen just before Dr.Jit is loaded, and nothing is loaded until then.
"""

import sys


class _LlvmFirst:
    """A finder of modules that finds none, but sees Dr.Jit come."""

    def find_spec(self, name: str, *_: object) -> None:
        """Choose the LLVM if it is Dr.Jit that is imported."""
        if name != "drjit":
            return
        sys.meta_path.remove(self)
        from lightpaint.scene.runtime.llvm import prepare_llvm

        prepare_llvm()


def choose_llvm_at_import() -> None:
    """Choose the LLVM when Dr.Jit is imported, unless it is already."""
    if "drjit" not in sys.modules:
        sys.meta_path.insert(0, _LlvmFirst())
