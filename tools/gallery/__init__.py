"""The gallery: every model's characteristic picture, drawn by the model itself when the documentation is built."""

from tools.gallery import friction, hysteresis
from tools.gallery.drawing import FOLDER, PICTURES, Picture, write

__all__ = ["FOLDER", "PICTURES", "Picture", "friction", "hysteresis", "write"]
