"""`lightpaint cache` and `lightpaint doctor`."""

from collections.abc import Sequence
from pathlib import Path

from lightpaint.basis.cache import cache as bases
from lightpaint.basis.cache import delete_orphans, folder
from lightpaint.cli.doctor import examine
from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError


def cache(*, action: str, names: Sequence[str]) -> CommandOutcome:
    """Run `lightpaint cache [list | drop NAME... | clear]`."""
    if action != "drop" and names:
        raise BasisError(f"cache {action} takes no name: did you mean cache drop {names[0]}?")
    if action == "list":
        listed_entries = bases.entries()
        fields = {"folder": str(folder()), "largest": bases.MAX_BYTES}
        tables.show_kept(listed_entries)
        size = sum(entry.size for entry in listed_entries) / 1e6
        terminal.write(f"kept in {folder()}: {size:.0f} of at most {bases.MAX_BYTES / 1e6:.0f} MB")
        kept_documents = [documents.kept_document(entry) for entry in reversed(listed_entries)]
        return CommandOutcome(lambda: {**fields, "kept": kept_documents})
    deleted = bases.entries() if action == "clear" else _kept_by_names(names)
    freed_bytes = bases.delete_entries(deleted)
    if action == "clear":
        freed_bytes += delete_orphans()
    if action == "drop":
        tables.show_kept(deleted)
    terminal.write(f"{len(deleted)} deleted from {folder()}: {freed_bytes / 1e6:.1f} MB are free")
    deleted_documents = [documents.kept_document(entry) for entry in deleted]
    return CommandOutcome(
        lambda: {"folder": str(folder()), "dropped": deleted_documents, "freed": freed_bytes}
    )


def _kept_by_names(names: Sequence[str]) -> list[bases.Entry]:
    """Return the bases of these names, each once. Raises BasisError for an unknown name."""
    if not names:
        raise BasisError(
            "cache drop needs the name of a scene or of a file, as cache list shows it"
        )
    by_path: dict[Path, bases.Entry] = {}
    for name in names:
        if not (matches := bases.entries_named(name)):
            scenes = {entry.origin.scene for entry in bases.entries() if entry.origin is not None}
            known_scenes = some_names(sorted(scenes)) or "none"
            raise BasisError(f"no basis of {name!r} is kept in {folder()}: it has {known_scenes}")
        by_path |= {entry.path: entry for entry in matches}
    return list(by_path.values())


def doctor(*, variant: str | None) -> CommandOutcome:
    """Run `lightpaint doctor`."""
    findings = examine(variant)
    width = max(len(finding.subject) for finding in findings)
    for finding in findings:
        mark = {"ok": "ok", "missing": "MISSING", "info": ""}[finding.state]
        terminal.write(f"{finding.subject:{width}s} {mark:8s} {finding.result}")
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        if finding.remedy:
            terminal.write(f"to fix {finding.subject}: {finding.remedy}")
    terminal.write("something is missing" if missing else "everything that is needed works")
    return CommandOutcome(lambda: documents.doctor_document(findings), 2 if missing else 0)
