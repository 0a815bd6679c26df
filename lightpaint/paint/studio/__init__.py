"""The studio of a session: its renders, exact answers and exports, in threads of their own."""
