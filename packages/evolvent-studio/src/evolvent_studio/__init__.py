"""`evolvent studio`: a page in the browser, on this machine: cases, runs, motion, charts, identification, studies.

``form``, ``jobs``, ``worker``, ``folder`` and ``gate`` know nothing of the page and import no user interface; the rest
draws it with NiceGUI (extra ``studio``).
"""
