"""A scheduler that speaks TLS: with the right certificates it works, else one line says why not."""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from batches import SilentListener

from lightpaint.batch.dask_workers import ClusterWorkers
from lightpaint.errors import BatchError

dask = pytest.importorskip("dask", reason="Dask")
pytest.importorskip("distributed", reason="Dask's distributed")

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl")


@dataclass
class SecureScheduler:
    """A scheduler with certificates, and one that has none."""

    folder: Path
    tls: str
    plain: str

    def reached(self, address: str, **files: str) -> list[str]:
        """Workers at an address; files: of Dask's configuration."""
        settings = {
            f"distributed.comm.tls.{'client.' if name in ('cert', 'key') else ''}"
            f"{name.replace('_', '-')}": str(self.folder / file) if "." in file else file
            for name, file in files.items()
        }
        with dask.config.set(settings):
            workers = ClusterWorkers(address, SilentListener(), "topic")  # type: ignore[arg-type]
            try:
                return workers.addresses
            finally:
                workers.close()


@pytest.fixture(scope="module")
def secure_scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SecureScheduler]:
    folder = tmp_path_factory.mktemp("tls")
    for name in ("right", "wrong"):
        subprocess.run(
            [
                "openssl", "req", "-x509", "-nodes", "-days", "2", "-subj", f"/CN={name}",
                "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                "-keyout", f"{name}-key.pem", "-out", f"{name}.pem",
            ],
            cwd=folder, check=True, capture_output=True,
        )  # fmt: skip
    (folder / "junk.pem").write_text("no certificate", "utf-8")
    files = ["--tls-ca-file", "right.pem", "--tls-cert", "right.pem", "--tls-key", "right-key.pem"]
    words = [sys.executable, "-m", "dask", "scheduler", "--host", "127.0.0.1", "--port", "0"]
    started, addresses = [], []
    for name, protocol_options in (("tls", ["--protocol", "tls", *files]), ("plain", [])):
        command_line = [
            *words,
            "--no-dashboard",
            "--scheduler-file",
            f"{name}.json",
            *protocol_options,
        ]
        with (folder / f"{name}.log").open("w") as log:
            started.append(subprocess.Popen(command_line, cwd=folder, stdout=log, stderr=log))
    try:
        for name in ("tls", "plain"):
            addresses.append(_address(folder / f"{name}.json"))
        yield SecureScheduler(folder, *addresses)
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait(60)


def _address(file: Path) -> str:
    end_s = time.monotonic() + 60
    while time.monotonic() < end_s:
        try:
            return str(json.loads(file.read_text("utf-8"))["address"])
        except (OSError, ValueError):
            time.sleep(0.05)
    raise AssertionError(file.with_suffix(".log").read_text("utf-8"))


RIGHT = {"ca_file": "right.pem", "cert": "right.pem", "key": "right-key.pem"}
WRONG = {"ca_file": "wrong.pem", "cert": "wrong.pem", "key": "wrong-key.pem"}


def test_the_right_certificates_open_a_scheduler(secure_scheduler: SecureScheduler) -> None:
    assert secure_scheduler.tls.startswith("tls://")
    assert secure_scheduler.reached(secure_scheduler.tls, **RIGHT) == []
    assert secure_scheduler.reached(secure_scheduler.plain) == []
    assert secure_scheduler.reached(secure_scheduler.plain, **RIGHT) == []


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "needs certificates: DASK_DISTRIBUTED__COMM__TLS__CA_FILE"),
        ({"ca_file": "right.pem"}, "needs certificates: DASK_DISTRIBUTED__COMM__TLS__CA_FILE"),
        (WRONG, "do not trust each other's certificates"),
        ({**RIGHT, "ca_file": "wrong.pem"}, "do not trust each other's certificates (self"),
        ({**WRONG, "ca_file": "right.pem"}, "do not trust each other's certificates (tlsv1 alert"),
        ({**RIGHT, "ca_file": "none.pem"}, "cannot be used: No such file or directory ("),
        ({**RIGHT, "ca_file": "junk.pem"}, "cannot be used: "),
        ({**RIGHT, "key": "wrong-key.pem"}, "cannot be used: "),
        ({"ca_file": "right.pem", "cert": "right.pem"}, "a certificate needs its key"),
        ({**RIGHT, "min_version": "7"}, "Dask's configuration for tls://"),
    ],
)
def test_what_is_wrong_with_certificates_is_one_line(
    secure_scheduler: SecureScheduler, files: dict[str, str], message: str
) -> None:
    begin = time.monotonic()
    with pytest.raises(BatchError) as refusal:
        secure_scheduler.reached(secure_scheduler.tls, **files)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert time.monotonic() - begin < 10  # a client of Dask's own would wait for half a minute


def test_an_address_of_the_other_kind_is_told(secure_scheduler: SecureScheduler) -> None:
    with pytest.raises(BatchError, match=r"no TLS is spoken at tls://.*: .* is at tcp://127"):
        secure_scheduler.reached(secure_scheduler.plain.replace("tcp", "tls"), **RIGHT)
    with pytest.raises(BatchError, match=r"like tcp://host:8786 or tls://host:8786"):
        secure_scheduler.reached(secure_scheduler.tls.replace("tls", "tcp"))
    with (
        dask.config.set({"distributed.comm.require-encryption": True}),
        pytest.raises(BatchError, match=r"wants encryption here, and tcp://.* has none"),
    ):
        secure_scheduler.reached(secure_scheduler.plain, **RIGHT)
