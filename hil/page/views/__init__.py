"""What is seen: documents of bokeh, one for the plant and one for a valve."""
