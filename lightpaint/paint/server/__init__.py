"""The painter in a browser: HTTP, sockets, access, and ownership of the session."""
