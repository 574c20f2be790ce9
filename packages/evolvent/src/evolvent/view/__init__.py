"""What is drawn of a run: figures, drawings, animations, pages."""
