"""Drives of spools that pay out or reel in within bounds: searched with the thread model, from closed forms on."""

from evolvent.design.drives.bounds import Bounds as Bounds
from evolvent.design.drives.motion import Measures as Measures, Motion as Motion
from evolvent.design.drives.report import figure as figure, text as text
from evolvent.design.drives.search import Design as Design, design as design
