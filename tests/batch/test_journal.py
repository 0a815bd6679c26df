"""The journal of a batch: whatever a kill leaves of it, whole lines count and no others."""

import tempfile
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from lightpaint.batch.manifest.file_names import JOURNAL
from lightpaint.batch.plan.journal import Journal, JournalLine

LINES = [
    JournalLine("evening", "answer", "done", "a" * 64),
    JournalLine("Ærø · 夜", "answer", "failed", "b" * 64, "no such file: ø.exr"),
    JournalLine("evening", "render", "done", "c" * 64),
    JournalLine("evening", "answer", "done", "d" * 64),
]


def write_journal(folder: Path) -> bytes:
    journal = Journal(folder)
    for line in LINES:
        journal.add(line)
    return (folder / JOURNAL).read_bytes()


def test_cut_off_anywhere_it_has_the_lines_before_and_goes_on(tmp_path: Path) -> None:
    data = write_journal(tmp_path)
    ends = [k + 1 for k, byte in enumerate(data) if byte == ord("\n")]
    for cut in range(0, len(data), 7):
        (tmp_path / JOURNAL).write_bytes(data[:cut])
        journal = Journal(tmp_path)
        # A line without its end is whole, too.
        whole_lines = sum(end - 1 <= cut for end in ends)
        expected = {(line.look, line.kind): line for line in LINES[:whole_lines]}
        assert journal.lines == expected
        journal.add(LINES[-1])
        assert Journal(tmp_path).lines == {**expected, ("evening", "answer"): LINES[-1]}


def test_settled_it_does_not_tell_how_it_came_about(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    order = [("Ærø · 夜", "answer"), ("evening", "answer"), ("evening", "render")]
    journals = []
    for folder, lines in ((tmp_path / "one", LINES), (tmp_path / "other", LINES[1:])):
        journal = Journal(folder)
        for line in lines:
            journal.add(line)
        journal.rewrite(order)  # type: ignore[arg-type]
        journals.append((folder / JOURNAL).read_bytes())
    assert journals[0] == journals[1]
    journal.rewrite(order[:1])  # type: ignore[arg-type]
    assert [*Journal(tmp_path / "other").lines] == order[:1]


@given(st.binary(max_size=300))
def test_what_somebody_else_wrote_is_passed_over(junk: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / JOURNAL
        text = junk.decode("utf-8", "replace")
        path.write_text(text + "\n", encoding="utf-8", newline="")
        journal = Journal(Path(folder))
        assert not journal.lines
        journal.add(LINES[0])
        assert [*Journal(Path(folder)).lines.values()] == LINES[:1]


@given(st.integers(0, 10_000), st.integers(1, 255))
def test_a_damaged_byte_costs_no_more_than_the_lines_it_touches(place: int, flip: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        journal_bytes = write_journal(folder)
        data, place = bytearray(journal_bytes), place % len(journal_bytes)
        data[place] ^= flip
        (folder / JOURNAL).write_bytes(data)
        hit = {data[:place].count(b"\n")}
        if journal_bytes[place] == ord("\n"):  # the line behind it is joined
            hit.add(max(hit) + 1)
        journal = Journal(folder)
        for key, line in {(x.look, x.kind): x for k, x in enumerate(LINES) if k not in hit}.items():
            # What was hit may still be a line, of what nobody did.
            assert journal.lines[key] == line or journal.lines[key] not in LINES
        journal.add(LINES[1])
        assert Journal(folder).lines["Ærø · 夜", "answer"] == LINES[1]
        journal.rewrite([(x.look, x.kind) for x in LINES])
        assert not Journal(folder).remarks


def test_damage_is_said_and_half_a_line_of_a_kill_is_not(tmp_path: Path) -> None:
    data = write_journal(tmp_path)
    first = data.index(b"\n")
    (tmp_path / JOURNAL).write_bytes(data[: first // 2] + b"\xff" + data[first // 2 + 1 :])
    [remark] = Journal(tmp_path).remarks
    journal_path = tmp_path / JOURNAL
    assert remark == f"{journal_path} has a line that cannot be read: its step will be done again"
    (tmp_path / JOURNAL).write_bytes(data[:-20])
    journal = Journal(tmp_path)
    assert not journal.remarks
    journal.add(LINES[0])
    # Another kill, in the middle of the run that went on.
    assert not Journal(tmp_path).remarks
