"""What a page is sent: ``messages`` are how it is written, ``snapshot`` is what there is to draw."""
