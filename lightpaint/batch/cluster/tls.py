"""A check that this machine and a scheduler at a `tls://` address trust each other.

It runs before Dask connects, since a refused Dask client reports that late, or waits for half a
minute. Dask finds certificates by its own configuration (`distributed.comm.tls`), as its schedulers
and workers do.
"""

import socket
import ssl
from typing import Any

from lightpaint.errors import BatchError
from lightpaint.files import first_line

#: Advice on configuring certificates.
CONFIGURE_HINT = (
    "DASK_DISTRIBUTED__COMM__TLS__CA_FILE and DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT name them "
    "(and ...__CLIENT__KEY, where the key is in a file of its own)"
)


def check_trust(address: str, connection: socket.socket) -> None:
    """Raise BatchError, with advice, unless Dask's configuration can connect to `address`.

    connection: a new connection to the scheduler there; a TLS handshake uses it up. Raises OSError
    if it breaks off.
    """
    security = _security(address)
    if not address.startswith("tls://"):
        if security.require_encryption:
            raise BatchError(
                f"Dask's configuration wants encryption here, and {address} has none: give a "
                "scheduler's tls:// address, or turn distributed.comm.require-encryption off"
            )
        return
    context = _context(address, security)
    try:
        with context.wrap_socket(connection) as secure:
            # The scheduler reports a refused certificate in its first message after the handshake.
            secure.recv(1)
    except ssl.SSLCertVerificationError as error:
        reason = error.verify_message
    except ssl.SSLError as error:
        if error.reason in ("WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE", "HTTP_REQUEST"):
            raise BatchError(
                f"no TLS is spoken at {address}: a scheduler that was started without certificates "
                f"is at {address.replace('tls://', 'tcp://', 1)}"
            ) from None
        reason = (error.reason or first_line(error)).replace("_", " ").lower()
    else:
        return
    raise BatchError(
        f"the scheduler at {address} and this machine do not trust each other's certificates "
        f"({reason}): both have to be signed by an authority that the other one names; "
        f"{CONFIGURE_HINT}"
    )


def _security(address: str) -> Any:
    from distributed.security import Security

    try:
        return Security()
    except (ImportError, TypeError, ValueError) as error:
        raise BatchError(f"Dask's configuration for {address}: {first_line(error)}") from None


def _context(address: str, security: Any) -> ssl.SSLContext:
    try:
        context = security.get_connection_args("client")["ssl_context"]
    except (OSError, ValueError) as error:
        # Python does not say which of the files it is.
        files = security.get_tls_config_for_role("client")
        names = ", ".join(str(files[x])[:200] for x in ("ca_file", "cert", "key") if files[x])
        reason = error.strerror if isinstance(error, FileNotFoundError) else first_line(error)
        raise BatchError(
            f"the certificates for {address} cannot be used: {reason} ({names}); each is a PEM "
            "file, and a certificate needs its key"
        ) from None
    if not isinstance(context, ssl.SSLContext):
        raise BatchError(f"{address} needs certificates: {CONFIGURE_HINT}")
    return context
