"""Drives of spools that pay out or reel in within bounds: searched with the thread model, from closed forms on."""

from evolvent_papers.drives.answer import Design as Design
from evolvent_papers.drives.bounds import Bounds as Bounds
from evolvent_papers.drives.motion import Measures as Measures, Motion as Motion
from evolvent_papers.drives.search import design as design
