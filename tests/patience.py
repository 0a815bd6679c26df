"""How long tests wait for what must come: only a hang takes that long, on however busy a machine.

Background threads have a low priority. Beside other work they get a tenth of a processor, and what
takes two seconds alone takes a minute.
"""

PATIENCE_S = 600.0

#: The same for Playwright.
PATIENCE_MS = 1000 * PATIENCE_S
