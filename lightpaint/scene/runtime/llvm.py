"""Finds and tests the LLVM library for Dr.Jit.

Dr.Jit looks for LLVM once, when it is first imported, and crashes the process if the library is too
old. So each library is first tested in a separate process.
"""

import ctypes
import importlib.metadata
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

OLDEST_LLVM = 17
INSTALL_LLVM = (
    "pip install karellen-llvm-core (Linux x86-64), or install LLVM 17 or newer and set "
    "DRJIT_LIBLLVM_PATH to its libLLVM"
)


@dataclass(frozen=True)
class Llvm:
    """A libLLVM on this machine. version: None if it is unusable; `problem` says why."""

    path: Path
    origin: str
    version: tuple[int, int, int] | None
    problem: str = ""


def prepare_llvm() -> Llvm | None:
    """Find a usable LLVM and make Dr.Jit use it. Returns None if there is none."""
    usable = next((c for c in llvm_candidates() if c.version is not None), None)
    if usable is not None and "drjit" not in sys.modules:
        # The package's own link to its runtime appears only when Python starts for the second time.
        # RTLD_LOCAL, because a global runtime would take over Mitsuba's exceptions, and each would
        # crash the process.
        for path in _cpp_runtime(usable.path):
            ctypes.CDLL(str(path), ctypes.RTLD_LOCAL)
        os.environ["DRJIT_LIBLLVM_PATH"] = str(usable.path)
    return usable


@cache
def llvm_candidates() -> tuple[Llvm, ...]:
    """Return LLVM libraries in the order of preference, up to the first usable one."""
    candidates: list[Llvm] = []
    seen_paths: set[Path] = set()
    for path, origin in _llvm_paths():
        resolved = path.resolve()
        if resolved in seen_paths:
            continue
        seen_paths.add(resolved)
        candidates.append(_probe(path, origin))
        if candidates[-1].version is not None:
            break
    return tuple(candidates)


def _llvm_paths() -> Iterator[tuple[Path, str]]:
    if environment_path := os.environ.get("DRJIT_LIBLLVM_PATH"):
        yield Path(environment_path), "DRJIT_LIBLLVM_PATH"
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
    """Load `path` in a separate process and return its version."""
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
            start_new_session=True,  # or Ctrl-C would make it appear unusable
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return Llvm(path, origin, None, f"cannot be tested: {error}")
    if answer.returncode != 0:
        lines = answer.stderr.strip().splitlines()
        reason = lines[-1] if lines else f"exit status {answer.returncode}"
        if "LLVMGetVersion" in reason:
            reason = f"older than LLVM {OLDEST_LLVM}"
        return Llvm(path, origin, None, reason)
    major, minor, patch = (int(v) for v in answer.stdout.split())
    if major < OLDEST_LLVM:
        return Llvm(path, origin, None, f"LLVM {major}.{minor}.{patch}, older than {OLDEST_LLVM}")
    return Llvm(path, origin, (major, minor, patch))


def _cpp_runtime(llvm: Path) -> list[Path]:
    """Return the C++ runtime that some LLVM packages contain, in loading order."""
    names = ["libunwind.so.1", "libc++abi.so.1", "libc++.so.1"]
    folders = [llvm.parent, *sorted(llvm.parent.glob("*-linux-gnu"))]
    libraries = [folder / name for name in names for folder in folders if (folder / name).exists()]
    return libraries if len(libraries) >= len(names) - 1 else []
