"""Files of pictures: OpenEXR, PNG, TIFF, PSD and layered ones, read and written."""
