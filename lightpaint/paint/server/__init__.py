"""The painter in a browser: HTTP, sockets, who may connect, and which page has the session."""
