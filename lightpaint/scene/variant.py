"""Which Mitsuba runs here: one choice per process, made before Mitsuba is imported.

Dr.Jit looks for LLVM when it is first imported, cannot try twice, and one that is too old
brings the whole process down. So a library is tried out in a process of its own first.
This is the only module that calls `mi.set_variant`.
"""

import ctypes
import importlib.metadata
import os
import platform
import subprocess
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from lightpaint.errors import BackendError

OLDEST_LLVM = 17
FAST_VARIANT = "llvm_ad_rgb"
PLAIN_VARIANT = "scalar_rgb"
INSTALL_LLVM = (
    "pip install karellen-llvm-core (Linux x86-64), or install LLVM 17 or newer and set "
    "DRJIT_LIBLLVM_PATH to its libLLVM"
)


class SlowBackendWarning(UserWarning):
    """Renders will take many times longer than they need to."""


@dataclass(frozen=True)
class Llvm:
    """A libLLVM that was found. `version` is None if it cannot be used; `problem` says why."""

    path: Path
    origin: str
    version: tuple[int, int, int] | None
    problem: str = ""


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


def use_variant(wanted: str | None = None) -> Backend:
    """Set up Mitsuba once, as `wanted` or as the fastest RGB variant that works here.

    Later calls return the same backend. Raises BackendError if Mitsuba is missing, if
    `wanted` is no RGB variant of this installation, or if another one is already in use.
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

    needs_llvm = wanted is None or wanted.startswith("llvm")
    llvm = _prepare_llvm() if needs_llvm else None
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
        _current = Backend(present)
    elif wanted is None:
        _current = _choose(mi, llvm)
    else:
        _current = _set(mi, wanted, llvm)
    mi.set_log_level(mi.LogLevel.Error)
    return _current


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
    warnings.warn(note, SlowBackendWarning, stacklevel=4)
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


def _prepare_llvm() -> Llvm | None:
    """Find a usable LLVM and make Dr.Jit take it. None if there is none."""
    usable = next((c for c in llvm_candidates() if c.version is not None), None)
    if usable is not None and "drjit" not in sys.modules:
        _preload_cpp_runtime(usable.path)
        os.environ["DRJIT_LIBLLVM_PATH"] = str(usable.path)
    return usable


@cache
def llvm_candidates() -> tuple[Llvm, ...]:
    """LLVM libraries in the order they are tried, up to the first usable one."""
    found: list[Llvm] = []
    seen: set[Path] = set()
    for path, origin in _llvm_paths():
        resolved = path.resolve()
        if resolved in seen:
            continue
        seen.add(resolved)
        found.append(_probe(path, origin))
        if found[-1].version is not None:
            break
    return tuple(found)


def _llvm_paths() -> Iterator[tuple[Path, str]]:
    if named := os.environ.get("DRJIT_LIBLLVM_PATH"):
        yield Path(named), "DRJIT_LIBLLVM_PATH"
    try:
        files = importlib.metadata.files("karellen-llvm-core") or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in sorted(files, key=lambda f: len(f.name)):
        if file.name.startswith("libLLVM") and ".so" in file.name:
            yield Path(str(file.locate())).resolve(), "karellen-llvm-core"
    name = {"Darwin": "libLLVM*.dylib", "Windows": "LLVM-C.dll"}.get(
        platform.system(), "libLLVM*.so*"
    )
    folders = [
        "/usr/lib/llvm-*/lib",
        f"/usr/lib/{platform.machine()}-linux-gnu",
        "/usr/lib64",
        "/usr/lib",
        "/usr/local/lib",
        "/opt/homebrew/opt/llvm*/lib",
        "/usr/local/opt/llvm*/lib",
        "C:/Program Files/LLVM/bin",
    ]
    for folder in folders:
        base = Path(folder)
        root = Path(base.anchor)
        # Newest first: llvm-19 before llvm-15.
        for path in sorted(root.glob(str(base.relative_to(root) / name)), reverse=True):
            yield path, "system"


_PROBE = """
import ctypes, sys
sys.path[:] = []
for path in sys.argv[2:]:
    ctypes.CDLL(path, ctypes.RTLD_LOCAL)
llvm = ctypes.CDLL(sys.argv[1])
version = [ctypes.c_uint() for _ in range(3)]
llvm.LLVMGetVersion(*map(ctypes.byref, version))
print(*(v.value for v in version))
"""


def _probe(path: Path, origin: str) -> Llvm:
    """Load `path` in a process of its own and ask for its version."""
    if not path.exists():
        return Llvm(path, origin, None, "no such file")
    runtime = [str(p) for p in _cpp_runtime(path)]
    try:
        answer = subprocess.run(
            [sys.executable, "-I", "-S", "-c", _PROBE, str(path), *runtime],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Llvm(path, origin, None, f"cannot be tried: {error}")
    if answer.returncode != 0:
        lines = answer.stderr.strip().splitlines()
        reason = lines[-1] if lines else f"exit status {answer.returncode}"
        if "LLVMGetVersion" in reason:
            reason = f"older than LLVM {OLDEST_LLVM}"
        return Llvm(path, origin, None, reason)
    major, minor, patch = (int(v) for v in answer.stdout.split())
    if major < OLDEST_LLVM:
        return Llvm(path, origin, None, f"LLVM {major}.{minor}.{patch}, needs {OLDEST_LLVM}")
    return Llvm(path, origin, (major, minor, patch))


def _cpp_runtime(llvm: Path) -> list[Path]:
    """The C++ runtime that some LLVM packages bring along, in loading order."""
    names = ["libunwind.so.1", "libc++abi.so.1", "libc++.so.1"]
    folders = [llvm.parent, *sorted(llvm.parent.glob("*-linux-gnu"))]
    found = [folder / name for name in names for folder in folders if (folder / name).exists()]
    return found if len(found) >= len(names) - 1 else []


def _preload_cpp_runtime(llvm: Path) -> None:
    # The package's own link to its runtime appears only at the second start of Python.
    # RTLD_LOCAL: seen by all, this runtime would take over Mitsuba's exceptions, and every
    # one of them would end the process.
    for path in _cpp_runtime(llvm):
        ctypes.CDLL(str(path), ctypes.RTLD_LOCAL)
