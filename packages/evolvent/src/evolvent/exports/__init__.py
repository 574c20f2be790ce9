"""Runs as files that other programs read, and as a report.

Every exporter is ``write(run, path, request) -> str``, in its own module; it returns a sentence that says what was
written. Libraries of the extra ``export`` are imported when they are used.
"""
