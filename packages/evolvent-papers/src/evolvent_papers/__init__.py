"""Systems, figures and claims of three papers computed with evolvent, and its validation against measurements."""
