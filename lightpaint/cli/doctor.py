"""Checks of what works on this machine, with the command that installs what is missing."""

import ctypes
import importlib.metadata
import os
import platform
import subprocess
import sys
from dataclasses import dataclass
from typing import Literal

from lightpaint.errors import BackendError
from lightpaint.scene.runtime.llvm import INSTALL_LLVM, llvm_candidates
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.version import __version__

State = Literal["ok", "missing", "info"]


#: Packages that lightpaint needs.
PACKAGES = ("mitsuba", "drjit", "numpy", "OpenEXR", "OpenImageIO", "pillow", "colour-science")


@dataclass(frozen=True)
class Finding:
    """The result of one check. remedy: the command to run if something is missing."""

    subject: str
    state: State
    result: str
    remedy: str = ""


def examine(variant: str | None = None) -> list[Finding]:
    """Check everything that lightpaint needs. `variant`: as in `use_variant`."""
    findings = [
        Finding("lightpaint", "info", __version__),
        Finding("Python", "info", f"{platform.python_version()} ({sys.executable})"),
        Finding("system", "info", f"{platform.system()} {platform.machine()}"),
        Finding("cores", "info", str(len(_usable_cores()))),
    ]
    findings += [_package(name) for name in PACKAGES]
    findings.append(_denoiser())
    findings.append(_extra("OpenColorIO", "opencolorio", "ocio"))
    findings.append(_extra("USD", "usd-core", "usd"))
    findings.append(_extra("painter", "uvicorn", "paint"))
    findings.append(_extra("painter in notebooks", "anywidget", "notebook"))
    findings.append(_extra("batches on a cluster", "distributed", "cluster"))
    findings.append(_extra("shell completion", "argcomplete", "completion"))
    findings += _llvm()
    findings.append(_gpu())
    findings.append(_backend(variant))
    return findings


def _usable_cores() -> list[int]:
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def _package(name: str) -> Finding:
    try:
        return Finding(name, "ok", importlib.metadata.version(name))
    except importlib.metadata.PackageNotFoundError:
        return Finding(name, "missing", "not installed", f"pip install {name}")


def _extra(purpose: str, package: str, extra: str) -> Finding:
    """Return the finding of an optional package."""
    version = _package(package)
    if version.state == "ok":
        return Finding(purpose, "ok", version.result)
    return Finding(purpose, "info", f"not installed, optional: pip install 'lightpaint[{extra}]'")


def _denoiser() -> Finding:
    """Return the finding of the denoiser, which is optional."""
    try:
        from lightpaint.images import OLDEST_OIDN, oidn_is_installed
    except ImportError:  # NumPy is missing, as another finding says
        return Finding("denoiser", "info", "not looked for")
    version = _package("pyoidn")
    if oidn_is_installed():
        return Finding("denoiser", "ok", f"Open Image Denoise (pyoidn {version.result})")
    found = f"; pyoidn {version.result} is too old" if version.state == "ok" else ""
    oldest = ".".join(map(str, OLDEST_OIDN))
    hint = f"simpler filters{found}; a better one: pip install 'pyoidn>={oldest}'"
    return Finding("denoiser", "info", hint)


def _llvm() -> list[Finding]:
    findings = []
    for llvm in llvm_candidates():
        if llvm.version is not None:
            version = ".".join(map(str, llvm.version))
            findings.append(Finding("LLVM", "ok", f"{version} from {llvm.origin}: {llvm.path}"))
            export = f"export DRJIT_LIBLLVM_PATH={llvm.path}"
            findings.append(Finding("for plain mitsuba", "info", export))
        else:
            skipped_text = f"skipped, {llvm.problem}: {llvm.path} ({llvm.origin})"
            findings.append(Finding("LLVM", "info", skipped_text))
    if not any(finding.state == "ok" for finding in findings):
        findings.append(Finding("LLVM", "missing", "no usable one", INSTALL_LLVM))
    return findings


def _gpu() -> Finding:
    """Return the finding of an NVIDIA GPU, which is optional."""
    try:
        ctypes.CDLL("libcuda.so.1")
        names = subprocess.run(
            ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"],
            capture_output=True,
            text=True,
            timeout=20,
            check=True,
        ).stdout.split("\n")
    except (OSError, subprocess.SubprocessError):
        return Finding("GPU", "info", "none found, none needed")
    names_text = ", ".join(name.strip() for name in names if name.strip())
    return Finding("GPU", "info", f"{names_text}: used with -m cuda_ad_rgb")


def _backend(variant: str | None) -> Finding:
    try:
        backend = use_variant(variant)
    except BackendError as error:
        return Finding("backend", "missing", str(error))
    if backend.note:
        return Finding("backend", "missing", backend.note, INSTALL_LLVM)
    return Finding("backend", "ok", f"{backend.variant} starts and computes")
